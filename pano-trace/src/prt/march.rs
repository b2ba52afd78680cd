//! Hierarchical marching of a ray through the depth field.

use super::answer::{Answer, FieldHit};
use super::back_face::Entry;
use super::field::{DepthField, Face, face_axes};
use glam::{Vec2, Vec3};

/// Points nearer to the capture point than this have no direction worth the name; metres.
pub(super) const NEAREST: f32 = 1e-4;
/// How far into the next cell a step goes, in cells; some units in the last place of a coordinate up to 4096.
pub(super) const NUDGE: f32 = 1e-3;

/// How many cells from a gap a layer's slope is read.
pub(super) const CLEAR: f32 = 3.0;

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

impl Stretch {
    /// Inverse planar depth at `s`.
    #[inline]
    fn inverse_at(&self, s: f32) -> f32 {
        self.inverse + self.inverse_along * s
    }

    /// t times the inverse depth at `s`.
    #[inline]
    fn weighted_t_at(&self, s: f32) -> f32 {
        self.weighted_t + self.weighted_t_along * s
    }
}

/// A ray on its way.
struct Progress {
    origin: Vec3,
    direction: Vec3,
    /// Where it ends.
    t_max: f32,
    back_faces: bool,
    /// The nearest back face met so far.
    back_face: Option<FieldHit>,
    /// What the ray meets if it stays behind a front layer until then.
    back_layer: Option<FieldHit>,
    steps: u32,
}

impl Progress {
    /// The nearest of the assumed faces, where they end the ray.
    fn assumed(&self) -> Option<FieldHit> {
        match (self.back_face, self.back_layer) {
            (Some(a), Some(b)) => Some(if a.t <= b.t { a } else { b }),
            (a, b) => a.or(b),
        }
        .filter(|hit| hit.t < self.t_max)
    }

    /// Where the ray ends as far as is known.
    fn end(&self) -> f32 {
        self.assumed().map_or(self.t_max, |hit| hit.t)
    }
}

