// Asks the shared functions: one invocation a number.

@group(0) @binding(0) var<uniform> count: vec4u;
@group(0) @binding(1) var<storage, read> given: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> got: array<vec4f>;

// (sin, cos, angle of (x, y), hypotenuse) of (angle, x, y).
@compute @workgroup_size(64)
fn angles(@builtin(global_invocation_id) id: vec3u) {
    if id.x < count.x {
        let v = given[id.x];
        got[id.x] = vec4f(sin_cos(v.x), angle_of(v.y, v.z), hypotenuse(v.y, v.z));
    }
}

// A direction from (u, v), and back.
@compute @workgroup_size(64)
fn directions(@builtin(global_invocation_id) id: vec3u) {
    if id.x < count.x {
        let d = direction_from_uv(given[id.x].xy);
        got[2u * id.x] = vec4f(d, 0.0);
        got[2u * id.x + 1u] = vec4f(uv_from_direction(d), 0.0, 0.0);
    }
}

@compute @workgroup_size(64)
fn finite(@builtin(global_invocation_id) id: vec3u) {
    if id.x < count.x {
        let v = given[id.x].x;
        got[id.x] = vec4f(select(0.0, 1.0, is_finite(v)), select(0.0, 1.0, is_nan(v)), limited(v), 0.0);
    }
}

// The second four numbers of a sample of a pixel.
@compute @workgroup_size(64)
fn random(@builtin(global_invocation_id) id: vec3u) {
    if id.x < count.x {
        let asked = bitcast<vec4u>(given[id.x]);
        var state = sampler_of(asked.xy, asked.z, asked.w, count.y);
        next_4d(&state);
        got[id.x] = next_4d(&state);
    }
}
