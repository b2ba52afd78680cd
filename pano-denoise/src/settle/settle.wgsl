// Single pixels that stick out are settled before the filter (`limit`, `exceed`, `spread`, `lighten`) and after it (`stray`, `settle`), one
// invocation a pixel. What the CPU scatters is gathered here in the same order: by the pixels it comes from, row by row.

// Columns wrap; rows never do.
override WRAP: bool;
// The layer is the change of the real surfaces, in units of the photo; else what objects show, in units of their share.
override REAL: bool;

@group(0) @binding(0) var<uniform> rows: Rows;
@group(0) @binding(1) var<storage, read_write> layer: array<f32>;
@group(0) @binding(2) var<storage, read> coverage: array<f32>;
@group(0) @binding(3) var<storage, read> photo: array<f32>;
@group(0) @binding(4) var<storage, read> depth: array<f32>;
@group(0) @binding(5) var<storage, read> normal: array<f32>;
// What a pixel has too much, in units, and among how much weight that is divided; no weight: it is as it should be.
@group(0) @binding(6) var<storage, read_write> excess: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> lighter: array<f32>;

// Pixels to each side over which what sticks out is spread.
const REACH = i32(SPREAD);

fn layer_at(i: u32) -> vec3f {
    return vec3f(layer[3u * i], layer[3u * i + 1u], layer[3u * i + 2u]);
}

fn put(i: u32, value: vec3f) {
    layer[3u * i] = value.x;
    layer[3u * i + 1u] = value.y;
    layer[3u * i + 2u] = value.z;
}

fn photo_at(i: u32) -> vec3f {
    return vec3f(photo[3u * i], photo[3u * i + 1u], photo[3u * i + 2u]);
}

fn normal_at(i: u32) -> vec3f {
    return vec3f(normal[3u * i], normal[3u * i + 1u], normal[3u * i + 2u]);
}

fn are_numbers(v: vec3f) -> vec3<bool> {
    return vec3<bool>(!is_nan(v.x), !is_nan(v.y), !is_nan(v.z));
}

// The larger one, and the second if one is no number, as the CPU has it.
fn larger(a: vec3f, b: vec3f) -> vec3f {
    return select(b, a, (a > b) & are_numbers(a) & are_numbers(b));
}

fn smaller(a: vec3f, b: vec3f) -> vec3f {
    return select(b, a, (a < b) & are_numbers(a) & are_numbers(b));
}

// Whether an object shows in the pixel.
fn is_covered(i: u32) -> bool {
    return coverage[i] > 0.0 && !is_nan(coverage[i]);
}

fn is_free(i: u32) -> bool {
    return coverage[i] == 0.0 && !is_nan(coverage[i]);
}

// Whether a pixel has something of the layer to compare with.
fn is_known(i: u32) -> bool {
    if REAL {
        return is_free(i);
    }
    return is_covered(i);
}

// What one is.
fn unit_at(i: u32) -> vec3f {
    if REAL {
        return larger(photo_at(i), vec3f(LEAST_SHOWN));
    }
    return vec3f(coverage[i]);
}

// Whether two pixels show the same surface.
fn alike(a: u32, b: u32) -> bool {
    let near = depth[a];
    let far = depth[b];
    let cosine = dot(normal_at(a), normal_at(b));
    return cosine > 1.0 - ALIKE && !is_nan(cosine) && is_finite(near) && is_finite(far) && far != 0.0 && abs(near / far - 1.0) < ALIKE;
}

// How many columns lie within `radius` of one, itself among them; if they wrap, each counts once.
fn columns(radius: i32) -> i32 {
    return select(2 * radius + 1, min(2 * radius + 1, i32(rows.width)), WRAP);
}

// The k-th of them; negative if it is outside.
fn column(x: i32, radius: i32, k: i32) -> i32 {
    let width = i32(rows.width);
    let at = x - radius + k;
    if WRAP {
        return (at % width + width) % width;
    }
    return select(-1, at, at >= 0 && at < width);
}

// Which of them is the picture's leftmost.
fn leftmost(x: i32, radius: i32) -> i32 {
    let to_seam = i32(rows.width) - column(x, radius, 0);
    return select(0, to_seam, WRAP && to_seam < columns(radius));
}

