// Where the change of a real point comes from; see tracer/delta.rs.

// A cone that holds objects: the probability of its being chosen, and that over its solid angle.
struct Target {
    cone: Cone,
    density: f32,
    probability: f32,
}

// Where the objects are, seen from a point.
struct Aim {
    targets: array<Target, MAX_CLUSTERS>,
    count: u32,
    inside: bool,
    form_factor: f32,
}

// Of the point in hand, and where the surroundings of the objects are, if they are asked for.
var<private> aim: Aim;
var<private> around: Aim;

fn ball_form_factor(ball: vec4f, at: vec3f, normal: vec3f) -> f32 {
    let to = ball.xyz - at;
    let distance = max(length(to), ball.w);
    let sine = ball.w / distance;
    let facing = dot(to, normal) / distance;
    return select(sine * sine * max(facing, 0.3 * sine), 0.0, facing <= -sine);
}

// `scale`: radii of the balls that are aimed at.
fn aim_at(x: vec3f, normal: vec3f, scale: f32) -> Aim {
    var found: Aim;
    var total = 0.0;
    for (var i = 0u; i < params.clusters.y; i++) {
        let ball = ball_at(params.clusters.x, i) * vec4f(1.0, 1.0, 1.0, scale);
        let form_factor = ball_form_factor(ball, x, normal);
        if form_factor <= 0.0 {
            continue;
        }
        let cone = cone_around(ball, x);
        if cone.cap <= 0.0 {
            found.inside = true;
            continue;
        }
        let to = ball.xyz - x;
        let facing = form_factor * dot(to, to) / (ball.w * ball.w);
        found.form_factor += form_factor;
        found.targets[found.count] = Target(cone, facing / TAU, cone.cap * facing);
        found.count += 1u;
        total += cone.cap * facing;
    }
    for (var i = 0u; i < found.count; i++) {
        found.targets[i].probability /= total;
        found.targets[i].density /= total;
    }
    return found;
}

// Density per steradian with which `aim_sample` finds `d`.
fn aim_pdf(of_: ptr<private, Aim>, d: vec3f) -> f32 {
    var pdf = 0.0;
    for (var i = 0u; i < (*of_).count; i++) {
        if cone_contains((*of_).targets[i].cone, d) {
            pdf += (*of_).targets[i].density;
        }
    }
    return pdf;
}

fn aim_meets(of_: ptr<private, Aim>, d: vec3f) -> bool {
    return (*of_).inside || aim_pdf(of_, d) > 0.0;
}

fn aim_sample(of_: ptr<private, Aim>, at: vec2f, pick: f32) -> vec3f {
    var chosen = (*of_).targets[(*of_).count - 1u].cone;
    var left = pick;
    for (var i = 0u; i < (*of_).count; i++) {
        if left < (*of_).targets[i].probability {
            chosen = (*of_).targets[i].cone;
            break;
        }
        left -= (*of_).targets[i].probability;
    }
    return cone_sample(chosen, at);
}

// See influence::spread_over_square.
fn spread_over_square(first: vec2f, i: u32) -> vec2f {
    return fract(first + vec2f(0.7548777, 0.5698403) * f32(i));
}

// See Lights::behind.
fn light_behind(of_: ptr<private, Aim>, x: vec3f, normal: vec3f) -> f32 {
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
        if aim_meets(of_, d) {
            behind += light;
        }
    }
    return select(0.0, behind / all_of_it, all_of_it > 0.0);
}

// Whether the mirror image of an object may show at a real surface, seen along `direction` and left at `x`.
fn may_mirror_objects(x: vec3f, normal: vec3f, direction: vec3f) -> bool {
    let axis = reflect(direction, normal);
    for (var i = 0u; i < params.view.balls.y; i++) {
        let ball = ball_at(params.view.balls.x, i);
        let to = ball.xyz - x;
        let along = dot(to, axis);
        let off = to - axis * along;
        if along > -ball.w && dot(off, off) <= ball.w * ball.w {
            return true;
        }
    }
    return false;
}

// One sample in how many is enough for the change of a real point that is seen along `direction`; see Tracer::thinning.
fn thinning_of(hit: RealHit, matter: Matter, direction: vec3f) -> u32 {
    let x = world_leave(params.world, hit);
    aim = aim_at(x, hit.normal, 1.0);
    if aim.inside || (any(matter.beyond > vec3f(0.0)) && may_mirror_objects(x, hit.normal, direction)) {
        return 1u;
    }
    let second_order = SECOND_ORDER && params.bounces >= 2u;
    if aim.count == 0u && !second_order {
        return MOST_THINNING;
    }
    let spiky = GLOSS || BODIES;
    let found = select(aim.form_factor, SPIKY * sqrt(aim.form_factor), spiky);
    var share = max(found, light_behind(&aim, x, hit.normal) - aim.form_factor);
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
