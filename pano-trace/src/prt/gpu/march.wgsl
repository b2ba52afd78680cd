// Hierarchical marching of rays through the depth field; see march.rs and back_face.rs for the reasons. In homogeneous coordinates on
// the faces of a cube everything along a ray is linear. Comes after field.wgsl.
//
// A ray that passes behind a layer asks for another ray's way (the back face is the front one, turned). Shaders know no recursion:
// the first ray stops there (`Journey`), and goes on when the other has been marched.

// What a ray met.
struct Met {
    normal: vec3f,
    t: f32,
    // One of the numbers below.
    what: u32,
    at_gap: u32,
    back: u32,
    pad1: u32,
    // The direction that shows what an assumed face is made of.
    shown: vec3f,
    pad2: u32,
}

const LEFT: u32 = 0u;
const SURFACE: u32 = 1u;
const OUT_OF_STEPS: u32 = 2u;
// What is only assumed.
const BACK_FACE: u32 = 3u;
const BACK_LAYER: u32 = 4u;
// No answer yet: the ray passes behind a layer, or comes back in sight.
const ENTERS: u32 = 5u;
const IN_SIGHT: u32 = 6u;
const NONE: f32 = -1.0;

struct Stretch {
    face: u32,
    exists: bool,
    t_begin: f32,
    begin: vec2f,
    along: vec2f,
    inverse: f32,
    inverse_along: f32,
    weighted_t: f32,
    weighted_t_along: f32,
}

// A point of the ray on the face: x, y, inverse planar depth, t times that. Without an end it is the vanishing point.
fn project(o: vec3f, d: vec3f, t: f32, near: f32) -> vec4f {
    if t >= FAR_AWAY {
        return vec4f(d.xy / d.z, 0.0, 1.0 / d.z);
    }
    let p = o + d * t;
    let w = 1.0 / max(p.z, near);
    return vec4f(p.xy * w, w, t * w);
}

// The part of the ray that a face sees.
fn clip(face: u32, ray: Ray) -> Stretch {
    var stretch: Stretch;
    stretch.face = face;
    stretch.exists = false;
    let nearest = params.field.nearest[face / 4u][face % 4u];
    if nearest >= FAR_AWAY {
        return stretch;
    }
    let axes = axes_of(face);
    let o = vec3f(dot(ray.origin, axes[1]), dot(ray.origin, axes[2]), dot(ray.origin, axes[0]));
    let d = vec3f(dot(ray.direction, axes[1]), dot(ray.direction, axes[2]), dot(ray.direction, axes[0]));
    let near = max(0.5 * nearest, NEAREST);
    var at = array<f32, 5>(o.z - o.x, o.z + o.x, o.z - o.y, o.z + o.y, o.z - near);
    var slope = array<f32, 5>(d.z - d.x, d.z + d.x, d.z - d.y, d.z + d.y, d.z);
    var t0 = 0.0;
    var t1 = ray.t_max;
    for (var i = 0; i < 5; i++) {
        if slope[i] > 0.0 {
            t0 = max(t0, -at[i] / slope[i]);
        } else if slope[i] < 0.0 {
            t1 = min(t1, -at[i] / slope[i]);
        } else if at[i] < 0.0 {
            return stretch;
        }
    }
    if !(t0 < t1) {
        return stretch;
    }
    let n = f32(params.field.cells);
    let begin = project(o, d, t0, near);
    let end = project(o, d, t1, near);
    if !is_finite(begin.x) || !is_finite(begin.y) || !is_finite(end.x) || !is_finite(end.y) || !is_finite(end.z) {
        return stretch;
    }
    let to = clamp((end.xy + 1.0) * (0.5 * n), vec2f(0.0), vec2f(n));
    stretch.exists = true;
    stretch.t_begin = t0;
    stretch.begin = clamp((begin.xy + 1.0) * (0.5 * n), vec2f(0.0), vec2f(n));
    stretch.along = to - stretch.begin;
    stretch.inverse = begin.z;
    stretch.inverse_along = end.z - begin.z;
    stretch.weighted_t = begin.w;
    stretch.weighted_t_along = end.w - begin.w;
    return stretch;
}

fn inverse_along(ray: Stretch, s: f32) -> f32 {
    return ray.inverse + ray.inverse_along * s;
}

fn weighted_t_along(ray: Stretch, s: f32) -> f32 {
    return ray.weighted_t + ray.weighted_t_along * s;
}

