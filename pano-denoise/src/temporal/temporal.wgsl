// Temporal accumulation along motion vectors, one invocation a pixel; see cpu.rs for the reasons. Sums are f32: values are
// limited before.

override WRAP: bool;
// Whether there is a past at all, and whether it is clamped to the neighbourhood.
override HAS_PAST: bool;
override CLAMPED: bool;

// Up to here an f32 counts.
const MOST_FRAMES: f32 = 16777216.0;

struct Temporal {
    rows: Rows,
    blend: f32,
    depth: f32,
    normal: f32,
    reach: f32,
}

@group(0) @binding(0) var<uniform> params: Temporal;
@group(0) @binding(1) var<storage, read> signal: array<f32>;
// Normal and depth.
@group(0) @binding(2) var<storage, read> surface: array<vec4f>;
@group(0) @binding(3) var<storage, read> thing: array<u32>;
// Where the point was in the previous frame, and how far away: three numbers.
@group(0) @binding(4) var<storage, read> previous: array<f32>;
// Value and the number of frames.
@group(0) @binding(5) var<storage, read> past: array<vec4f>;
@group(0) @binding(6) var<storage, read> past_surface: array<vec4f>;
@group(0) @binding(7) var<storage, read> past_thing: array<u32>;
@group(0) @binding(8) var<storage, read_write> accumulated: array<vec4f>;

fn signal_at(i: u32) -> vec3f {
    return vec3f(signal[3u * i], signal[3u * i + 1u], signal[3u * i + 2u]);
}

fn same_depth(a: f32, b: f32) -> bool {
    if is_finite(a) && is_finite(b) {
        return abs(a - b) <= params.depth * max(abs(a), abs(b));
    }
    return is_finite(a) == is_finite(b);
}

fn same_normal(a: vec3f, b: vec3f) -> bool {
    return all(a == b) || dot(a, b) >= params.normal;
}

// What is known of the point seen at a pixel; frames is 0 if nothing is.
struct Recalled {
    value: vec3f,
    frames: f32,
}

fn recall(p: u32) -> Recalled {
    let none = Recalled(vec3f(0.0), 0.0);
    let at = vec2f(previous[3u * p], previous[3u * p + 1u]) - 0.5;
    if !is_finite(at.x) || !is_finite(at.y) || max(abs(at.x), abs(at.y)) > 1e6 {
        return none;
    }
    let base = floor(at);
    let f = at - base;
    var sum = vec3f(0.0);
    var weights = 0.0;
    var frames = MOST_FRAMES;
    for (var i = 0; i < 4; i++) {
        let d = vec2i(i % 2, i / 2);
        let weight = select(1.0 - f.x, f.x, d.x == 1) * select(1.0 - f.y, f.y, d.y == 1);
        let place = place_at(params.rows, vec2i(base), d, WRAP);
        if weight <= 0.0 || !place.exists {
            continue;
        }
        let q = index_of(params.rows, place.texel);
        if past_thing[q] != thing[p] || !same_depth(previous[3u * p + 2u], past_surface[q].w)
            || !same_normal(surface[p].xyz, past_surface[q].xyz) {
            continue;
        }
        sum += limited3(past[q].xyz) * weight;
        weights += weight;
        frames = min(frames, past[q].w);
    }
    // Less than a hundredth of a texel is a corner that only rounding touches.
    if weights > 0.01 {
        return Recalled(sum / weights, frames);
    }
    return none;
}

// `old`, at most so many standard deviations from the mean of the new values around the pixel that show the same thing.
fn within_neighbourhood(texel: vec2i, p: u32, old: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    var squares = vec3f(0.0);
    var count = 0.0;
    // Deviations are taken from one of the values: squares of large numbers would cancel.
    var origin = vec3f(0.0);
    for (var dy = -2; dy <= 2; dy++) {
        for (var dx = -2; dx <= 2; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if place.exists && thing[q] == thing[p] && is_finite3(signal_at(q)) {
                let value = limited3(signal_at(q));
                origin = select(origin, value, count == 0.0);
                sum += value - origin;
                squares += (value - origin) * (value - origin);
                count += 1.0;
            }
        }
    }
    if count == 0.0 {
        return old;
    }
    let shift = sum / count;
    let mean = origin + shift;
    let deviation = sqrt(max(squares / count - shift * shift, vec3f(0.0)));
    let reach = deviation * params.reach + abs(mean) * 1e-6;
    return clamp(old, mean - reach, mean + reach);
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    let value = signal_at(p);
    let known = is_finite3(value);
    var recalled = Recalled(vec3f(0.0), 0.0);
    if HAS_PAST {
        recalled = recall(p);
    }
    if recalled.frames == 0.0 {
        accumulated[p] = vec4f(select(vec3f(0.0), value, known), 1.0);
        return;
    }
    var old = recalled.value;
    if CLAMPED {
        old = within_neighbourhood(texel, p, old);
    }
    if !known {
        accumulated[p] = vec4f(old, recalled.frames);
        return;
    }
    let weight = max(params.blend, 1.0 / (recalled.frames + 1.0));
    accumulated[p] = vec4f(old + (limited3(value) - old) * weight, min(recalled.frames + 1.0, MOST_FRAMES));
}
