// What of a lamp reaches the point in hand, sample by sample; see shadow.rs and survey.rs. Each round asks one sample about objects or about
// real surfaces, so that a pixel can wait in memory between any two rays.

// Samples for a point that counts so much of its pixel.
fn point_count() -> u32 {
    if SHADOW != ADAPTIVE {
        return params.shadow_samples;
    }
    return clamp(u32(ceil(frame.weight * f32(params.shadow_samples))), 1u, params.shadow_samples);
}

fn lamp_turn() -> vec2f {
    return sin_cos((shadow.turn + GOLDEN * f32(shadow.lamp)) * TAU).yx;
}

// Doubt is about what a pixel itself shows.
fn is_settling() -> bool {
    return SHADOW == ADAPTIVE && is_shown();
}

fn is_shown() -> bool {
    return frame.depth == 0u;
}

// The ray to sample `i`; false if that is below the horizon.
fn aim_at_sample(i: u32, toward: Toward) -> bool {
    let direction = pattern_direction(pattern_at(point_count()), i, toward, lamp_turn());
    if dot(direction, here.horizon) <= 0.0 {
        return false;
    }
    send(leave_here(direction), direction);
    ray.limit = toward.end;
    media = frame.media;
    return true;
}

// Begins with a phase: the samples it asks.
fn begin_phase(phase: u32, survey: Survey) {
    let all_ = point_count();
    let adaptive_ = SHADOW == ADAPTIVE;
    let again = (survey.known & REFERENCE) != 0u;
    let real_probes = (phase == STILL_DARK || phase == SURFACES_FIRST) && here.real == IF_OBJECTS_DO;
    let thorough = pixel.thorough == 1u && is_shown() && !real_probes;
    let probes = select(params.probes, REAL_PROBES, real_probes);
    shadow.phase = phase;
    shadow.next = 0u;
    shadow.end = all_;
    shadow.answers = 0u;
    if phase < OBJECTS_ALL && adaptive_ && !thorough && probes < all_ {
        shadow.end = probes;
        if again {
            shadow.next = select(SECOND_LOOKS_BEGIN, SECOND_REAL_LOOK_BEGIN, real_probes);
            shadow.end = select(SECOND_LOOKS_END, SECOND_REAL_LOOK_END, real_probes);
        }
    }
    shadow.first = shadow.next;
}

// Begins with the lamp in hand; what is known of it already is told at once.
fn begin_lamp(toward: Toward) {
    shadow.lit = Lit(vec3f(1.0), 1.0);
    shadow.phase = TOLD;
    if !SHADOWS {
        return;
    }
    let objects_reach = SHADOW == SOFT || objects_may_block(toward, here.position);
    var settled = vec4u(0u);
    if is_settling() {
        let surface = notes[note_at(shadow.lamp, 1u)];
        let kept = notes[note_at(shadow.lamp, 0u)];
        let same = surface.w == frame.instance && dot(unpacked(surface), here.horizon) > SAME_NORMAL;
        if (kept.w & SETTLED) != 0u && same {
            settled = kept;
        }
    }
    if !objects_reach && here.real == IF_OBJECTS_DO {
        if is_settling() {
            keep(packed(vec3f(1.0), (settled.w & (OPEN_KNOWN | OPEN)) | SETTLED | PASSES_KNOWN));
        }
        note_lit(true, false);
        return;
    }
    for (var i = 0u; i < point_count(); i++) {
        notes[answer_at(i)] = vec4u(0u);
    }
    shadow.objects = Survey(vec3f(1.0), REFERENCE | ENOUGH);
    if objects_reach {
        let known = (settled.w & PASSES_KNOWN) != 0u;
        shadow.objects = Survey(unpacked(settled), select(0u, REFERENCE | ENOUGH, known));
    }
    let open = (settled.w & OPEN) != 0u;
    shadow.surfaces = Survey(vec3f(select(0.0, 1.0, open)), select(0u, REFERENCE | ENOUGH, (settled.w & OPEN_KNOWN) != 0u));
    // What real surfaces are known to keep in the dark, objects cannot darken: only that is made sure of.
    if here.real == IF_OBJECTS_DO && (settled.w & (OPEN_KNOWN | OPEN)) == OPEN_KNOWN {
        begin_phase(STILL_DARK, shadow.surfaces);
    } else if objects_reach {
        begin_phase(OBJECTS_FIRST, shadow.objects);
    } else {
        begin_phase(SURFACES_FIRST, shadow.surfaces);
    }
}

