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
// Inverse planar depth, (n + 1)² samples a face; 0 where nothing is.
@group(0) @binding(1) var<storage, read> inverses: array<f32>;
// As many sets of bits: 1 the cell lies across a gap, 2 the step to the right is one, 4 the step down is one.
@group(0) @binding(2) var<storage, read> gaps: array<u32>;
// Smallest and largest inverse depth of the cells of each face, and of the levels above them, packed and in tiles (pyramid.rs).
@group(0) @binding(3) var<storage, read> base: array<u32>;
@group(0) @binding(4) var<storage, read> upper: array<u32>;
@group(0) @binding(5) var<storage, read> rays: array<Ray>;
@group(0) @binding(6) var<storage, read_write> marched: array<Marched>;

fn field_inverse(i: u32) -> f32 {
    return inverses[i];
}

fn field_gaps(i: u32) -> u32 {
    return gaps[i];
}

fn field_base(i: u32) -> u32 {
    return base[i];
}

fn field_upper(i: u32) -> u32 {
    return upper[i];
}

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
