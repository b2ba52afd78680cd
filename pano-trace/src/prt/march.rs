//! Hierarchical marching of a ray through the depth field.

use super::field::{AXES, DepthField, Face};
use glam::{Vec2, Vec3};

/// Where a ray met the captured surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldHit {
    /// Distance in metres.
    pub t: f32,
    /// Unit normal of the surface on the side the ray came from.
    pub normal: Vec3,
    /// The ray came from behind: it met the side that the panorama has not seen.
    pub back: bool,
    /// The surface was met at a gap, on the half cell of its last sample.
    pub at_gap: bool,
    /// The ray met the hidden side between a front layer and the one behind it, which nothing has seen: the direction of the
    /// front layer's last sample, whose colour is the best guess.
    pub hidden_side: Option<Vec3>,
}

/// Points nearer to the capture point than this have no direction worth the name; metres.
const NEAREST: f32 = 1e-4;
/// How far into the next cell a step goes, in cells; some units in the last place of a coordinate up to 4096.
const NUDGE: f32 = 1e-3;

/// A stretch of the ray in one face, in homogeneous coordinates: everything is linear in s ∈ [0, 1].
struct Stretch {
    face: usize,
    t_begin: f32,
    /// Position on the face in cells.
    from: Vec2,
    along: Vec2,
    /// Inverse planar depth of the ray.
    inverse: f32,
    inverse_along: f32,
    /// t times the inverse depth.
    weighted_t: f32,
    weighted_t_along: f32,
}