// Where a coordinate leaves the cell `c` of the given size.
fn exit(start: f32, along: f32, c: u32, size: f32) -> f32 {
    if along > 0.0 {
        return (f32(c + 1u) * size - start) / along;
    }
    return select(FAR_AWAY, (f32(c) * size - start) / along, along < 0.0);
}

// Where along the ray a line through the middle of a cell is crossed, within (s0, s1), or s1.
fn cut(start: f32, along: f32, at: f32, s0: f32, s1: f32) -> f32 {
    let s = (at - start) / along;
    return select(s1, s, along != 0.0 && s > s0 && s < s1);
}

// What came of a cell: where the ray crosses a surface, NONE for no crossing; or that it passes between two layers.
struct Crossing {
    root: f32,
    // ENTERS or IN_SIGHT; LEFT for neither.
    what: u32,
    // In which of three parts of the cell, and where.
    part: u32,
    s: f32,
    corner: vec2u,
    other: vec2u,
}

// At a gap each corner keeps a quarter of the cell, in its own plane. The first `parts` - 1 parts are done, and the passage into the
// next one has been told.
fn cross_quarters(ray: Stretch, cell: vec2u, s0: f32, s1: f32, parts: u32, back_faces: bool) -> Crossing {
    let middle = vec2f(cell) + 0.5;
    let cx = cut(ray.begin.x, ray.along.x, middle.x, s0, s1);
    let cy = cut(ray.begin.y, ray.along.y, middle.y, s0, s1);
    var ends = array<f32, 4>(s0, min(cx, cy), max(cx, cy), s1);
    var result: Crossing;
    result.root = NONE;
    var other = vec2u(0u);
    var last = NONE;
    for (var k = max(parts, 1u) - 1u; k < 3u; k++) {
        let e0 = ends[k];
        let e1 = ends[k + 1u];
        if e1 <= e0 {
            continue;
        }
        let p = ray.begin + ray.along * (0.5 * (e0 + e1));
        let corner = cell + select(vec2u(0u), vec2u(1u), p >= middle);
        let q = quarter(ray.face, corner.x, corner.y);
        let off0 = ray.begin + ray.along * e0 - vec2f(corner);
        let off1 = ray.begin + ray.along * e1 - vec2f(corner);
        let v0 = max(q.x + dot(q.yz, off0), 0.0);
        let v1 = max(q.x + dot(q.yz, off1), 0.0);
        let w0 = inverse_along(ray, e0);
        let w1 = inverse_along(ray, e1);
        if last >= 0.0 {
            if !gap_between(ray.face, other, corner) {
                // The crack between two quarters of one surface.
                if (w0 > last) != (w0 > v0) {
                    result.root = e0;
                    return result;
                }
            } else if back_faces && w0 < max(last, v0) {
                var what = LEFT;
                if w0 > min(last, v0) && v0 > last {
                    // Infinity has no sides.
                    what = select(LEFT, ENTERS, last > 0.0);
                } else if w0 > v0 {
                    what = IN_SIGHT;
                }
                if what != LEFT {
                    return Crossing(NONE, what, k, e0, corner, other);
                }
            }
        }
        let g0 = w0 - v0;
        let g1 = w1 - v1;
        if (g0 > 0.0) != (g1 > 0.0) {
            result.root = e0 + (e1 - e0) * clamp(g0 / (g0 - g1), 0.0, 1.0);
            return result;
        }
        other = corner;
        last = v1;
    }
    return result;
}

// Ray minus bilinear patch.
fn patch_gap(corners: vec4f, ray: Stretch, cell: vec2u, s: f32) -> f32 {
    let f = ray.begin + ray.along * s - vec2f(cell);
    return inverse_along(ray, s) - mix(mix(corners.x, corners.y, f.x), mix(corners.z, corners.w, f.x), f.y);
}

