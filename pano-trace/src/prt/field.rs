//! The depth of a panorama on the faces of a cube, with min/max pyramids.

use super::pyramid::{Pyramid, Range};
use glam::{Mat3, Vec2, Vec3};
use pano_core::{image::Image, sphere};
use rayon::prelude::*;

/// How depth becomes a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOptions {
    /// Quads along a cube face's side; 0 takes about the panorama's own resolution (⅜ of its width). Higher resolves finer
    /// gaps and costs memory with the square.
    pub resolution: usize,
    /// A step between neighbours is a gap if it exceeds this many times the steps beside it… (3: creases up to 70° stay
    /// closed; chosen on the demo room.) Higher closes more gaps.
    pub gap_contrast: f32,
    /// …and this relative change of depth (0.01: what sensors resolve). Higher closes more gaps.
    pub gap_relative: f32,
    /// Whether a front layer has a back face at its gaps (BASSRT), or a ray passes between any two layers. Things have sides
    /// that the panorama has not seen.
    pub back_faces: bool,
    /// Cells of any level that a ray looks at before it gives up. A ray on a smooth field takes some tens; the longest
    /// possible way has about 12 × the resolution.
    pub max_steps: u32,
}

impl Default for FieldOptions {
    fn default() -> Self {
        Self { resolution: 0, gap_contrast: 3.0, gap_relative: 0.01, back_faces: true, max_steps: 65_536 }
    }
}

/// One face of the cube: samples at the corners of `n` × `n` cells.
#[derive(Clone, Debug)]
pub(super) struct Face {
    /// Inverse planar depth, 1/m; 0 where nothing is. (n + 1)² samples, row-major.
    pub(super) inverse: Vec<f32>,
    /// Whether a cell lies across a gap; n² cells.
    pub(super) gap: Vec<bool>,
    /// Whether the step from a sample to its right neighbour is a gap; n + 1 rows of n.
    pub(super) gap_right: Vec<bool>,
    /// Whether the step from a sample to the one below is a gap; n rows of n + 1.
    pub(super) gap_below: Vec<bool>,
    /// Between which inverse depths its cells lie.
    pub(super) pyramid: Pyramid,
}

/// A panorama's depth, ready for rays. Positions are relative to the capture point, in the panorama's frame.
#[derive(Clone, Debug)]
pub struct DepthField {
    pub(super) n: usize,
    pub(super) faces: Vec<Face>,
    pub(super) back_faces: bool,
    pub(super) max_steps: u32,
}

/// Relative change of depth from which on a step up and the step down next to it are a thing one sample wide, not noise.
const SPIKE: f32 = 0.05;

/// Axes of the six faces: forward, right (image x) and down (image y).
pub(super) const AXES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::Z, Vec3::NEG_Y],
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y],
    [Vec3::Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::NEG_Y, Vec3::X, Vec3::Z],
    [Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y],
    [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
];

/// Turns a face's own axes (right, down, forward) into the panorama's.
#[inline]
pub(super) fn face_axes(face: usize) -> Mat3 {
    let [forward, right, down] = AXES[face];
    Mat3::from_cols(right, down, forward)
}

/// The face that shows direction `d`, and where: x, y in [−1, 1].
#[inline]
pub(super) fn face_from_direction(d: Vec3) -> (usize, Vec2) {
    let a = d.abs();
    let face = if a.x >= a.y && a.x >= a.z {
        usize::from(d.x < 0.0)
    } else if a.y >= a.z {
        2 + usize::from(d.y < 0.0)
    } else {
        4 + usize::from(d.z < 0.0)
    };
    let [forward, right, down] = AXES[face];
    (face, Vec2::new(d.dot(right), d.dot(down)) / d.dot(forward))
}

impl DepthField {
    /// From an equirectangular picture of distances along the ray; not finite or ≤ 0 is nothing.
    pub fn new(depth: &Image<f32>, options: &FieldOptions) -> Self {
        let n = match options.resolution {
            0 => (depth.width() * 3 / 8).next_multiple_of(16).clamp(16, 4096),
            n => n.max(1),
        };
        let samples: Vec<Vec<f32>> = (0..6).map(|face| sample_face(depth, face, n)).collect();
        let faces = samples.into_iter().map(|inverse| Face::new(inverse, n, options)).collect();
        Self { n, faces, back_faces: options.back_faces, max_steps: options.max_steps }
    }

    /// With `inverse` planar depths at the (n + 1)² corners of the cells of one face, and nothing on the others.
    pub(super) fn of_face(face: usize, inverse: Vec<f32>, n: usize, options: &FieldOptions) -> Self {
        let mut faces: Vec<Face> = (0..6).map(|_| Face::nothing()).collect();
        faces[face] = Face::new(inverse, n, options);
        Self { n, faces, back_faces: options.back_faces, max_steps: options.max_steps }
    }

