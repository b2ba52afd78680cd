// Surfaces that wait for one another. The CPU's functions call each other; here what a ray meets goes onto a stack, and comes down again
// once all its own rays have been answered. A pixel goes from ray to ray and can wait in memory between any two of them. The order of
// the random numbers is the CPU's.

// A surface whose radiance, or change, is asked for.
struct Waiting {
    // What it counts for the one before.
    factor: vec3f,
    stage: u32,
    // Of the ray that met it.
    direction: vec3f,
    // Surfaces before it.
    depth: u32,
    // What its rays have come to.
    light: vec3f,
    // NOTHING of a real one.
    instance: u32,
    // Where the ray met it.
    t: f32,
    u: f32,
    v: f32,
    face: u32,
    // Of a real one; of a clear one the facet as its normal.
    position: vec3f,
    surface: u32,
    normal: vec3f,
    // The ray's share of its pixel.
    weight: f32,
    // Of a real one, see shade::Change; `light` is what it mirrors of objects.
    without: vec3f,
    pad1: u32,
    irradiance: vec3f,
    pad2: u32,
    highlight: vec3f,
    pad3: u32,
    dimmed: vec3f,
    media: Media,
    // What its ray covers, where textures are filtered.
    beam: Beam,
}

// What a surface on the stack asks next.
const ENTER: u32 = 0u;
const REFRACT: u32 = 1u;
const REFLECT: u32 = 2u;
const LIGHT: u32 = 3u;
const LAMPS: u32 = 4u;
const CHANGE: u32 = 5u;
const MIRRORED: u32 = 6u;
const FINISH: u32 = 7u;

// What the ray in hand is for: a pixel, a mirror or glass, a mirror too rough to show real surfaces, a real surface's mirror; a lamp's
// sample before objects, before real surfaces, and of one that nothing else is asked about.
const IDLE: u32 = 0u;
const CAMERA: u32 = 1u;
const ONWARD: u32 = 2u;
const ROUGH: u32 = 3u;
const GLOSSY: u32 = 4u;
const OBJECT_PROBE: u32 = 5u;
const SURFACE_PROBE: u32 = 6u;
const OPEN_PROBE: u32 = 7u;

// What goes along with the ray in hand to the next surface.
struct Errand {
    factor: vec3f,
    weight: f32,
    // In place of everything real.
    behind: vec3f,
    depth: u32,
    roughness: f32,
    beam: Beam,
}

// A pixel between two rays.
struct Walk {
    value: vec3f,
    // Surfaces on the stack.
    level: u32,
    shadow: Shadow,
    numbers: Sampler,
    // The sample in hand, whether it is under way, and what it shows.
    number: u32,
    under_way: u32,
    shows: u32,
    pad0: u32,
    pad1: u32,
}

// What a pixel has come to.
struct Seen {
    pixel: Pixel,
    photo: vec3f,
    // Any ray through it may meet an object; nothing can change here; all samples are asked.
    looks: u32,
    quiet: u32,
    thorough: u32,
    // It is to be traced.
    due: u32,
    // Lamps as bits: those that shine here, those that do not, those whose samples differ.
    bright: u32,
    dark: u32,
    penumbra: u32,
    taken: u32,
    shadow_rays: u32,
}

struct Held {
    seen: Seen,
    walk: Walk,
}

@group(0) @binding(6) var<storage, read_write> pixels: array<Held>;
@group(0) @binding(7) var<storage, read_write> stack: array<Waiting>;

// The surface on top of the stack, as rays leave it.
struct Here {
    position: vec3f,
    // Light from below it does not count.
    horizon: vec3f,
    // When real surfaces count; see BLOCKS.
    real: u32,
    // What a pixel covers of it.
    neighbours: Neighbours,
    // Of an object.
    bsdf: Bsdf,
    lobes: Lobes,
    material: Material,
    emission: vec3f,
    outside: bool,
    // Where its material begins in the tables.
    material_word: u32,
    // Of a real one: what the picture shows of it.
    pictured: Pictured,
}

// What the picture shows of a real surface, if it is the picture that tells what it is made of.
struct Pictured {
    radiance: vec3f,
    exists: bool,
}

var<private> texel: vec2i;
var<private> index: u32;
var<private> pixel: Seen;
var<private> walk: Walk;
var<private> shadow: Shadow;
var<private> numbers: Sampler;
var<private> level: u32;
var<private> value: vec3f;
var<private> frame: Waiting;
var<private> is_loaded: bool;
var<private> here: Here;
var<private> job: u32;
var<private> errand: Errand;

