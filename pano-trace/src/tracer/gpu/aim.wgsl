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

// `scale`: radii of the balls that are aimed at.
fn aim_at(x: vec3f, normal: vec3f, scale: f32) -> Aim {
    var aim: Aim;
    var total = 0.0;
    for (var i = 0u; i < params.clusters.y; i++) {
        let ball = ball_at(params.clusters.x, i) * vec4f(1.0, 1.0, 1.0, scale);
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

// See influence::spread_over_square.
fn spread_over_square(first: vec2f, i: u32) -> vec2f {
    return fract(first + vec2f(0.7548777, 0.5698403) * f32(i));
}

// See Lights::behind.
fn light_behind(aim: ptr<function, Aim>, x: vec3f, normal: vec3f) -> f32 {
    var all_of_it = 0.0;
    var behind = 0.0;
    for (var i = 0u; i < params.lights.y; i++) {
        let point = ball_at(params.lights.x, i);
        let to = select(point.xyz, point.xyz - x, point.w > 0.0);
        let d2 = max(dot(to, to), 1e-12);
        let d = to / sqrt(d2);
        let cosine = dot(d, normal);
        if cosine <= 0.0 {
            continue;
        }
        let light = cosine * select(1.0, point.w / d2, point.w > 0.0);
        all_of_it += light;
        if aim_meets(aim, d) {
            behind += light;
        }
    }
    return select(0.0, behind / all_of_it, all_of_it > 0.0);
}

// One sample in how many is enough for the change of a real point; see Tracer::thinning.
fn thinning_of(hit: RealHit) -> u32 {
    let x = world_leave(hit);
    var aim = aim_at(x, hit.normal, 1.0);
    if aim.inside {
        return 1u;
    }
    let second_order = SECOND_ORDER && params.bounces >= 2u;
    if aim.count == 0u && !second_order {
        return MOST_THINNING;
    }
    let spiky = GLOSS || BODIES;
    let found = select(aim.form_factor, SPIKY * sqrt(aim.form_factor), spiky);
    var share = max(found, BEHIND * (light_behind(&aim, x, hit.normal) - aim.form_factor));
    if second_order {
        share = max(share, SECOND_ORDER_SHARE * aim_at(x, hit.normal, SURROUNDINGS).form_factor);
    }
    var most = select(MOST_THINNING, MOST_THINNING_SPIKY, spiky);
    if EMITTERS || MIS != BALANCE {
        most = MOST_THINNING_UNAIMED;
    }
    var thinning = 1u;
    while thinning < most && share * share * f32(2u * thinning) <= 1.0 {
        thinning *= 2u;
    }
    return thinning;
}