    /// Whether direction `d` points into a cell at a gap or next to one.
    pub fn near_gap(&self, d: Vec3) -> bool {
        let (face, at) = face_from_direction(d);
        let n = self.n as isize;
        let g = (at + 1.0) * (0.5 * n as f32);
        let (i, j) = (g.x as isize, g.y as isize);
        let gap = |x: isize, y: isize| self.faces[face].gap[(y.clamp(0, n - 1) * n + x.clamp(0, n - 1)) as usize];
        (-1..=1).any(|dy| (-1..=1).any(|dx| gap(i + dx, j + dy)))
    }

    /// Whether the surfaces in two directions less than a cell apart are not the same one.
    pub(super) fn gap_between(&self, d0: Vec3, d1: Vec3) -> bool {
        let sample = |d: Vec3| {
            let (face, at) = face_from_direction(d);
            let g = ((at + 1.0) * (0.5 * self.n as f32)).round().clamp(Vec2::ZERO, Vec2::splat(self.n as f32));
            (face, (g.x as usize, g.y as usize))
        };
        let ((face, a), (other, b)) = (sample(d0), sample(d1));
        face != other || (a != b && self.faces[face].gap_between(self.n, a, b))
    }

    /// Inverse distance along unit direction `d`; 0: nothing there.
    pub fn inverse_distance(&self, d: Vec3) -> f32 {
        let (face, at) = face_from_direction(d);
        self.faces[face].patch(self.n, at).0 * d.dot(AXES[face][0])
    }

    /// Inverse distance along unit direction `d` (0: nothing there), and the plane of the surface around as the vector `p`
    /// with p·x = 1 for its points x, from which normals follow.
    pub fn look(&self, d: Vec3) -> (f32, Vec3) {
        let (face, at) = face_from_direction(d);
        let patch = self.faces[face].patch(self.n, at);
        let (inverse, plane) = (patch.0, self.faces[face].smooth_plane(self.n, at, patch));
        (inverse * d.dot(AXES[face][0]), face_axes(face) * plane)
    }
}

fn sample_face(depth: &Image<f32>, face: usize, n: usize) -> Vec<f32> {
    let axes = face_axes(face);
    let usable = |z: f32| if z.is_finite() && z > 0.0 { 1.0 / z } else { 0.0 };
    let mut inverse = vec![0.0; (n + 1) * (n + 1)];
    inverse.par_chunks_mut(n + 1).enumerate().for_each(|(j, row)| {
        for (i, value) in row.iter_mut().enumerate() {
            let at = Vec2::new(i as f32, j as f32) * (2.0 / n as f32) - 1.0;
            let ray = axes * at.extend(1.0);
            let uv = sphere::uv_from_direction(ray);
            let taps = sphere::bilinear_taps(depth.width(), depth.height(), uv).map(|t| (usable(depth.get(t.x, t.y)), t.weight));
            let (lo, hi) = taps.iter().fold((f32::MAX, 0f32), |(lo, hi), t| (lo.min(t.0), hi.max(t.0)));
            // Texels of one surface are interpolated; across a gap the nearest one counts, never a mixture.
            let inverse_distance = if hi <= lo * 1.1 {
                taps.iter().map(|t| t.0 * t.1).sum()
            } else {
                taps.iter().fold((0.0, -1.0), |best, t| if t.1 > best.1 { *t } else { best }).0
            };
            // Planar depth is distance times the cosine to the face's axis, 1/|ray|.
            *value = inverse_distance * ray.length();
        }
    });
    inverse
}

/// The pyramid of one cell with nothing in it.
fn nothing() -> Pyramid {
    Pyramid::new(1, |_, _| Range { min: 0.0, max: 0.0 })
}

impl Face {
    fn new(inverse: Vec<f32>, n: usize, options: &FieldOptions) -> Self {
        let at = |i: usize, j: usize| inverse[j * (n + 1) + i];
        // A step is a gap if it is large against the steps on both sides of it along the same line.
        let is_gap = |line: &dyn Fn(usize) -> f32, k: usize| {
            let (a, b) = (line(k), line(k + 1));
            let step = (b - a).abs();
            if step <= options.gap_relative * a.max(b) {
                return false;
            }
            // What is one sample wide has a step on either side, neither of which excuses the other.
            let spike = step > SPIKE * a.max(b);
            let size = |other: f32| if spike && other * (b - a) < 0.0 { 0.0 } else { other.abs() };
            let before = (k > 0).then(|| size(a - line(k - 1)));
            let after = (k + 2 <= n).then(|| size(line(k + 2) - b));
            // At the border of a face only one side is known.
            let beside = before.unwrap_or(0.0).max(after.unwrap_or(0.0));
            step > options.gap_contrast * beside
        };
        let gap_right: Vec<bool> = (0..(n + 1) * n).into_par_iter().map(|c| is_gap(&|i| at(i, c / n), c % n)).collect();
        let gap_below: Vec<bool> =
            (0..n * (n + 1)).into_par_iter().map(|c| is_gap(&|j| at(c % (n + 1), j), c / (n + 1))).collect();
        let gap: Vec<bool> = (0..n * n)
            .map(|c| {
                let (i, j) = (c % n, c / n);
                gap_right[j * n + i] || gap_right[(j + 1) * n + i] || gap_below[j * (n + 1) + i] || gap_below[j * (n + 1) + i + 1]
            })
            .collect();
        let mut face = Self { inverse, gap, gap_right, gap_below, pyramid: nothing() };
        face.pyramid = Pyramid::new(n, |x, y| face.range(n, x, y));
        face
    }