fn draw() -> vec4f {
    var state = numbers;
    let drawn = next_4d(&state);
    numbers = state;
    return drawn;
}

fn top() -> u32 {
    return index * params.levels + level - 1u;
}

fn on_object() -> bool {
    return frame.instance != NOTHING;
}

// Where a ray leaves the surface on top.
fn leave_here(direction: vec3f) -> vec3f {
    if on_object() {
        return offset_point(here.position, bsdf_offset_normal(here.bsdf, direction));
    }
    return here.position;
}

fn send(origin: vec3f, direction: vec3f) {
    ray = quest_of(origin, direction);
}

// The surface on top has found light.
fn add_light(light: vec3f) {
    stack[top()].light += light;
}

fn go_to(stage: u32) {
    frame.stage = stage;
    stack[top()].stage = stage;
}

// The surface on top is done: what it comes to.
fn come_down(found: vec3f) {
    level -= 1u;
    is_loaded = false;
    let counted = frame.factor * found;
    if level == 0u {
        value = counted;
    } else {
        add_light(counted);
    }
}

// What infinity shows to a ray, or whatever stands there where it is followed no farther.
fn sky_of(direction: vec3f, roughness: f32) -> vec3f {
    if roughness == 0.0 {
        return environment_look(params.world, direction);
    }
    return specular_look(direction, roughness);
}

// Sends a ray on from the surface on top; where there have been too many or it counts too little, its light is known.
fn launch(why: u32, direction: vec3f, factor: vec3f, share: vec3f, roughness: f32, behind: vec3f) {
    errand.factor = factor;
    errand.weight = frame.weight * most_of(share);
    errand.behind = behind;
    errand.depth = frame.depth + 1u;
    errand.roughness = roughness;
    if errand.depth > params.deepest || errand.weight < LEAST_WEIGHT {
        if why == ROUGH {
            add_light(factor * behind);
        } else if why == ONWARD {
            add_light(factor * sky_of(direction, roughness));
        }
        return;
    }
    job = why;
    send(leave_here(direction), direction);
}

// Puts what the ray in hand met onto the stack.
fn put_on(object: Hit, real: RealHit, factor: vec3f, weight: f32) {
    var waiting: Waiting;
    waiting.direction = ray.direction;
    waiting.depth = errand.depth;
    waiting.factor = factor;
    waiting.weight = weight;
    waiting.instance = object.instance;
    waiting.t = object.t;
    waiting.u = object.u;
    waiting.v = object.v;
    waiting.face = object.face;
    waiting.media = media;
    waiting.beam = errand.beam;
    if object.instance == NOTHING {
        waiting.t = real.t;
        waiting.position = real.position;
        waiting.normal = real.normal;
        waiting.surface = real.surface;
        waiting.stage = LIGHT;
    }
    level += 1u;
    stack[top()] = waiting;
    is_loaded = false;
}

// Takes the surface on top in hand.
fn take_top() {
    is_loaded = true;
    frame = stack[top()];
    if on_object() {
        let hit = Hit(frame.t, frame.u, frame.v, frame.instance, frame.face);
        let face = face_at(objects(), hit, frame.direction);
        var footprint = point_area();
        if FILTERED {
            let covered = covered_by(frame.beam, face, hit, frame.direction, params.most_anisotropy);
            here.neighbours = covered.neighbours;
            footprint = covered.footprint;
        }
        let surface = surface_of(objects(), face, hit, frame.direction, footprint);
        here.bsdf = bsdf_at(surface.material, surface.geometric, surface.normal, -frame.direction);
        here.lobes = bsdf_lobes(here.bsdf);
        here.position = surface.position;
        here.horizon = bsdf_offset_normal(here.bsdf, -frame.direction);
        here.material = surface.material;
        here.emission = surface.emission;
        here.outside = surface.outside;
        here.material_word = material_of(objects(), hit);
        here.real = BLOCKS;
    } else {
        let hit = real_on_top();
        here.position = world_leave(params.world, hit);
        if FILTERED {
            here.neighbours = neighbours_on_plane(frame.beam, frame.direction, frame.t, frame.normal);
        }
        here.horizon = frame.normal;
        here.real = IF_OBJECTS_DO;
        here.pictured = Pictured(vec3f(0.0), false);
        if level > 1u {
            here.pictured = pictured_at(hit);
            here.real = select(ALWAYS, IF_OBJECTS_DO, here.pictured.exists);
        }
    }
}

fn real_on_top() -> RealHit {
    return RealHit(frame.position, frame.t, frame.normal, frame.surface, vec3f(0.0), true);
}
