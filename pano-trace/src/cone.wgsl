// The directions in which a ball is seen; see cone.rs.

struct Cone {
    axis: vec3f,
    // 1 − cos of its half angle; 0 for none.
    cap: f32,
}

// None inside the ball or close to it.
fn cone_around(ball: vec4f, x: vec3f) -> Cone {
    let to = ball.xyz - x;
    let d2 = dot(to, to);
    let r2 = ball.w * ball.w;
    if d2 <= NEAREST_BALL * r2 {
        return Cone(vec3f(0.0), 0.0);
    }
    let sin2 = max(CONE_MARGIN * r2 / d2, NARROWEST_CONE);
    return Cone(to / sqrt(d2), sin2 / (1.0 + sqrt(1.0 - sin2)));
}

fn cone_contains(cone: Cone, d: vec3f) -> bool {
    let chord = d - cone.axis;
    return dot(chord, chord) <= 2.0 * cone.cap;
}

fn cone_sample(cone: Cone, u: vec2f) -> vec3f {
    let disc = concentric_disc(u);
    let r2 = dot(disc, disc);
    let height = cone.cap * r2;
    let sine = sqrt(max(height * (2.0 - height), 0.0));
    let scale = select(0.0, sine / sqrt(max(r2, 1e-37)), r2 > 0.0);
    let off = tangent_of(cone.axis) * (disc.x * scale) + bitangent_of(cone.axis) * (disc.y * scale);
    return normalize(off + cone.axis * (1.0 - height));
}

