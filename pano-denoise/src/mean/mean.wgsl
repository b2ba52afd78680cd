// The mean filter of penumbrae: a window about each pixel of a penumbra, one invocation a pixel. Sums are f32: values are limited
// before.
//
// Pictures that are copied bit for bit are arrays of bits.

override WRAP: bool;
// The layer is that of the real surfaces: its share of a pixel is 1 - coverage, and it is averaged as a ratio to the photo.
override REAL: bool;

struct Mean {
    rows: Rows,
    // Inverses of the sigmas, 0 for a term that is switched off.
    depth: f32,
    normal: f32,
    albedo: f32,
    // Pixels to each side.
    radius: i32,
}

@group(0) @binding(0) var<uniform> params: Mean;
@group(0) @binding(1) var<storage, read> layer: array<u32>;
@group(0) @binding(2) var<storage, read> coverage: array<f32>;
@group(0) @binding(6) var<storage, read> photo: array<f32>;
// 1 where a penumbra is seen.
@group(0) @binding(7) var<storage, read> penumbra: array<u32>;
@group(0) @binding(8) var<storage, read_write> filtered: array<u32>;

fn layer_at(i: u32) -> vec3f {
    return vec3f(bitcast<f32>(layer[3u * i]), bitcast<f32>(layer[3u * i + 1u]), bitcast<f32>(layer[3u * i + 2u]));
}

fn share_at(i: u32) -> f32 {
    return select(coverage[i], 1.0 - coverage[i], REAL);
}

// Whether a pixel has a share of the layer, and a value.
fn counts(i: u32) -> bool {
    return share_at(i) > 0.0 && !is_nan(share_at(i)) && is_finite3(layer_at(i));
}

// What a pixel's value is in proportion to; 0 in channels that are black or no number.
fn base_at(i: u32) -> vec3f {
    if !REAL {
        return vec3f(1.0);
    }
    let base = vec3f(photo[3u * i], photo[3u * i + 1u], photo[3u * i + 2u]);
    let finite = vec3<bool>(is_finite(base.x), is_finite(base.y), is_finite(base.z));
    return select(vec3f(0.0), min(base, vec3f(LARGEST)), finite & (base >= vec3f(SMALLEST)));
}

@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    // What is left alone keeps its bits.
    for (var c = 0u; c < 3u; c++) {
        filtered[3u * p + c] = layer[3u * p + c];
    }
    if penumbra[p] == 0u || !counts(p) {
        return;
    }
    var sum = vec3f(0.0);
    var weights = vec3f(0.0);
    for (var dy = -params.radius; dy <= params.radius; dy++) {
        for (var dx = -params.radius; dx <= params.radius; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if !place.exists || !counts(q) {
                continue;
            }
            let exponent = colored_exponent_at(p, q, vec2i(dx, dy), place.over_pole);
            if exponent >= FAR {
                continue;
            }
            let weight = exp(-exponent);
            let base = base_at(q);
            let known = base > vec3f(0.0);
            let ratio = limited3(limited3(layer_at(q)) / select(vec3f(1.0), base, known));
            sum += select(vec3f(0.0), ratio * weight, known);
            weights += select(vec3f(0.0), vec3f(share_at(q) * weight), known);
        }
    }
    let base = base_at(p);
    for (var c = 0u; c < 3u; c++) {
        if base[c] > 0.0 && weights[c] > 0.0 {
            filtered[3u * p + c] = bitcast<u32>(limited(sum[c] / weights[c]) * share_at(p) * base[c]);
        }
    }
}
