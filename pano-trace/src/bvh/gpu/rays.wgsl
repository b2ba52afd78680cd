// Rays of a list through the hierarchy, one invocation a ray: the nearest face (`closest`), or whether there is any (`any_hit`).

struct Rays {
    count: u32,
    root: u32,
}

@group(0) @binding(0) var<uniform> params: Rays;
@group(0) @binding(4) var<storage, read> rays: array<Ray>;
@group(0) @binding(5) var<storage, read_write> hits: array<Hit>;
@group(0) @binding(6) var<storage, read_write> occluded: array<u32>;

@compute @workgroup_size(64)
fn closest(@builtin(global_invocation_id) id: vec3u) {
    if id.x < params.count {
        let ray = rays[id.x];
        hits[id.x] = trace_ray(params.root, ray.origin, ray.direction, ray.t_max, false);
    }
}

@compute @workgroup_size(64)
fn any_hit(@builtin(global_invocation_id) id: vec3u) {
    if id.x < params.count {
        let ray = rays[id.x];
        let hit = trace_ray(params.root, ray.origin, ray.direction, ray.t_max, true);
        occluded[id.x] = select(0u, 1u, hit.instance != NOTHING);
    }
}
