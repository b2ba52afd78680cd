// Where the change of a real point comes from; see tracer/delta.rs.

struct Cone {
    axis: vec3f,
    cap: f32,
    density: f32,
    probability: f32,
}

struct Aim {
    cones: array<Cone, MAX_CLUSTERS>,
    count: u32,
    inside: bool,
    form_factor: f32,
}

fn ball_form_factor(ball: vec4f, at: vec3f, normal: vec3f) -> f32 {
    let to = ball.xyz - at;
    let distance = max(length(to), ball.w);
    let sine = ball.w / distance;
    let facing = dot(to, normal) / distance;
    return select(sine * sine * max(facing, 0.3 * sine), 0.0, facing <= -sine);
}

fn aim_at(x: vec3f, normal: vec3f) -> Aim {
    var aim: Aim;
    var total = 0.0;
    for (var i = 0u; i < params.clusters.y; i++) {
        let ball = ball_at(params.clusters.x, i);
        let form_factor = ball_form_factor(ball, x, normal);
        if form_factor <= 0.0 {
            continue;
        }
        let to = ball.xyz - x;
        let d2 = dot(to, to);
        let r2 = ball.w * ball.w;
        if d2 <= 1.05 * r2 {
            aim.inside = true;
            continue;
        }
        let sin2 = max(CONE_MARGIN * r2 / d2, NARROWEST_CONE);
        let facing = form_factor * d2 / r2;
        let cap = sin2 / (1.0 + sqrt(1.0 - sin2));
        aim.form_factor += form_factor;
        aim.cones[aim.count] = Cone(to / sqrt(d2), cap, facing / TAU, cap * facing);
        aim.count += 1u;
        total += cap * facing;
    }
    for (var i = 0u; i < aim.count; i++) {
        aim.cones[i].probability /= total;
        aim.cones[i].density /= total;
    }
    return aim;
}

fn cone_contains(cone: Cone, d: vec3f) -> bool {
    let chord = d - cone.axis;
    return dot(chord, chord) <= 2.0 * cone.cap;
}

// Density per steradian with which `aim_sample` finds `d`.
fn aim_pdf(aim: ptr<function, Aim>, d: vec3f) -> f32 {
    var pdf = 0.0;
    for (var i = 0u; i < (*aim).count; i++) {
        if cone_contains((*aim).cones[i], d) {
            pdf += (*aim).cones[i].density;
        }
    }
    return pdf;
}

fn aim_meets(aim: ptr<function, Aim>, d: vec3f) -> bool {
    return (*aim).inside || aim_pdf(aim, d) > 0.0;
}

fn aim_sample(aim: ptr<function, Aim>, at: vec2f, pick: f32) -> vec3f {
    var chosen = (*aim).cones[(*aim).count - 1u];
    var left = pick;
    for (var i = 0u; i < (*aim).count; i++) {
        if left < (*aim).cones[i].probability {
            chosen = (*aim).cones[i];
            break;
        }
        left -= (*aim).cones[i].probability;
    }
    let disc = concentric_disc(at);
    let r2 = dot(disc, disc);
    let height = chosen.cap * r2;
    let sine = sqrt(max(height * (2.0 - height), 0.0));
    let scale = select(0.0, sine / sqrt(max(r2, 1e-37)), r2 > 0.0);
    let off = tangent_of(chosen.axis) * (disc.x * scale) + bitangent_of(chosen.axis) * (disc.y * scale);
    return normalize(off + chosen.axis * (1.0 - height));
}

// One sample in how many is enough for the change of a real point; see Tracer::thinning.
fn thinning_of(hit: RealHit) -> u32 {
    let aim = aim_at(world_leave(hit), hit.normal);
    if aim.inside {
        return 1u;
    }
    if aim.count == 0u && !(SECOND_ORDER && params.bounces >= 2u) {
        return 16u;
    }
    if aim.form_factor < 0.125 * FULL_EFFORT {
        return 4u;
    }
    return select(1u, 2u, aim.form_factor < 0.5 * FULL_EFFORT);
}

