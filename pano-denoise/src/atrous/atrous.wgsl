// The à-trous joint bilateral filter: pictures become pixels without premultiplication (`prepare`), each level spreads taps
// twice as far (`level`), and pixels become pictures again (`finish`). See cpu.rs for the reasons. Sums are f32:
// values are limited before.

override WRAP: bool;

struct Atrous {
    rows: Rows,
    // Inverses of the sigmas, 0 for a term that is switched off.
    depth: f32,
    normal: f32,
    // The sigma itself.
    luminance: f32,
    // Pixels between taps.
    step: i32,
}

@group(0) @binding(0) var<uniform> params: Atrous;
@group(0) @binding(1) var<storage, read> signal: array<f32>;
@group(0) @binding(2) var<storage, read> share: array<f32>;
@group(0) @binding(5) var<storage, read> variance: array<f32>;
// Value without premultiplication and share, 0 for a pixel that takes no part; and the variance of its luminance.
@group(0) @binding(6) var<storage, read> pixels: array<vec4f>;
@group(0) @binding(7) var<storage, read> variances: array<f32>;
@group(0) @binding(8) var<storage, read_write> next_pixels: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> next_variances: array<f32>;
@group(0) @binding(10) var<storage, read_write> filtered: array<f32>;

fn signal_at(i: u32) -> vec3f {
    return vec3f(signal[3u * i], signal[3u * i + 1u], signal[3u * i + 2u]);
}

// A pixel without premultiplication, and its share.
fn prepared(i: u32) -> vec4f {
    let value = signal_at(i);
    if share[i] > 0.0 && !is_nan(share[i]) && is_finite3(value) {
        let part = min(share[i], 1.0);
        return vec4f(limited3(limited3(value) / part), part);
    }
    return vec4f(0.0);
}

@compute @workgroup_size(8, 8)
fn prepare(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let i = index_of(params.rows, texel_of(params.rows, id));
    next_pixels[i] = prepared(i);
    next_variances[i] = select(0.0, clamp(variance[i], 0.0, LARGEST * LARGEST), is_finite(variance[i]));
}

@compute @workgroup_size(8, 8)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let i = index_of(params.rows, texel_of(params.rows, id));
    let part = pixels[i].w > 0.0;
    let value = select(signal_at(i), pixels[i].xyz * pixels[i].w, part);
    filtered[3u * i] = value.x;
    filtered[3u * i + 1u] = value.y;
    filtered[3u * i + 2u] = value.z;
    next_variances[i] = select(variance[i], variances[i], part);
}

@compute @workgroup_size(8, 8)
fn level(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    let centre = pixels[p];
    next_pixels[p] = centre;
    next_variances[p] = variances[p];
    if centre.w == 0.0 {
        return;
    }
    var exponents: array<f32, 25>;
    var spread = 0.0;
    var count = 0.0;
    // Most of the change is nothing.
    var black = true;
    for (var i = 0; i < 25; i++) {
        let tap = vec2i(i % 5 - 2, i / 5 - 2);
        let place = place_at(params.rows, texel, tap * params.step, WRAP);
        let q = index_of(params.rows, place.texel);
        exponents[i] = FAR;
        if !place.exists || pixels[q].w == 0.0 {
            continue;
        }
        black = black && all(pixels[q].xyz == vec3f(0.0));
        exponents[i] = min(exponent_at(p, q, tap * params.step, place.over_pole), FAR);
        // Variances are noisy themselves: a 3×3 mean over the same surface.
        if all(abs(tap) <= vec2i(1)) {
            let weight = SPLINE[abs(tap.x)] * SPLINE[abs(tap.y)] * exp(-exponents[i]);
            spread += variances[q] * weight;
            count += weight;
        }
    }
    if black {
        return;
    }
    let deviation = sqrt(select(0.0, spread / count, count > 0.0));
    let bright = luminance(centre.xyz);
    let scale = params.luminance * deviation + ROUNDING * abs(bright) + 1e-30;
    var sum = vec3f(0.0);
    var weights = 0.0;
    var squares = 0.0;
    for (var i = 0; i < 25; i++) {
        if exponents[i] >= FAR {
            continue;
        }
        let tap = vec2i(i % 5 - 2, i / 5 - 2);
        let q = index_of(params.rows, place_at(params.rows, texel, tap * params.step, WRAP).texel);
        let there = pixels[q];
        let apart = min(abs(luminance(there.xyz) - bright) / scale, FAR);
        // A larger share of the pixel is a better known value.
        let weight = SPLINE[abs(tap.x)] * SPLINE[abs(tap.y)] * there.w * exp(-exponents[i] - apart);
        sum += there.xyz * weight;
        weights += weight;
        squares += variances[q] * weight * weight;
    }
    if weights > 0.0 {
        next_pixels[p] = vec4f(sum / weights, centre.w);
        next_variances[p] = squares / (weights * weights);
    }
}
