// The state of a sample on its way from ray to ray (`trace.wgsl`), and the weights of what it finds.

// What the ray in hand is for.
const IDLE: u32 = 0u;
const CAMERA: u32 = 1u;
// A path's next vertex; a light sample of the environment, or of a shining face.
const PATH: u32 = 2u;
const SHADOW: u32 = 3u;
const AIMED: u32 = 4u;
// dpt: light that objects may block; a direction in which they may be.
const BLOCKED: u32 = 5u;
const CHANGE: u32 = 6u;
// onepass: a light sample, and a direction, in both scenes.
const LIGHT_PAIR: u32 = 7u;
const PAIR: u32 = 8u;

// What is to be done once the answer is known.
const GO_ON: u32 = 0u;
const AT_VERTEX: u32 = 1u;
const AT_POINT: u32 = 2u;
const AT_PAIR: u32 = 3u;
const NEXT_STRATEGY: u32 = 4u;
const FINISHED: u32 = 5u;
const DONE: u32 = 6u;

// What a ray met first.
const INFINITY: u32 = 0u;
const OBJECT: u32 = 1u;
const REAL: u32 = 2u;

struct First {
    what: u32,
    object: Hit,
    real: RealHit,
    // Of the ray.
    direction: vec3f,
}

// A path under way.
struct Path {
    // What its light counts, and what is left of light along it.
    outer: vec3f,
    throughput: vec3f,
    // Density with which its direction was found; negative: light sampling was not tried.
    found_by: f32,
    remaining: u32,
    // Bounces so far; the first of a real surface's own comes before the path's.
    depth: i32,
    // Whether it can meet objects.
    mixed: bool,
}

// A light sample: what it counts, and the density with which the surface would have found it. What comes after it.
struct Light {
    value: vec3f,
    pdf: f32,
    distance: f32,
    next_job: u32,
    next_origin: vec3f,
    next_direction: vec3f,
}

// A walk that begins when the one in hand has ended.
struct Later {
    exists: bool,
    first: First,
    path: Path,
}

// The real point whose change is asked for.
struct Point {
    x: vec3f,
    // The next strategy: 0 light, 1 cone, 2 cosine, 3 none.
    stage: u32,
    normal: vec3f,
    cone_rate: f32,
    // Reflectance/π and what the point itself counts.
    scale: vec3f,
    light_rate: f32,
    // Light samples, and how many of them were taken.
    lights: u32,
    taken: u32,
    u: vec4f,
    cosine_rate: f32,
    bounces: u32,
    second_order: bool,
}

fn path_of(outer: vec3f, bounces: u32, mixed: bool) -> Path {
    return Path(outer, vec3f(1.0), -1.0, bounces, 0, mixed);
}

fn balance(mine: f32, other: f32) -> f32 {
    return select(0.0, mine / (mine + other), mine > 0.0);
}

// Share of light samples aimed at the real world; the others are aimed at shining objects.
fn world_share(mixed: bool) -> f32 {
    if !EMITTERS || !mixed {
        return 1.0;
    }
    return select(0.0, 0.5, LIT);
}

// Weight of what a path meets against the light samples that could have found it; `sky_pdf` is that of the environment's there.
fn weight_of(path: Path, first: First, sky_pdf: f32) -> f32 {
    if path.found_by < 0.0 || MIS == BSDF_ONLY {
        return 1.0;
    }
    if MIS == LIGHT_ONLY {
        return 0.0;
    }
    let share = world_share(path.mixed);
    var other = 0.0;
    if first.what == INFINITY {
        other = share * sky_pdf;
    } else if EMITTERS && first.what == OBJECT && share < 1.0 {
        other = (1.0 - share) * emitter_pdf(objects(), first.object, first.direction);
    }
    return balance(path.found_by, other);
}

// Factors of the light that is blocked and of the light that an object sends instead; see `Tracer::weights`.
struct Weights {
    blocked: f32,
    sent: f32,
    light_finds_it: bool,
}

// Density per steradian of a point's third strategy.
fn cosine_pdf(around: ptr<function, Aim>, d: vec3f, cosine: f32) -> f32 {
    if SECOND_ORDER && (*around).count > 0u {
        return AROUND * aim_pdf(around, d) + (1.0 - AROUND) * cosine / PI;
    }
    return cosine / PI;
}

fn weights_of(point: Point, aim: ptr<function, Aim>, around: ptr<function, Aim>, d: vec3f, cosine: f32, sky_pdf: f32) -> Weights {
    let by_aim = point.cone_rate * aim_pdf(aim, d) + point.cosine_rate * cosine_pdf(around, d, cosine);
    let by_light = point.light_rate * sky_pdf;
    var all_ = by_aim + by_light;
    if MIS == LIGHT_ONLY && by_light > 0.0 {
        all_ = by_light;
    }
    if by_aim <= 0.0 || !is_finite(all_) {
        return Weights(0.0, 0.0, false);
    }
    return Weights(1.0 / all_, 1.0 / by_aim, by_light > 0.0);
}

