// Differential compositing, one invocation a pixel: photo·(1 - coverage) + delta + object, and the change as a ratio.
//
// Pictures that are copied bit for bit are arrays of bits.

struct Composite {
    rows: Rows,
    // What the multiplier divides by at least.
    floor: f32,
}

// What clamping at 0 changed in one workgroup.
struct Clamped {
    pixels: u32,
    energy: f32,
}

@group(0) @binding(0) var<uniform> params: Composite;
@group(0) @binding(1) var<storage, read> photo: array<u32>;
@group(0) @binding(2) var<storage, read> object: array<f32>;
@group(0) @binding(3) var<storage, read> coverage: array<f32>;
@group(0) @binding(4) var<storage, read> delta: array<f32>;
@group(0) @binding(5) var<storage, read_write> color: array<u32>;
@group(0) @binding(6) var<storage, read_write> multiplier: array<f32>;
// One for each workgroup.
@group(0) @binding(7) var<storage, read_write> clamped: array<Clamped>;

const GROUP: u32 = 64u;
var<workgroup> parts: array<Clamped, GROUP>;

fn composite_pixel(i: u32, channel: u32, share: f32) -> f32 {
    let at = 3u * i + channel;
    let real = bitcast<f32>(photo[at]);
    let sum = real * share + delta[at] + object[at];
    color[at] = bitcast<u32>(to_radiance(sum));
    let base = max(real, params.floor) * share;
    // No real surface in the pixel, or a black frame, which has no scale: no ratio either.
    multiplier[at] = select(1.0, to_radiance(1.0 + delta[at] / base), base > 0.0);
    return select(0.0, -sum, sum < 0.0 && !is_nan(sum));
}

@compute @workgroup_size(8, 8)
fn composite(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    parts[local] = Clamped(0u, 0.0);
    if is_held(params.rows, id) {
        let i = index_of(params.rows, texel_of(params.rows, id));
        let change = vec3f(delta[3u * i], delta[3u * i + 1u], delta[3u * i + 2u]);
        if coverage[i] == 0.0 && all(change == vec3f(0.0)) {
            for (var c = 0u; c < 3u; c++) {
                color[3u * i + c] = photo[3u * i + c];
                multiplier[3u * i + c] = 1.0;
            }
        } else {
            let share = 1.0 - coverage[i];
            let below = vec3f(composite_pixel(i, 0u, share), composite_pixel(i, 1u, share), composite_pixel(i, 2u, share));
            parts[local] = Clamped(select(0u, 1u, any(below > vec3f(0.0))), dot(below, LUMINANCE_WEIGHTS));
        }
    }
    workgroupBarrier();
    if local == 0u {
        var sum = Clamped(0u, 0.0);
        for (var i = 0u; i < GROUP; i++) {
            sum.pixels += parts[i].pixels;
            sum.energy += parts[i].energy;
        }
        clamped[group.y * groups.x + group.x] = sum;
    }
}
