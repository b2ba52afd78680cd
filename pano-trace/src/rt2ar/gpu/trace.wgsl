// RT²AR's tracer over proxies, one invocation a pixel: each ray is answered at once.

struct Recursion {
    rows: Rows,
    view: View,
    world: World,
    lighting: Lighting,
    clusters: vec2u,
    // Primary rays a pixel, and how many surfaces may follow one another.
    samples: u32,
    deepest: u32,
    // Surfaces that wait at most; rays of this submission.
    levels: u32,
    rounds: u32,
    // Points of a lamp: how many at most, how many decide, and where the patterns begin.
    shadow_samples: u32,
    probes: u32,
    patterns: u32,
    response: u32,
    response_count: u32,
    // Where the answers begin among the notes.
    answers: u32,
    reflectance_cap: f32,
    // The largest luminance that is no lamp's.
    brightest: f32,
    // Most lookups of a texture along the longer axis of what a ray covers.
    most_anisotropy: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> params: Recursion;
@group(0) @binding(8) var<storage, read_write> under_way: array<atomic<u32>>;

fn pictured_at(hit: RealHit) -> Pictured {
    if !FROM_PICTURE || number_at(params.world.reflectances + REFLECTANCE_WORDS * hit.surface) < 0.0 {
        return Pictured(vec3f(0.0), false);
    }
    return Pictured(environment_look(params.world, hit.position - params.world.capture), true);
}

// Where a ray goes on that has crossed a face at `t`.
fn just_beyond(t: f32) -> f32 {
    return t * (1.0 + 1e-6) + 1e-7;
}

// Follows the ray in hand past bodies that do not show, or to a lamp past those that let light through.
fn meet() -> Meeting {
    var met: Meeting;
    met.left = vec3f(1.0);
    met.object = Hit(ray.limit, 0.0, 0.0, NOTHING, 0u);
    met.real.t = ray.limit;
    let probes = job == OBJECT_PROBE;
    if !probes {
        met.real = world_hit(params.world, params.view.roots.y, ray.origin, ray.direction, ray.limit);
    }
    let looks = job != SURFACE_PROBE && job != OPEN_PROBE && (job != CAMERA || pixel.looks == 1u);
    let end = met.real.t;
    var passed = 0.0;
    var beyond = 0.0;
    // Of what a lamp's ray passes, the opaque objects come first: any of them will do.
    var kinds = select(ANY_KIND, OPAQUE_KIND, BODIES && probes);
    for (var i = 0u; i < MAX_CROSSED + 1u; i++) {
        var hit = Hit(end, 0.0, 0.0, NOTHING, 0u);
        if looks {
            hit = trace_among(params.view.roots.x, ray.origin, ray.direction, beyond, end, probes && kinds != CLEAR_KIND, kinds);
        }
        if hit.instance == NOTHING {
            if BODIES && probes && kinds == OPAQUE_KIND {
                kinds = CLEAR_KIND;
                continue;
            }
            met.left *= media_transmittance(end - passed);
            return met;
        }
        if probes && kinds != CLEAR_KIND {
            met.left = vec3f(0.0);
            return met;
        }
        met.left *= media_transmittance(hit.t - passed);
        if !BODIES {
            met.object = hit;
            return met;
        }
        let surface = surface_at(objects(), hit, ray.direction);
        let m = surface.material;
        let clear = clear_share(m);
        let word_of_material = material_of(objects(), hit);
        let before = media;
        var eta = 1.0;
        if clear > 0.0 && !m.thin {
            eta = cross_body(hit.instance, word_of_material, surface.outside);
        }
        if probes {
            // From within, the straight way stands for the bent one outside, which always gets out.
            let normal = bsdf_at(m, surface.geometric, surface.normal, -ray.direction).normal;
            let straight = select(max(eta, 1.0 / eta), 1.0, m.thin);
            met.left *= m.base_color * clear * (1.0 - clear_reflectance(m, abs(dot(ray.direction, normal)), straight));
            if all(met.left == vec3f(0.0)) || clear <= 0.0 {
                met.left = vec3f(0.0);
                return met;
            }
        } else if m.thin || clear <= 0.0 || !is_unseen(surface, word_of_material, eta) {
            media = before;
            met.object = hit;
            return met;
        }
        passed = hit.t;
        beyond = just_beyond(hit.t);
    }
    // Faulty meshes have no end.
    met.left = select(met.left, vec3f(0.0), probes);
    met.real.exists = false;
    return met;
}

// What is at each pixel's centre.
@compute @workgroup_size(8, 8)
fn look(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    let center = vec2f(texel) + 0.5;
    pixel = pixels[index].seen;
    pixel.looks = select(0u, 1u, may_see_objects(vec2f(texel)));
    job = CAMERA;
    media.count = 0u;
    send(params.view.position, camera_direction(center));
    let met = meet();
    var real = met.real;
    real.exists = real.exists && met.object.instance == NOTHING;
    let guides = guides_of(met.object, real, ray.direction);
    pixel.pixel = guides.pixel;
    pixel.quiet = select(1u, 0u, pixel.looks == 1u);
    if met.object.instance != NOTHING {
        pixel.quiet = 0u;
    } else if real.exists {
        if MIRRORING {
            pixel.quiet = 0u;
        }
        for (var i = 0u; i < params.lighting.lamp_count; i++) {
            let toward = toward_lamp(i, real.position);
            if !is_below(toward, real.normal) {
                pixel.bright |= 1u << i;
                if SHADOWS && objects_may_block(toward, real.position) {
                    pixel.quiet = 0u;
                }
            }
        }
    }
    pixels[index].seen = pixel;
}

// Some rays of each pixel that is due.
@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    texel = texel_of(params.rows, id);
    index = index_of(params.rows, texel);
    if pixels[index].seen.due == 0u {
        return;
    }
    pixel = pixels[index].seen;
    walk = pixels[index].walk;
    shadow = walk.shadow;
    numbers = walk.numbers;
    level = walk.level;
    value = walk.value;
    is_loaded = false;
    if walk.number == 0u && walk.under_way == 0u {
        for (var i = 0u; i < params.lighting.lamp_count * NOTES; i++) {
            notes[note_at(0u, i)] = vec4u(0u);
        }
    }
    for (var i = 0u; i < params.rounds; i++) {
        if !find_ray() {
            if walk.under_way == 1u {
                end_sample();
            }
            if walk.number >= params.samples {
                pixel.due = 0u;
                break;
            }
            begin_sample();
        }
        take(meet());
    }
    walk.shadow = shadow;
    walk.numbers = numbers;
    walk.level = level;
    walk.value = value;
    pixels[index] = Held(pixel, walk);
}

// How many pixels are not done.
@compute @workgroup_size(8, 8)
fn count(@builtin(global_invocation_id) id: vec3u) {
    if is_held(params.rows, id) && pixels[index_of(params.rows, texel_of(params.rows, id))].seen.due == 1u {
        atomicAdd(&under_way[0], 1u);
    }
}
