// Samples of MR360's tracer, one invocation a pixel. The CPU's functions call each other; here a loop goes from question to question:
// each is asked of the point in hand (at first, of the camera), draws its random numbers, follows a ray, and adds what lies there.
// Everything counts linearly, so that a factor goes along in place of a sum that comes back. The order of the random numbers is the
// CPU's.

// The questions, in the order in which a point asks them.
const CAMERA: u32 = 0u;
// What is in the way of the light from all around?
const AMBIENT: u32 = 1u;
// Does a lamp reach it? One question a lamp.
const LAMP: u32 = 2u;
// What does it mirror, or let through?
const ONWARD: u32 = 3u;
const DONE: u32 = 4u;

// What a sample shows.
const INFINITY: u32 = 0u;
const OBJECT: u32 = 1u;
const REAL: u32 = 2u;

// A point of a surface.
struct Point {
    // Where rays that leave a real surface begin; an object's surface itself.
    position: vec3f,
    on_object: bool,
    // For shading.
    normal: vec3f,
    // Along which it was met.
    direction: vec3f,
    // Of objects.
    bsdf: Bsdf,
    lobes: Lobes,
}

// Change of the irradiance relative to what it is without objects; all of it can be taken away and no more.
fn ratio(change: f32, without: f32) -> f32 {
    let share = change / without;
    return select(0.0, select(max(share, -1.0), -1.0, is_nan(share)), without > 0.0 && !is_nan(without));
}

