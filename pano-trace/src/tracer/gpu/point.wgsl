// The real point in hand: how often each strategy looks for what changes it, the rays it asks for, and what they count; see
// tracer/delta.rs.

fn has_second_order() -> bool {
    return SECOND_ORDER && point.bounces >= 2u;
}

// Aims at what may change the point in hand.
fn look_for_objects() {
    aim = aim_at(point.x, point.normal, 1.0);
    around.count = 0u;
    if has_second_order() && MIS != BSDF_ONLY {
        around = aim_at(point.x, point.normal, SURROUNDINGS);
    }
}

// The change of a real point is asked for.
fn begin_point(hit: RealHit, matter: Matter, effort: Effort) {
    if CAPTURED && point.stage < 3u {
        put_point_aside();
    }
    point.x = world_leave(params.world, hit);
    point.normal = hit.normal;
    point.bounces = path.remaining;
    point.stage = 3u;
    look_for_objects();
    let nothing = aim.count == 0u && !aim.inside;
    if (nothing && !has_second_order() && !EVERYWHERE) || all(matter.reflectance == vec3f(0.0)) {
        return;
    }
    point.scale = path.outer * matter.reflectance / PI;
    point.stage = 0u;
    point.cosine_rate = 0.0;
    if aim.inside || MIS == BSDF_ONLY || EVERYWHERE {
        point.cosine_rate = effort.share;
    } else if has_second_order() {
        point.cosine_rate = effort.share * min(SECOND_ORDER_EFFORT * sqrt(effort.boost), 1.0);
    }
    point.cone_rate = 0.0;
    if aim.count > 0u && MIS != BSDF_ONLY {
        point.cone_rate = effort.share * min(effort.boost * max(aim.form_factor / FULL_EFFORT, effort.least), 1.0);
    }
    point.lights = select(effort.lights, select(0u, 1u, EVERYWHERE), nothing || EVERYWHERE);
    if MIS == BSDF_ONLY {
        point.lights = 0u;
    }
    point.taken = 0u;
    point.light_rate = effort.share * f32(point.lights);
    point.share = effort.share;
    point.u = draw();
}

// The next ray of the point in hand, or in the next turn that of one that waits; false if there is none.
fn next_strategy() -> bool {
    loop {
        if point.stage >= 3u {
            return take_point_back();
        }
        let stage = point.stage;
        let number_of_light = point.taken;
        point.taken += 1u;
        if stage > 0u || point.taken >= point.lights {
            point.stage += 1u;
        }
        var rate = point.light_rate;
        var used = point.u.z < point.share && number_of_light < point.lights;
        var u = point.u;
        if stage > 0u {
            rate = select(point.cosine_rate, point.cone_rate, stage == 1u);
            used = select(rate > 0.0, point.u.w < rate, stage == 1u);
            if used {
                u = draw();
            }
        }
        if !used {
            continue;
        }
        var sample = LightSample(vec3f(0.0), true, vec3f(0.0), AT_ANYTHING);
        if stage == 0u {
            sample = world_sample_light(params.world, point.x, spread_over_square(u.xy, number_of_light));
            sample.exists = sample.exists && (EVERYWHERE || aim_meets(&aim, sample.direction));
        } else if stage == 1u {
            sample.direction = aim_sample(&aim, u.xy, u.z);
        } else {
            sample.exists = u.z < rate;
            if SECOND_ORDER && around.count > 0u && u.w < AROUND {
                sample.direction = aim_sample(&around, u.xy, u.w / AROUND);
            } else {
                let disc = concentric_disc(u.xy);
                let up = sqrt(max(1.0 - dot(disc, disc), 0.0));
                sample.direction = tangent_of(point.normal) * disc.x + bitangent_of(point.normal) * disc.y + point.normal * up;
            }
        }
        if sample.exists && dot(sample.direction, point.normal) > 0.0 {
            send(select(CHANGE, BLOCKED, stage == 0u), point.x, sample.direction);
            ray.goal = sample.goal;
            ray.aimed = sample.aimed;
            if sample.aimed == AT_SURFACE {
                // What lies behind the light blocks none of it.
                ray.limit = distance(sample.goal, point.x);
            }
            return true;
        }
    }
    return false;
}

// Factors of the light that is blocked and of the light that an object sends instead; see `Tracer::weights`.
struct Weights {
    blocked: f32,
    sent: f32,
    light_finds_it: bool,
}

// Density per steradian of a point's third strategy.
fn cosine_pdf(d: vec3f, cosine: f32) -> f32 {
    if SECOND_ORDER && around.count > 0u {
        return AROUND * aim_pdf(&around, d) + (1.0 - AROUND) * cosine / PI;
    }
    return cosine / PI;
}

fn weights_of(point: Point, d: vec3f, cosine: f32, pdf: f32) -> Weights {
    let by_aim = point.cone_rate * aim_pdf(&aim, d) + point.cosine_rate * cosine_pdf(d, cosine);
    let by_light = point.light_rate * pdf;
    var all_ = by_aim + by_light;
    if MIS == LIGHT_ONLY && by_light > 0.0 {
        all_ = by_light;
    }
    if by_aim <= 0.0 || !is_finite(all_) {
        return Weights(0.0, 0.0, false);
    }
    return Weights(1.0 / all_, 1.0 / by_aim, by_light > 0.0);
}

