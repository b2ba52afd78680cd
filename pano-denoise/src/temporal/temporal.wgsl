// Temporal accumulation along motion vectors, one invocation a pixel: `recall` asks history, `accumulate` corrects and blends.
// See cpu.rs for the reasons. Sums are f32: values are limited before.

override WRAP: bool;
// Whether there is a past at all, whether it is corrected, and whether variances are measured.
override HAS_PAST: bool;
override CLAMPED: bool;
override MEASURED: bool;

// Frames are counted up to here.
const MOST_FRAMES: u32 = 16777216u;

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
// Which thing, SHARP where there is no noise, and the level of interpolation.
@group(0) @binding(3) var<storage, read> thing: array<u32>;
// Where the point was in the previous frame, and how far away: three numbers.
@group(0) @binding(4) var<storage, read> previous: array<f32>;
// Value, and the variance of one frame's luminance.
@group(0) @binding(5) var<storage, read> past: array<vec4f>;
@group(0) @binding(6) var<storage, read> past_surface: array<vec4f>;
// Thing, and the number of frames.
@group(0) @binding(7) var<storage, read> past_thing: array<vec2u>;
@group(0) @binding(8) var<storage, read_write> recalled: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> recalled_frames: array<u32>;
@group(0) @binding(10) var<storage, read> known: array<vec4f>;
@group(0) @binding(11) var<storage, read> known_frames: array<u32>;
@group(0) @binding(12) var<storage, read> measured: array<f32>;
@group(0) @binding(13) var<storage, read_write> accumulated: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> accumulated_frames: array<u32>;

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
    recalled_frames[p] = 0u;
    let at = vec2f(previous[3u * p], previous[3u * p + 1u]) - 0.5;
    if !is_finite(at.x) || !is_finite(at.y) || max(abs(at.x), abs(at.y)) > 1e6 {
        return;
    }
    let base = floor(at);
    let f = at - base;
    var sum = vec4f(0.0);
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
        if past_thing[q].y == 0u || past_thing[q].x != (thing[p] & THING)
            || !same_depth(previous[3u * p + 2u], past_surface[q].w)
            || !same_normal(surface[p].xyz, past_surface[q].xyz) {
            continue;
        }
        sum += vec4f(limited3(past[q].xyz), min(past[q].w, LARGEST * LARGEST)) * weight;
        weights += weight;
        frames = min(frames, past_thing[q].y);
    }
    // Less than a hundredth of a texel is a corner that only rounding touches.
    if weights > 0.01 {
        recalled[p] = sum / weights;
        recalled_frames[p] = frames;
    }
}

struct Statistics {
    mean: vec3f,
    variance: vec3f,
    luminance_variance: f32,
    count: f32,
}

fn level_of(p: u32) -> u32 {
    return (thing[p] & ~(THING | SHARP)) / (THING + 1u);
}

// Over the pixels within `radius` that show the same thing, turned the same way: of the new values, or of what they are apart
// from history.
fn around(texel: vec2i, p: u32, radius: i32, apart: bool, sampled: bool) -> Statistics {
    var sum = vec3f(0.0);
    var squares = vec3f(0.0);
    var bright_squares = 0.0;
    var count = 0.0;
    // Deviations are taken from one of the values: squares of large numbers would cancel.
    var origin = vec3f(0.0);
    for (var dy = -radius; dy <= radius; dy++) {
        for (var dx = -radius; dx <= radius; dx++) {
            let place = place_at(params.rows, texel, vec2i(dx, dy), WRAP);
            let q = index_of(params.rows, place.texel);
            if !place.exists || ((thing[q] ^ thing[p]) & THING) != 0u || !same_normal(surface[q].xyz, surface[p].xyz)
                || !is_finite3(signal_at(q)) || (apart && known_frames[q] == 0u) || (sampled && level_of(q) > 0u) {
                continue;
            }
            var value = limited3(signal_at(q));
            if apart {
                value -= known[q].xyz;
            }
            origin = select(origin, value, count == 0.0);
            let off = value - origin;
            sum += off;
            squares += off * off;
            bright_squares += luminance(off) * luminance(off);
            count += 1.0;
        }
    }
    if count == 0.0 {
        return Statistics(vec3f(0.0), vec3f(0.0), 0.0, 0.0);
    }
    let shift = sum / count;
    let bright = luminance(shift);
    let variance = max(squares / count - shift * shift, vec3f(0.0));
    return Statistics(origin + shift, variance, max(bright_squares / count - bright * bright, 0.0), count);
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
    var frames = 0u;
    if HAS_PAST {
        frames = known_frames[p];
    }
    var is_measured = false;
    var variance = 0.0;
    if MEASURED {
        is_measured = is_finite(measured[p]);
        variance = select(0.0, min(measured[p], LARGEST * LARGEST), is_measured);
    }
    if frames == 0u {
        if is_known && !is_measured {
            variance = around(texel, p, i32(RADIUS), false, true).luminance_variance;
        }
        accumulated[p] = select(vec4f(0.0), vec4f(value, variance), is_known);
        accumulated_frames[p] = select(0u, 1u, is_known);
        return;
    }
    let near = around(texel, p, i32(RADIUS), true, true);
    var old = known[p].xyz;
    if (thing[p] & SHARP) != 0u {
        let now = around(texel, p, i32(SHARP_RADIUS), false, false);
        let reach = sqrt(now.variance) * SHARP_REACH + abs(now.mean) * 1e-6;
        if now.count > 0.0 {
            old = clamp(old, now.mean - reach, now.mean + reach);
        }
    } else if CLAMPED {
        // The part of the difference that noise does not explain.
        let off = abs(luminance(near.mean));
        if off > 0.0 {
            let error = sqrt(max(near.luminance_variance, known[p].w) / near.count);
            old += near.mean * max(1.0 - params.reach * error / off, 0.0);
        }
    }
    if !is_known {
        accumulated[p] = vec4f(old, known[p].w);
        accumulated_frames[p] = frames;
        return;
    }
    if !is_measured {
        variance = near.luminance_variance;
    }
    let weight = max(params.blend, 1.0 / f32(frames + 1u));
    let worth = weight / f32(1u << (2u * level_of(p)));
    accumulated[p] = vec4f(old + (limited3(value) - old) * worth, known[p].w + (variance - known[p].w) * weight);
    accumulated_frames[p] = min(frames + 1u, MOST_FRAMES);
}
