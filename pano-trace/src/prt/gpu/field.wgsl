// The depth of a panorama on the faces of a cube: samples, gaps, ranges, and which way the surface faces; see field.rs, slopes.rs and
// pyramid.rs. A shader that includes this has a `Field` in its uniform `params` and binds, in this order:
// - `inverses`: inverse planar depth, (n + 1)² samples a face; 0 where nothing is;
// - `gaps`: as many sets of bits: 1 the cell lies across a gap, 2 the step to the right is one, 4 the step down is one;
// - `base` and `upper`: smallest and largest inverse depth of the cells of each face, and of the levels above them, packed and in tiles.

struct Field {
    // Cells along a face, levels of the pyramid, cells that a ray may look at.
    cells: u32,
    levels: u32,
    steps: u32,
    // 1 if layers have back faces at their gaps.
    back_faces: u32,
    // Planar depth of the nearest sample of each face; FAR_AWAY if it has none.
    nearest: array<vec4f, 2>,
    // Where each level begins in `field_upper`, of one face; and in the last one, how many numbers that are in all.
    begins: array<vec4u, 4>,
}

const FAR_AWAY: f32 = 3e38;

fn field_inverse(i: u32) -> f32 {
    return inverses[i];
}

fn field_gaps(i: u32) -> u32 {
    return gaps[i];
}

fn field_base(i: u32) -> u32 {
    return base[i];
}

fn field_upper(i: u32) -> u32 {
    return upper[i];
}

// Forward, right and down of a face, as rows.
fn axes_of(face: u32) -> mat3x3f {
    switch face {
        case 0u: { return mat3x3f(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0), vec3f(0.0, -1.0, 0.0)); }
        case 1u: { return mat3x3f(vec3f(-1.0, 0.0, 0.0), vec3f(0.0, 0.0, -1.0), vec3f(0.0, -1.0, 0.0)); }
        case 2u: { return mat3x3f(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, -1.0)); }
        case 3u: { return mat3x3f(vec3f(0.0, -1.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0)); }
        case 4u: { return mat3x3f(vec3f(0.0, 0.0, 1.0), vec3f(-1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0)); }
        default: { return mat3x3f(vec3f(0.0, 0.0, -1.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0)); }
    }
}

// The index of a sample, and of its bits.
fn sample_of(face: u32, i: u32, j: u32) -> u32 {
    let side = params.field.cells + 1u;
    return (face * side + j) * side + i;
}

// The inverse depth that a bound of a range stands for.
fn unpacked(code: u32) -> f32 {
    if code == 0u {
        return 0.0;
    }
    return select(bitcast<f32>((code + BIAS) << SHIFT), FAR_AWAY, code == 0xffffu);
}

fn range_of(face: u32, level: u32, x: u32, y: u32) -> vec2f {
    let side = (params.field.cells + (1u << level) - 1u) >> level;
    let across = (side + TILE - 1u) / TILE;
    let at = ((y / TILE * across + x / TILE) * TILE + y % TILE) * TILE + x % TILE;
    var packed: u32;
    if level == 0u {
        packed = field_base(face * across * across * TILE * TILE + at);
    } else {
        let begin = params.field.begins[(level - 1u) / 4u][(level - 1u) % 4u];
        packed = field_upper(face * params.field.begins[3][3] + begin + at);
    }
    return vec2f(unpacked(packed & 0xffffu), unpacked(packed >> 16u));
}

// The surface about a sample beside a gap: its value and its slopes per cell, from the neighbours on its own side of it.
fn quarter(face: u32, i: u32, j: u32) -> vec3f {
    let n = params.field.cells;
    let k = sample_of(face, i, j);
    let row = n + 1u;
    let value = field_inverse(k);
    var slopes = vec2f(0.0);
    let left = i > 0u && (field_gaps(k - min(k, 1u)) & 2u) == 0u;
    let right = i < n && (field_gaps(k) & 2u) == 0u;
    let above = j > 0u && (field_gaps(k - min(k, row)) & 4u) == 0u;
    let below = j < n && (field_gaps(k) & 4u) == 0u;
    if left && right {
        slopes.x = 0.5 * (field_inverse(k + 1u) - field_inverse(k - 1u));
    } else if left {
        slopes.x = value - field_inverse(k - 1u);
    } else if right {
        slopes.x = field_inverse(k + 1u) - value;
    }
    if above && below {
        slopes.y = 0.5 * (field_inverse(k + row) - field_inverse(k - row));
    } else if above {
        slopes.y = value - field_inverse(k - row);
    } else if below {
        slopes.y = field_inverse(k + row) - value;
    }
    return vec3f(value, slopes);
}

