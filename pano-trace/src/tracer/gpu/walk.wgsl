// The state of a sample on its way from ray to ray (`turn.wgsl`), and the weights of what it finds.

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
// What a real surface may mirror.
const REFLECTED: u32 = 9u;

// What is to be done once the answer is known.
const GO_ON: u32 = 0u;
const AT_VERTEX: u32 = 1u;
const AT_POINT: u32 = 2u;
const AT_PAIR: u32 = 3u;
const NEXT_STRATEGY: u32 = 4u;
const FINISHED: u32 = 5u;
const DONE: u32 = 6u;

// A path under way.
struct Path {
    // What its light counts, and (`throughput`) what is left of light along it.
    outer: vec3f,
    // Density with which its direction was found; negative: light sampling was not tried.
    found_by: f32,
    throughput: vec3f,
    remaining: u32,
    // Bounces so far; the first of a real surface's own comes before the path's.
    depth: i32,
    // 1 if it can meet objects.
    mixed: u32,
    // 1 if it has scattered at one last.
    from_object: u32,
}

// A light sample: what it counts, and the density with which the surface would have found it. What comes after it.
struct Light {
    value: vec3f,
    pdf: f32,
    next_origin: vec3f,
    distance: f32,
    next_direction: vec3f,
    next_job: u32,
}

// A walk that begins when the one in hand has ended.
struct Later {
    exists: bool,
    first: First,
    path: Path,
}

// What a real surface may mirror: what it sends out beyond diffuse reflection, 0 for nothing, and the ray.
struct Mirror {
    origin: vec3f,
    pad0: u32,
    direction: vec3f,
    pad1: u32,
    beyond: vec3f,
    pad2: u32,
}

// How much work goes into the change of a point; see delta::Effort.
struct Effort {
    share: f32,
    least: f32,
    boost: f32,
    lights: u32,
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
    u: vec4f,
    // Light samples, and how many of them were taken.
    lights: u32,
    taken: u32,
    // How often it uses any strategy, and the third one.
    share: f32,
    cosine_rate: f32,
    bounces: u32,
}

fn path_of(outer: vec3f, bounces: u32, mixed: bool) -> Path {
    return Path(outer, -1.0, vec3f(1.0), bounces, 0, select(0u, 1u, mixed), 0u);
}

// Of points that only colour a path's end.
fn of_a_paths_end() -> Effort {
    return Effort(PATHS_END_SHARE, LEAST_EFFORT_ONCE, 1.0, 1u);
}

// Of points that a mirror or glass shows.
fn of_an_image() -> Effort {
    return Effort(1.0, LEAST_EFFORT_ONCE, 1.0, LIGHTS_OF_AN_IMAGE);
}

// Of points that change another.
fn of_another() -> Effort {
    return Effort(1.0, LEAST_EFFORT_ONCE, 1.0, SECOND_ORDER_LIGHTS);
}

fn balance(mine: f32, other: f32) -> f32 {
    return select(0.0, mine / (mine + other), mine > 0.0);
}

// Share of light samples aimed at the real world; the others are aimed at shining objects.
fn world_share(mixed: u32) -> f32 {
    if !EMITTERS || mixed == 0u {
        return 1.0;
    }
    return select(0.0, 0.5, LIT);
}

// Weight of what a path meets against the light samples that could have found it; `pdf` is that of the real world's there.
fn weight_of(path: Path, first: First, pdf: f32) -> f32 {
    if path.found_by < 0.0 || MIS == BSDF_ONLY {
        return 1.0;
    }
    if MIS == LIGHT_ONLY {
        return 0.0;
    }
    let share = world_share(path.mixed);
    var other = 0.0;
    if first.what != OBJECT {
        other = share * pdf;
    } else if EMITTERS && share < 1.0 {
        other = (1.0 - share) * emitter_pdf(objects(), first.object, first.direction);
    }
    return balance(path.found_by, other);
}