// The index of a neighbour's pixel, and whether there is one.
struct Beside {
    index: u32,
    exists: bool,
}

fn beside(x: i32, y: i32) -> Beside {
    let exists = x >= 0 && y >= 0 && y < i32(rows.height);
    return Beside(index_of(rows, vec2i(x, y)), exists);
}

// Changes leave no less than no light.
@compute @workgroup_size(8, 8)
fn limit(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let p = index_of(rows, texel_of(rows, id));
    put(p, larger(layer_at(p), larger(photo_at(p), vec3f(0.0)) * (coverage[p] - 1.0)));
}

// A change as a share of the photo.
fn share_at(i: u32) -> vec3f {
    if is_covered(i) {
        return vec3f(0.0);
    }
    return layer_at(i) / unit_at(i);
}

// Weight of a pixel over which the excess of another is spread.
fn weight_between(a: vec2i, b: vec2i) -> f32 {
    var apart = abs(a - b);
    if WRAP {
        apart.x = min(apart.x, i32(rows.width) - apart.x);
    }
    return 1.0 - f32(apart.x * apart.x + apart.y * apart.y) / f32(2 * (REACH + 1) * (REACH + 1));
}

// Whether the excess of a pixel is spread over another one.
fn receives(from_: u32, to: u32) -> bool {
    return from_ == to || (is_free(to) && alike(from_, to));
}

// What sticks out of the change of real surfaces, and over how much weight it is to be spread.
@compute @workgroup_size(8, 8)
fn exceed(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let p = index_of(rows, texel);
    excess[p] = vec4f(0.0);
    let share = share_at(p);
    let here = abs(luminance(share));
    var largest = 0.0;
    for (var dy = -1; dy <= 1; dy++) {
        for (var k = 0; k < columns(1); k++) {
            let q = beside(column(texel.x, 1, k), texel.y + dy);
            if q.exists && q.index != p {
                let magnitude = abs(luminance(share_at(q.index)));
                largest = select(max(largest, magnitude), largest, is_nan(magnitude));
            }
        }
    }
    let most = max(STANDS_OUT * largest, INVISIBLE);
    if !is_finite(here) || here <= most {
        return;
    }
    var weights = 0.0;
    for (var dy = -REACH; dy <= REACH; dy++) {
        for (var k = 0; k < columns(REACH); k++) {
            let there = vec2i(column(texel.x, REACH, k), texel.y + dy);
            let q = beside(there.x, there.y);
            if q.exists && receives(p, q.index) {
                weights += weight_between(texel, there);
            }
        }
    }
    excess[p] = vec4f(share * (1.0 - most / here), weights);
}

// What sticks out around a pixel comes to it, and goes from it.
@compute @workgroup_size(8, 8)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let p = index_of(rows, texel);
    let shown = photo_at(p);
    let begin = leftmost(texel.x, REACH);
    var value = layer_at(p);
    for (var dy = -REACH; dy <= REACH; dy++) {
        for (var k = 0; k < columns(REACH); k++) {
            let there = vec2i(column(texel.x, REACH, (begin + k) % columns(REACH)), texel.y + dy);
            let q = beside(there.x, there.y);
            if !q.exists {
                continue;
            }
            let from_ = excess[q.index];
            if from_.w > 0.0 && receives(q.index, p) {
                if q.index == p {
                    value -= from_.xyz * shown;
                }
                value += from_.xyz * shown * (weight_between(there, texel) / from_.w);
            }
        }
    }
    put(p, value);
}

// Objects are not darker than black: they show what the darkest of their neighbours does. Columns do not wrap here.
@compute @workgroup_size(8, 8)
fn lighten(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let p = index_of(rows, texel);
    var value = larger(layer_at(p), vec3f(0.0));
    if !is_light(p) {
        value = vec3f(0.0);
        var darkest = -1.0;
        for (var dy = -1; dy <= 1; dy++) {
            for (var k = 0; k < columns(1); k++) {
                let q = beside(column(texel.x, 1, k), texel.y + dy);
                if q.exists && is_covered(q.index) && is_light(q.index) {
                    let shown = larger(layer_at(q.index), vec3f(0.0)) / coverage[q.index];
                    if darkest < 0.0 || luminance(shown) < darkest {
                        darkest = luminance(shown);
                        value = shown * coverage[p];
                    }
                }
            }
        }
    }
    lighter[3u * p] = value.x;
    lighter[3u * p + 1u] = value.y;
    lighter[3u * p + 2u] = value.z;
}

