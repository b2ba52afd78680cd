// Sparse tracing: the level of every pixel (eq. 3 and 4 of the IPRT paper, `levels`), and what pixels that were not traced take
// from those that were (Algorithm 2, `interpolate`), one invocation a pixel.

struct Sparse {
    rows: Rows,
    delta1: f32,
    delta2: f32,
    sigma_position: f32,
}

@group(0) @binding(0) var<uniform> params: Sparse;
@group(0) @binding(1) var<storage, read> position: array<f32>;
@group(0) @binding(2) var<storage, read> normal: array<f32>;
// Frames for which a pixel stays active.
@group(0) @binding(3) var<storage, read> active_frames: array<u32>;
@group(0) @binding(4) var<storage, read_write> found: array<u32>;

@group(0) @binding(5) var<storage, read> level: array<u32>;
// Whether a pixel is to be filled.
@group(0) @binding(6) var<storage, read> wanted: array<u32>;
@group(0) @binding(7) var<storage, read> known: array<f32>;
@group(0) @binding(8) var<storage, read> signal: array<f32>;
@group(0) @binding(9) var<storage, read_write> filled: array<f32>;
@group(0) @binding(10) var<storage, read_write> share: array<f32>;

fn position_at(i: u32) -> vec3f {
    return vec3f(position[3u * i], position[3u * i + 1u], position[3u * i + 2u]);
}

fn normal_at(i: u32) -> vec3f {
    return vec3f(normal[3u * i], normal[3u * i + 1u], normal[3u * i + 2u]);
}

// The larger one; NaN is none.
fn larger(a: f32, b: f32) -> f32 {
    return select(max(a, b), a, is_nan(b));
}

@compute @workgroup_size(8, 8)
fn levels(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    var weight = select(0.0, 1.0, active_frames[p] > 0u);
    if weight == 0.0 {
        for (var i = 0; i < 25; i++) {
            let place = place_at(params.rows, texel, vec2i(i % 5 - 2, i / 5 - 2), false);
            if place.exists {
                let q = index_of(params.rows, place.texel);
                weight = larger(weight, distance(normal_at(p), normal_at(q)));
                weight = larger(weight, params.sigma_position * distance(position_at(p), position_at(q)));
            }
        }
        weight = min(weight, 1.0);
    }
    found[p] = select(select(2u, 1u, weight >= params.delta1), 0u, weight >= params.delta2);
}

// Whether a pixel was traced, and has a share in what was seen.
fn is_traced(x: u32, y: u32) -> bool {
    if x >= params.rows.width || y >= params.rows.height {
        return false;
    }
    let i = y * params.rows.width + x;
    let mask = (1u << level[i]) - 1u;
    return (x & mask) == 0u && (y & mask) == 0u && known[i] > 0.0;
}

@compute @workgroup_size(8, 8)
fn interpolate(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let i = id.y * params.rows.width + id.x;
    // What is not filled stays as it is.
    for (var c = 0u; c < 3u; c++) {
        filled[3u * i + c] = signal[3u * i + c];
    }
    share[i] = known[i];
    let mask = (1u << level[i]) - 1u;
    if ((id.x & mask) == 0u && (id.y & mask) == 0u) || wanted[i] == 0u {
        return;
    }
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let o = vec2u(corner / 2u, corner % 2u);
        let step = 1u << level[i];
        var at = step * (id.xy / step + o);
        // A neighbour of a coarser level may not have been traced; those of the coarsest grid all are.
        if !is_traced(at.x, at.y) {
            at = 4u * (id.xy / 4u + o);
        }
        if is_traced(at.x, at.y) {
            let q = at.y * params.rows.width + at.x;
            let weight = 1.0 / max(distance(vec2f(at), vec2f(id.xy)), 1e-3);
            sum += vec3f(signal[3u * q], signal[3u * q + 1u], signal[3u * q + 2u]) * weight;
            shares += known[q] * weight;
        }
    }
    if shares > 0.0 {
        for (var c = 0u; c < 3u; c++) {
            filled[3u * i + c] = sum[c] / shares;
        }
        share[i] = 1.0;
    }
}
