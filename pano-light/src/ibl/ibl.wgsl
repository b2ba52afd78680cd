// Maps for image-based lighting: the pyramid (`halve`, `widen`), and the lookups in it (`convolve`), one invocation a pixel.
// All levels lie one after the other in one buffer.

struct Ibl {
    // Size of what is made, and where it begins, in pixels.
    width: u32,
    height: u32,
    begin: u32,
    // Halving: where the finer level begins.
    finer: u32,
    // Widening: where the rows' reaches begin.
    reaches: u32,
    // Convolving: lookups of a pixel.
    lookups: u32,
}

@group(0) @binding(0) var<uniform> params: Ibl;
@group(0) @binding(1) var<storage, read_write> plain: array<f32>;
@group(0) @binding(2) var<storage, read_write> wide: array<f32>;
// Half the width over which each row is averaged, in whole pixels.
@group(0) @binding(3) var<storage, read> reach: array<u32>;
// (u, v) in the first column; width and beginning of the level.
@group(0) @binding(4) var<storage, read> lookup: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> convolved: array<f32>;

fn plain_at(i: u32) -> vec3f {
    return vec3f(plain[3u * i], plain[3u * i + 1u], plain[3u * i + 2u]);
}

fn wide_at(i: u32) -> vec3f {
    return vec3f(wide[3u * i], wide[3u * i + 1u], wide[3u * i + 2u]);
}

// Two by two pixels become one; rows weigh as their solid angles do, which go with the sine in their middle.
@compute @workgroup_size(8, 8)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.width || id.y >= params.height {
        return;
    }
    let rows = f32(2u * params.height);
    let upper = sin_cos((f32(2u * id.y) + 0.5) / rows * PI).x;
    let lower = sin_cos((f32(2u * id.y) + 1.5) / rows * PI).x;
    let at = params.finer + 4u * id.y * params.width + 2u * id.x;
    let below = at + 2u * params.width;
    let sum = (plain_at(at) + plain_at(at + 1u)) * upper + (plain_at(below) + plain_at(below + 1u)) * lower;
    let mean = sum * (0.5 / (upper + lower));
    let i = params.begin + id.y * params.width + id.x;
    plain[3u * i] = mean.x;
    plain[3u * i + 1u] = mean.y;
    plain[3u * i + 2u] = mean.z;
}

// A mean along the row, so that all pixels cover round patches of the same size.
@compute @workgroup_size(8, 8)
fn widen(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.width || id.y >= params.height {
        return;
    }
    let half = reach[params.reaches + id.y];
    let row = params.begin + id.y * params.width;
    var sum = vec3f(0.0);
    for (var d = 0u; d <= 2u * half; d++) {
        sum += plain_at(row + (id.x + params.width + d - half) % params.width);
    }
    let mean = sum / f32(2u * half + 1u);
    let i = row + id.x;
    wide[3u * i] = mean.x;
    wide[3u * i + 1u] = mean.y;
    wide[3u * i + 2u] = mean.z;
}

// The mean of the lookups, which columns turn about the pole. Bilinear; rows beyond the poles are those of the pole.
@compute @workgroup_size(8, 8)
fn convolve(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.width || id.y >= params.height {
        return;
    }
    var sum = vec3f(0.0);
    for (var s = 0u; s < params.lookups; s++) {
        let asked = lookup[id.y * params.lookups + s];
        let width = u32(asked.z);
        let height = width / 2u;
        let begin = u32(asked.w);
        let turn = f32(id.x) / f32(params.width);
        // Never negative: a turn more.
        let x = (asked.x + turn + 1.0) * f32(width) - 0.5;
        let y = clamp(asked.y * f32(height) - 0.5, 0.0, f32(height - 1u));
        let left = u32(x) % width;
        let right = (left + 1u) % width;
        let upper = begin + u32(y) * width;
        let lower = begin + min(u32(y) + 1u, height - 1u) * width;
        let f = vec2f(fract(x), fract(y));
        let above = mix(wide_at(upper + left), wide_at(upper + right), f.x);
        let below = mix(wide_at(lower + left), wide_at(lower + right), f.x);
        sum += mix(above, below, f.y);
    }
    let mean = sum / f32(params.lookups);
    let i = id.y * params.width + id.x;
    convolved[3u * i] = mean.x;
    convolved[3u * i + 1u] = mean.y;
    convolved[3u * i + 2u] = mean.z;
}
