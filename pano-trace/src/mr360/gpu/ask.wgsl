// Samples of MR360's tracer, each on its way from question to question. The CPU's functions call each other; here each question is asked
// of the point in hand (at first, of the camera): `ask` draws its random numbers and sends its ray, `reckon` adds what the answer comes
// to. Everything counts linearly, so that a factor goes along in place of a sum that comes back. The order of the random numbers is the
// CPU's.
//
// A shader that includes this says what light comes from the real world along the ray in hand (`real_light`).

// The questions, in the order in which a point asks them.
const CAMERA: u32 = 0u;
// What is in the way of the light from all around?
const AMBIENT: u32 = 1u;
// Does a lamp reach it? One question a lamp.
const LAMP: u32 = 2u;
// What does it mirror, or let through?
const ONWARD: u32 = 3u;
const DONE: u32 = 4u;

// A point of a surface.
struct Point {
    // Where rays that leave a real surface begin; an object's surface itself.
    position: vec3f,
    // 1, or 0 of a real one.
    on_object: u32,
    // For shading.
    normal: vec3f,
    // Surfaces before it.
    depth: u32,
    // Along which it was met.
    direction: vec3f,
    pad: u32,
    // Of objects.
    bsdf: Bsdf,
    lobes: Lobes,
}

// A sample between two rays.
struct Sample {
    point: Point,
    // What the point in hand counts, and what has been found.
    scale: vec3f,
    question: u32,
    total: vec3f,
    lamp: u32,
    // Irradiance of the real point without objects, and its change.
    without: vec3f,
    // What the sample shows: INFINITY, OBJECT or REAL.
    shown: u32,
    change: vec3f,
    number: u32,
    numbers: Sampler,
    pad: u32,
}

var<private> texel: vec2i;
var<private> index: u32;
var<private> lit: LitPixel;
var<private> sample: Sample;

fn on_object() -> bool {
    return sample.point.on_object == 1u;
}

// Light goes through the point in hand, and one of its lobes is followed.
fn lets_through() -> bool {
    return BODIES && on_object() && sample.point.lobes.transmission > 0.0;
}

// No more rays are sent from the point in hand.
fn is_deep() -> bool {
    return on_object() && sample.point.depth >= MAX_DEPTH;
}

// Of what the point in hand mirrors.
fn mirror_roughness() -> f32 {
    return select(params.lighting.gloss_roughness, sample.point.lobes.roughness, on_object());
}

fn mirror_axis() -> vec3f {
    return reflect(sample.point.direction, sample.point.normal);
}

// Only objects matter, and of the real world only whether it is before them.
fn asks_for_objects() -> bool {
    return sample.question == AMBIENT || sample.question == LAMP || (sample.question == ONWARD && !on_object());
}

// Change of the irradiance relative to what it is without objects; all of it can be taken away and no more.
fn ratio(change: f32, without: f32) -> f32 {
    let share = change / without;
    return select(0.0, select(max(share, -1.0), -1.0, is_nan(share)), without > 0.0 && !is_nan(without));
}

// The first sample of a pixel with those guides.
fn begin_lit(guides: Pixel) {
    lit = pixels[index];
    lit.pixel = guides;
    lit.mixed = select(0u, 1u, may_see_objects(vec2f(texel)));
    for (var i = 0u; i < params.lighting.lamp_count; i++) {
        reached[index * params.lighting.lamp_count + i] = 0u;
    }
}

// The sample reaches a lamp.
fn count_reached(lamp: u32) {
    reached[index * params.lighting.lamp_count + lamp] += 1u;
}

// Adds what the sample has come to; the next one begins.
fn end_sample() {
    var value = sample.total;
    if sample.shown == REAL {
        let c = sample.change;
        let e = sample.without;
        value += lit.photo * vec3f(ratio(c.x, e.x), ratio(c.y, e.y), ratio(c.z, e.z));
    }
    lit.pixel = with_sample(lit.pixel, value, sample.shown == OBJECT);
    sample.number += 1u;
    sample.question = CAMERA;
}

