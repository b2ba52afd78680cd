// Samples of the two passes, one invocation a pixel: `follow.wgsl` answers the ray in hand, `advance` says what that means and sends the
// next one; see iprt/trace.rs. What a pixel's sample has come to waits in memory. The order of the random numbers is the CPU's.

// What a pixel's samples have come to. Of the second pass the objects' radiance is in `real`.
struct Estimate {
    real: vec3f,
    // Sum of squared luminances.
    real_squares: f32,
    change: vec3f,
    change_squares: f32,
    mirror: vec3f,
    mirror_rays: u32,
    mirrored: vec3f,
    // Samples that have found what they looked for.
    count: u32,
    mirrored_mixed: vec3f,
    // All of them; before `begin` whether any are wanted.
    samples: u32,
    touched: u32,
    rays: u32,
    pad0: u32,
    pad1: u32,
}

// A pixel's sample between two turns.
struct EstimateLane {
    total: vec3f,
    // IDLE once all samples are done.
    job: u32,
    numbers: Sampler,
    number: u32,
    path: Path,
    light: Light,
    // Where rays leave the real point, its normal, and the direction in which it is seen.
    place: vec3f,
    attempt: u32,
    normal: vec3f,
    // What the path in hand is followed for.
    purpose: u32,
    direction: vec3f,
    pad0: u32,
    // What its light is compared with.
    kept: vec3f,
    pad1: u32,
}

@group(0) @binding(8) var<storage, read_write> lanes: array<EstimateLane>;
@group(0) @binding(19) var<storage, read_write> estimates: array<Estimate>;

// What the ray in hand is for, beside CAMERA, REFLECTED and those of a path: light that arrives at a real point.
const ARRIVING: u32 = 16u;

// What a path is followed for: an object's radiance, the change of a real point, what is mirrored there.
const SEEN_OBJECT: u32 = 0u;
const CHANGED: u32 = 1u;
const MIRRORED: u32 = 2u;

var<private> lane: u32;
var<private> texel: vec2i;
var<private> estimate: Estimate;
var<private> number: u32;
var<private> attempt: u32;
var<private> place: vec3f;
var<private> normal: vec3f;
var<private> seen_along: vec3f;
var<private> purpose: u32;
var<private> kept: vec3f;

// A ray through the pixel. Frames go on where the one before ended; attempts are streams of their own.
fn send_camera() {
    let index = params.view.stream.x * estimate.samples + number;
    numbers = sampler_of(vec2u(texel), index, attempt, params.view.stream.y);
    let drawn = draw();
    send(CAMERA, params.view.position, camera_direction(vec2f(texel) + drawn.xy));
    ray.goal = vec3f(drawn.z, 0.0, 0.0);
    ray.asks = ASKS | FOR_OBJECTS | AS_SHOWN;
}

fn next_sample() {
    number += 1u;
    attempt = 0u;
    job = IDLE;
    if number < estimate.samples {
        send_camera();
    }
}

// A sample that is not finite counts as black.
fn finite_or_black(value: vec3f) -> vec3f {
    return select(vec3f(0.0), value, is_finite3(value));
}

fn squared_luminance(value: vec3f) -> f32 {
    let l = luminance(value);
    return l * l;
}

fn add_real(value: vec3f) {
    let real = finite_or_black(value);
    estimate.real += real;
    estimate.real_squares += squared_luminance(real);
    estimate.count += 1u;
}

// What one ray tells of E_R and of E_RV − E_R, and the ray that asks what the point mirrors.
fn add_irradiance(real: vec3f, changed: vec3f) {
    let change = finite_or_black(changed);
    add_real(real);
    estimate.change += change;
    estimate.change_squares += squared_luminance(change);
    send(REFLECTED, place, reflect(seen_along, normal));
    let wanted = estimate.mirror_rays < MIRROR_RAYS;
    ray.asks = ASKS | FOR_OBJECTS | BEHIND_OBJECTS | select(IF_MET, 0u, wanted);
}

fn begin_irradiance(hit: RealHit) {
    place = world_leave(params.world, hit);
    normal = hit.normal;
    seen_along = ray.direction;
    let u = draw();
    let by_light = u.z < 0.5;
    var sample = LightSample(cosine_direction(normal, u.xy), true, vec3f(0.0), AT_ANYTHING);
    if by_light {
        sample = world_sample_light(params.world, place, u.xy);
    }
    if !sample.exists || dot(sample.direction, normal) <= 0.0 {
        add_irradiance(vec3f(0.0), vec3f(0.0));
        return;
    }
    send(ARRIVING, place, sample.direction);
    ray.goal = sample.goal;
    ray.aimed = sample.aimed;
    ray.asks = ASKS | FOR_OBJECTS | BEHIND_OBJECTS | AS_UPDATED | select(0u, BY_FACET, by_light);
}

// Follows the light that the object in hand sends back.
fn begin_walk(what_for: u32, outer: vec3f, bounces: u32, first: First) {
    purpose = what_for;
    path = path_of(outer, bounces, true);
    total = vec3f(0.0);
    job = IDLE;
    light.next_job = IDLE;
    scatter(first, Matter(vec3f(0.0), vec3f(0.0)), false, 1.0);
}

fn end_walk() {
    switch purpose {
        case SEEN_OBJECT: {
            add_real(total);
            next_sample();
        }
        case CHANGED: {
            add_irradiance(kept, total - kept);
        }
        default: {
            if is_finite3(kept) && is_finite3(total) {
                estimate.mirrored += kept;
                estimate.mirrored_mixed += total;
            }
            next_sample();
        }
    }
}

