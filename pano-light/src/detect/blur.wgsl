// The luminance of the upper half of a map, blurred by a box that wraps from left to right and repeats the first and the last
// row: `across` and then `down`, one invocation a pixel.

struct Blur {
    rows: Rows,
    radius: u32,
}

@group(0) @binding(0) var<uniform> params: Blur;
@group(0) @binding(1) var<storage, read> radiance: array<f32>;
@group(0) @binding(2) var<storage, read_write> halfway: array<f32>;
@group(0) @binding(3) var<storage, read_write> blurred: array<f32>;

@compute @workgroup_size(8, 8)
fn across(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let reach = i32(params.radius);
    let width = i32(params.rows.width);
    var sum = 0.0;
    for (var dx = -reach; dx <= reach; dx++) {
        let x = (((texel.x + dx) % width) + width) % width;
        let i = 3u * index_of(params.rows, vec2i(x, texel.y));
        sum += dot(vec3f(radiance[i], radiance[i + 1u], radiance[i + 2u]), LUMA_WEIGHTS);
    }
    halfway[index_of(params.rows, texel)] = sum;
}

@compute @workgroup_size(8, 8)
fn down(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let reach = i32(params.radius);
    var sum = 0.0;
    for (var dy = -reach; dy <= reach; dy++) {
        sum += halfway[index_of(params.rows, vec2i(texel.x, clamp(texel.y + dy, 0, i32(params.rows.height) - 1)))];
    }
    let side = f32(2u * params.radius + 1u);
    blurred[index_of(params.rows, texel)] = sum / (side * side);
}
