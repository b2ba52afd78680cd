// Samples of the path tracers over proxies, one invocation a pixel: each turn's ray is answered at once.

struct Trace {
    rows: Rows,
    view: View,
    world: World,
    bounces: u32,
    samples: u32,
    // Before which sample this submission stops.
    end: u32,
    pad: u32,
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

// What lies on the ray in hand, and its light.
fn answer_with_light() -> Answer {
    var answer = answer_to(ray);
    // If it counts: behind an object, or where nothing is.
    let met = answer.object.instance != NOTHING;
    let behind = (ray.asks & BEHIND_OBJECTS) != 0u;
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
    take_pixel(index);
    last = min(params.end, started.most);
    point.stage = 3u;
    var goes_on = begin_sample();
    while goes_on {
        ray.asks = question();
        goes_on = turn(answer_with_light());
    }
    put_pixel(index);
}