fn asks_objects() -> bool {
    return shadow.phase == OBJECTS_FIRST || shadow.phase == OBJECTS_ALL;
}

// The next ray to a sample of the lamp in hand; false once all is told.
fn next_probe(toward: Toward) -> bool {
    while shadow.phase != TOLD {
        if shadow.phase >= READY {
            tell_lamp(toward, shadow.phase == CLEARED);
            break;
        }
        if shadow.next >= shadow.end {
            end_phase();
            continue;
        }
        let told = notes[answer_at(shadow.next)];
        if asks_objects() {
            if (told.w & OBJECTS_TOLD) != 0u {
                count_answer(unpacked(told));
                continue;
            }
        } else {
            if (told.w & SURFACES_TOLD) != 0u {
                count_answer(vec3f(select(0.0, 1.0, (told.w & OPEN) != 0u)));
                continue;
            }
            // What objects block anyway is not asked about.
            if here.real == BLOCKS && blocks_fully(told) {
                shadow.next += 1u;
                continue;
            }
        }
        if aim_at_sample(shadow.next, toward) {
            job = select(SURFACE_PROBE, OBJECT_PROBE, asks_objects());
            return true;
        }
        shadow.next += 1u;
    }
    return false;
}

// What objects let through of a sample, as far as it is known.
fn passes_of(told: vec4u) -> vec3f {
    if (told.w & OBJECTS_TOLD) != 0u {
        return unpacked(told);
    }
    return select(vec3f(0.0), shadow.objects.reference, is_agreed(shadow.objects));
}

fn blocks_fully(told: vec4u) -> bool {
    let known = (told.w & OBJECTS_TOLD) != 0u || is_agreed(shadow.objects);
    return known && all(passes_of(told) == vec3f(0.0));
}

// The sample in hand has that answer.
fn count_answer(value: vec3f) {
    if asks_objects() {
        shadow.objects = joined(shadow.objects, value);
    } else {
        shadow.surfaces = joined(shadow.surfaces, value);
    }
    shadow.answers += 1u;
    shadow.next += 1u;
}

// Keeps the answer to the ray in hand.
fn take_probe(value: vec3f) {
    let at = answer_at(shadow.next);
    var told = notes[at];
    if asks_objects() {
        told = packed(value, told.w | OBJECTS_TOLD);
    } else {
        told.w |= SURFACES_TOLD | select(0u, OPEN, value.x > 0.0);
    }
    notes[at] = told;
    count_answer(value);
}

// What is asked next, once the samples of a phase have been.
fn end_phase() {
    let phase = shadow.phase;
    // Of the first ones half must have an answer.
    let least = select((shadow.end - shadow.first + 1u) / 2u, 1u, phase >= OBJECTS_ALL);
    let enough = shadow.answers >= least;
    var survey = shadow.surfaces;
    if asks_objects() {
        survey = shadow.objects;
    }
    survey.known = (survey.known & ~ENOUGH) | select(0u, ENOUGH, enough);
    if asks_objects() {
        shadow.objects = survey;
    } else {
        shadow.surfaces = survey;
    }
    let dark = is_agreed(shadow.surfaces) && shadow.surfaces.reference.x == 0.0;
    switch phase {
        case STILL_DARK: {
            if dark {
                shadow.phase = READY;
            } else {
                begin_phase(OBJECTS_FIRST, shadow.objects);
            }
        }
        case OBJECTS_FIRST: {
            if here.real == IF_OBJECTS_DO && (shadow.objects.known & DIMMED) == 0u {
                shadow.phase = CLEARED;
            } else {
                begin_phase(SURFACES_FIRST, shadow.surfaces);
            }
        }
        case SURFACES_FIRST: {
            if dark {
                shadow.phase = READY;
            } else if !is_agreed(shadow.objects) {
                begin_phase(OBJECTS_ALL, shadow.objects);
            } else {
                begin_all_surfaces();
            }
        }
        case OBJECTS_ALL: {
            begin_all_surfaces();
        }
        default: {
            shadow.phase = READY;
        }
    }
}

