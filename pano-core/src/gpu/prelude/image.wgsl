// Pictures in buffers: which rows are held, and where neighbours are.

struct Rows {
    width: u32,
    height: u32,
    first: u32,
    count: u32,
}

// The picture's size, signed for arithmetic.
fn size_of(rows: Rows) -> vec2i {
    return vec2i(i32(rows.width), i32(rows.height));
}

// The index in the buffer of the texel (x, y) of the whole picture.
fn index_of(rows: Rows, texel: vec2i) -> u32 {
    return u32((texel.y - i32(rows.first)) * i32(rows.width) + texel.x);
}

// Whether an invocation has a pixel of its own.
fn is_held(rows: Rows, id: vec3u) -> bool {
    return id.x < rows.width && id.y < rows.count;
}

// The texel of the whole picture that invocation `id` works on.
fn texel_of(rows: Rows, id: vec3u) -> vec2i {
    return vec2i(i32(id.x), i32(id.y + rows.first));
}

// A neighbour's place: its texel, whether there is one, and whether a pole was stepped over on the way to it.
struct Place {
    texel: vec2i,
    exists: bool,
    over_pole: bool,
}

// The pixel `offset` away from `texel`. Nothing is outside a picture unless it is a whole panorama (`wrap`).
fn place_at(rows: Rows, texel: vec2i, offset: vec2i, wrap: bool) -> Place {
    let size = size_of(rows);
    let at = texel + offset;
    if all(at >= vec2i(0)) && all(at < size) {
        return Place(at, true, false);
    }
    return Place(wrap_texel(size, at.x, at.y), wrap, at.y < 0 || at.y >= size.y);
}