// Goes to the next question that the point in hand asks, or to the next sample.
fn settle_question() {
    let lobes = sample.point.lobes;
    if sample.question == AMBIENT {
        let white = !on_object() || any(lobes.diffuse > vec3f(0.0));
        sample.question = select(LAMP, AMBIENT, AMBIENT_OCCLUSION && sample.point.depth == 0u && white);
    }
    if sample.question == LAMP && sample.lamp >= params.lighting.lamp_count {
        sample.question = ONWARD;
    }
    if sample.question == ONWARD {
        let mirrors = select(MIRRORING, GLOSS && any(lobes.specular > vec3f(0.0)), on_object());
        sample.question = select(DONE, ONWARD, lets_through() || mirrors);
    }
    if sample.question == DONE {
        end_sample();
    }
}

// Asks the next question of the samples before `last`; false if there is none. The ray in hand asks for nothing where the answer is known
// without one.
fn ask(last: u32) -> bool {
    loop {
        settle_question();
        if sample.number >= last {
            return false;
        }
        if send_ray() {
            return true;
        }
        sample.question = DONE;
    }
    return false;
}

// The ray of the question in hand; false if it leads nowhere.
fn send_ray() -> bool {
    let point = sample.point;
    let question = sample.question;
    var numbers = sample.numbers;
    if question == CAMERA {
        numbers = sampler_of(vec2u(texel), sample.number, params.view.stream.x, params.view.stream.y);
    }
    let through = lets_through();
    let deep = question == ONWARD && is_deep();
    let roughness = mirror_roughness();
    var u = vec4f(0.0);
    if question != ONWARD || !on_object() || through || (roughness > 0.0 && !deep) {
        u = next_4d(&numbers);
    }
    sample.numbers = numbers;
    var origin = point.position;
    var direction = mirror_axis();
    var follows = !deep;
    switch question {
        case CAMERA: {
            origin = params.view.position;
            direction = camera_direction(vec2f(texel) + u.xy);
        }
        case AMBIENT: {
            direction = cosine_direction(point.normal, u.xy);
        }
        case LAMP: {
            let source = source_at(sample.lamp);
            direction = cap_direction(source.direction, source.cos_radius, u.xy);
            follows = SHADOWS && dot(direction, point.normal) > 0.0;
        }
        default: {
            if through {
                let scattered = bsdf_sample(point.bsdf, u);
                if !scattered.exists || deep {
                    return false;
                }
                direction = scattered.direction;
                sample.scale *= scattered.weight;
            } else if roughness > 0.0 && !deep {
                direction = lobe_direction(direction, roughness, u.xy);
            }
            if !on_object() && dot(direction, point.normal) <= 0.0 {
                return false;
            }
        }
    }
    let leaves_object = question != CAMERA && on_object();
    if leaves_object {
        origin = offset_point(origin, bsdf_offset_normal(point.bsdf, direction));
    }
    ray = quest_of(origin, direction);
    ray.goal.x = u.z;
    if follows {
        let sees_objects = question != CAMERA || lit.mixed == 1u;
        ray.asks = ASKS | select(0u, FOR_OBJECTS, sees_objects) | select(0u, IF_MET, asks_for_objects())
            | select(UNLIT, 0u, leaves_object && question == ONWARD) | select(0u, AS_SHOWN, question == CAMERA);
        lit.pixel.rays += 1u;
    }
    return true;
}

