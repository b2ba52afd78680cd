// Clamps lone bright pixels to a multiple of the greatest of their eight neighbours, one invocation a pixel.

override WRAP: bool;

struct Firefly {
    rows: Rows,
    factor: f32,
}

// What one workgroup clamped.
struct Clamped {
    pixels: u32,
    energy: f32,
    before: f32,
}

@group(0) @binding(0) var<uniform> params: Firefly;
@group(0) @binding(1) var<storage, read> share: array<f32>;
@group(0) @binding(2) var<storage, read> signal: array<f32>;
@group(0) @binding(3) var<storage, read_write> clamped: array<f32>;
// One for each workgroup.
@group(0) @binding(4) var<storage, read_write> report: array<Clamped>;

const GROUP: u32 = 64u;
var<workgroup> parts: array<Clamped, GROUP>;

fn signal_at(i: u32) -> vec3f {
    return vec3f(signal[3u * i], signal[3u * i + 1u], signal[3u * i + 2u]);
}

// Magnitude of the luminance.
fn bright(value: vec3f) -> f32 {
    return abs(luminance(limited3(value)));
}

// That without the premultiplication; negative where the pixel takes no part.
fn bright_at(i: u32) -> f32 {
    let value = signal_at(i);
    if share[i] > 0.0 && !is_nan(share[i]) && is_finite3(value) {
        return min(bright(value) / min(share[i], 1.0), LARGEST);
    }
    return -1.0;
}

@compute @workgroup_size(8, 8)
fn clamp_fireflies(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    parts[local] = Clamped(0u, 0.0, 0.0);
    if is_held(params.rows, id) {
        let texel = texel_of(params.rows, id);
        let i = index_of(params.rows, texel);
        var value = signal_at(i);
        let here = bright_at(i);
        if here >= 0.0 {
            let before = bright(value);
            var greatest = -1.0;
            for (var dy = -1; dy <= 1; dy++) {
                for (var dx = -1; dx <= 1; dx++) {
                    let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
                    // Around a small sphere a pixel may be its own neighbour.
                    if place.exists && any(place.texel != texel) {
                        greatest = max(greatest, bright_at(index_of(params.rows, place.texel)));
                    }
                }
            }
            let limit = greatest * params.factor;
            parts[local].before = before;
            if greatest >= 0.0 && here > limit {
                value *= limit / here;
                parts[local].pixels = 1u;
                parts[local].energy = before - bright(value);
            }
        }
        clamped[3u * i] = value.x;
        clamped[3u * i + 1u] = value.y;
        clamped[3u * i + 2u] = value.z;
    }
    workgroupBarrier();
    if local == 0u {
        var sum = Clamped(0u, 0.0, 0.0);
        for (var i = 0u; i < GROUP; i++) {
            sum.pixels += parts[i].pixels;
            sum.energy += parts[i].energy;
            sum.before += parts[i].before;
        }
        report[group.y * groups.x + group.x] = sum;
    }
}
