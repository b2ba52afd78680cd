// What an object's surface asks, ray by ray; see Shader::object.

fn has_body() -> bool {
    return BODIES && clear_share(here.material) > 0.0;
}

// `direction`, or where it leads into the surface the geometric normal's mirror image.
fn above_surface(direction: vec3f) -> vec3f {
    let geometric = bsdf_offset_normal(here.bsdf, -frame.direction);
    return select(reflect(frame.direction, geometric), direction, dot(direction, geometric) > 0.0);
}

// Sends the ray off a clear surface, or the one through it.
fn send_through(above: bool) {
    let out = -frame.direction;
    let m = here.material;
    let geometric = bsdf_offset_normal(here.bsdf, out);
    var normal = select(-here.bsdf.normal, here.bsdf.normal, here.outside || m.thin);
    normal = select(geometric, normal, dot(normal, out) > 0.0);
    media = frame.media;
    var eta = 1.0;
    if !m.thin {
        eta = cross_body(frame.instance, here.material_word, here.outside);
    }
    let rough = m.alpha > 0.0 && !m.thin;
    var facet = frame.normal;
    if above {
        media = frame.media;
        facet = normal;
        if rough {
            facet = facet_of(normal, out, m.alpha, draw().xy);
        }
        frame.normal = facet;
        stack[top()].normal = facet;
    }
    let clear = clear_share(m);
    let reflected = clear_reflectance(m, max(dot(out, facet), 0.0), eta);
    var bent = Bent(frame.direction, true);
    var share = m.base_color * clear * (1.0 - reflected);
    if above {
        bent.direction = reflect(frame.direction, facet);
        if !rough {
            bent.direction = above_surface(bent.direction);
        }
        share = vec3f(reflected * clear);
    } else if !m.thin {
        bent = refracted(frame.direction, facet, eta);
    }
    // A facet may send light to the wrong side: it is lost.
    if !bent.exists || all(share == vec3f(0.0)) || (dot(bent.direction, geometric) > 0.0) != above {
        return;
    }
    var factor = share;
    if rough {
        factor *= facets_let_through(normal, out, bent.direction, m.alpha);
    }
    if FILTERED {
        if rough {
            errand.beam = scattered_beam(here.neighbours, bent.direction, LOBE_WIDTH * m.alpha);
        } else if above {
            errand.beam = reflected_beam(here.neighbours, frame.direction, facet);
        } else {
            errand.beam = refracted_beam(here.neighbours, frame.direction, facet, eta);
        }
    }
    launch(ONWARD, bent.direction, factor, share, 0.0, vec3f(0.0));
}

// Sends a ray of the lobe about the mirrored direction.
fn send_mirrored() {
    let specular = here.lobes.specular;
    let roughness = here.lobes.roughness;
    let axis = above_surface(reflect(frame.direction, here.bsdf.normal));
    var direction = axis;
    if roughness > 0.0 {
        direction = lobe_direction(axis, roughness, draw().xy);
    }
    if FILTERED {
        errand.beam = reflected_beam(here.neighbours, frame.direction, here.bsdf.normal);
        if roughness > 0.0 {
            errand.beam = scattered_beam(here.neighbours, direction, LOBE_WIDTH * roughness * roughness);
        }
    }
    media = frame.media;
    var behind = vec3f(0.0);
    let blurred = roughness >= BLURRED;
    if blurred {
        behind = specular_look(axis, roughness);
    }
    launch(select(ONWARD, ROUGH, blurred), direction, specular, specular, roughness, behind);
}

// One step of the object's surface on top.
fn step_object() {
    let lobes = here.lobes;
    switch frame.stage {
        case ENTER: {
            add_light(here.emission);
            go_to(select(REFLECT, REFRACT, has_body()));
            if has_body() {
                send_through(true);
            }
        }
        case REFRACT: {
            go_to(REFLECT);
            send_through(false);
        }
        case REFLECT: {
            go_to(LIGHT);
            if most_of(lobes.diffuse) > 0.0 {
                add_light(lobes.diffuse * diffuse_look(here.bsdf.normal));
            }
            if GLOSS && most_of(lobes.specular) > 0.0 {
                send_mirrored();
            }
        }
        case LIGHT: {
            // Mirrors see the lamps in the panorama itself.
            let mirror = all(lobes.diffuse == vec3f(0.0)) && (lobes.roughness == 0.0 || bsdf_is_specular(here.bsdf));
            if mirror {
                go_to(FINISH);
            } else {
                begin_lamps();
            }
        }
        default: {
            come_down(stack[top()].light);
        }
    }
}

// What the object on top would send back of a lamp that nothing blocks.
fn object_receives(toward: Toward) -> vec3f {
    if all(here.lobes.specular == vec3f(0.0)) && !has_body() {
        return here.lobes.diffuse / PI * received(toward, here.bsdf.normal);
    }
    return unshadowed(toward, here.horizon, TO_BSDF, vec3f(0.0));
}
