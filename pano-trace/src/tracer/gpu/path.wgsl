// A path on its way from ray to ray: the ray in hand, and what its answer means for a path, a light sample and a path's end. See
// tracer/path.rs; `vertex.wgsl` is where it scatters.

// What tracers have come to at the pixel in hand.
var<private> pixel: Pixel;
var<private> numbers: Sampler;
// Of the sample in hand.
var<private> total: vec3f;
var<private> job: u32;
var<private> path: Path;
var<private> light: Light;

fn draw() -> vec4f {
    var state = numbers;
    let drawn = next_4d(&state);
    numbers = state;
    return drawn;
}

fn send(what_for: u32, origin: vec3f, direction: vec3f) {
    job = what_for;
    ray = quest_of(origin, direction);
}

// What is asked of a path's ray in hand, or of a light sample's.
fn path_question() -> u32 {
    // Whether what lies at a surface that is aimed at is nearer than an object, is told by comparing them.
    let blocks = job == SHADOW && ray.aimed == AT_INFINITY;
    return ASKS | select(0u, FOR_OBJECTS, path.mixed == 1u) | select(0u, FOR_ANY | UNLESS_MET, blocks);
}

// Adds what a light sample comes to; says what is to be done.
fn reckon_path(answer: Answer, what: u32) -> u32 {
    if job == PATH {
        return AT_VERTEX;
    }
    if job == SHADOW {
        let pdf = world_share(path.mixed) * answer.pdf;
        if answer.known && what != OBJECT && pdf > 0.0 {
            total += light.value * answer.light / select(pdf, pdf + light.pdf, MIS == BALANCE);
        }
    } else if EMITTERS && what == OBJECT && answer.object.t >= light.distance * 0.999 {
        let pdf = (1.0 - world_share(path.mixed)) * emitter_pdf(objects(), answer.object, ray.direction);
        if pdf > 0.0 {
            let density = select(pdf, pdf + light.pdf, MIS == BALANCE);
            total += light.value * surface_at(objects(), answer.object, ray.direction).emission / density;
        }
    }
    return GO_ON;
}

// Light at the end of a path that goes no farther.
fn add_end(answer: Answer, weight: f32) {
    total += path.outer * path.throughput * answer.light * weight;
}
