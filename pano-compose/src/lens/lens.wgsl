// Bloom and glare: bright light is taken out of the picture (`reduce` for the bloom, `take` for the glare), spread along lines of
// pixels (`spread`), and put back (`finish`), one invocation a pixel.
//
// Pictures that are copied bit for bit are arrays of bits.

override BLOOM: bool;
override GLARE: bool;
override WRAP: bool;
// A line goes both ways from a pixel; its sum is added to what is there.
override BOTH_WAYS: bool;
override ADDED: bool;

struct Lens {
    rows: Rows,
    threshold: f32,
    glare_threshold: f32,
    // Shares of bright light.
    bloom: f32,
    glare: f32,
    // What of the bloom is none.
    nothing: f32,
    // 1 if the photo's own light is spread as well.
    everything: u32,
    // Pixels of the picture to one of the bloom's map, whose size follows.
    scale: u32,
    map_width: u32,
    map_height: u32,
    // Rows whose light is counted.
    keep_first: u32,
    keep_count: u32,
}

struct Line {
    rows: Rows,
    step_x: i32,
    step_y: i32,
    reach: i32,
}

@group(0) @binding(0) var<uniform> params: Lens;
@group(0) @binding(1) var<storage, read> picture: array<u32>;
@group(0) @binding(2) var<storage, read> photo: array<f32>;
// Light of one part: in the map of the bloom, or in the rows that are held.
@group(0) @binding(3) var<storage, read_write> taken: array<f32>;

@group(0) @binding(0) var<uniform> line: Line;
@group(0) @binding(4) var<storage, read> before: array<f32>;
@group(0) @binding(5) var<storage, read> weights: array<f32>;
@group(0) @binding(6) var<storage, read_write> after: array<f32>;

// The bloom's map and the glare, spread.
@group(0) @binding(7) var<storage, read> map: array<f32>;
@group(0) @binding(8) var<storage, read> rays: array<f32>;
@group(0) @binding(9) var<storage, read_write> made: array<u32>;
// Luminance that was spread, one for each workgroup.
@group(0) @binding(10) var<storage, read_write> report: array<f32>;

const GROUP: u32 = 64u;
var<workgroup> parts: array<f32, GROUP>;

fn picture_at(i: u32) -> vec3f {
    return vec3f(bitcast<f32>(picture[3u * i]), bitcast<f32>(picture[3u * i + 1u]), bitcast<f32>(picture[3u * i + 2u]));
}

// The part of a radiance above a luminance.
fn bright(radiance: vec3f, threshold: f32) -> vec3f {
    if !is_finite3(radiance) {
        return vec3f(0.0);
    }
    let most = min(radiance, vec3f(BRIGHTEST));
    let l = luminance(most);
    return select(vec3f(0.0), most * (1.0 - threshold / l), l > threshold);
}

// What is taken from pixel `i`.
fn light_of(i: u32, threshold: f32, share: f32) -> vec3f {
    var own = vec3f(0.0);
    if params.everything == 0u {
        own = bright(vec3f(photo[3u * i], photo[3u * i + 1u], photo[3u * i + 2u]), threshold);
    }
    return max(bright(picture_at(i), threshold) - own, vec3f(0.0)) * share;
}

// The mean over the pixels of each one of the bloom's map; rows begin with a whole one.
@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    let first = vec2u(id.x, id.y + params.rows.first / params.scale) * params.scale;
    let end = min(first + params.scale, vec2u(params.rows.width, params.rows.first + params.rows.count));
    if any(first >= end) {
        return;
    }
    var sum = vec3f(0.0);
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            sum += light_of(index_of(params.rows, vec2i(vec2u(x, y))), params.threshold, params.bloom);
        }
    }
    let mean = sum / f32(params.scale * params.scale);
    let i = first.y / params.scale * params.map_width + id.x;
    taken[3u * i] = mean.x;
    taken[3u * i + 1u] = mean.y;
    taken[3u * i + 2u] = mean.z;
}

@compute @workgroup_size(8, 8)
fn take(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(params.rows, id) {
        return;
    }
    let i = index_of(params.rows, texel_of(params.rows, id));
    let light = light_of(i, params.glare_threshold, params.glare);
    taken[3u * i] = light.x;
    taken[3u * i + 1u] = light.y;
    taken[3u * i + 2u] = light.z;
}