// Whether two corners of one cell belong to different surfaces: every way along its edges crosses a gap.
fn gap_between(face: u32, a: vec2u, b: vec2u) -> bool {
    let lo = min(a, b);
    let right_a = a.x != b.x && (field_gaps(sample_of(face, lo.x, a.y)) & 2u) != 0u;
    let right_b = a.x != b.x && (field_gaps(sample_of(face, lo.x, b.y)) & 2u) != 0u;
    let below_a = a.y != b.y && (field_gaps(sample_of(face, a.x, lo.y)) & 4u) != 0u;
    let below_b = a.y != b.y && (field_gaps(sample_of(face, b.x, lo.y)) & 4u) != 0u;
    return (right_a || below_b) && (below_a || right_b);
}

// The surface at a place of a face: inverse planar depth, and the plane (a, b, c) with inverse = a·x + b·y + c through it.
struct Patch {
    inverse: f32,
    plane: vec3f,
}

// A place in [-1, 1]² of a face, in cells.
fn cells_of(at: vec2f) -> vec2f {
    let n = f32(params.field.cells);
    return clamp((at + 1.0) * (0.5 * n), vec2f(0.0), vec2f(n));
}

fn cell_of(g: vec2f) -> vec2u {
    return min(vec2u(g), vec2u(params.field.cells - 1u));
}

fn patch_at(face: u32, at: vec2f) -> Patch {
    let g = cells_of(at);
    let cell = cell_of(g);
    let f = g - vec2f(cell);
    let per_unit = 0.5 * f32(params.field.cells);
    let k = sample_of(face, cell.x, cell.y);
    if (field_gaps(k) & 1u) != 0u {
        let corner = cell + select(vec2u(0u), vec2u(1u), f >= vec2f(0.5));
        let q = quarter(face, corner.x, corner.y);
        let w = max(q.x + dot(q.yz, g - floor(g + 0.5)), 0.0);
        let slopes = q.yz * per_unit;
        return Patch(w, vec3f(slopes, w - dot(slopes, at)));
    }
    let below = k + params.field.cells + 1u;
    let a = field_inverse(k);
    let b = field_inverse(k + 1u);
    let c = field_inverse(below);
    let d = field_inverse(below + 1u);
    let top = a + (b - a) * f.x;
    let bottom = c + (d - c) * f.x;
    let w = top + (bottom - top) * f.y;
    let slopes = vec2f((b - a) * (1.0 - f.y) + (d - c) * f.y, bottom - top) * per_unit;
    return Patch(w, vec3f(slopes, w - dot(slopes, at)));
}

// Pairs to put in order, one after another, that sort eight numbers.
fn sorted_median(values: array<f32, 8>, count: u32) -> f32 {
    var steps = values;
    var network = SORTING_NETWORK;
    for (var i = 0u; i < SORTING_PAIRS; i++) {
        let a = network[2u * i];
        let b = network[2u * i + 1u];
        let lo = min(steps[a], steps[b]);
        steps[b] = max(steps[a], steps[b]);
        steps[a] = lo;
    }
    return select(0.5 * (steps[3] + steps[4]), steps[3], count % 2u == 1u);
}

// Median of the steps of inverse depth around a sample, along a row (`bit` 2) or a column (4), up to the first gap.
fn median_step(face: u32, i: u32, j: u32, bit: u32) -> f32 {
    let n = params.field.cells;
    let stride = select(n + 1u, 1u, bit == 2u);
    let k = select(j, i, bit == 2u);
    let at = sample_of(face, i, j);
    let reach = max(min(SLOPE_REACH, min(k, n - k)), 1u);
    // What is missing is thought half below and half above all.
    var steps: array<f32, 8>;
    var count = 0u;
    for (var back = 1u; back <= min(reach, k); back++) {
        let c = at - back * stride;
        if (field_gaps(c) & bit) != 0u {
            break;
        }
        steps[count] = field_inverse(c + stride) - field_inverse(c);
        count += 1u;
    }
    for (var ahead = 0u; ahead < min(reach, n - k); ahead++) {
        let c = at + ahead * stride;
        if (field_gaps(c) & bit) != 0u {
            break;
        }
        steps[count] = field_inverse(c + stride) - field_inverse(c);
        count += 1u;
    }
    if count == 0u {
        return 0.0;
    }
    for (var missing = count; missing < 8u; missing++) {
        steps[missing] = select(FAR_AWAY, -FAR_AWAY, missing - count < (8u - count) / 2u);
    }
    return sorted_median(steps, count);
}

// How inverse depth changes per cell at a sample.
fn slopes_at(face: u32, i: u32, j: u32) -> vec2f {
    return vec2f(median_step(face, i, j, 2u), median_step(face, i, j, 4u));
}

// Whether the steps along each axis of a cell and of those before and after it are alike within `tolerance`.
fn is_even(face: u32, cell: vec2u, tolerance: f32) -> bool {
    let n = params.field.cells;
    if any(cell == vec2u(0u)) || any(cell + 2u > vec2u(n)) {
        return false;
    }
    let k = sample_of(face, cell.x, cell.y);
    var even = true;
    for (var axis = 0u; axis < 2u; axis++) {
        let stride = select(1u, n + 1u, axis == 1u);
        let across = select(n + 1u, 1u, axis == 1u);
        let middle = field_inverse(k + stride) - field_inverse(k);
        var others = array<u32, 3>(k - stride, k + stride, k + across);
        for (var o = 0; o < 3; o++) {
            let step = field_inverse(others[o] + stride) - field_inverse(others[o]);
            even = even && abs(step - middle) <= tolerance;
        }
    }
    return even;
}