// The first sign change of a quadratic: regula falsi with the middle, then one secant step. NONE for no crossing.
fn cross_bilinear(corners: vec4f, ray: Stretch, cell: vec2u, s0: f32, s1: f32) -> f32 {
    let g0 = patch_gap(corners, ray, cell, s0);
    let g1 = patch_gap(corners, ray, cell, s1);
    if (g0 > 0.0) == (g1 > 0.0) || s1 <= s0 {
        return NONE;
    }
    let middle = 0.5 * (s0 + s1);
    let gm = patch_gap(corners, ray, cell, middle);
    var lo = vec2f(s0, g0);
    var hi = vec2f(middle, gm);
    if (gm > 0.0) == (g0 > 0.0) {
        lo = vec2f(middle, gm);
        hi = vec2f(s1, g1);
    }
    let first = lo.x + (hi.x - lo.x) * clamp(lo.y / (lo.y - hi.y), 0.0, 1.0);
    let gf = patch_gap(corners, ray, cell, first);
    if (gf > 0.0) == (lo.y > 0.0) {
        lo = vec2f(first, gf);
    } else {
        hi = vec2f(first, gf);
    }
    let root = lo.x + (hi.x - lo.x) * clamp(lo.y / (lo.y - hi.y), 0.0, 1.0);
    return select(lo.x, root, is_finite(root));
}

// A ray on its way.
struct Journey {
    ray: Ray,
    // Faces of the cube that are behind it, as bits.
    done: u32,
    steps: u32,
    stretch: Stretch,
    // On the stretch: where, on which level of the pyramid.
    s: f32,
    level: u32,
    // Parts of the cell that are done, and one more; 0 before the cell.
    parts: u32,
    // The passage that it stopped at.
    passage: Crossing,
}

fn journey_of(ray: Ray) -> Journey {
    var journey: Journey;
    journey.ray = ray;
    journey.steps = params.field.steps;
    return journey;
}

// Goes on to the stretch in the next face that sees the ray; false if there is none before `end`.
fn next_stretch(journey: ptr<function, Journey>, end: f32) -> bool {
    var first: Stretch;
    first.exists = false;
    for (var face = 0u; face < 6u; face++) {
        if (((*journey).done >> face) & 1u) == 0u {
            let stretch = clip(face, (*journey).ray);
            if stretch.exists && (!first.exists || stretch.t_begin < first.t_begin) {
                first = stretch;
            } else if !stretch.exists {
                (*journey).done |= 1u << face;
            }
        }
    }
    if !first.exists || first.t_begin >= end {
        return false;
    }
    (*journey).done |= 1u << first.face;
    (*journey).stretch = first;
    (*journey).s = 0.0;
    (*journey).level = min(params.field.levels - 1u, 3u);
    (*journey).parts = 0u;
    return true;
}

// The first surface nearer than `end`, or the next passage between layers.
fn march_on(journey: ptr<function, Journey>, end: f32, back_faces: bool) -> Met {
    var result: Met;
    let n = params.field.cells;
    let top = params.field.levels - 1u;
    // Whether the ray has just passed over a block, and a cell of it.
    var has_passed = false;
    var passed = vec2u(0u);
    while (*journey).steps > 0u {
        if !(*journey).stretch.exists {
            if !next_stretch(journey, end) {
                return result;
            }
            has_passed = false;
        }
        let ray = (*journey).stretch;
        let length = max(abs(ray.along.x), abs(ray.along.y));
        let nudge = select(1.0, min(NUDGE / max(length, 1e-30), 1.0), length > 0.0);
        let s = (*journey).s;
        var level = (*journey).level;
        // What stopped in a cell goes on there.
        (*journey).steps -= select(0u, 1u, (*journey).parts == 0u);
        let next = min(s + nudge, 1.0);
        let p = ray.begin + ray.along * next;
        let cell = vec2u(clamp(vec2i(p), vec2i(0), vec2i(i32(n) - 1)));
        if has_passed && level < top && any((cell ^ passed) >> vec2u(level + 1u) != vec2u(0u)) {
            level += 1u;
        }
        has_passed = false;
        let c = cell >> vec2u(level);
        let size = f32(1u << level);
        let leaves = min(exit(ray.begin.x, ray.along.x, c.x, size), exit(ray.begin.y, ray.along.y, c.y, size));
        let s_exit = clamp(leaves, next, 1.0);
        let w0 = inverse_along(ray, s);
        let w1 = inverse_along(ray, s_exit);
        let range = range_of(ray.face, level, c.x, c.y);
        (*journey).level = level;
        if max(w0, w1) >= range.x && min(w0, w1) <= range.y {
            if level > 0u {
                (*journey).level = level - 1u;
                continue;
            }
            let k = sample_of(ray.face, cell.x, cell.y);
            let at_gap = field_gaps(k) & 1u;
            var root = NONE;
            if at_gap == 1u {
                let crossing = cross_quarters(ray, cell, s, s_exit, (*journey).parts, back_faces);
                if crossing.what != LEFT {
                    (*journey).parts = crossing.part + 1u;
                    (*journey).passage = crossing;
                    result.what = crossing.what;
                    return result;
                }
                root = crossing.root;
            } else {
                let below = k + n + 1u;
                let corners = vec4f(field_inverse(k), field_inverse(k + 1u), field_inverse(below), field_inverse(below + 1u));
                root = cross_bilinear(corners, ray, cell, s, s_exit);
            }
            if root >= 0.0 {
                let t = weighted_t_along(ray, root) / inverse_along(ray, root);
                if t > 0.0 && is_finite(t) && t < end {
                    let at = (ray.begin + ray.along * root) * (2.0 / f32(n)) - 1.0;
                    let side = side_of(ray.face, at, (*journey).ray.direction);
                    if side.exists {
                        return Met(side.normal, t, SURFACE, at_gap, select(0u, 1u, side.back), 0u, vec3f(0.0), 0u);
                    }
                }
            }
        } else {
            has_passed = true;
            passed = cell;
        }
        (*journey).parts = 0u;
        (*journey).s = s_exit;
        if s_exit >= 1.0 || (end < FAR_AWAY && weighted_t_along(ray, s_exit) >= end * inverse_along(ray, s_exit)) {
            (*journey).stretch.exists = false;
        }
    }
    result.what = OUT_OF_STEPS;
    return result;
}

