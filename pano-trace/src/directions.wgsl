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