// Light at a texel; what lies outside of the frame, or of the rows that are held, is dark.
fn before_at(texel: vec2i) -> vec3f {
    let width = i32(line.rows.width);
    var x = texel.x;
    if WRAP {
        x = ((x % width) + width) % width;
    }
    let y = texel.y - i32(line.rows.first);
    if x < 0 || x >= width || y < 0 || y >= i32(line.rows.count) {
        return vec3f(0.0);
    }
    let i = u32(y * width + x);
    return vec3f(before[3u * i], before[3u * i + 1u], before[3u * i + 2u]);
}

// The weighted sum of the light along a line of pixels.
@compute @workgroup_size(8, 8)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(line.rows, id) {
        return;
    }
    let texel = texel_of(line.rows, id);
    var sum = before_at(texel) * weights[0];
    for (var s = 1; s <= line.reach; s++) {
        let offset = vec2i(line.step_x, line.step_y) * s;
        var light = before_at(texel + offset);
        if BOTH_WAYS {
            light += before_at(texel - offset);
        }
        sum += light * weights[s];
    }
    let i = index_of(line.rows, texel);
    for (var c = 0u; c < 3u; c++) {
        if ADDED {
            after[3u * i + c] += sum[c];
        } else {
            after[3u * i + c] = sum[c];
        }
    }
}

fn map_at(texel: vec2i) -> vec3f {
    let size = vec2i(i32(params.map_width), i32(params.map_height));
    var x = clamp(texel.x, 0, size.x - 1);
    if WRAP {
        x = ((texel.x % size.x) + size.x) % size.x;
    }
    let i = u32(clamp(texel.y, 0, size.y - 1) * size.x + x);
    return vec3f(map[3u * i], map[3u * i + 1u], map[3u * i + 2u]);
}

// The bloom at a pixel: its map, looked up bilinearly.
fn bloom_at(texel: vec2i) -> vec3f {
    let at = (vec2f(texel) + 0.5) / f32(params.scale) - 0.5;
    let whole = vec2i(floor(at));
    let f = at - floor(at);
    let above = mix(map_at(whole), map_at(whole + vec2i(1, 0)), f.x);
    let below = mix(map_at(whole + vec2i(0, 1)), map_at(whole + vec2i(1, 1)), f.x);
    let value = mix(above, below, f.y);
    return select(vec3f(0.0), value, max(value.x, max(value.y, value.z)) > params.nothing);
}

// A pixel without the light that was taken from it, and with what came to it.
fn exchanged(value: vec3f, light: vec3f, come: vec3f) -> vec3f {
    let sum = value - light + come;
    return vec3f(to_radiance(sum.x), to_radiance(sum.y), to_radiance(sum.z));
}

@compute @workgroup_size(8, 8)
fn finish(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    parts[local] = 0.0;
    if is_held(params.rows, id) {
        let texel = texel_of(params.rows, id);
        let i = index_of(params.rows, texel);
        var value = picture_at(i);
        var gone = 0.0;
        var touched = false;
        if BLOOM {
            let light = light_of(i, params.threshold, params.bloom);
            let come = bloom_at(texel);
            if any(light != vec3f(0.0)) || any(come != vec3f(0.0)) {
                value = exchanged(value, light, come);
                touched = true;
            }
            gone += luminance(light);
        }
        if GLARE {
            let light = light_of(i, params.glare_threshold, params.glare);
            let come = vec3f(rays[3u * i], rays[3u * i + 1u], rays[3u * i + 2u]);
            if any(light != vec3f(0.0)) || any(come != vec3f(0.0)) {
                value = exchanged(value, light, come);
                touched = true;
            }
            gone += luminance(light);
        }
        for (var c = 0u; c < 3u; c++) {
            made[3u * i + c] = select(picture[3u * i + c], bitcast<u32>(value[c]), touched);
        }
        let row = u32(texel.y);
        if row >= params.keep_first && row < params.keep_first + params.keep_count {
            parts[local] = gone;
        }
    }
    workgroupBarrier();
    if local == 0u {
        var sum = 0.0;
        for (var i = 0u; i < GROUP; i++) {
            sum += parts[i];
        }
        report[group.y * groups.x + group.x] = sum;
    }
}
