// Samples of the path tracers over proxies, one invocation a pixel: each turn's ray is answered at once.

struct Trace {
    rows: Rows,
    view: View,
    world: World,
    bounces: u32,
    samples: u32,
    // Samples of this submission.
    begin: u32,
    end: u32,
    clusters: vec2u,
    lights: vec2u,
}

@group(0) @binding(0) var<uniform> params: Trace;

// Paths go on where they meet a proxy.
const CAPTURED: bool = false;

// No point waits while another is in hand.
fn put_point_aside() {
}

fn take_point_back() -> bool {
    return false;
}

fn points_wait() -> bool {
    return false;
}

// Guides of each pixel, and what its centre asks for.
@compute @workgroup_size(8, 8)
fn start(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    begin_pixel(at, guides_at(vec2f(at) + 0.5));
}

// What lies on the ray in hand.
fn answer_of(asks: u32) -> Answer {
    var answer: Answer;
    answer.object = Hit(ray.limit, 0.0, 0.0, NOTHING, 0u);
    if (asks & FOR_OBJECTS) != 0u {
        answer.object = trace_ray(params.view.roots.x, ray.origin, ray.direction, ray.limit, (asks & FOR_ANY) != 0u);
    }
    let met = answer.object.instance != NOTHING;
    let behind = (asks & BEHIND_OBJECTS) != 0u;
    answer.asked = asks_world(asks, met);
    if answer.asked {
        answer.real = world_hit(params.world, params.view.roots.y, ray.origin, ray.direction, select(answer.object.t, NEVER, behind));
    }
    answer.known = answer.asked && !answer.real.exists;
    // If it counts: behind an object, or where nothing is.
    if answer.known && job > CAMERA && met == behind {
        answer.light = environment_look(params.world, ray.direction);
        answer.pdf = environment_pdf(params.world, ray.direction);
    }
    return answer;
}

@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    let index = index_of(params.rows, texel);
    started = pixels[index];
    pixel = started.pixel;
    last = min(params.end, started.most);
    number = params.begin;
    point.stage = 3u;
    if !begin_sample() {
        return;
    }
    while turn(answer_of(question())) {
    }
    pixels[index].pixel = pixel;
}