// Whether the layer is no darker than black.
fn is_light(i: u32) -> bool {
    let light = luminance(layer_at(i));
    return light >= 0.0 && !is_nan(light);
}

// Whether the filter has found little to average with: rims of objects, and pixels with few of their kind beside them.
fn has_few(texel: vec2i, p: u32) -> bool {
    if is_covered(p) && coverage[p] < 1.0 {
        return true;
    }
    var same = 0u;
    for (var dy = -1; dy <= 1; dy++) {
        for (var k = 0; k < columns(1); k++) {
            let q = beside(column(texel.x, 1, k), texel.y + dy);
            same += u32(q.exists && q.index != p && is_covered(q.index) == is_covered(p) && alike(p, q.index));
        }
    }
    return same <= FEW;
}

// A number's place in the order of all numbers, and back.
fn rank_of(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
}

fn of_rank(rank: u32) -> f32 {
    return bitcast<f32>(select(~rank, rank & 0x7fffffffu, (rank >> 31u) == 1u));
}

// How far a pixel is outside of what those beside it allow, and how many of them there are.
@compute @workgroup_size(8, 8)
fn stray(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let p = index_of(rows, texel);
    excess[p] = vec4f(0.0);
    let here = layer_at(p) / unit_at(p);
    // Surfaces without change keep that.
    if !is_known(p) || !is_finite3(here) || (REAL && all(layer_at(p) == vec3f(0.0))) {
        return;
    }
    var values: array<vec3f, 9>;
    values[0] = here;
    var count = 1u;
    var least: vec3f;
    var most: vec3f;
    for (var dy = -1; dy <= 1; dy++) {
        for (var k = 0; k < columns(1); k++) {
            let q = beside(column(texel.x, 1, k), texel.y + dy);
            if q.exists && q.index != p && is_known(q.index) {
                let value = layer_at(q.index) / unit_at(q.index);
                least = select(smaller(least, value), value, count == 1u);
                most = select(larger(most, value), value, count == 1u);
                values[count] = value;
                count += 1u;
            }
        }
    }
    if count <= ENOUGH {
        return;
    }
    let few = has_few(texel, p);
    var kept: vec3f;
    if REAL && few {
        for (var channel = 0u; channel < 3u; channel++) {
            var ranks: array<u32, 9>;
            for (var i = 0u; i < count; i++) {
                let rank = rank_of(values[i][channel]);
                var at = i;
                for (; at > 0u && ranks[at - 1u] > rank; at--) {
                    ranks[at] = ranks[at - 1u];
                }
                ranks[at] = rank;
            }
            kept[channel] = (of_rank(ranks[(count - 1u) / 2u]) + of_rank(ranks[count / 2u])) * 0.5;
        }
    } else if REAL {
        kept = smaller(larger(here, least), most);
    } else if few {
        kept = smaller(larger(here, least / AT_RIMS), most * AT_RIMS);
    } else {
        kept = larger(here, least * DARK);
    }
    if any((kept != here) | !are_numbers(kept)) {
        excess[p] = vec4f(here - kept, f32(count - 1u));
    }
}

// What goes beyond its bounds around a pixel comes to it, unless that makes it less than no light, and goes from it.
@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    if !is_held(rows, id) {
        return;
    }
    let texel = texel_of(rows, id);
    let p = index_of(rows, texel);
    let unit = unit_at(p);
    let black = unit * select(0.0, -1.0, REAL);
    let begin = leftmost(texel.x, 1);
    var value = layer_at(p);
    for (var dy = -1; dy <= 1; dy++) {
        for (var k = 0; k < columns(1); k++) {
            let q = beside(column(texel.x, 1, (begin + k) % columns(1)), texel.y + dy);
            if !q.exists {
                continue;
            }
            let from_ = excess[q.index];
            if from_.w > 0.0 && q.index == p {
                value -= from_.xyz * unit;
            } else if from_.w > 0.0 && is_known(p) {
                value = larger(value + from_.xyz * unit / from_.w, smaller(value, black));
            }
        }
    }
    put(p, value);
}
