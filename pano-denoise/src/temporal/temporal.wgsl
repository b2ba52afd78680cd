// Temporal accumulation along motion vectors, one invocation a pixel: `recall` asks history, `accumulate` corrects and blends.
// See cpu.rs for the reasons. Sums are f32: values are limited before.

override WRAP: bool;
// Whether there is a past at all, whether it is corrected, and whether variances are measured.
override HAS_PAST: bool;
override CLAMPED: bool;
override MEASURED: bool;

// More than any number of frames.
const MANY: f32 = 1e9;

struct Temporal {
    rows: Rows,
    blend: f32,
    still: f32,
    depth: f32,
    normal: f32,
    reach: f32,
}

@group(0) @binding(0) var<uniform> params: Temporal;
@group(0) @binding(1) var<storage, read> signal: array<f32>;
// Normal and depth.
@group(0) @binding(2) var<storage, read> surface: array<vec4f>;
// Which thing, SHARP where there is no noise, and the level of interpolation.
@group(0) @binding(3) var<storage, read> thing: array<u32>;
// Where the point was in the previous frame, and how far away: three numbers.
@group(0) @binding(4) var<storage, read> previous: array<f32>;
// Value, and the variance of one frame's luminance.
@group(0) @binding(5) var<storage, read> past: array<vec4f>;
@group(0) @binding(6) var<storage, read> past_surface: array<vec4f>;
// Thing, and the bits of the number of frames that the value is worth.
@group(0) @binding(7) var<storage, read> past_thing: array<vec2u>;
@group(0) @binding(8) var<storage, read_write> recalled: array<vec4f>;
// Frames, negative where the point has moved: shaders may bind eight arrays only.
@group(0) @binding(9) var<storage, read_write> recalled_frames: array<f32>;
@group(0) @binding(10) var<storage, read> known: array<vec4f>;
@group(0) @binding(11) var<storage, read> known_frames: array<f32>;
@group(0) @binding(12) var<storage, read> measured: array<f32>;
@group(0) @binding(13) var<storage, read_write> accumulated: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> accumulated_frames: array<f32>;

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

// What is known of the point seen at a pixel; no frames if nothing is.
@compute @workgroup_size(8, 8)
fn recall(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let p = index_of(params.rows, texel_of(params.rows, id));
    recalled[p] = vec4f(0.0);
    recalled_frames[p] = 0.0;
    let at = vec2f(previous[3u * p], previous[3u * p + 1u]) - 0.5;
    if !is_finite(at.x) || !is_finite(at.y) || max(abs(at.x), abs(at.y)) > 1e6 {
        return;
    }
    let base = floor(at);
    let f = at - base;
    var sum = vec4f(0.0);
    var weights = 0.0;
    var frames = MANY;
    for (var i = 0; i < 4; i++) {
        let d = vec2i(i % 2, i / 2);
        let weight = select(1.0 - f.x, f.x, d.x == 1) * select(1.0 - f.y, f.y, d.y == 1);
        let place = place_at(params.rows, vec2i(base), d, WRAP);
        if weight <= 0.0 || !place.exists {
            continue;
        }
        let q = index_of(params.rows, place.texel);
        let worth = bitcast<f32>(past_thing[q].y);
        if worth == 0.0 || past_thing[q].x != (thing[p] & THING)
            || !same_depth(previous[3u * p + 2u], past_surface[q].w)
            || !same_normal(surface[p].xyz, past_surface[q].xyz) {
            continue;
        }
        sum += vec4f(limited3(past[q].xyz), min(past[q].w, LARGEST * LARGEST)) * weight;
        weights += weight;
        frames = min(frames, worth);
    }
    // Less than a hundredth of a texel is a corner that only rounding touches.
    if weights > 0.01 {
        recalled[p] = sum / weights;
        let moved = abs(at - vec2f(texel_of(params.rows, id)));
        recalled_frames[p] = select(-frames, frames, max(moved.x, moved.y) <= STILL);
    }
}

struct Statistics {
    mean: vec3f,
    variance: f32,
    count: f32,
}

fn level_of(p: u32) -> u32 {
    return (thing[p] & ~(THING | SHARP)) / (THING + 1u);
}

// That pixel q shows what p does, turned the same way, in a finite value.
fn is_alike(q: u32, p: u32) -> bool {
    return ((thing[q] ^ thing[p]) & THING) == 0u && same_normal(surface[q].xyz, surface[p].xyz) && is_finite3(signal_at(q));
}

