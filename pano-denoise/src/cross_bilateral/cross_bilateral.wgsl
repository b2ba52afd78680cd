// The 5×5 cross-bilateral filter: one pass for means and second differences (`local`), one for the average (`average`); see
// cpu.rs for the reasons. Sums are f32: values are limited before.

override WRAP: bool;
// The share of the pixel is 1 - coverage: the layer is that of the real surfaces.
override REAL: bool;

struct CrossBilateral {
    rows: Rows,
    // Inverses of the sigmas, 0 for a term that is switched off.
    space: f32,
    depth: f32,
    normal: f32,
    albedo: f32,
    // The sigma itself, and whether it counts.
    radiance: f32,
    ranged: u32,
}

@group(0) @binding(0) var<uniform> params: CrossBilateral;
@group(0) @binding(1) var<storage, read> layer: array<f32>;
@group(0) @binding(2) var<storage, read> coverage: array<f32>;
// Mean over 3×3 pixels of the same surface, without premultiplication.
@group(0) @binding(6) var<storage, read_write> mean: array<f32>;
// Second differences along four directions; negative where a neighbour is not of the same surface.
@group(0) @binding(7) var<storage, read_write> residual: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> filtered: array<f32>;

fn layer_at(i: u32) -> vec3f {
    return vec3f(layer[3u * i], layer[3u * i + 1u], layer[3u * i + 2u]);
}

fn mean_at(i: u32) -> vec3f {
    return vec3f(mean[3u * i], mean[3u * i + 1u], mean[3u * i + 2u]);
}

// Share of the pixel, 0 where it is no tap.
fn share_at(i: u32) -> f32 {
    let share = select(coverage[i], 1.0 - coverage[i], REAL);
    return select(0.0, min(share, 1.0), share > 0.0 && !is_nan(share) && is_finite3(layer_at(i)));
}

// The layer's value without the premultiplication; the share there is above 0.
fn value_at(i: u32) -> vec3f {
    return limited3(limited3(layer_at(i)) / share_at(i));
}

// Whether the pixel belongs to the layer and anything within two pixels is not black.
fn is_active(texel: vec2i) -> bool {
    let here = index_of(params.rows, texel);
    if share_at(here) == 0.0 {
        return false;
    }
    for (var dy = -2; dy <= 2; dy++) {
        for (var dx = -2; dx <= 2; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if place.exists && share_at(q) > 0.0 && any(layer_at(q) != vec3f(0.0)) {
                return true;
            }
        }
    }
    return false;
}

// -ln of the weight that the guides give the tap `place`, `offset` away from `p`; FAR if it is not of the layer.
fn guide_exponent(p: u32, place: Place, offset: vec2i) -> f32 {
    let q = index_of(params.rows, place.texel);
    if share_at(q) == 0.0 {
        return FAR;
    }
    return colored_exponent_at(p, q, offset, place.over_pole);
}

const NEIGHBOURS = array<vec2i, 8>(
    vec2i(1, 0), vec2i(0, 1), vec2i(1, 1), vec2i(1, -1), vec2i(-1, 0), vec2i(0, -1), vec2i(-1, -1), vec2i(-1, 1),
);

@compute @workgroup_size(8, 8)
fn local(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    var around = vec3f(0.0);
    // Black neighbourhoods are without noise.
    var lines = vec4f(0.0);
    if is_active(texel) {
        let here = value_at(p);
        var sum = limited3(layer_at(p));
        var shares = share_at(p);
        var values: array<vec3f, 8>;
        var same: array<bool, 8>;
        var neighbours = NEIGHBOURS;
        for (var i = 0; i < 8; i++) {
            let place = place_at(params.rows, texel, neighbours[i], WRAP);
            same[i] = false;
            if place.exists {
                let q = index_of(params.rows, place.texel);
                let weight = exp(-guide_exponent(p, place, neighbours[i]));
                // The exponent of what is not of the layer is FAR; its value may be no number.
                if weight > 0.0 {
                    sum += limited3(layer_at(q)) * weight;
                    shares += share_at(q) * weight;
                }
                if weight > 0.5 {
                    same[i] = true;
                    values[i] = value_at(q);
                }
            }
        }
        around = limited3(sum / shares);
        for (var d = 0; d < 4; d++) {
            lines[d] = -1.0;
            if same[d] && same[d + 4] {
                // The variance of a - 2b + c is 6 times that of a, b, c.
                lines[d] = length(values[d] - 2.0 * here + values[d + 4]) / sqrt(6.0);
            }
        }
    }
    mean[3u * p] = around.x;
    mean[3u * p + 1u] = around.y;
    mean[3u * p + 2u] = around.z;
    residual[p] = lines;
}

