// Hierarchical marching of rays through the depth field, surfaces only; see march.rs for the reasons. In homogeneous coordinates on the
// faces of a cube everything along a ray is linear. Includes field.wgsl.

// What a ray met.
struct Met {
    normal: vec3f,
    t: f32,
    // One of the numbers below.
    what: u32,
    at_gap: u32,
    back: u32,
    pad: u32,
}

const LEFT: u32 = 0u;
const SURFACE: u32 = 1u;
const OUT_OF_STEPS: u32 = 2u;
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

// At a gap each corner keeps a quarter of the cell, in its own plane; NONE for no crossing.
fn cross_quarters(ray: Stretch, cell: vec2u, s0: f32, s1: f32) -> f32 {
    let middle = vec2f(cell) + 0.5;
    let cx = cut(ray.begin.x, ray.along.x, middle.x, s0, s1);
    let cy = cut(ray.begin.y, ray.along.y, middle.y, s0, s1);
    var ends = array<f32, 4>(s0, min(cx, cy), max(cx, cy), s1);
    var other = vec2u(0u);
    var last = NONE;
    for (var k = 0; k < 3; k++) {
        let e0 = ends[k];
        let e1 = ends[k + 1];
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
        // The crack between two quarters of one surface.
        if last >= 0.0 && !gap_between(ray.face, other, corner) && (w0 > last) != (w0 > v0) {
            return e0;
        }
        let g0 = w0 - v0;
        let g1 = w1 - v1;
        if (g0 > 0.0) != (g1 > 0.0) {
            return e0 + (e1 - e0) * clamp(g0 / (g0 - g1), 0.0, 1.0);
        }
        other = corner;
        last = v1;
    }
    return NONE;
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

// The first surface on a stretch nearer than `t_max`, as `Met`; `steps` counts down.
fn march_stretch(ray: Stretch, direction: vec3f, t_max: f32, steps: ptr<function, u32>) -> Met {
    var result: Met;
    let n = params.field.cells;
    let top = params.field.levels - 1u;
    let length = max(abs(ray.along.x), abs(ray.along.y));
    let nudge = select(1.0, min(NUDGE / max(length, 1e-30), 1.0), length > 0.0);
    var s = 0.0;
    var level = min(top, 3u);
    // Whether the ray has just passed over a block, and a cell of it.
    var has_passed = false;
    var passed = vec2u(0u);
    while *steps > 0u {
        *steps -= 1u;
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
        if max(w0, w1) >= range.x && min(w0, w1) <= range.y {
            if level > 0u {
                level -= 1u;
                continue;
            }
            let k = sample_of(ray.face, cell.x, cell.y);
            let at_gap = field_gaps(k) & 1u;
            var root = NONE;
            if at_gap == 1u {
                root = cross_quarters(ray, cell, s, s_exit);
            } else {
                let corners = vec4f(field_inverse(k), field_inverse(k + 1u), field_inverse(k + n + 1u), field_inverse(k + n + 2u));
                root = cross_bilinear(corners, ray, cell, s, s_exit);
            }
            if root >= 0.0 {
                let t = weighted_t_along(ray, root) / inverse_along(ray, root);
                if t > 0.0 && is_finite(t) && t < t_max {
                    let at = (ray.begin + ray.along * root) * (2.0 / f32(n)) - 1.0;
                    let side = side_of(ray.face, at, direction);
                    if side.exists {
                        return Met(side.normal, t, SURFACE, at_gap, select(0u, 1u, side.back), 0u);
                    }
                }
            }
        } else {
            has_passed = true;
            passed = cell;
        }
        if s_exit >= 1.0 || (t_max < FAR_AWAY && weighted_t_along(ray, s_exit) >= t_max * inverse_along(ray, s_exit)) {
            return result;
        }
        s = s_exit;
    }
    result.what = OUT_OF_STEPS;
    return result;
}

// The nearest surface on a ray.
fn march_ray(ray: Ray) -> Met {
    var steps = params.field.steps;
    // The faces that see the ray, in the order in which it passes them.
    var done = 0u;
    var result: Met;
    for (var pass_ = 0; pass_ < 6; pass_++) {
        var first: Stretch;
        first.exists = false;
        for (var face = 0u; face < 6u; face++) {
            if ((done >> face) & 1u) == 0u {
                let stretch = clip(face, ray);
                if stretch.exists && (!first.exists || stretch.t_begin < first.t_begin) {
                    first = stretch;
                } else if !stretch.exists {
                    done |= 1u << face;
                }
            }
        }
        if !first.exists || first.t_begin >= ray.t_max {
            break;
        }
        done |= 1u << first.face;
        result = march_stretch(first, ray.direction, ray.t_max, &steps);
        if result.what != LEFT {
            break;
        }
    }
    return result;
}