// Over the sampled pixels alike within RADIUS: of the new values, or of what they are apart from history.
fn around(texel: vec2i, p: u32, apart: bool) -> Statistics {
    var sum = vec3f(0.0);
    var squares = 0.0;
    var count = 0.0;
    // Deviations are taken from one of the values: squares of large numbers would cancel.
    var origin = vec3f(0.0);
    let radius = i32(RADIUS);
    for (var dy = -radius; dy <= radius; dy++) {
        for (var dx = -radius; dx <= radius; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if !place.exists || !is_alike(q, p) || (apart && known_frames[q] == 0.0) || level_of(q) > 0u {
                continue;
            }
            var value = limited3(signal_at(q));
            if apart {
                value -= known[q].xyz;
            }
            origin = select(origin, value, count == 0.0);
            let off = value - origin;
            sum += off;
            squares += luminance(off) * luminance(off);
            count += 1.0;
        }
    }
    if count == 0.0 {
        return Statistics(vec3f(0.0), 0.0, 0.0);
    }
    let shift = sum / count;
    let bright = luminance(shift);
    let mean = origin + shift;
    // Few values tell how large they are, and not how far apart.
    let large = select(0.0, luminance(mean) * luminance(mean), count < LONELY);
    return Statistics(mean, max(squares / count - bright * bright, 0.0) + large, count);
}

// `value` within the range of the new values around, if there are any, which `least` and `most` extend.
fn within_range(texel: vec2i, p: u32, value: vec3f, least: vec3f, most: vec3f) -> vec3f {
    var low = least;
    var high = most;
    let radius = i32(RANGE_RADIUS);
    for (var dy = -radius; dy <= radius; dy++) {
        for (var dx = -radius; dx <= radius; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if place.exists && is_alike(q, p) {
                let around = limited3(signal_at(q));
                low = min(low, around);
                high = max(high, around);
            }
        }
    }
    return select(value, clamp(value, low, high), low.x <= high.x);
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let texel = texel_of(params.rows, id);
    let p = index_of(params.rows, texel);
    let value = signal_at(p);
    let is_known = is_finite3(value);
    let worth = 1.0 / f32(1u << (2u * level_of(p)));
    var frames = 0.0;
    var is_still = false;
    if HAS_PAST {
        frames = abs(known_frames[p]);
        is_still = known_frames[p] > 0.0;
    }
    var is_measured = false;
    var variance = 0.0;
    if MEASURED {
        is_measured = is_finite(measured[p]);
        variance = select(0.0, min(measured[p], LARGEST * LARGEST), is_measured);
    }
    if frames == 0.0 {
        if is_known && !is_measured {
            variance = around(texel, p, false).variance;
        }
        accumulated[p] = select(vec4f(0.0), vec4f(value, variance), is_known);
        accumulated_frames[p] = select(0.0, worth, is_known);
        return;
    }
    let near = around(texel, p, true);
    var old = known[p].xyz;
    // The part of the difference that noise does not explain.
    var doubt = 0.0;
    if (thing[p] & SHARP) != 0u {
        old = within_range(texel, p, old, vec3f(LARGEST), vec3f(-LARGEST));
    } else if CLAMPED {
        let off = abs(luminance(near.mean));
        if off > 0.0 {
            let error = sqrt(max(near.variance, known[p].w) / near.count);
            doubt = max(1.0 - params.reach * error / off, 0.0);
        }
        if doubt > 0.0 {
            // What a lamp beside it has lost must not make a dark pixel negative.
            old = within_range(texel, p, old + near.mean * doubt, old, old);
        }
    }
    if !is_known {
        accumulated[p] = vec4f(old, known[p].w);
        accumulated_frames[p] = frames;
        return;
    }
    if !is_measured {
        variance = near.variance;
    }
    let least = select(params.blend, params.still, is_still && near.count >= LONELY);
    // What is doubted is as a pixel that moves.
    frames = min(frames, max(frames * (1.0 - doubt), 1.0 / params.blend));
    let weight = max(least * worth, worth / (frames + worth));
    // How noisy values are is as well known between samples as at them.
    let learned = min(weight / worth, 1.0);
    accumulated[p] = vec4f(old + (limited3(value) - old) * weight, known[p].w + (variance - known[p].w) * learned);
    accumulated_frames[p] = 1.0 / ((1.0 - weight) * (1.0 - weight) / frames + weight * weight / worth);
}
