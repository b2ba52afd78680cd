// Pictures on surfaces, looked up at points or averaged over footprints; see pano_core::texture.

// Any object has a texture; textures are averaged over footprints, whose smaller pictures are in the tables.
override TEXTURES: bool = true;
override FILTERED: bool = false;

// What a pixel covers on a texture: how far (u, v) of the mesh moves along two axes; at most so many lookups along the longer one, none for
// a point.
struct TextureArea {
    x: vec2f,
    y: vec2f,
    most: u32,
}

fn point_area() -> TextureArea {
    return TextureArea(vec2f(0.0), vec2f(0.0), 0u);
}

fn uv_at(i: u32) -> vec2f {
    return vec2f(number_at(i), number_at(i + 1u));
}

// A coordinate in texels, of one period.
fn texture_fold(t: f32, wrap: u32, n: i32) -> f32 {
    if wrap == CLAMP {
        return clamp(t, 0.0, 1.0) * f32(n) - 0.5;
    }
    let period = select(1.0, 2.0, wrap == MIRROR);
    return (t - period * floor(t / period)) * f32(n) - 0.5;
}

// The column or row that shows at `i`.
fn texture_index(i: i32, wrap: u32, n: i32) -> i32 {
    if wrap == CLAMP {
        return clamp(i, 0, n - 1);
    }
    let period = select(n, 2 * n, wrap == MIRROR);
    let folded = ((i % period) + period) % period;
    return min(folded, select(folded, 2 * n - 1 - folded, wrap == MIRROR));
}

// Bilinear lookup in one of a texture's pictures.
fn texture_bilinear(texels: u32, size: vec2i, wrap: vec2u, uv: vec2f) -> vec3f {
    let at = vec2f(texture_fold(uv.x, wrap.x, size.x), texture_fold(uv.y, wrap.y, size.y));
    let whole = floor(at);
    let fraction = at - whole;
    var sum = vec3f(0.0);
    for (var k = 0; k < 4; k++) {
        let d = vec2i(k % 2, k / 2);
        let x = texture_index(i32(whole.x) + d.x, wrap.x, size.x);
        let y = texture_index(i32(whole.y) + d.y, wrap.y, size.y);
        let texel = texels + 2u * u32(y * size.x + x);
        let weights = select(vec2f(1.0) - fraction, fraction, d == vec2i(1));
        sum += vec3f(unpack2x16unorm(word(texel)), unpack2x16unorm(word(texel + 1u)).x) * (weights.x * weights.y);
    }
    return sum;
}

// Between the two pictures whose texels are nearest to 2^`level` wide; each is half as large as the one before it in the tables.
fn texture_trilinear(texture: u32, wrap: vec2u, uv: vec2f, level: f32) -> vec3f {
    var size = vec2i(i32(word(texture + 1u)), i32(word(texture + 2u)));
    var texels = word(texture);
    let wanted = clamp(level, 0.0, f32(firstLeadingBit(max(size.x, size.y))));
    let below = u32(wanted);
    for (var i = 0u; i < below; i++) {
        texels += 2u * u32(size.x * size.y);
        size = max(size / 2, vec2i(1));
    }
    let share = wanted - f32(below);
    let fine = texture_bilinear(texels, size, wrap, uv);
    if share == 0.0 {
        return fine;
    }
    texels += 2u * u32(size.x * size.y);
    return mix(fine, texture_bilinear(texels, max(size / 2, vec2i(1)), wrap, uv), share);
}

// The longer axis of the ellipse that two axes make of the unit circle, and the length of the shorter one.
fn axes_of_ellipse(a: vec2f, b: vec2f) -> vec3f {
    let most = max(abs(a), abs(b));
    let scale = max(most.x, most.y);
    if !(scale > 0.0 && is_finite(scale)) {
        return vec3f(0.0);
    }
    let x = a / scale;
    let y = b / scale;
    let xx = x.x * x.x + y.x * y.x;
    let xy = x.x * x.y + y.x * y.y;
    let yy = x.y * x.y + y.y * y.y;
    let mean = 0.5 * (xx + yy);
    let difference = 0.5 * (xx - yy);
    let root = hypotenuse(difference, xy);
    let angle = sin_cos(0.5 * angle_of(xy, difference)).yx;
    return vec3f(angle * (sqrt(mean + root) * scale), sqrt(max(mean - root, 0.0)) * scale);
}

// The mean over a footprint.
fn texture_look(texture: u32, mesh_uv: vec2f, footprint: TextureArea) -> vec3f {
    let size = vec2i(i32(word(texture + 1u)), i32(word(texture + 2u)));
    let wrap = vec2u(word(texture + 3u), word(texture + 4u));
    let scale = number_at(texture + 11u);
    var uv = uv_at(texture + 5u) * mesh_uv.x + uv_at(texture + 7u) * mesh_uv.y + uv_at(texture + 9u);
    if !is_finite(uv.x) || !is_finite(uv.y) {
        uv = vec2f(0.0);
    }
    var long = vec2f(0.0);
    var short = 0.0;
    if FILTERED && footprint.most > 0u {
        let x = (uv_at(texture + 5u) * footprint.x.x + uv_at(texture + 7u) * footprint.x.y) * vec2f(size);
        let y = (uv_at(texture + 5u) * footprint.y.x + uv_at(texture + 7u) * footprint.y.y) * vec2f(size);
        let axes = axes_of_ellipse(x, y);
        long = axes.xy;
        short = axes.z;
    }
    let reach = length(long);
    if !FILTERED || reach <= 1.0 || !is_finite(reach) {
        return texture_bilinear(word(texture), size, wrap, uv) * scale;
    }
    let most = f32(footprint.most);
    let width = max(max(short, reach / most), 1.0);
    let probes = clamp(ceil(reach / width), 1.0, most);
    let level = log2(max(reach / probes, width));
    let step = long / vec2f(size) / probes;
    var mean = vec3f(0.0);
    for (var i = 0u; i < u32(probes); i++) {
        let value = texture_trilinear(texture, wrap, uv + step * (f32(i) + 0.5 - 0.5 * probes), level);
        mean += (value - mean) / f32(i + 1u);
    }
    return mean * scale;
}