impl DepthField {
    /// The first crossing of the captured surface by the ray from `origin` along unit `direction`, nearer than `t_max`.
    /// Positions are relative to the capture point, in the panorama's frame.
    pub fn march(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<FieldHit> {
        let mut stretches: [Option<Stretch>; 6] = [const { None }; 6];
        let mut count = 0;
        for face in 0..6 {
            if let Some(s) = self.clip(face, origin, direction, t_max) {
                let mut k = count;
                while k > 0 && stretches[k - 1].as_ref().is_some_and(|o| o.t_begin > s.t_begin) {
                    stretches.swap(k, k - 1);
                    k -= 1;
                }
                stretches[k] = Some(s);
                count += 1;
            }
        }
        stretches[..count].iter().flatten().find_map(|s| self.march_stretch(s, direction, t_max))
    }

    /// The part of the ray that the face sees.
    fn clip(&self, face: usize, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Stretch> {
        let [forward, right, down] = AXES[face];
        let o = Vec3::new(origin.dot(right), origin.dot(down), origin.dot(forward));
        let d = Vec3::new(direction.dot(right), direction.dot(down), direction.dot(forward));
        // In front of everything the face shows there is nothing to cross; without that part the inverse depth of a ray that
        // passes close by the capture point keeps its precision.
        let nearest = self.faces[face].nearest();
        if nearest == f32::INFINITY {
            return None;
        }
        let near = (0.5 * nearest).max(NEAREST);
        let (mut t0, mut t1) = (0.0f32, t_max);
        // The pyramid |x| ≤ z, |y| ≤ z, cut off at the apex.
        let planes =
            [(o.z - o.x, d.z - d.x), (o.z + o.x, d.z + d.x), (o.z - o.y, d.z - d.y), (o.z + o.y, d.z + d.y), (o.z - near, d.z)];
        for (at, slope) in planes {
            let crossing = -at / slope;
            if slope > 0.0 {
                t0 = t0.max(crossing);
            } else if slope < 0.0 {
                t1 = t1.min(crossing);
            } else if at < 0.0 {
                return None;
            }
        }
        if t0 >= t1 || t0.is_nan() || t1.is_nan() {
            return None;
        }
        let half = 0.5 * self.n as f32;
        let project = |t: f32| {
            if t.is_finite() {
                let p = o + d * t;
                let inverse = 1.0 / p.z.max(near);
                (Vec2::new(p.x, p.y) * inverse, inverse, t * inverse)
            } else {
                // The vanishing point. A ray without end that stays in the face has d.z > 0.
                (Vec2::new(d.x, d.y) / d.z, 0.0, 1.0 / d.z)
            }
        };
        let (p0, w0, tw0) = project(t0);
        let (p1, w1, tw1) = project(t1);
        let cells = |p: Vec2| ((p + 1.0) * half).clamp(Vec2::ZERO, Vec2::splat(self.n as f32));
        let (from, to) = (cells(p0), cells(p1));
        (from.is_finite() && to.is_finite() && w1.is_finite()).then_some(Stretch {
            face,
            t_begin: t0,
            from,
            along: to - from,
            inverse: w0,
            inverse_along: w1 - w0,
            weighted_t: tw0,
            weighted_t_along: tw1 - tw0,
        })
    }

    fn march_stretch(&self, ray: &Stretch, direction: Vec3, t_max: f32) -> Option<FieldHit> {
        let face = &self.faces[ray.face];
        let n = self.n;
        let top = face.pyramid.len() - 1;
        // The smallest step in s that moves a whole nudge along the faster axis.
        let length = ray.along.abs().max_element();
        let nudge = if length > 0.0 { (NUDGE / length).min(1.0) } else { 1.0 };
        let (mut s, mut level) = (0.0f32, top.min(3));
        loop {
            // The cell is that of a point a nudge farther on; the stretch looked at begins where the last one ended, or a
            // crossing between the two would be missed.
            let next = (s + nudge).min(1.0);
            let p = ray.from + ray.along * next;
            let last = n as i32 - 1;
            let (x, y) = ((p.x as i32).clamp(0, last) as usize, (p.y as i32).clamp(0, last) as usize);
            let (cx, cy) = (x >> level, y >> level);
            let size = (1usize << level) as f32;
            let exit = |from: f32, along: f32, c: usize| {
                if along > 0.0 {
                    ((c + 1) as f32 * size - from) / along
                } else if along < 0.0 {
                    (c as f32 * size - from) / along
                } else {
                    f32::INFINITY
                }
            };
            let s_exit = exit(ray.from.x, ray.along.x, cx).min(exit(ray.from.y, ray.along.y, cy)).clamp(next, 1.0);
            let (w0, w1) = (ray.inverse + ray.inverse_along * s, ray.inverse + ray.inverse_along * s_exit);
            let (near, far) = (w0.max(w1), w0.min(w1));
            let range = face.pyramid[level][cy * n.div_ceil(1 << level) + cx];
            if near >= range.min && far <= range.max {
                if level > 0 {
                    level -= 1;
                    continue;
                }
                if let Some(hit) = self.cross_cell(face, ray, (x, y), (s, s_exit), direction)
                    && hit.t < t_max
                {
                    return Some(hit);
                }
            } else if level < top {
                level += 1;
            }
            if s_exit >= 1.0 {
                return None;
            }
            s = s_exit;
        }
    }

    /// The crossing inside one cell between `s.0` and `s.1`.
    fn cross_cell(&self, face: &Face, ray: &Stretch, (x, y): (usize, usize), s: (f32, f32), direction: Vec3) -> Option<FieldHit> {
        let n = self.n;
        let at_gap = face.gap[y * n + x];
        let (root, side) = if at_gap {
            cross_quarters(&|i, j| face.quarter(n, i, j), ray, (x, y), s, self.thickness)?
        } else {
            (cross_bilinear(face.corners(n, x, y), ray, (x, y), s)?, None)
        };
        let w = ray.inverse + ray.inverse_along * root;
        let t = (ray.weighted_t + ray.weighted_t_along * root) / w;
        if t <= 0.0 || !t.is_finite() {
            return None;
        }
        let at = (ray.from + ray.along * root) * (2.0 / n as f32) - 1.0;
        let (_, plane) = face.patch(n, at);
        let [forward, right, down] = AXES[ray.face];
        if let Some((i, j)) = side {
            let sample = Vec2::new(i as f32, j as f32) * (2.0 / n as f32) - 1.0;
            let front = (forward + right * sample.x + down * sample.y).normalize();
            return Some(FieldHit { t, normal: -direction, back: false, at_gap, hidden_side: Some(front) });
        }
        let toward = -(right * plane.x + down * plane.y + forward * plane.z).try_normalize()?;
        let back = toward.dot(direction) > 0.0;
        Some(FieldHit { t, normal: if back { -toward } else { toward }, back, at_gap, hidden_side: None })
    }
}

/// The first sign change of (ray − bilinear patch) along the line through the cell: a quadratic in s.
fn cross_bilinear([a, b, c, d]: [f32; 4], ray: &Stretch, (x, y): (usize, usize), (s0, s1): (f32, f32)) -> Option<f32> {
    let gap = |s: f32| {
        let f = ray.from + ray.along * s - Vec2::new(x as f32, y as f32);
        let (top, bottom) = (a + (b - a) * f.x, c + (d - c) * f.x);
        ray.inverse + ray.inverse_along * s - (top + (bottom - top) * f.y)
    };
    let (g0, g1) = (gap(s0), gap(s1));
    if (g0 > 0.0) == (g1 > 0.0) || s1 <= s0 {
        return None;
    }
    // g is quadratic: two ends and the middle give it whole. Solved by regula falsi with the middle, then one secant
    // step, which is exact to rounding for the nearly straight g of one cell and keeps the root inside.
    let middle = 0.5 * (s0 + s1);
    let gm = gap(middle);
    let (lo, glo, hi, ghi) = if (gm > 0.0) == (g0 > 0.0) { (middle, gm, s1, g1) } else { (s0, g0, middle, gm) };
    let first = lo + (hi - lo) * (glo / (glo - ghi)).clamp(0.0, 1.0);
    let gf = gap(first);
    let (lo, glo, hi, ghi) = if (gf > 0.0) == (glo > 0.0) { (first, gf, hi, ghi) } else { (lo, glo, first, gf) };
    let root = lo + (hi - lo) * (glo / (glo - ghi)).clamp(0.0, 1.0);
    Some(if root.is_finite() { root } else { lo })
}

/// At a gap each corner keeps a quarter of the cell, in its own plane. Where two quarters meet, a side joins the nearer one to
/// what is behind it, as deep as `thickness` times the nearer distance; the sample of the nearer one comes with such a hit.
fn cross_quarters(
    quarter: &dyn Fn(usize, usize) -> [f32; 3],
    ray: &Stretch,
    (x, y): (usize, usize),
    (s0, s1): (f32, f32),
    thickness: f32,
) -> Option<(f32, Option<(usize, usize)>)> {
    let middle = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let cut = |from: f32, along: f32, at: f32| {
        let s = (at - from) / along;
        if s > s0 && s < s1 { s } else { s1 }
    };
    let (cx, cy) = (cut(ray.from.x, ray.along.x, middle.x), cut(ray.from.y, ray.along.y, middle.y));
    let ends = [s0, cx.min(cy), cx.max(cy), s1];
    // The last quarter: its corner and the surface's inverse depth where the ray left it.
    let mut last: Option<((usize, usize), f32)> = None;
    for e in ends.windows(2) {
        let (e0, e1) = (e[0], e[1]);
        if e1 <= e0 {
            continue;
        }
        let p = ray.from + ray.along * (0.5 * (e0 + e1));
        let corner = (x + usize::from(p.x >= middle.x), y + usize::from(p.y >= middle.y));
        let [value, slope_x, slope_y] = quarter(corner.0, corner.1);
        let surface = |s: f32| {
            let off = ray.from + ray.along * s - Vec2::new(corner.0 as f32, corner.1 as f32);
            (value + slope_x * off.x + slope_y * off.y).max(0.0)
        };
        let inverse = |s: f32| ray.inverse + ray.inverse_along * s;
        let (w0, w1) = (inverse(e0), inverse(e1));
        let (v0, v1) = (surface(e0), surface(e1));
        if let Some((other, v)) = last {
            let (near, far) = (v.max(v0), v.min(v0));
            // Infinity has no sides: between a frame and the sky light passes.
            if far > 0.0 && w0 < near && w0 > far && near <= w0 * (1.0 + thickness) {
                return Some((e0, Some(if v > v0 { other } else { corner })));
            }
        }
        let (g0, g1) = (w0 - v0, w1 - v1);
        if (g0 > 0.0) != (g1 > 0.0) {
            return Some((e0 + (e1 - e0) * (g0 / (g0 - g1)).clamp(0.0, 1.0), None));
        }
        last = Some((corner, v1));
    }
    None
}
