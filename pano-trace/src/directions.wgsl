// Directions, and what is drawn on discs about them; see directions.rs and, for the disc, bsdf/mod.rs.

fn is_negative(x: f32) -> bool {
    return (bitcast<u32>(x) >> 31u) != 0u;
}

fn copy_sign(x: f32, sign: f32) -> f32 {
    return select(abs(x), -abs(x), is_negative(sign));
}

fn most_of(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// `v` with length 1, or `otherwise` if it has no direction.
fn normalized_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let inverse = 1.0 / sqrt(dot(v, v));
    return select(otherwise, v * inverse, is_finite(inverse) && inverse > 0.0);
}

// Two unit vectors at right angles to unit `n` and to each other (Duff et al. 2017), as glam makes them.
fn tangent_of(n: vec3f) -> vec3f {
    let sign = copy_sign(1.0, n.z);
    let a = -1.0 / (sign + n.z);
    return vec3f(1.0 + sign * n.x * n.x * a, sign * (n.x * n.y * a), -sign * n.x);
}

fn bitangent_of(n: vec3f) -> vec3f {
    let sign = copy_sign(1.0, n.z);
    let a = -1.0 / (sign + n.z);
    return vec3f(n.x * n.y * a, sign + n.y * n.y * a, -n.y);
}

fn concentric_disc(u: vec2f) -> vec2f {
    let o = u * 2.0 - 1.0;
    if o.x == 0.0 && o.y == 0.0 {
        return o;
    }
    var r = o.y;
    var phi = 0.0;
    if abs(o.x) > abs(o.y) {
        r = o.x;
        phi = 0.25 * PI * (o.y / o.x);
    } else {
        phi = 0.5 * PI - 0.25 * PI * (o.x / o.y);
    }
    let turn = sin_cos(phi);
    return r * turn.yx;
}

// The unit vector whose cosine to `axis` is `z`, turned about it.
fn around_axis(axis: vec3f, z: f32, turn: f32) -> vec3f {
    let angle = sin_cos(turn * TAU);
    let r = sqrt(max(1.0 - z * z, 0.0));
    return normalize(axis * z + (tangent_of(axis) * angle.y + bitangent_of(axis) * angle.x) * r);
}

fn cap_direction(axis: vec3f, cos_radius: f32, u: vec2f) -> vec3f {
    return around_axis(axis, 1.0 - u.x * (1.0 - cos_radius), u.y);
}

fn cosine_direction(normal: vec3f, u: vec2f) -> vec3f {
    let disc = concentric_disc(u);
    let up = sqrt(max(1.0 - dot(disc, disc), 0.0));
    return normalize(tangent_of(normal) * disc.x + bitangent_of(normal) * disc.y + normal * up);
}

fn lobe_direction(axis: vec3f, roughness: f32, u: vec2f) -> vec3f {
    let r2 = roughness * roughness;
    let cos2 = (1.0 - u.x) / (1.0 + (r2 * r2 - 1.0) * u.x);
    return around_axis(axis, max(2.0 * cos2 - 1.0, 0.0), u.y);
}

fn lobe_pdf(axis: vec3f, roughness: f32, d: vec3f) -> f32 {
    let r2 = roughness * roughness;
    let alpha2 = max(r2 * r2, 1e-6);
    let cosine = dot(axis, d);
    let base = 0.5 * (1.0 + cosine) * (alpha2 - 1.0) + 1.0;
    return select(0.0, 0.25 / PI * alpha2 / (base * base), cosine > 0.0);
}
