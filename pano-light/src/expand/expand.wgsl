// Inverse tone mapping (MR360, equations 1-3), one invocation a pixel.

@group(0) @binding(0) var<uniform> rows: Rows;
// Linear colours and radiance, three numbers a pixel.
@group(0) @binding(1) var<storage, read> ldr: array<f32>;
@group(0) @binding(2) var<storage, read_write> hdr: array<f32>;

// To [0, 1]; NaN becomes 0.
fn clamped(c: f32) -> f32 {
    return select(0.0, min(c, 1.0), c > 0.0 && !is_nan(c));
}

@compute @workgroup_size(8, 8)
fn expand(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let at = 3u * index_of(rows, texel_of(rows, id));
    let rgb = vec3f(clamped(ldr[at]), clamped(ldr[at + 1u]), clamped(ldr[at + 2u]));
    let y = dot(rgb, LUMA_WEIGHTS);
    let y2 = y * y;
    let y4 = y2 * y2;
    let expanded = rgb * (GAIN * (y4 * y4 * y2) + BASE);
    hdr[at] = expanded.x;
    hdr[at + 1u] = expanded.y;
    hdr[at + 2u] = expanded.z;
}
