// Rays of a list through the depth field, one invocation a ray.

struct March {
    field: Field,
    count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

// What a ray met, and the normal by the slopes around.
struct Marched {
    met: Met,
    smoothed: vec3f,
    pad: u32,
}

@group(0) @binding(0) var<uniform> params: March;
// See field.wgsl.
@group(0) @binding(1) var<storage, read> inverses: array<f32>;
@group(0) @binding(2) var<storage, read> gaps: array<u32>;
@group(0) @binding(3) var<storage, read> base: array<u32>;
@group(0) @binding(4) var<storage, read> upper: array<u32>;
@group(0) @binding(5) var<storage, read> rays: array<Ray>;
@group(0) @binding(6) var<storage, read_write> marched: array<Marched>;

@compute @workgroup_size(64)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.count {
        return;
    }
    let ray = rays[id.x];
    let met = march_ray(ray);
    var normal = met.normal;
    if met.what == SURFACE {
        normal = smooth_normal(ray.origin + ray.direction * met.t, ray.direction, Side(met.normal, met.back == 1u, true));
    }
    marched[id.x] = Marched(met, normal, 0u);
}