// Unit direction, in cells, across a gap between a sample on the front layer and one behind: to where the samples around that are nearer
// to the front layer lie on the average.
fn toward_front(face: u32, front: vec2i, behind: vec2i) -> vec2f {
    let n = i32(params.field.cells);
    let near = field_inverse(sample_of(face, u32(front.x), u32(front.y)));
    let far = field_inverse(sample_of(face, u32(behind.x), u32(behind.y)));
    let radius = f32(RIM_REACH);
    var toward = vec2f(0.0);
    for (var y = -i32(RIM_REACH); y <= i32(RIM_REACH); y++) {
        for (var x = -i32(RIM_REACH); x <= i32(RIM_REACH); x++) {
            let p = front + vec2i(x, y);
            let mirror = front + behind - p;
            let from_middle = vec2f(p * 2 - front - behind) * 0.5;
            let weight = 1.0 - dot(from_middle, from_middle) / (radius * radius);
            if weight > 0.0 && all(p >= vec2i(0)) && all(p <= vec2i(n)) && all(mirror >= vec2i(0)) && all(mirror <= vec2i(n)) {
                let value = field_inverse(sample_of(face, u32(p.x), u32(p.y)));
                toward += from_middle * (weight * clamp((2.0 * value - near - far) / (near - far), -1.0, 1.0));
            }
        }
    }
    let inverse = 1.0 / sqrt(dot(toward, toward));
    if is_finite(inverse) && inverse > 0.0 {
        return toward * inverse;
    }
    return normalize(vec2f(front - behind));
}

// A ray crossing the gap beside a front layer, going behind it.
struct Entry {
    edge: vec3f,
    t: f32,
    rim: vec3f,
    exists: bool,
    back: vec3f,
    back_sample: vec3f,
}

// A layer's plane near a passage, in the face's frame, and the place it was read at, in cells.
struct Layer {
    plane: vec3f,
    at: vec2f,
}

fn layer_at(face: u32, sample: vec2u, clear_of_gap: vec2f) -> Layer {
    let n = f32(params.field.cells);
    let clear = clamp(clear_of_gap, vec2f(0.0), vec2f(n));
    let cell = cell_of(clear);
    if (field_gaps(sample_of(face, cell.x, cell.y)) & 1u) != 0u {
        let place = vec2f(sample) * (2.0 / n) - 1.0;
        let slopes = slopes_at(face, sample.x, sample.y) * (0.5 * n);
        return Layer(vec3f(slopes, field_inverse(sample_of(face, sample.x, sample.y)) - dot(slopes, place)), vec2f(sample));
    }
    let place = clear * (2.0 / n) - 1.0;
    return Layer(smooth_plane(face, place, patch_at(face, place)), clear);
}

