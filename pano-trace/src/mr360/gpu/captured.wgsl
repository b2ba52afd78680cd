// MR360's tracer over a panorama with depth, one invocation a pixel: `follow.wgsl` answers the ray in hand, `advance` says what that means
// and sends the next one. Samples wait in memory.

struct LitWave {
    rows: Rows,
    view: View,
    world: World,
    field: Field,
    lighting: Lighting,
    samples: u32,
    // Which of the counters this turn adds to.
    turn: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: LitWave;
@group(0) @binding(8) var<storage, read_write> samples: array<Sample>;

// A captured surface carries its light; no ray is sent to infinity where there have been too many.
fn real_light(answer: Answer) -> vec3f {
    if answer.asked {
        return answer.light;
    }
    return beyond(params.world, to_pano(params.world, ray.direction));
}

// Keeps what the next turn needs.
fn put_sample() {
    samples[index] = sample;
    pixels[index] = lit;
    asked[index].quest = ray;
}

// Guides of each pixel, from the rays through the centres, and its first ray.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    let answer = answer_of(index);
    begin_lit(guides_of(answer.object, answer.real, asked[index].quest.direction).pixel);
    sample.question = CAMERA;
    send_ray();
    put_sample();
}

@compute @workgroup_size(8, 8)
fn advance(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    if asked[index].quest.asks != 0u || samples[index].number >= params.samples {
        return;
    }
    sample = samples[index];
    lit = pixels[index];
    ray = asked[index].quest;
    var answer = answer_of(index);
    loop {
        reckon(answer);
        if !ask(params.samples) || ray.asks != 0u {
            break;
        }
        // Known without a ray.
        answer = Answer();
        answer.object.instance = NOTHING;
    }
    put_sample();
}
