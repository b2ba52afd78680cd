// MR360's tracer over proxies, one invocation a pixel: each question is answered at once.

struct LitFrame {
    rows: Rows,
    view: View,
    world: World,
    lighting: Lighting,
    // Samples of this submission.
    begin: u32,
    end: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: LitFrame;

// What the panorama shows of a real point, or of infinity.
fn real_light(answer: Answer) -> vec3f {
    var at = ray.direction;
    if answer.real.exists {
        at = normalized_or(answer.real.position - params.lighting.capture, ray.direction);
    }
    return environment_look(params.world, at);
}

// Guides of each pixel.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    begin_lit(guides_at(vec2f(texel) + 0.5).pixel);
    pixels[index] = lit;
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    lit = pixels[index];
    sample.question = CAMERA;
    sample.number = params.begin;
    while ask(params.end) {
        reckon(answer_to(ray));
    }
    pixels[index] = lit;
}
