// What is known of a lamp's samples at a point, and where that is kept; see survey.rs.

// How shadows are found, in the order of rt2ar::Shadow; whether there are any.
override SHADOW: u32 = 2u;
override SHADOWS: bool = true;
const HARD: u32 = 0u;
const SOFT: u32 = 1u;
const ADAPTIVE: u32 = 2u;

// When it is asked what real surfaces let through, see shadow::Real.
const BLOCKS: u32 = 0u;
const IF_OBJECTS_DO: u32 = 1u;
const ALWAYS: u32 = 2u;

// What is asked in turn about one lamp.
const START: u32 = 0u;
const STILL_DARK: u32 = 1u;
const OBJECTS_FIRST: u32 = 2u;
const SURFACES_FIRST: u32 = 3u;
const OBJECTS_ALL: u32 = 4u;
const SURFACES_ALL: u32 = 5u;
// All samples have been asked that need be; the same, and no object is in the way.
const READY: u32 = 6u;
const CLEARED: u32 = 7u;
const TOLD: u32 = 8u;

// A lamp at a point: share that real surfaces let through, and per channel what arrives past objects, too.
struct Lit {
    reaches: vec3f,
    open: f32,
}

// What is known of all samples, of objects or (0 or 1) of real surfaces.
struct Survey {
    reference: vec3f,
    // Bits of REFERENCE and the like.
    known: u32,
}

const REFERENCE: u32 = 1u;
const DIFFERENT: u32 = 2u;
const ENOUGH: u32 = 4u;
// An answer was less than everything.
const DIMMED: u32 = 8u;

// One lamp's samples under way.
struct Shadow {
    objects: Survey,
    surfaces: Survey,
    lit: Lit,
    unshadowed: vec3f,
    phase: u32,
    // The next sample and the last but one, and how many had an answer.
    next: u32,
    end: u32,
    answers: u32,
    // Of the phase in hand, the first sample.
    first: u32,
    lamp: u32,
    // By how much the samples are turned, a share of a turn.
    turn: f32,
    // Of the real point in hand: open samples, and whether anything has changed.
    opened: u32,
    changed: u32,
}

// Per lamp of a pixel: what its samples agree on, the surface that holds for, what reaches the pixel's samples and the one in hand, and the
// real point in hand. After all of them, the answers of the samples of the lamp in hand.
@group(0) @binding(9) var<storage, read_write> notes: array<vec4u>;

const SETTLED: u32 = 1u;
const OPEN_KNOWN: u32 = 2u;
const OPEN: u32 = 4u;
const PASSES_KNOWN: u32 = 8u;

// Bits of a sample's answers, beside OPEN.
const OBJECTS_TOLD: u32 = 1u;
const SURFACES_TOLD: u32 = 2u;

fn note_at(lamp: u32, which: u32) -> u32 {
    return (index * params.lighting.lamp_count + lamp) * NOTES + which;
}

fn answer_at(i: u32) -> u32 {
    return params.answers + index * params.shadow_samples + i;
}

fn packed(v: vec3f, w: u32) -> vec4u {
    return vec4u(bitcast<vec3u>(v), w);
}

fn unpacked(v: vec4u) -> vec3f {
    return bitcast<vec3f>(v.xyz);
}

fn is_agreed(survey: Survey) -> bool {
    return (survey.known & (REFERENCE | DIFFERENT | ENOUGH)) == (REFERENCE | ENOUGH);
}

fn are_alike(a: vec3f, b: vec3f) -> bool {
    return most_of(abs(a - b)) < ALIKE;
}

// With one more answer.
fn joined(survey: Survey, value: vec3f) -> Survey {
    var with_it = survey;
    if (survey.known & REFERENCE) == 0u {
        with_it.reference = value;
        with_it.known |= REFERENCE;
    } else if !are_alike(survey.reference, value) {
        with_it.known |= DIFFERENT;
    }
    if any(value != vec3f(1.0)) {
        with_it.known |= DIMMED;
    }
    return with_it;
}