impl DepthField {
    /// The first crossing of the captured surface, or of a back face assumed at one of its gaps, by the ray from `origin`
    /// along unit `direction`, nearer than `t_max`. Positions are relative to the capture point, in the panorama's frame.
    pub fn march(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Answer {
        self.march_with(origin, direction, t_max, self.back_faces)
    }

    /// The same without back faces.
    pub(super) fn march_surfaces(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Answer {
        self.march_with(origin, direction, t_max, false)
    }

    fn march_with(&self, origin: Vec3, direction: Vec3, t_max: f32, back_faces: bool) -> Answer {
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
        let mut ray = Progress { origin, direction, t_max, back_faces, back_face: None, back_layer: None, steps: self.max_steps };
        for s in stretches[..count].iter().flatten() {
            if s.t_begin < ray.end()
                && let Some(hit) = self.march_stretch(s, &mut ray)
            {
                return Answer::Surface(hit);
            }
            if ray.steps == 0 {
                return Answer::OutOfSteps;
            }
        }
        ray.assumed().map_or(Answer::Left, Answer::BackFace)
    }

    /// The part of the ray that the face sees.
    fn clip(&self, face: usize, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Stretch> {
        let axes = face_axes(face);
        let (o, d) = (axes.transpose_mul_vec3(origin), axes.transpose_mul_vec3(direction));
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

    /// The first surface hit on the stretch. Back faces are noted in `progress` and end it.
    fn march_stretch(&self, ray: &Stretch, progress: &mut Progress) -> Option<FieldHit> {
        let face = &self.faces[ray.face];
        let n = self.n;
        let top = face.pyramid.top();
        // The smallest step in s that moves a whole nudge along the faster axis.
        let length = ray.along.abs().max_element();
        let nudge = if length > 0.0 { (NUDGE / length).min(1.0) } else { 1.0 };
        // Which side of a cell is ahead, and how far one cell is in s. A ray along the other axis never gets there.
        let ahead = |along: f32| if along == 0.0 { (n + 1, 1.0) } else { (usize::from(along > 0.0), 1.0 / along) };
        let (ahead_x, ahead_y) = (ahead(ray.along.x), ahead(ray.along.y));
        let (mut s, mut level) = (0.0f32, top.min(3));
        // A cell of the block that the ray has just passed over.
        let mut passed: Option<(usize, usize)> = None;
        while progress.steps > 0 {
            progress.steps -= 1;
            // The cell is that of a point a nudge farther on; the stretch looked at begins where the last one ended, or a
            // crossing between the two would be missed.
            let next = (s + nudge).min(1.0);
            let p = ray.from + ray.along * next;
            let last = n as i32 - 1;
            let (x, y) = ((p.x as i32).clamp(0, last) as usize, (p.y as i32).clamp(0, last) as usize);
            // The block above is that in which this level was needed, until the ray has left it.
            if let Some((px, py)) = passed.take()
                && ((x ^ px) | (y ^ py)) >> (level + 1) != 0
                && level < top
            {
                level += 1;
            }
            let (cx, cy) = (x >> level, y >> level);
            let size = (1usize << level) as f32;
            let exit = |from: f32, (ahead, per_cell): (usize, f32), c: usize| ((c + ahead) as f32 * size - from) * per_cell;
            let s_exit = exit(ray.from.x, ahead_x, cx).min(exit(ray.from.y, ahead_y, cy)).clamp(next, 1.0);
            let (w0, w1) = (ray.inverse_at(s), ray.inverse_at(s_exit));
            let (near, far) = (w0.max(w1), w0.min(w1));
            let range = face.pyramid.at(level, cx, cy);
            if near >= range.min && far <= range.max {
                if level > 0 {
                    level -= 1;
                    continue;
                }
                if let Some(hit) = self.cross_cell(face, ray, (x, y), (s, s_exit), progress)
                    && hit.t < progress.end()
                {
                    return Some(hit);
                }
            } else {
                passed = Some((x, y));
            }
            if s_exit >= 1.0 || ray.weighted_t_at(s_exit) >= progress.end() * ray.inverse_at(s_exit) {
                return None;
            }
            s = s_exit;
        }
        None
    }

    /// The crossing inside one cell between `s.0` and `s.1`.
    fn cross_cell(
        &self,
        face: &Face,
        ray: &Stretch,
        (x, y): (usize, usize),
        s: (f32, f32),
        progress: &mut Progress,
    ) -> Option<FieldHit> {
        let n = self.n;
        let at_gap = face.gap[y * n + x];
        let root = if at_gap {
            self.cross_quarters(face, ray, (x, y), s, progress)?
        } else {
            cross_bilinear(face.corners(n, x, y), ray, (x, y), s)?
        };
        let t = ray.weighted_t_at(root) / ray.inverse_at(root);
        if t <= 0.0 || !t.is_finite() {
            return None;
        }
        let at = (ray.from + ray.along * root) * (2.0 / n as f32) - 1.0;
        let (normal, back) = self.side(ray.face, at, progress.direction)?;
        Some(FieldHit { t, normal, back, at_gap, hidden_side: None })
    }

    /// At a gap each corner keeps a quarter of the cell, in its own plane. Where the ray passes from one layer behind the
    /// next, the back face there is looked for.
    fn cross_quarters(
        &self,
        face: &Face,
        ray: &Stretch,
        (x, y): (usize, usize),
        (s0, s1): (f32, f32),
        progress: &mut Progress,
    ) -> Option<f32> {
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
            let [value, slope_x, slope_y] = face.quarter(self.n, corner.0, corner.1);
            let surface = |s: f32| {
                let off = ray.from + ray.along * s - Vec2::new(corner.0 as f32, corner.1 as f32);
                (value + slope_x * off.x + slope_y * off.y).max(0.0)
            };
            let (w0, w1) = (ray.inverse_at(e0), ray.inverse_at(e1));
            let (v0, v1) = (surface(e0), surface(e1));
            if let Some((other, v)) = last {
                if !face.gap_between(self.n, other, corner) {
                    // The crack between two quarters of one surface.
                    if (w0 > v) != (w0 > v0) {
                        return Some(e0);
                    }
                } else if progress.back_faces && w0 < v.max(v0) {
                    if w0 > v.min(v0) && v0 > v {
                        // Infinity has no sides: between a frame and the sky light passes.
                        if v > 0.0 {
                            self.enter(face, ray, e0, (corner, other), progress);
                        }
                    } else if w0 > v0 {
                        // In front of what is behind, back in sight.
                        progress.back_layer = None;
                    }
                }
            }
            let (g0, g1) = (w0 - v0, w1 - v1);
            if (g0 > 0.0) != (g1 > 0.0) {
                return Some(e0 + (e1 - e0) * (g0 / (g0 - g1)).clamp(0.0, 1.0));
            }
            last = Some((corner, v1));
        }
        None
    }

    /// Notes what the ray will meet that passes at `s` behind the layer at `corner`, in front of the one at `other`.
    fn enter(
        &self,
        face: &Face,
        ray: &Stretch,
        s: f32,
        (corner, other): ((usize, usize), (usize, usize)),
        progress: &mut Progress,
    ) {
        let axes = face_axes(ray.face);
        let on_cube = |p: Vec3| axes * p;
        let to_face = |cells: Vec2| cells * (2.0 / self.n as f32) - 1.0;
        let middle = ray.from + ray.along * s;
        // Samples right at a gap are those of the nearest texel: a few cells off, the layers' planes are better, if the layers
        // are as wide there.
        let plane = |(i, j): (usize, usize), off: Vec2| {
            let clear = (middle + off * CLEAR).clamp(Vec2::ZERO, Vec2::splat(self.n as f32));
            let (x, y) = ((clear.x as usize).min(self.n - 1), (clear.y as usize).min(self.n - 1));
            if face.gap[y * self.n + x] {
                (Vec2::new(i as f32, j as f32), face.sample_plane(self.n, i, j))
            } else {
                let at = to_face(clear);
                (clear, face.smooth_plane(self.n, at, face.patch(self.n, at)))
            }
        };
        let toward_front = face.toward_front(self.n, corner, other);
        let (_, front) = plane(corner, toward_front);
        let on_front = |cells: Vec2| {
            let at = to_face(cells).extend(1.0);
            let inverse = front.dot(at);
            (inverse > 0.0).then(|| on_cube(at) / inverse)
        };
        // Two points of the rim, a cell apart.
        let along_rim = 0.5 * toward_front.perp();
        let rim = on_front(middle + along_rim).zip(on_front(middle - along_rim)).and_then(|(a, b)| (a - b).try_normalize());
        let (Some(edge), Some(rim)) = (on_front(middle), rim) else { return };
        let step = ray.along / ray.along.abs().max_element().max(f32::MIN_POSITIVE);
        let (sample, back) = plane(other, -step);
        let entry = Entry {
            edge,
            rim,
            back: on_cube(back),
            back_sample: on_cube(to_face(sample).extend(1.0)).normalize(),
            t: ray.weighted_t_at(s) / ray.inverse_at(s),
        };
        let nearest = progress.back_face.map_or(progress.t_max, |b| b.t);
        if let Some(hit) = self.back_face(progress.origin, progress.direction, &entry, nearest)
            && hit.t > 0.0
        {
            progress.back_face = Some(hit);
        }
        progress.back_layer = self.back_layer(progress.origin, progress.direction, &entry);
    }
}

/// The first sign change of (ray − bilinear patch) along the line through the cell: a quadratic in s.
fn cross_bilinear([a, b, c, d]: [f32; 4], ray: &Stretch, (x, y): (usize, usize), (s0, s1): (f32, f32)) -> Option<f32> {
    let gap = |s: f32| {
        let f = ray.from + ray.along * s - Vec2::new(x as f32, y as f32);
        let (top, bottom) = (a + (b - a) * f.x, c + (d - c) * f.x);
        ray.inverse_at(s) - (top + (bottom - top) * f.y)
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