// Light that arrives at the real point in hand, from an object if one is in the way.
fn reckon_arriving(answer: Answer, first: First) {
    estimate.rays += select(1u, 2u, answer.known);
    if !answer.known {
        add_irradiance(vec3f(0.0), vec3f(0.0));
        return;
    }
    let cosine = dot(ray.direction, normal);
    let weight = cosine / (0.5 * (cosine / PI + answer.pdf));
    let before = select(answer.light, relits[lane].before, relits[lane].changed == 1u);
    kept = before * weight;
    if first.what != OBJECT {
        // Exactly nothing where nothing has changed.
        add_irradiance(kept, (answer.light - before) * weight);
        return;
    }
    estimate.touched = 1u;
    begin_walk(CHANGED, vec3f(weight), max(params.bounces, 1u) - 1u, first);
}

// What the real point in hand mirrors, and what of it an object hides.
fn reckon_reflected(answer: Answer, first: First) {
    estimate.rays += 1u;
    if estimate.mirror_rays < MIRROR_RAYS {
        estimate.rays += 1u;
        estimate.mirror += answer.light;
        estimate.mirror_rays += 1u;
    }
    if first.what != OBJECT {
        next_sample();
        return;
    }
    kept = answer.light;
    begin_walk(MIRRORED, vec3f(1.0), max(params.bounces, 1u) - 1u, first);
}

fn reckon_camera(answer: Answer, first: First) {
    estimate.rays += 1u;
    attempt += 1u;
    if first.what == select(REAL, OBJECT, params.virtual_pass == 1u) {
        if first.what == REAL {
            begin_irradiance(first.real);
        } else {
            begin_walk(SEEN_OBJECT, vec3f(1.0), params.bounces, first);
        }
    } else if attempt < params.attempts {
        send_camera();
    } else {
        next_sample();
    }
}

// A path's ray, or a light sample's.
fn reckon_walk(answer: Answer, first: First) {
    estimate.rays += 1u;
    let then = reckon_path(answer, first.what);
    job = IDLE;
    if then == GO_ON {
        send(light.next_job, light.next_origin, light.next_direction);
        return;
    }
    let weight = weight_of(path, first, answer.pdf);
    if first.what == OBJECT {
        light.next_job = IDLE;
        scatter(first, Matter(vec3f(0.0), vec3f(0.0)), false, weight);
    } else {
        add_end(answer, weight);
    }
}

// Takes the answer to what was asked of the ray in hand.
fn step(answer: Answer) {
    let first = first_of(answer);
    switch job {
        case CAMERA: {
            reckon_camera(answer, first);
        }
        case ARRIVING: {
            reckon_arriving(answer, first);
        }
        case REFLECTED: {
            reckon_reflected(answer, first);
        }
        default: {
            reckon_walk(answer, first);
        }
    }
}

// Rays through the centres of the pixels that are wanted, for what the world shows there without objects.
@compute @workgroup_size(8, 8)
fn centers(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let at = texel_of(params.rows, id);
    let k = index_of(params.rows, at);
    send(CAMERA, params.view.position, camera_direction(vec2f(at) + 0.5));
    ray.asks = select(0u, ASKS, estimates[k].samples > 0u);
    asked[k].quest = ray;
}

// How many samples each pixel takes, and its first ray.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    lane = index_of(params.rows, texel);
    estimate = estimates[lane];
    job = IDLE;
    var wanted = estimate.samples > 0u;
    estimate.samples = params.samples;
    if params.virtual_pass == 1u {
        wanted = may_see_objects(vec2f(texel));
    } else if wanted {
        let answer = answer_of(lane);
        if answer.real.exists {
            let thinning = thinning_of(answer.real, Matter(vec3f(0.0), vec3f(0.0)), asked[lane].quest.direction);
            let most = min(thinning, MOST_THINNING_OF_IRRADIANCE);
            estimate.samples = (params.samples + most - 1u) / most;
        }
    } else {
        estimate.samples = 1u;
    }
    ray.asks = 0u;
    if wanted {
        send_camera();
    }
    put_estimate();
}

// Keeps what the next turn needs.
fn put_estimate() {
    if job == PATH || job == SHADOW || job == AIMED {
        ray.asks = path_question() | AS_UPDATED | select(0u, BY_FACET, job == SHADOW);
    }
    estimates[lane] = estimate;
    asked[lane].quest = ray;
    lanes[lane] = EstimateLane(
        total, job, numbers, number, path, light, place, attempt, normal, purpose, seen_along, 0u, kept, 0u
    );
}

fn take_estimate() {
    let lane_ = lanes[lane];
    estimate = estimates[lane];
    ray = asked[lane].quest;
    total = lane_.total;
    job = lane_.job;
    numbers = lane_.numbers;
    number = lane_.number;
    path = lane_.path;
    light = lane_.light;
    place = lane_.place;
    attempt = lane_.attempt;
    normal = lane_.normal;
    purpose = lane_.purpose;
    seen_along = lane_.direction;
    kept = lane_.kept;
}

@compute @workgroup_size(8, 8)
fn advance(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    lane = index_of(params.rows, texel);
    if asked[lane].quest.asks != 0u || lanes[lane].job == IDLE {
        return;
    }
    take_estimate();
    step(answer_of(lane));
    if job == IDLE && number < estimate.samples {
        end_walk();
    }
    put_estimate();
}