// a / b for a, b >= 0, with 0/0 = 0, as far as it matters to an exponent.
fn ratio(a: f32, b: f32) -> f32 {
    return select(select(FAR, min(a / b, FAR), b > 0.0), 0.0, a == 0.0);
}

@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    // What is left alone keeps its bits.
    filtered[3u * p] = layer[3u * p];
    filtered[3u * p + 1u] = layer[3u * p + 1u];
    filtered[3u * p + 2u] = layer[3u * p + 2u];
    if !is_active(texel) {
        return;
    }
    var exponents: array<f32, 25>;
    // The least exponent of the taps whose line is known, for each direction.
    var least = vec4f(FAR);
    for (var i = 0; i < 25; i++) {
        let offset = vec2i(i % 5 - 2, i / 5 - 2);
        let place = place_at(params.rows, texel, offset, WRAP);
        exponents[i] = FAR;
        if place.exists {
            exponents[i] = guide_exponent(p, place, offset);
            let lines = residual[index_of(params.rows, place.texel)];
            least = select(least, min(least, vec4f(exponents[i])), lines >= vec4f(0.0));
        }
    }
    // Weights relative to the largest, as all of them may be too small for f32.
    var noise = vec4f(0.0);
    var weights = vec4f(0.0);
    for (var i = 0; i < 25; i++) {
        if exponents[i] < FAR {
            let place = place_at(params.rows, texel, vec2i(i % 5 - 2, i / 5 - 2), WRAP);
            let lines = residual[index_of(params.rows, place.texel)];
            let known = select(vec4f(0.0), exp(least - vec4f(exponents[i])), lines >= vec4f(0.0));
            noise += known * lines * lines;
            weights += known;
        }
    }
    // Without a single straight line of three pixels nothing is known of the noise: the pixel is left alone.
    var variance = -1.0;
    for (var d = 0; d < 4; d++) {
        if weights[d] > 0.0 {
            let along = noise[d] / weights[d];
            variance = select(min(variance, along), along, variance < 0.0);
        }
    }
    if variance < 0.0 {
        return;
    }
    let centre = value_at(p);
    let around = mean_at(p);
    let spread = variance * params.radiance * params.radiance;
    var sum = limited3(layer_at(p));
    var shares = share_at(p);
    var others = false;
    for (var i = 0; i < 25; i++) {
        if i == 12 || exponents[i] >= FAR {
            continue;
        }
        let offset = vec2i(i % 5 - 2, i / 5 - 2);
        let q = index_of(params.rows, place_at(params.rows, texel, offset, WRAP).texel);
        var exponent = exponents[i] + 0.5 * dot(vec2f(offset), vec2f(offset)) * params.space * params.space;
        if params.ranged != 0u {
            let apart = mean_at(q) - around;
            let raw = value_at(q) - centre;
            exponent += 0.5 * ratio(dot(apart, apart), spread)
                + 0.5 * max(ratio(dot(raw, raw), 2.0 * spread) - OUTLIER * OUTLIER, 0.0);
        }
        let weight = exp(-exponent);
        if weight > 0.0 {
            others = true;
            sum += limited3(layer_at(q)) * weight;
            shares += share_at(q) * weight;
        }
    }
    if others {
        let value = sum / shares * share_at(p);
        filtered[3u * p] = value.x;
        filtered[3u * p + 1u] = value.y;
        filtered[3u * p + 2u] = value.z;
    }
}
