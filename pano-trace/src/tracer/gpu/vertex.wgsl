// Where a path scatters: light samples, and the next direction; see tracer/path.rs and, for pairs, differential.rs.

// The next vertex of a path, or of a pair of them. A pair's vertex is a real one, both scenes share its directions, and `remaining`
// counts its bounce as well.
fn scatter(first: First, matter: Matter, pair: bool, weight: f32) {
    var scale = path.outer * path.throughput;
    var bsdf: Bsdf;
    var position: vec3f;
    let on_object = first.what == OBJECT;
    path.from_object = select(0u, 1u, on_object);
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
        bsdf = bsdf_lambert(matter.reflectance, first.real.normal, -first.direction);
        position = world_leave(params.world, first.real);
    }
    if path.remaining == 0u {
        return;
    }

    // A light sample.
    light.next_job = IDLE;
    let aims = (!bsdf_is_specular(bsdf) || pair) && (MIS != BSDF_ONLY || METHOD == IBL);
    if aims || pair {
        let u = draw();
        let share = world_share(path.mixed);
        if EMITTERS && METHOD != IBL && !pair && u.z >= share {
            let sample = emitter_sample(objects(), position, vec4f(u.xy, (u.z - share) / (1.0 - share), u.w));
            var origin = position;
            if on_object {
                origin = offset_point(position, bsdf_offset_normal(bsdf, sample.direction));
            }
            let to = sample.point - origin;
            light.distance = length(to);
            send(select(IDLE, AIMED, sample.exists), origin, to / light.distance);
            ray.limit = light.distance * 1.001;
        } else if aims {
            var sample: LightSample;
            if METHOD == IBL {
                let found = environment_sample(params.world, u.xy);
                sample = LightSample(found.direction, found.exists, vec3f(0.0), AT_INFINITY);
            } else {
                sample = world_sample_light(params.world, position, u.xy);
            }
            var origin = position;
            if on_object {
                origin = offset_point(position, bsdf_offset_normal(bsdf, sample.direction));
            }
            send(select(IDLE, select(SHADOW, LIGHT_PAIR, pair), sample.exists), origin, sample.direction);
            ray.goal = sample.goal;
            ray.aimed = sample.aimed;
        }
        if job != IDLE {
            let value = bsdf_eval(bsdf, ray.direction);
            light.value = scale * value.f_cos;
            light.pdf = value.pdf;
            if METHOD == IBL {
                // Nothing blocks it.
                job = IDLE;
                let pdf = environment_pdf(params.world, ray.direction);
                if pdf > 0.0 {
                    total += light.value * environment_look(params.world, ray.direction) / (pdf + value.pdf);
                }
            } else if all(value.f_cos == vec3f(0.0)) {
                job = IDLE;
                pixel.rays += select(0u, 2u, pair);
            }
        }
    }

    // The next direction.
    let sample = bsdf_sample(bsdf, draw());
    if METHOD == IBL {
        if sample.exists {
            let other = environment_pdf(params.world, sample.direction);
            let share = select(balance(sample.pdf, other), 1.0, sample.specular);
            total += sample.weight * environment_look(params.world, sample.direction) * share;
        }
        return;
    }
    var survives = sample.exists;
    if pair {
        path.outer *= sample.weight;
    } else if survives {
        path.throughput *= sample.weight;
        survives = any(path.throughput != vec3f(0.0));
        if path.depth >= i32(ROULETTE_FROM) {
            let chance = min(most_of(path.throughput), 1.0);
            survives = survives && draw().x < chance;
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
    if job == IDLE {
        send(light.next_job, light.next_origin, light.next_direction);
    }
}

