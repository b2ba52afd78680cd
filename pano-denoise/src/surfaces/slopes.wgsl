// Inverse depth everywhere with its smaller one-sided difference, to the right and down: at a silhouette that is the one on the
// surface.

override WRAP: bool;

@group(0) @binding(0) var<uniform> rows: Rows;
@group(0) @binding(1) var<storage, read> depth: array<f32>;
// Inverse depth, its change to the right, its change down.
@group(0) @binding(2) var<storage, read_write> slope: array<f32>;

fn inverse_at(texel: vec2i) -> f32 {
    let d = depth[index_of(rows, texel)];
    return select(0.0, 1.0 / max(d, MIN_DEPTH), d > 0.0 && d < MAX_DEPTH && is_finite(d));
}

// The difference towards a neighbour, and whether there is one.
fn step_to(texel: vec2i, offset: vec2i, here: f32) -> vec2f {
    let place = place_at(rows, texel, offset, WRAP);
    if !place.exists {
        return vec2f(0.0, 0.0);
    }
    return vec2f(inverse_at(place.texel) - here, 1.0);
}

fn smaller(ahead: vec2f, behind: vec2f) -> f32 {
    if ahead.y > 0.0 && behind.y > 0.0 {
        return select(-behind.x, ahead.x, abs(ahead.x) <= abs(behind.x));
    }
    return select(-behind.x, ahead.x, ahead.y > 0.0);
}

@compute @workgroup_size(8, 8)
fn slopes(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let here = inverse_at(texel);
    let at = 3u * index_of(rows, texel);
    slope[at] = here;
    slope[at + 1u] = smaller(step_to(texel, vec2i(1, 0), here), step_to(texel, vec2i(-1, 0), here));
    slope[at + 2u] = smaller(step_to(texel, vec2i(0, 1), here), step_to(texel, vec2i(0, -1), here));
}