// Guides of each pixel.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let index = index_of(params.rows, texel);
    let corner = vec2f(texel);
    pixels[index].pixel = guides_at(corner + 0.5).pixel;
    pixels[index].mixed = select(0u, 1u, may_see_objects(corner));
    for (var i = 0u; i < params.lamp_count; i++) {
        reached[index * params.lamp_count + i] = 0u;
    }
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let index = index_of(params.rows, texel);
    var pixel = pixels[index].pixel;
    let mixed = pixels[index].mixed == 1u;
    var number = params.begin;

    var sampler: Sampler;
    var question = CAMERA;
    var lamp = 0u;
    var point: Point;
    // Surfaces behind the first one.
    var depth = 0u;
    var shown = INFINITY;
    // What the point in hand counts, and what has been found.
    var scale = vec3f(1.0);
    var total = vec3f(0.0);
    // Irradiance of the real point without objects, and its change.
    var without = vec3f(0.0);
    var change = vec3f(0.0);

    loop {
        // What the point does not ask.
        if question == AMBIENT {
            let white = !point.on_object || any(point.lobes.diffuse > vec3f(0.0));
            question = select(LAMP, AMBIENT, AMBIENT_OCCLUSION && depth == 0u && white);
        }
        if question == LAMP && lamp >= params.lamp_count {
            question = ONWARD;
        }
        let through = BODIES && point.on_object && point.lobes.transmission > 0.0;
        if question == ONWARD {
            let mirrors = select(MIRRORING, GLOSS && any(point.lobes.specular > vec3f(0.0)), point.on_object);
            question = select(DONE, ONWARD, through || mirrors);
        }
        if question == DONE {
            var value = total;
            if shown == REAL {
                let relative = vec3f(ratio(change.x, without.x), ratio(change.y, without.y), ratio(change.z, without.z));
                value = pixels[index].photo * relative + total;
            }
            if is_finite3(value) {
                pixel.object += select(vec3f(0.0), value, shown == OBJECT);
                pixel.delta += select(value, vec3f(0.0), shown == OBJECT);
            } else {
                pixel.discarded += 1u;
            }
            pixel.covered += select(0u, 1u, shown == OBJECT);
            number += 1u;
            question = CAMERA;
        }
        if number >= params.end {
            break;
        }

        // The ray.
        if question == CAMERA {
            sampler = sampler_of(vec2u(texel), number, params.view.stream.x, params.view.stream.y);
        }
        let floor_mirrors = question == ONWARD && !point.on_object;
        let object_mirrors = question == ONWARD && point.on_object && !through;
        let roughness = select(point.lobes.roughness, params.gloss_roughness, floor_mirrors);
        let axis = reflect(point.direction, point.normal);
        let deep = question == ONWARD && point.on_object && depth >= MAX_DEPTH;
        var u = vec4f(0.0);
        if !object_mirrors || (roughness > 0.0 && !deep) {
            u = next_4d(&sampler);
        }
        var origin = point.position;
        var direction = axis;
        var source: Lamp;
        var follows = true;
        switch question {
            case CAMERA: {
                origin = params.view.position;
                direction = camera_direction(vec2f(texel) + u.xy);
                point.on_object = false;
                depth = 0u;
                shown = INFINITY;
                scale = vec3f(1.0);
                total = vec3f(0.0);
            }
            case AMBIENT: {
                direction = cosine_direction(point.normal, u.xy);
            }
            case LAMP: {
                source = lamp_at(lamp);
                direction = cap_direction(source.direction, source.cos_radius, u.xy);
                follows = SHADOWS && dot(direction, point.normal) > 0.0;
            }
            default: {
                if through {
                    let sample = bsdf_sample(point.bsdf, u);
                    if !sample.exists || deep {
                        question = DONE;
                        continue;
                    }
                    direction = sample.direction;
                    scale *= sample.weight;
                } else if roughness > 0.0 && !deep {
                    direction = lobe_direction(axis, roughness, u.xy);
                }
                follows = !deep;
                if floor_mirrors && dot(direction, point.normal) <= 0.0 {
                    question = DONE;
                    continue;
                }
            }
        }
        if point.on_object {
            origin = offset_point(origin, bsdf_offset_normal(point.bsdf, direction));
        }

        // What lies on it: a real surface, before it an object, or neither.
        var object = Hit(NEVER, 0.0, 0.0, NOTHING, 0u);
        var real: RealHit;
        if follows {
            if question != CAMERA || mixed {
                object = trace_ray(params.view.roots.x, origin, direction, NEVER, false);
            }
            let met = object.instance != NOTHING;
            let asks_objects = question == AMBIENT || question == LAMP || floor_mirrors;
            if met || !asks_objects {
                real = world_hit(params.world, params.view.roots.y, origin, direction, object.t);
            }
            pixel.rays += 1u;
            if met && asks_objects {
                pixel.rays += select(1u, 2u, question == LAMP);
            }
        }
        let on_object = object.instance != NOTHING && !real.exists;
        // Whether that is the next point.
        let is_point = select(question == ONWARD && on_object, on_object || real.exists, question == CAMERA);
        var found: Point;
        var emission = vec3f(0.0);
        var transmittance = vec3f(1.0);
        var open = vec3f(0.0);
        if on_object && question != LAMP {
            let surface = surface_at(objects(), object, direction);
            found.bsdf = bsdf_at(surface.material, surface.geometric, surface.normal, -direction);
            found.lobes = bsdf_lobes(found.bsdf);
            found.position = surface.position;
            found.normal = found.bsdf.normal;
            emission = surface.emission;
            transmittance = surface.transmittance;
        } else if real.exists && question == CAMERA {
            found.position = world_leave(params.world, real);
            found.normal = real.normal;
        }
        found.on_object = on_object;
        found.direction = direction;
        if is_point || (on_object && question == AMBIENT) {
            open = diffuse_look(found.normal);
        }

        // What the maps and the panorama show there.
        let shows_lobe = object_mirrors && roughness > 0.0 && !on_object && !(real.exists && roughness < 0.5);
        var sky = vec3f(0.0);
        if shows_lobe || (on_object && (question == AMBIENT || floor_mirrors)) {
            let at = select(direction, axis, shows_lobe);
            sky = specular_look(at, select(roughness, BEHIND_ROUGHNESS, question == AMBIENT));
        } else if question == ONWARD && !floor_mirrors && !on_object {
            var at = direction;
            if real.exists {
                at = normalized_or(real.position - params.capture, direction);
            }
            sky = environment_look(params.world, at);
        }

        // What that comes to.
        switch question {
            case AMBIENT: {
                question = LAMP;
                if on_object {
                    // Glass lets through, roughly, what lies behind it.
                    var blocked = sky * (found.lobes.transmission - 1.0);
                    if found.lobes.transmission <= 0.0 {
                        var sent = found.lobes.diffuse * open;
                        if GLOSS {
                            sent += found.lobes.specular * specular_look(reflect(direction, found.normal), found.lobes.roughness);
                        }
                        blocked = emission + min(sent, sky) - sky;
                    }
                    total += select(vec3f(0.0), scale * point.lobes.diffuse * blocked, point.on_object);
                    change += select(blocked * PI, vec3f(0.0), point.on_object);
                }
            }
            case LAMP: {
                let cosine = dot(direction, point.normal);
                let visible = cosine > 0.0 && !on_object;
                if !point.on_object {
                    without += source.intensity * max(dot(source.direction, point.normal), 0.0);
                    change -= select(source.intensity * max(cosine, 0.0), vec3f(0.0), visible);
                } else if visible {
                    total += scale * bsdf_eval(point.bsdf, direction).f_cos * source.intensity;
                }
                if visible && depth == 0u {
                    reached[index * params.lamp_count + lamp] += 1u;
                }
                lamp += 1u;
            }
            default: {
                if question == CAMERA {
                    shown = select(select(INFINITY, REAL, real.exists), OBJECT, on_object);
                    for (var i = 0u; shown == INFINITY && i < params.lamp_count; i++) {
                        reached[index * params.lamp_count + i] += 1u;
                    }
                } else {
                    if object_mirrors {
                        scale *= point.lobes.specular;
                    } else if floor_mirrors {
                        // What the object hides is taken away.
                        scale = vec3f(gloss_fresnel(-dot(point.direction, point.normal)) * params.gloss);
                        sky = -sky;
                    }
                    total += scale * sky;
                    depth += 1u;
                }
                question = DONE;
                if is_point {
                    point = found;
                    lamp = 0u;
                    let clear = BODIES && found.lobes.transmission > 0.0;
                    scale *= transmittance;
                    let white = !clear && any(found.lobes.diffuse > vec3f(0.0));
                    total += scale * (emission + select(vec3f(0.0), found.lobes.diffuse * open, white));
                    if depth == 0u {
                        without = open * PI;
                        change = vec3f(0.0);
                    }
                    question = select(AMBIENT, ONWARD, clear);
                }
            }
        }
    }
    pixels[index].pixel = pixel;
}