fn begin_all_surfaces() {
    if is_agreed(shadow.surfaces) {
        shadow.phase = READY;
    } else {
        begin_phase(SURFACES_ALL, shadow.surfaces);
    }
}

// All is told of the lamp in hand; `is_clear`: no object is in the way.
fn tell_lamp(toward: Toward, is_clear: bool) {
    shadow.phase = TOLD;
    var penumbra = false;
    if !is_clear {
        let objects_agree = is_agreed(shadow.objects);
        let surfaces_agree = is_agreed(shadow.surfaces);
        let passes = shadow.objects.reference;
        let open = shadow.surfaces.reference.x > 0.0;
        let all_blocked = objects_agree && all(passes == vec3f(0.0)) && !surfaces_agree && here.real == BLOCKS;
        if all_blocked || (surfaces_agree && !open) {
            shadow.lit = Lit(vec3f(0.0), 0.0);
        } else if objects_agree && surfaces_agree {
            shadow.lit = Lit(passes, 1.0);
        } else {
            penumbra = sum_samples(toward);
        }
    }
    if is_settling() {
        var known = SETTLED;
        known |= select(0u, PASSES_KNOWN, is_clear || is_agreed(shadow.objects));
        if is_agreed(shadow.surfaces) {
            known |= OPEN_KNOWN | select(0u, OPEN, shadow.surfaces.reference.x > 0.0);
        }
        keep(packed(select(shadow.objects.reference, vec3f(1.0), is_clear), known));
    }
    let most = select(shadow.lit.open, 1.0, here.real == BLOCKS);
    note_lit(most_of(vec3f(most) - shadow.lit.reaches) < ALIKE, penumbra);
}

// The mean over all samples; whether they differ.
fn sum_samples(toward: Toward) -> bool {
    let points = point_count();
    let pattern = pattern_at(points);
    let turn = lamp_turn();
    var count = 0u;
    var opened = 0u;
    var sum = vec3f(0.0);
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    for (var i = 0u; i < points; i++) {
        if dot(pattern_direction(pattern, i, toward, turn), here.horizon) <= 0.0 {
            continue;
        }
        let told = notes[answer_at(i)];
        var open = is_agreed(shadow.surfaces) && shadow.surfaces.reference.x > 0.0;
        if (told.w & SURFACES_TOLD) != 0u {
            open = (told.w & OPEN) != 0u;
        }
        let value = select(vec3f(0.0), passes_of(told), open);
        count += 1u;
        opened += select(0u, 1u, open);
        sum += value;
        low = min(low, value);
        high = max(high, value);
    }
    if count == 0u {
        return false;
    }
    let share = 1.0 / f32(count);
    shadow.lit = Lit(sum * share, f32(opened) * share);
    return (opened > 0u && opened < count) || most_of(high - low) >= ALIKE;
}

// Keeps what the samples of the lamp in hand agree on, for the pixel's later rays.
fn keep(settled: vec4u) {
    notes[note_at(shadow.lamp, 0u)] = settled;
    notes[note_at(shadow.lamp, 1u)] = packed(here.horizon, frame.instance);
}

// Keeps what is found where a pixel shows it.
fn note_lit(bright: bool, penumbra: bool) {
    if !is_shown() {
        return;
    }
    let bit = 1u << shadow.lamp;
    pixel.bright |= select(0u, bit, bright);
    pixel.dark |= select(bit, 0u, bright);
    pixel.penumbra |= select(0u, bit, penumbra);
    let reaches = shadow.lit.reaches;
    notes[note_at(shadow.lamp, 2u)].y = bitcast<u32>((reaches.x + reaches.y + reaches.z) / 3.0);
}