    /// A face that shows nothing; no ray looks at its samples.
    fn nothing() -> Self {
        Self { inverse: vec![], gap: vec![], gap_right: vec![], gap_below: vec![], pyramid: nothing() }
    }

    /// Between which inverse depths the surface of a cell lies.
    fn range(&self, n: usize, i: usize, j: usize) -> Range {
        let mut range = Range::NOTHING;
        let mut hold = |w: f32| range = range.union(Range { min: w, max: w });
        self.corners(n, i, j).into_iter().for_each(&mut hold);
        if self.gap[j * n + i] {
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                // A quarter reaches half a cell along both of its slopes.
                let [value, slope_x, slope_y] = self.quarter(n, i + x, j + y);
                let reach = 0.5 * (slope_x.abs() + slope_y.abs());
                hold((value - reach).max(0.0));
                hold(value + reach);
            }
        }
        range
    }

    /// Planar depth of the nearest sample, in metres; infinite where nothing is.
    #[inline]
    pub(super) fn nearest(&self) -> f32 {
        1.0 / self.pyramid.whole().max
    }

    /// The four corner samples of a cell: top left, top right, bottom left, bottom right.
    #[inline]
    pub(super) fn corners(&self, n: usize, i: usize, j: usize) -> [f32; 4] {
        let k = j * (n + 1) + i;
        [self.inverse[k], self.inverse[k + 1], self.inverse[k + n + 1], self.inverse[k + n + 2]]
    }

    /// The surface about a sample beside a gap: its value and its slopes per cell along x and y, taken from the neighbours on
    /// its own side of the gap. It goes on as a plane for half a cell.
    pub(super) fn quarter(&self, n: usize, i: usize, j: usize) -> [f32; 3] {
        let k = j * (n + 1) + i;
        let value = self.inverse[k];
        let slope = |before: Option<f32>, after: Option<f32>| match (before, after) {
            (Some(a), Some(b)) => 0.5 * (b - a),
            (Some(a), None) => value - a,
            (None, Some(b)) => b - value,
            (None, None) => 0.0,
        };
        let left = (i > 0 && !self.gap_right[j * n + i - 1]).then(|| self.inverse[k - 1]);
        let right = (i < n && !self.gap_right[j * n + i]).then(|| self.inverse[k + 1]);
        let above = (j > 0 && !self.gap_below[k - (n + 1)]).then(|| self.inverse[k - (n + 1)]);
        let below = (j < n && !self.gap_below[k]).then(|| self.inverse[k + n + 1]);
        [value, slope(left, right), slope(above, below)]
    }

    /// Whether two corners of one cell belong to different surfaces: along its edges every way from one to the other
    /// crosses a gap.
    pub(super) fn gap_between(&self, n: usize, a: (usize, usize), b: (usize, usize)) -> bool {
        let (x, y) = (a.0.min(b.0), a.1.min(b.1));
        let right = |j: usize| a.0 != b.0 && self.gap_right[j * n + x];
        let below = |i: usize| a.1 != b.1 && self.gap_below[y * (n + 1) + i];
        (right(a.1) || below(b.0)) && (below(a.0) || right(b.1))
    }

    /// Inverse planar depth at `at` in [−1, 1]², and the plane (a, b, c) with inverse = a·x + b·y + c through it.
    pub(super) fn patch(&self, n: usize, at: Vec2) -> (f32, Vec3) {
        let g = ((at + 1.0) * (0.5 * n as f32)).clamp(Vec2::ZERO, Vec2::splat(n as f32));
        let (i, j) = ((g.x as usize).min(n - 1), (g.y as usize).min(n - 1));
        let f = g - Vec2::new(i as f32, j as f32);
        let per_unit = 0.5 * n as f32;
        if self.gap[j * n + i] {
            let [value, slope_x, slope_y] = self.quarter(n, i + usize::from(f.x >= 0.5), j + usize::from(f.y >= 0.5));
            let off = g - (g + 0.5).floor();
            let w = (value + slope_x * off.x + slope_y * off.y).max(0.0);
            let (dx, dy) = (slope_x * per_unit, slope_y * per_unit);
            return (w, Vec3::new(dx, dy, w - dx * at.x - dy * at.y));
        }
        let [a, b, c, d] = self.corners(n, i, j);
        let (top, bottom) = (a + (b - a) * f.x, c + (d - c) * f.x);
        let w = top + (bottom - top) * f.y;
        let dx = ((b - a) * (1.0 - f.y) + (d - c) * f.y) * per_unit;
        let dy = (bottom - top) * per_unit;
        (w, Vec3::new(dx, dy, w - dx * at.x - dy * at.y))
    }
}
