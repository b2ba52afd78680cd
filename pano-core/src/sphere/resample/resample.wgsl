// From panorama to view, and from panorama to panorama of another size. The panorama may come in bands of rows: each adds its
// part to what is there.

// What pixels of the output stand for: a perspective view, the whole sphere turned, or the sphere as it is.
override PROJECTION: u32;
const PERSPECTIVE: u32 = 0u;
const PANORAMA: u32 = 1u;
const UNTURNED: u32 = 2u;

struct Resample {
    // Of the output.
    view: Rows,
    // Of the panorama: what is bound.
    panorama: Rows,
    // Quaternion from the camera's frame into the panorama's.
    turn: vec4f,
    // Perspective: focal lengths and optical axis in pixels.
    focal: vec2f,
    center: vec2f,
    // 0 for the panorama's first band.
    band: u32,
    // Rows of the panorama that this band alone counts.
    keep_first: u32,
    keep_count: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> params: Resample;
@group(0) @binding(1) var<storage, read> panorama: array<f32>;
@group(0) @binding(2) var<storage, read_write> resampled: array<f32>;
// Shrinking: share of each slice of rows, one list after the other, and where the list of a row of the output begins.
@group(0) @binding(3) var<storage, read> slices: array<f32>;
@group(0) @binding(4) var<storage, read> starts: array<u32>;

fn panorama_at(texel: vec2i) -> vec3f {
    let i = 3u * index_of(params.panorama, texel);
    return vec3f(panorama[i], panorama[i + 1u], panorama[i + 2u]);
}

// A channel as lighting wants it: not negative, a number, and with room for squares.
fn sanitized(value: vec3f) -> vec3f {
    var clean = vec3f(0.0);
    for (var c = 0; c < 3; c++) {
        clean[c] = select(0.0, min(value[c], LARGEST), value[c] > 0.0 && !is_nan(value[c]));
    }
    return clean;
}

// Whether a row of the panorama is this band's.
fn counts(row: i32) -> bool {
    let at = u32(row) - params.keep_first;
    return u32(row) >= params.keep_first && at < params.keep_count;
}

fn add(id: vec3u, value: vec3f) {
    let i = 3u * index_of(params.view, texel_of(params.view, id));
    if params.band == 0u {
        resampled[i] = value.x;
        resampled[i + 1u] = value.y;
        resampled[i + 2u] = value.z;
    } else {
        resampled[i] += value.x;
        resampled[i + 1u] += value.y;
        resampled[i + 2u] += value.z;
    }
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// Where in the panorama a pixel of the output looks.
fn lookup_at(texel: vec2i) -> vec2f {
    let size = vec2f(size_of(params.view));
    let at = vec2f(texel) + 0.5;
    if PROJECTION == UNTURNED {
        return at / size;
    }
    let off = (at - params.center) / params.focal;
    var direction = vec3f(off.x, -off.y, -1.0);
    if PROJECTION == PANORAMA {
        direction = direction_from_uv(at / size);
    }
    return uv_from_direction(turned(params.turn, direction));
}

// A bilinear lookup for each pixel of the output.
@compute @workgroup_size(8, 8)
fn look_up(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.view, id) {
        return;
    }
    let size = size_of(params.panorama);
    let at = footprint(size, lookup_at(texel_of(params.view, id)));
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let tap = tap_of(size, at, i);
        if counts(tap.texel.y) {
            let value = panorama_at(tap.texel);
            sum += select(value, sanitized(value), PROJECTION == UNTURNED) * tap.weight;
        }
    }
    add(id, sum);
}

// A mean over solid angle for each pixel of a smaller panorama. Ends of cells are compared as integers, as on the CPU.
@compute @workgroup_size(8, 8)
fn shrink(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.view, id) {
        return;
    }
    let texel = texel_of(params.view, id);
    let width = params.view.width;
    let sources = params.panorama.width;
    let left = u32(texel.x) * sources;
    let right = left + sources;
    let row = u32(texel.y);
    let first = row * params.panorama.height / params.view.height;
    var sum = vec3f(0.0);
    for (var s = starts[row]; s < starts[row + 1u]; s++) {
        let y = i32(first + s - starts[row]);
        if !counts(y) {
            continue;
        }
        var across = vec3f(0.0);
        for (var x = left / width; x * width < right; x++) {
            let overlap = min(right, (x + 1u) * width) - max(left, x * width);
            across += sanitized(panorama_at(vec2i(i32(x), y))) * f32(overlap);
        }
        sum += across * (slices[s] / f32(sources));
    }
    add(id, sum);
}