// Adds what the answer comes to; no object and no real surface if the ray asked for nothing.
fn reckon(answer: Answer) {
    let point = sample.point;
    let question = sample.question;
    let was_on_object = question != CAMERA && on_object();
    let floor_mirrors = question == ONWARD && !was_on_object;
    let object_mirrors = question == ONWARD && was_on_object && !lets_through();
    let roughness = mirror_roughness();
    let met = answer.object.instance != NOTHING;
    if met && asks_for_objects() {
        lit.pixel.rays += select(1u, 2u, question == LAMP);
    }
    let sees_object = met && !answer.real.exists;
    // Whether that is the next point.
    let is_point = select(question == ONWARD && sees_object, sees_object || answer.real.exists, question == CAMERA);
    var found: Point;
    var emission = vec3f(0.0);
    var transmittance = vec3f(1.0);
    var open = vec3f(0.0);
    if sees_object && question != LAMP {
        let surface = surface_at(objects(), answer.object, ray.direction);
        found.bsdf = bsdf_at(surface.material, surface.geometric, surface.normal, -ray.direction);
        found.lobes = bsdf_lobes(found.bsdf);
        found.position = surface.position;
        found.normal = found.bsdf.normal;
        emission = surface.emission;
        transmittance = surface.transmittance;
    } else if answer.real.exists && question == CAMERA {
        found.position = world_leave(params.world, answer.real);
        found.normal = answer.real.normal;
    }
    found.on_object = select(0u, 1u, sees_object);
    found.direction = ray.direction;
    if is_point || (sees_object && question == AMBIENT) {
        open = diffuse_look(found.normal);
    }

    // What the maps and the panorama show there.
    let shows_lobe = object_mirrors && roughness > 0.0 && !sees_object && !(answer.real.exists && roughness < 0.5);
    var sky = vec3f(0.0);
    if shows_lobe || (sees_object && (question == AMBIENT || floor_mirrors)) {
        let at = select(ray.direction, mirror_axis(), shows_lobe);
        sky = specular_look(at, select(roughness, BEHIND_ROUGHNESS, question == AMBIENT));
    } else if question == ONWARD && !floor_mirrors && !sees_object {
        sky = real_light(answer);
    }

    switch question {
        case AMBIENT: {
            sample.question = LAMP;
            if sees_object {
                // Glass lets through, roughly, what lies behind it.
                var blocked = sky * (found.lobes.transmission - 1.0);
                if found.lobes.transmission <= 0.0 {
                    var sent = found.lobes.diffuse * open;
                    if GLOSS {
                        sent += found.lobes.specular * specular_look(reflect(ray.direction, found.normal), found.lobes.roughness);
                    }
                    blocked = emission + min(sent, sky) - sky;
                }
                sample.total += select(vec3f(0.0), sample.scale * point.lobes.diffuse * blocked, was_on_object);
                sample.change += select(blocked * PI, vec3f(0.0), was_on_object);
            }
        }
        case LAMP: {
            let source = source_at(sample.lamp);
            let cosine = dot(ray.direction, point.normal);
            let visible = cosine > 0.0 && !sees_object;
            if !was_on_object {
                sample.without += source.intensity * max(dot(source.direction, point.normal), 0.0);
                sample.change -= select(source.intensity * max(cosine, 0.0), vec3f(0.0), visible);
            } else if visible {
                sample.total += sample.scale * bsdf_eval(point.bsdf, ray.direction).f_cos * source.intensity;
            }
            if visible && point.depth == 0u {
                count_reached(sample.lamp);
            }
            sample.lamp += 1u;
        }
        default: {
            if question == CAMERA {
                sample.scale = vec3f(1.0);
                sample.total = vec3f(0.0);
                sample.without = open * PI;
                sample.change = vec3f(0.0);
                sample.shown = select(select(INFINITY, REAL, answer.real.exists), OBJECT, sees_object);
                for (var i = 0u; sample.shown == INFINITY && i < params.lighting.lamp_count; i++) {
                    count_reached(i);
                }
            } else {
                if object_mirrors {
                    sample.scale *= point.lobes.specular;
                } else if floor_mirrors {
                    // What the object hides is taken away.
                    sample.scale = vec3f(gloss_fresnel(-dot(point.direction, point.normal)) * params.lighting.gloss);
                    sky = -sky;
                }
                sample.total += sample.scale * sky;
                found.depth = point.depth + 1u;
            }
            sample.question = DONE;
            if is_point {
                sample.point = found;
                sample.lamp = 0u;
                let clear = lets_through();
                sample.scale *= transmittance;
                let white = !clear && any(found.lobes.diffuse > vec3f(0.0));
                sample.total += sample.scale * (emission + select(vec3f(0.0), found.lobes.diffuse * open, white));
                sample.question = select(AMBIENT, ONWARD, clear);
            }
        }
    }
}
