// Samples of the path tracers, one invocation a pixel. The CPU's functions call each other; here a loop goes from ray to ray: it asks
// for what lies on the ray in hand, adds what that comes to (everything counts linearly, so that a factor goes along instead of a
// sum coming back), and finds the next one. Walks that wait for another to end are few: see `Later` and `Point`. The order of the
// random numbers is the CPU's.

@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let index = index_of(params.rows, texel);
    let started = pixels[index];
    var pixel = started.pixel;
    let end = min(params.end, started.most);
    var number = params.begin;
    if number >= end {
        return;
    }

    var sampler: Sampler;
    var total = vec3f(0.0);
    var is_object = false;
    var origin = vec3f(0.0);
    var direction = vec3f(0.0);
    var limit = NEVER;
    var job = IDLE;
    var path = path_of(vec3f(0.0), 0u, false);
    var light: Light;
    var later: Later;
    var point: Point;
    point.stage = 3u;
    var aim: Aim;
    // Where the surroundings of the objects are, if they are asked for.
    var around: Aim;
    // How the point's strategies are used.
    var effort = 1.0;
    var least = LEAST_EFFORT;
    var boost = 1.0;
    var lights = 1u;
    var fresh = true;

    loop {
        if fresh {
            fresh = false;
            sampler = sampler_of(vec2u(texel), number, params.view.stream.x, params.view.stream.y);
            total = vec3f(0.0);
            is_object = false;
            let jitter = next_4d(&sampler);
            origin = params.view.position;
            direction = camera_direction(vec2f(texel) + jitter.xy);
            limit = NEVER;
            job = CAMERA;
            path.mixed = started.mixed == 1u;
        }

        // What lies on the ray.
        var object = Hit(limit, 0.0, 0.0, NOTHING, 0u);
        var real: RealHit;
        if job != IDLE {
            let any_hit = job == SHADOW || job == BLOCKED || job == LIGHT_PAIR;
            let on_path = job == CAMERA || job == PATH || job == SHADOW;
            if path.mixed || !on_path {
                object = trace_ray(params.view.roots.x, origin, direction, limit, any_hit);
            }
            let met = object.instance != NOTHING;
            var asks = true;
            if job == SHADOW {
                asks = !met;
            } else if job == BLOCKED || job == LIGHT_PAIR || (job == CHANGE && !(point.stage == 3u && point.second_order)) {
                asks = met;
            }
            if asks {
                let up_to = select(NEVER, object.t, on_path || job == AIMED);
                real = world_hit(params.world, params.view.roots.y, origin, direction, select(up_to, NEVER, any_hit));
            }
            pixel.rays += 1u;
            if (job == BLOCKED || job == CHANGE) && asks {
                pixel.rays += 1u;
            } else if job == LIGHT_PAIR || job == PAIR {
                pixel.rays += 1u;
            }
        }
        let met = object.instance != NOTHING;
        var first = First(INFINITY, object, real, direction);
        if real.exists && (!met || real.t < object.t) {
            first.what = REAL;
        } else if met {
            first.what = OBJECT;
        }

        // What the environment shows there, if it counts: behind an object, or where nothing is.
        var sky = vec3f(0.0);
        var sky_pdf = 0.0;
        let behind = job == BLOCKED || job == CHANGE || job == LIGHT_PAIR || job == PAIR;
        if job > CAMERA && !real.exists && met == behind {
            sky = environment_look(params.world, direction);
            sky_pdf = environment_pdf(params.world, direction);
        }

        // What that comes to.
        var then = GO_ON;
        switch job {
            case CAMERA: {
                then = DONE;
                if first.what == OBJECT {
                    is_object = true;
                    path = path_of(vec3f(1.0), params.bounces, true);
                    then = AT_VERTEX;
                } else if first.what == REAL {
                    path = path_of(vec3f(1.0), params.bounces, true);
                    if METHOD == DPT {
                        effort = started.share;
                        least = LEAST_EFFORT;
                        boost = started.boost;
                        lights = u32(sqrt(boost));
                        then = AT_POINT;
                    } else if METHOD == ONE_PASS {
                        then = AT_PAIR;
                    } else if METHOD == TWO_PASS {
                        path.depth = -1;
                        later = Later(true, first, path);
                        later.path.outer = vec3f(-1.0);
                        later.path.mixed = false;
                        then = AT_VERTEX;
                    }
                }
            }
            case PATH: {
                then = AT_VERTEX;
            }
            case SHADOW: {
                let pdf = world_share(path.mixed) * sky_pdf;
                if first.what == INFINITY && pdf > 0.0 {
                    total += light.value * sky / select(pdf, pdf + light.pdf, MIS == BALANCE);
                }
            }
            case AIMED: {
                if EMITTERS && first.what == OBJECT && object.t >= light.distance * 0.999 {
                    let pdf = (1.0 - world_share(path.mixed)) * emitter_pdf(objects(), object, direction);
                    if pdf > 0.0 {
                        let density = select(pdf, pdf + light.pdf, MIS == BALANCE);
                        total += light.value * surface_at(objects(), object, direction).emission / density;
                    }
                }
            }
            case BLOCKED: {
                if METHOD == DPT && met && !real.exists {
                    let cosine = dot(direction, point.normal);
                    let weights = weights_of(point, &aim, &around, direction, cosine, sky_pdf);
                    total -= point.scale * sky * (cosine * weights.blocked);
                }
                then = NEXT_STRATEGY;
            }
            case CHANGE: {
                then = NEXT_STRATEGY;
                let cosine = dot(direction, point.normal);
                if METHOD == DPT && first.what == OBJECT {
                    let weights = weights_of(point, &aim, &around, direction, cosine, sky_pdf);
                    let scale = point.scale * cosine;
                    let blocks = weights.blocked > 0.0 && !(MIS == LIGHT_ONLY && weights.light_finds_it);
                    if blocks && !real.exists {
                        total -= scale * sky * weights.blocked;
                    }
                    if weights.sent > 0.0 {
                        path = path_of(scale * weights.sent, point.bounces - 1u, true);
                        then = AT_VERTEX;
                    }
                    if blocks && real.exists {
                        // The light behind the object comes first.
                        later = Later(then == AT_VERTEX, first, path);
                        path = path_of(-scale * weights.blocked, point.bounces - 1u, false);
                        first.what = REAL;
                        then = AT_VERTEX;
                    }
                } else if METHOD == DPT && first.what == REAL && point.stage == 3u && point.second_order {
                    path = path_of(point.scale * (cosine / (point.cosine_rate * cosine_pdf(&around, direction, cosine))), point.bounces - 1u, true);
                    effort = 0.5;
                    least = LEAST_EFFORT_ONCE;
                    boost = 1.0;
                    lights = SECOND_ORDER_LIGHTS;
                    then = AT_POINT;
                }
            }
            case LIGHT_PAIR: {
                if METHOD == ONE_PASS && met && !real.exists {
                    if sky_pdf > 0.0 {
                        let weight = select(1.0, balance(sky_pdf, light.pdf), MIS == BALANCE);
                        total -= light.value * sky * (weight / sky_pdf);
                    }
                }
            }
            case PAIR: {
                then = FINISHED;
                let bounces = path.remaining - 1u;
                if METHOD == ONE_PASS && first.what == OBJECT {
                    let outer = path.outer;
                    if real.exists {
                        later = Later(true, first, path_of(-outer, bounces, false));
                        later.first.what = REAL;
                    } else {
                        var seen = path;
                        seen.mixed = false;
                        total -= outer * sky * weight_of(seen, First(INFINITY, object, real, direction), sky_pdf);
                    }
                    path = path_of(outer, bounces, true);
                    then = AT_VERTEX;
                } else if METHOD == ONE_PASS && first.what == REAL && bounces > 0u {
                    path = path_of(path.outer, bounces, true);
                    then = AT_PAIR;
                }
            }
            default: {
                then = FINISHED;
            }
        }
        if job == SHADOW || job == AIMED || job == LIGHT_PAIR {
            job = light.next_job;
            origin = light.next_origin;
            direction = light.next_direction;
            limit = NEVER;
        }

        if then == FINISHED {
            then = select(DONE, NEXT_STRATEGY, METHOD == DPT);
            if later.exists {
                later.exists = false;
                first = later.first;
                path = later.path;
                then = AT_VERTEX;
            }
        }
        if METHOD == DPT && then == AT_POINT {
            let hit = first.real;
            point.x = world_leave(hit);
            point.normal = hit.normal;
            point.bounces = path.remaining;
            point.second_order = SECOND_ORDER && path.remaining >= 2u;
            point.stage = 3u;
            then = NEXT_STRATEGY;
            aim = aim_at(point.x, point.normal, 1.0);
            let nothing = aim.count == 0u && !aim.inside;
            if !nothing || point.second_order || EVERYWHERE {
                let reflectance = world_reflectance(params.world, hit);
                point.scale = path.outer * reflectance / PI;
                if any(reflectance != vec3f(0.0)) {
                    point.stage = 0u;
                    point.cosine_rate = 0.0;
                    if aim.inside || MIS == BSDF_ONLY || EVERYWHERE {
                        point.cosine_rate = effort;
                    } else if point.second_order {
                        point.cosine_rate = effort * min(SECOND_ORDER_EFFORT * sqrt(boost), 1.0);
                    }
                    point.cone_rate = 0.0;
                    if aim.count > 0u && MIS != BSDF_ONLY {
                        point.cone_rate = effort * min(boost * max(aim.form_factor / FULL_EFFORT, least), 1.0);
                    }
                    around.count = 0u;
                    if point.second_order && MIS != BSDF_ONLY {
                        around = aim_at(point.x, point.normal, SURROUNDINGS);
                    }
                    point.lights = select(lights, select(0u, 1u, EVERYWHERE), nothing || EVERYWHERE);
                    if MIS == BSDF_ONLY {
                        point.lights = 0u;
                    }
                    point.taken = 0u;
                    point.light_rate = effort * f32(point.lights);
                    point.u = next_4d(&sampler);
                }
            }
        }
        if METHOD == DPT && then == NEXT_STRATEGY {
            then = DONE;
            while point.stage < 3u && then == DONE {
                let stage = point.stage;
                let number_of_light = point.taken;
                point.taken += 1u;
                if stage > 0u || point.taken >= point.lights {
                    point.stage += 1u;
                }
                var rate = point.light_rate;
                var used = point.u.z < effort && number_of_light < point.lights;
                var u = point.u;
                if stage > 0u {
                    rate = select(point.cosine_rate, point.cone_rate, stage == 1u);
                    used = select(rate > 0.0, point.u.w < rate, stage == 1u);
                    if used {
                        u = next_4d(&sampler);
                    }
                }
                if !used {
                    continue;
                }
                var d: vec3f;
                var exists = true;
                if stage == 0u {
                    let sample = environment_sample(params.world, spread_over_square(u.xy, number_of_light));
                    d = sample.direction;
                    exists = sample.exists && (EVERYWHERE || aim_meets(&aim, d));
                } else if stage == 1u {
                    d = aim_sample(&aim, u.xy, u.z);
                } else {
                    exists = u.z < rate;
                    if SECOND_ORDER && around.count > 0u && u.w < AROUND {
                        d = aim_sample(&around, u.xy, u.w / AROUND);
                    } else {
                        let disc = concentric_disc(u.xy);
                        let up = sqrt(max(1.0 - dot(disc, disc), 0.0));
                        d = tangent_of(point.normal) * disc.x + bitangent_of(point.normal) * disc.y + point.normal * up;
                    }
                }
                if exists && dot(d, point.normal) > 0.0 {
                    origin = point.x;
                    direction = d;
                    limit = NEVER;
                    job = select(CHANGE, BLOCKED, stage == 0u);
                    then = GO_ON;
                }
            }
        }
        if then == DONE {
            if is_finite3(total) {
                pixel.object += select(vec3f(0.0), total, is_object);
                pixel.delta += select(total, vec3f(0.0), is_object);
            } else {
                pixel.discarded += 1u;
            }
            pixel.covered += select(0u, 1u, is_object);
            number += 1u;
            if number >= end {
                break;
            }
            fresh = true;
            continue;
        }

        if then == AT_VERTEX || then == AT_PAIR {
            // A pair's vertex is a real one, both scenes share its directions, and `remaining` counts its bounce as well.
            let pair = METHOD == ONE_PASS && then == AT_PAIR;
            job = IDLE;
            var scale = path.outer * path.throughput;
            let weight = weight_of(path, first, sky_pdf);
            if first.what == INFINITY {
                total += scale * sky * weight;
                continue;
            }
            var bsdf: Bsdf;
            var position: vec3f;
            let on_object = first.what == OBJECT;
            if on_object {
                let surface = surface_at(objects(), first.object, first.direction);
                if METHOD != IBL {
                    path.throughput *= surface.transmittance;
                    scale = path.outer * path.throughput;
                }
                total += scale * surface.emission * weight;
                bsdf = bsdf_at(surface.material, surface.geometric, surface.normal, -first.direction);
                position = surface.position;
            } else {
                bsdf = bsdf_lambert(world_reflectance(params.world, first.real), first.real.normal, -first.direction);
                position = world_leave(first.real);
            }
            if path.remaining == 0u {
                continue;
            }

            // A light sample.
            light.next_job = IDLE;
            let aims = (!bsdf_is_specular(bsdf) || pair) && (MIS != BSDF_ONLY || METHOD == IBL);
            if aims || pair {
                let u = next_4d(&sampler);
                let share = world_share(path.mixed);
                limit = NEVER;
                if EMITTERS && METHOD != IBL && !pair && u.z >= share {
                    let sample = emitter_sample(objects(), position, vec4f(u.xy, (u.z - share) / (1.0 - share), u.w));
                    origin = position;
                    if on_object {
                        origin = offset_point(position, bsdf_offset_normal(bsdf, sample.direction));
                    }
                    let to = sample.point - origin;
                    light.distance = length(to);
                    direction = to / light.distance;
                    limit = light.distance * 1.001;
                    job = select(IDLE, AIMED, sample.exists);
                } else if aims {
                    let sample = environment_sample(params.world, u.xy);
                    direction = sample.direction;
                    origin = position;
                    if on_object {
                        origin = offset_point(position, bsdf_offset_normal(bsdf, direction));
                    }
                    job = select(IDLE, select(SHADOW, LIGHT_PAIR, pair), sample.exists);
                }
                if job != IDLE {
                    let value = bsdf_eval(bsdf, direction);
                    light.value = scale * value.f_cos;
                    light.pdf = value.pdf;
                    if METHOD == IBL {
                        // Nothing blocks it.
                        job = IDLE;
                        let pdf = environment_pdf(params.world, direction);
                        if pdf > 0.0 {
                            total += light.value * environment_look(params.world, direction) / (pdf + value.pdf);
                        }
                    } else if all(value.f_cos == vec3f(0.0)) {
                        job = IDLE;
                        pixel.rays += select(0u, 2u, pair);
                    }
                }
            }

            // The next direction.
            let sample = bsdf_sample(bsdf, next_4d(&sampler));
            if METHOD == IBL {
                if sample.exists {
                    let other = environment_pdf(params.world, sample.direction);
                    let share = select(balance(sample.pdf, other), 1.0, sample.specular);
                    total += sample.weight * environment_look(params.world, sample.direction) * share;
                }
                continue;
            }
            var survives = sample.exists;
            if pair {
                path.outer *= sample.weight;
            } else if survives {
                path.throughput *= sample.weight;
                survives = any(path.throughput != vec3f(0.0));
                if path.depth >= i32(ROULETTE_FROM) {
                    let chance = min(most_of(path.throughput), 1.0);
                    survives = survives && next_4d(&sampler).x < chance;
                    path.throughput /= chance;
                }
                path.remaining -= 1u;
                path.depth += 1;
            }
            if survives {
                path.found_by = select(sample.pdf, -1.0, sample.specular);
                light.next_job = select(PATH, PAIR, pair);
                light.next_direction = sample.direction;
                light.next_origin = position;
                if on_object {
                    light.next_origin = offset_point(position, bsdf_offset_normal(bsdf, sample.direction));
                }
            }
            if job == IDLE && light.next_job != IDLE {
                job = light.next_job;
                origin = light.next_origin;
                direction = light.next_direction;
                limit = NEVER;
            }
        }
    }
    pixels[index].pixel = pixel;
}
