// What a real surface asks, ray by ray, and how objects change it; see Shader::change.

// Real surfaces mirror objects.
override MIRRORING: bool = true;

// Goes to the lamps of the surface on top.
fn begin_lamps() {
    shadow.turn = draw().x;
    shadow.lamp = 0u;
    shadow.phase = START;
    shadow.changed = select(0u, 1u, here.real == ALWAYS);
    go_to(LAMPS);
}

// Sends a ray to a lamp, or tells what reaches the surface on top and goes to the next one.
fn step_lamp() {
    if shadow.lamp >= params.lighting.lamp_count {
        shadow.lamp = 0u;
        begin_open();
        if on_object() {
            go_to(FINISH);
        } else if shadow.changed == 1u {
            stack[top()].without = diffuse_look(frame.normal) * PI;
            go_to(CHANGE);
        } else {
            go_to(MIRRORED);
        }
        return;
    }
    let toward = toward_lamp(shadow.lamp, here.position);
    if shadow.phase == START {
        shadow.unshadowed = vec3f(0.0);
        var counts = !is_below(toward, here.horizon);
        if on_object() {
            shadow.unshadowed = object_receives(toward);
            counts = any(shadow.unshadowed != vec3f(0.0));
        }
        if counts {
            begin_lamp(toward);
        } else {
            shadow.lit = Lit(vec3f(1.0), 1.0);
            shadow.phase = TOLD;
        }
    }
    if next_probe(toward) {
        return;
    }
    let lit = shadow.lit;
    if on_object() {
        add_light(shadow.unshadowed * lit.reaches);
    } else {
        notes[note_at(shadow.lamp, 3u)] = packed(lit.reaches, bitcast<u32>(lit.open));
        if any(lit.reaches != vec3f(lit.open)) {
            shadow.changed = 1u;
        }
    }
    shadow.lamp += 1u;
    shadow.phase = START;
}

// The next lamp's samples that tell whether real surfaces let it through.
fn begin_open() {
    shadow.next = 0u;
    shadow.answers = 0u;
    shadow.opened = 0u;
}

// Share of what the real surface on top mirrors that it sends along its ray.
fn mirror_weight() -> f32 {
    if !MIRRORING || frame.depth >= params.deepest {
        return 0.0;
    }
    return gloss_fresnel(-dot(frame.direction, frame.normal)) * params.lighting.gloss;
}

// Adds what a lamp counts for the change. Where something else is blocked, it is asked how much arrives of the lamps that nothing blocks.
fn step_change() {
    if shadow.lamp >= params.lighting.lamp_count {
        go_to(MIRRORED);
        return;
    }
    let toward = toward_lamp(shadow.lamp, here.position);
    let irradiance = received(toward, frame.normal);
    let told = notes[note_at(shadow.lamp, 3u)];
    let reaches = unpacked(told);
    var open = bitcast<f32>(told.w);
    let untouched = open == 1.0 && all(reaches == vec3f(1.0)) && any(irradiance != vec3f(0.0));
    let unasked = here.real == IF_OBJECTS_DO && untouched;
    if unasked {
        let points = point_count();
        let probes = select(min(params.probes, points), 1u, SHADOW == HARD);
        while shadow.next < probes {
            if aim_at_sample(shadow.next, toward) {
                job = OPEN_PROBE;
                return;
            }
            shadow.next += 1u;
        }
        open = select(1.0, f32(shadow.opened) * (1.0 / f32(shadow.answers)), shadow.answers > 0u);
    }
    var highlight = vec3f(0.0);
    let weight = mirror_weight();
    if weight > 0.0 {
        highlight = weight * unshadowed(toward, frame.normal, TO_LOBE, reflect(frame.direction, frame.normal));
    }
    stack[top()].without += irradiance * open;
    stack[top()].highlight += highlight * open;
    if !unasked {
        stack[top()].irradiance += irradiance * (reaches - open);
        stack[top()].dimmed += highlight * (reaches - open);
    }
    shadow.lamp += 1u;
    begin_open();
}

// Looks for an object in a ray of the lobe.
fn send_glossy() {
    let weight = mirror_weight();
    if weight <= 0.0 {
        return;
    }
    let axis = reflect(frame.direction, frame.normal);
    let direction = lobe_direction(axis, params.lighting.gloss_roughness, draw().xy);
    if dot(direction, frame.normal) > 0.0 {
        media = frame.media;
        if FILTERED {
            let spread = LOBE_WIDTH * params.lighting.gloss_roughness * params.lighting.gloss_roughness;
            errand.beam = scattered_beam(here.neighbours, direction, spread);
        }
        launch(GLOSSY, direction, vec3f(weight), vec3f(weight), 0.0, vec3f(0.0));
    }
}

// One step of the real surface on top.
fn step_real() {
    switch frame.stage {
        case LIGHT: {
            begin_lamps();
        }
        case CHANGE: {
            step_change();
        }
        case MIRRORED: {
            go_to(FINISH);
            send_glossy();
        }
        default: {
            come_down(real_radiance());
        }
    }
}

// Change of what a surface of radiance `l` sends back, in proportion to that `c` of its irradiance `e`.
fn change_of_channel(l: f32, e: f32, c: f32) -> f32 {
    let most = params.reflectance_cap / PI * abs(c);
    let share = c / e;
    let change = l * select(max(share, -1.0), -1.0, is_nan(share));
    // A change that is no number, of a light beyond all numbers, is none.
    return select(0.0, clamp(change, -most, most), e > 0.0 && !is_nan(most));
}

// How far a picture of radiance `l` can show a highlight.
fn shown_share(l: f32, told: f32) -> f32 {
    let share = max(l, 0.0) / told;
    return select(1.0, share * share, told > l);
}

// How objects change a surface that shows `radiance` without them.
fn change_of(change: Waiting, radiance: vec3f) -> vec3f {
    let l = radiance;
    let e = change.without;
    let c = change.irradiance;
    let h = change.highlight;
    let diffuse = vec3f(change_of_channel(l.x, e.x, c.x), change_of_channel(l.y, e.y, c.y), change_of_channel(l.z, e.z, c.z));
    let is_shown = min(min(shown_share(l.x, h.x), shown_share(l.y, h.y)), shown_share(l.z, h.z));
    return max(diffuse + change.dimmed * is_shown + change.light, -radiance);
}

// What the real surface on top comes to: its change where a pixel shows it, its radiance elsewhere.
fn real_radiance() -> vec3f {
    let change = stack[top()];
    if level == 1u {
        return change_of(change, pixel.photo);
    }
    if here.pictured.exists {
        return max(here.pictured.radiance + change_of(change, here.pictured.radiance), vec3f(0.0));
    }
    let irradiance = change.without + change.irradiance;
    let mirrored = change.highlight + change.dimmed + change.light;
    return max(world_reflectance(params.world, real_on_top()) / PI * irradiance + mirrored, vec3f(0.0));
}