// The plane through `at` and the surface there, with the slopes that it has around.
fn smooth_plane(face: u32, at: vec2f, patch_: Patch) -> vec3f {
    let per_unit = 0.5 * f32(params.field.cells);
    let g = cells_of(at);
    let cell = cell_of(g);
    if is_even(face, cell, EVEN * patch_.inverse / per_unit) {
        return patch_.plane;
    }
    let f = g - vec2f(cell);
    var slopes = vec2f(0.0);
    let at_gap = (field_gaps(sample_of(face, cell.x, cell.y)) & 1u) != 0u;
    for (var k = 0u; k < 4u; k++) {
        let d = vec2u(k % 2u, k / 2u);
        let nearest = select(vec2f(0.0), vec2f(1.0), (f >= vec2f(0.5)) == (d == vec2u(1u)));
        let weights = select(select(1.0 - f, f, d == vec2u(1u)), nearest, at_gap);
        let weight = weights.x * weights.y;
        if weight > 0.0 {
            slopes += slopes_at(face, cell.x + d.x, cell.y + d.y) * weight;
        }
    }
    slopes *= per_unit;
    return vec3f(slopes, patch_.inverse - dot(slopes, at));
}

// The face that shows direction `d`.
fn face_of(d: vec3f) -> u32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return select(0u, 1u, d.x < 0.0);
    }
    if a.y >= a.z {
        return select(2u, 3u, d.y < 0.0);
    }
    return select(4u, 5u, d.z < 0.0);
}

// The vector of a face's own frame (right, down, forward) in the panorama's.
fn from_face(face: u32, v: vec3f) -> vec3f {
    let axes = axes_of(face);
    return axes[1] * v.x + axes[2] * v.y + axes[0] * v.z;
}

// Where direction `d` points: the face, the place in [-1, 1]² of it, and the part of `d` along its axis.
struct Spot {
    face: u32,
    at: vec2f,
    ahead: f32,
}

fn spot_of(d: vec3f) -> Spot {
    let face = face_of(d);
    let axes = axes_of(face);
    let ahead = dot(d, axes[0]);
    return Spot(face, vec2f(dot(d, axes[1]), dot(d, axes[2])) / ahead, ahead);
}

// Inverse distance along unit `d`; 0: nothing there.
fn inverse_distance(d: vec3f) -> f32 {
    let spot = spot_of(d);
    return patch_at(spot.face, spot.at).inverse * spot.ahead;
}

// Whether `d` points into a cell at a gap or next to one.
fn near_gap(d: vec3f) -> bool {
    let spot = spot_of(d);
    let n = i32(params.field.cells);
    let cell = vec2i((spot.at + 1.0) * (0.5 * f32(n)));
    var near = false;
    for (var k = 0; k < 9; k++) {
        let beside = vec2u(clamp(cell + vec2i(k % 3, k / 3) - 1, vec2i(0), vec2i(n - 1)));
        near = near || (field_gaps(sample_of(spot.face, beside.x, beside.y)) & 1u) != 0u;
    }
    return near;
}

// What is seen along `d`: inverse distance (0: nothing), and the plane of the surface around; see DepthField::look.
struct Seen {
    inverse: f32,
    plane: vec3f,
}

fn look(d: vec3f) -> Seen {
    let spot = spot_of(d);
    let patch_ = patch_at(spot.face, spot.at);
    return Seen(patch_.inverse * spot.ahead, from_face(spot.face, smooth_plane(spot.face, spot.at, patch_)));
}

// Which way a surface faces, as a ray meets it.
struct Side {
    normal: vec3f,
    back: bool,
    // A surface through the capture point has no side.
    exists: bool,
}

fn side_of(face: u32, at: vec2f, direction: vec3f) -> Side {
    let n = -from_face(face, patch_at(face, at).plane);
    let inverse = 1.0 / sqrt(dot(n, n));
    let toward = n * inverse;
    let back = dot(toward, direction) > 0.0;
    return Side(select(toward, -toward, back), back, is_finite(inverse) && inverse > 0.0);
}

// The normal of a plane with the slopes around a hit, the facet's if it does not face the ray; see DepthField::smooth_normal.
fn smoothed(plane: vec3f, direction: vec3f, side: Side) -> vec3f {
    let inverse = 1.0 / sqrt(dot(plane, plane));
    let normal = plane * select(-inverse, inverse, side.back);
    return select(side.normal, normal, is_finite(inverse) && inverse > 0.0 && dot(normal, direction) <= 0.0);
}

// The same at a hit in direction `at`.
fn smooth_normal(at: vec3f, direction: vec3f, side: Side) -> vec3f {
    return smoothed(look(at).plane, direction, side);
}

