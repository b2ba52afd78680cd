// Samples from ray to ray: a round takes the answer to the ray in hand, and sends the next one.

// What the ray in hand meets.
struct Meeting {
    // The nearest object that lies before everything real.
    object: Hit,
    // The nearest real surface, whatever lies before it.
    real: RealHit,
    // What the media on the way left of the light; to a lamp, what objects let through.
    left: vec3f,
}

// Goes down the stack until there is a ray in hand; false once the sample is done.
fn find_ray() -> bool {
    job = IDLE;
    while level > 0u {
        if !is_loaded {
            take_top();
        }
        if frame.stage == LAMPS {
            step_lamp();
        } else if on_object() {
            step_object();
        } else {
            step_real();
        }
        if job != IDLE {
            return true;
        }
    }
    return false;
}

// What the panorama shows behind an object that a real surface mirrors.
fn behind_of(real: RealHit) -> vec3f {
    if real.exists {
        let pictured = pictured_at(real);
        if pictured.exists {
            return pictured.radiance;
        }
    }
    return environment_look(params.world, ray.direction);
}

// Takes the answer to the ray in hand.
fn take(met: Meeting) {
    if job >= OBJECT_PROBE {
        pixel.shadow_rays += 1u;
        let open = select(1.0, 0.0, met.real.exists);
        if job == OPEN_PROBE {
            shadow.opened += u32(open);
            shadow.answers += 1u;
            shadow.next += 1u;
        } else {
            take_probe(select(vec3f(open), met.left, job == OBJECT_PROBE));
        }
        return;
    }
    pixel.pixel.rays += 1u;
    let sees_object = met.object.instance != NOTHING;
    let sees_real = !sees_object && met.real.exists;
    let counted = met.left * errand.factor;
    switch job {
        case CAMERA: {
            walk.shows = select(select(INFINITY, REAL, sees_real), OBJECT, sees_object);
            for (var i = 0u; i < params.lighting.lamp_count; i++) {
                notes[note_at(i, 2u)].y = bitcast<u32>(select(1.0, 0.0, sees_object));
            }
            if sees_object || sees_real {
                // A real point's change is not seen through what lies before it.
                put_on(met.object, met.real, select(vec3f(1.0), counted, sees_object), 1.0);
            }
        }
        case ONWARD: {
            if sees_object || sees_real {
                put_on(met.object, met.real, counted, errand.weight * most_of(met.left));
            } else {
                add_light(counted * sky_of(ray.direction, errand.roughness));
            }
        }
        case ROUGH: {
            if sees_object {
                put_on(met.object, met.real, counted, errand.weight);
            } else {
                add_light(counted * errand.behind);
            }
        }
        default: {
            if sees_object {
                pixel.pixel.rays += 1u;
                let behind = behind_of(met.real);
                let before = behind * errand.factor / max(luminance(behind) / params.brightest, 1.0);
                stack[top()].highlight += before;
                stack[top()].dimmed -= before;
                put_on(met.object, met.real, counted, errand.weight);
            }
        }
    }
}

// Sends the ray of the sample in hand.
fn begin_sample() {
    numbers = sampler_of(vec2u(texel), walk.number, params.view.stream.x, params.view.stream.y);
    walk.under_way = 1u;
    value = vec3f(0.0);
    media.count = 0u;
    errand.factor = vec3f(1.0);
    errand.depth = 0u;
    job = CAMERA;
    let at = vec2f(texel) + draw().xy;
    if FILTERED {
        let x = camera_direction(at + vec2f(0.5, 0.0)) - camera_direction(at - vec2f(0.5, 0.0));
        let y = camera_direction(at + vec2f(0.0, 0.5)) - camera_direction(at - vec2f(0.0, 0.5));
        // A ray stands for its share of the pixel's area.
        let share = 1.0 / sqrt(f32(params.samples));
        errand.beam = beam_of(mat2x3f(vec3f(0.0), vec3f(0.0)), mat2x3f(x * share, y * share));
    }
    send(params.view.position, camera_direction(at));
}

// Adds what the sample in hand has come to.
fn end_sample() {
    for (var i = 0u; i < params.lighting.lamp_count; i++) {
        let at = note_at(i, 2u);
        let reached = bitcast<f32>(notes[at].y);
        notes[at].x = bitcast<u32>(bitcast<f32>(notes[at].x) + reached);
    }
    pixel.pixel = with_sample(pixel.pixel, value, walk.shows == OBJECT);
    walk.number += 1u;
    pixel.taken = walk.number;
    walk.under_way = 0u;
    // One more look, somewhere else in the pixel, makes sure.
    if pixel.quiet == 1u && pixel.taken == 1u && all(value == vec3f(0.0)) {
        walk.number = params.samples;
    }
}