fn enter(journey: ptr<function, Journey>) -> Entry {
    let passage = (*journey).passage;
    let ray = (*journey).stretch;
    let per_cell = 2.0 / f32(params.field.cells);
    let middle = ray.begin + ray.along * passage.s;
    let toward = toward_front(ray.face, vec2i(passage.corner), vec2i(passage.other));
    let front = layer_at(ray.face, passage.corner, middle + toward * CLEAR);
    var entry: Entry;
    // The rim's middle, and a point on either side of it, half a cell away.
    let along_rim = 0.5 * vec2f(-toward.y, toward.x);
    var points: array<vec3f, 3>;
    for (var k = 0; k < 3; k++) {
        let at = vec3f((middle + along_rim * f32(k - 1)) * per_cell - 1.0, 1.0);
        let inverse = dot(front.plane, at);
        if inverse <= 0.0 {
            return entry;
        }
        points[k] = from_face(ray.face, at) / inverse;
    }
    let rim = points[2] - points[0];
    let rim_inverse = 1.0 / sqrt(dot(rim, rim));
    entry.exists = is_finite(rim_inverse) && rim_inverse > 0.0;
    entry.edge = points[1];
    entry.rim = rim * rim_inverse;
    let step = ray.along / max(max(abs(ray.along.x), abs(ray.along.y)), 1e-37);
    let back = layer_at(ray.face, passage.other, middle - step * CLEAR);
    entry.back = from_face(ray.face, back.plane);
    entry.back_sample = normalize(from_face(ray.face, vec3f(back.at * per_cell - 1.0, 1.0)));
    entry.t = weighted_t_along(ray, passage.s) / inverse_along(ray, passage.s);
    return entry;
}

// A quarter turn about unit `axis`, there or back.
fn quarter_turn(axis: vec3f, v: vec3f, way: f32) -> vec3f {
    return axis * dot(axis, v) + way * cross(axis, v);
}

// The nearest surface on a ray, or what is assumed at its gaps.
fn march_ray(ray: Ray) -> Met {
    let back_faces = params.field.back_faces == 1u;
    var journey = journey_of(ray);
    // The nearest back face so far, and the layer that ends the ray if it stays behind the front one until then.
    var face: Met;
    var layer: Met;
    var answer: Met;
    loop {
        var assumed: Met;
        if face.what != LEFT && face.t < ray.t_max {
            assumed = face;
        }
        if layer.what != LEFT && layer.t < ray.t_max && (assumed.what == LEFT || layer.t < assumed.t) {
            assumed = layer;
        }
        let end = select(assumed.t, ray.t_max, assumed.what == LEFT);
        let met = march_on(&journey, end, back_faces);
        if met.what < ENTERS {
            answer = met;
            if met.what == LEFT {
                answer = assumed;
            }
            break;
        }
        if met.what == IN_SIGHT {
            layer.what = LEFT;
            continue;
        }
        let entry = enter(&journey);
        if !entry.exists {
            continue;
        }
        // Turned back, the ray meets the front layer from behind where it meets the back face.
        let outward = normalize(entry.edge);
        let inward = ray.direction - outward * dot(ray.direction, outward);
        let way = select(1.0, -1.0, dot(quarter_turn(entry.rim, outward, 1.0), inward) < 0.0);
        let crossing = ray.origin + ray.direction * entry.t;
        let start = entry.edge + quarter_turn(entry.rim, crossing - entry.edge, way);
        let turned = quarter_turn(entry.rim, ray.direction, way);
        let most = select(face.t, ray.t_max, face.what == LEFT);
        var other = journey_of(Ray(start, select(most - entry.t, FAR_AWAY, most >= FAR_AWAY), turned, 0u));
        let front = march_on(&other, other.ray.t_max, false);
        if front.what == SURFACE && front.back == 1u && entry.t + front.t > 0.0 {
            let q = normalize(start + turned * front.t);
            var normal = quarter_turn(entry.rim, smooth_normal(q, turned, Side(front.normal, true, true)), -way);
            normal = select(normal, -normal, dot(normal, ray.direction) > 0.0);
            face = Met(normal, entry.t + front.t, BACK_FACE, 0u, 0u, 0u, q, 0u);
        }
        layer.what = LEFT;
        let approach = dot(entry.back, ray.direction);
        let t = (1.0 - dot(entry.back, ray.origin)) / approach;
        let back_inverse = 1.0 / sqrt(dot(entry.back, entry.back));
        if approach > 0.0 && t > entry.t && is_finite(t) && is_finite(back_inverse) && back_inverse > 0.0 {
            layer = Met(entry.back * -back_inverse, t, BACK_LAYER, 0u, 0u, 0u, entry.back_sample, 0u);
        }
    }
    return answer;
}

