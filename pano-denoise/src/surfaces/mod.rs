//! What is seen at each pixel, as edge-stopping filters compare it: places of taps, tangent planes, normals.

#[cfg(feature = "gpu")]
pub(crate) mod gpu;

use glam::Vec3;
use pano_core::image::Image;
use rayon::prelude::*;

/// Smallest depth told apart, in the scene's unit: keeps inverse depths and their differences finite in `f32`.
const MIN_DEPTH: f32 = 1e-30;
/// From here on depth means that nothing is there.
const MAX_DEPTH: f32 = 1e9;

/// A tap's place: index, and whether a pole was stepped over on the way (its columns then run backwards).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) index: usize,
    over_pole: bool,
}

/// Inverse depth and its change per pixel to the right and down.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    inverse: f32,
    right: f32,
    down: f32,
}

/// The surfaces of a frame.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    slope: Vec<Slope>,
    normal: &'a [Vec3],
    width: usize,
    height: usize,
    wrap: bool,
}

impl<'a> Surfaces<'a> {
    /// From pictures of one size; `wrap`: a whole panorama.
    pub(crate) fn new(depth: &Image<f32>, normal: &'a Image<Vec3>, wrap: bool) -> Self {
        let (width, height) = depth.size();
        let mut surfaces = Self { slope: Vec::new(), normal: normal.data(), width, height, wrap };
        surfaces.slope = surfaces.slopes(depth.data());
        surfaces
    }

    /// The pixel `(dx, dy)` away from `(x, y)`; `None` outside a picture that does not wrap.
    #[inline]
    pub(crate) fn place(&self, x: usize, y: usize, dx: isize, dy: isize) -> Option<Place> {
        let (w, h) = (self.width as isize, self.height as isize);
        let (x, y) = (x as isize + dx, y as isize + dy);
        if (0..w).contains(&x) && (0..h).contains(&y) {
            return Some(Place { index: (y * w + x) as usize, over_pole: false });
        }
        if !self.wrap {
            return None;
        }
        let over_pole = !(0..h).contains(&y);
        let (x, y) = match (over_pole, y < 0) {
            (false, _) => (x, y),
            (true, true) => (x + w / 2, -1 - y),
            (true, false) => (x + w / 2, 2 * h - 1 - y),
        };
        // In a picture lower than the window a tap may pass both poles: the clamp keeps it inside.
        Some(Place { index: (y.clamp(0, h - 1) * w + x.rem_euclid(w)) as usize, over_pole })
    }

    /// Inverse depth everywhere with its smaller one-sided difference: at a silhouette that is the one on the surface.
    fn slopes(&self, depth: &[f32]) -> Vec<Slope> {
        let inverse = |d: f32| if d > 0.0 && d < MAX_DEPTH { 1.0 / d.max(MIN_DEPTH) } else { 0.0 };
        let mut slopes = vec![Slope::default(); depth.len()];
        slopes.par_chunks_mut(self.width).enumerate().for_each(|(y, row)| {
            for (x, slope) in row.iter_mut().enumerate() {
                let here = inverse(depth[y * self.width + x]);
                let step = |dx, dy| self.place(x, y, dx, dy).map(|q| inverse(depth[q.index]) - here);
                let smaller = |ahead: Option<f32>, behind: Option<f32>| match (ahead, behind.map(|b| -b)) {
                    (Some(a), Some(b)) => {
                        if a.abs() <= b.abs() {
                            a
                        } else {
                            b
                        }
                    }
                    (a, b) => a.or(b).unwrap_or(0.0),
                };
                *slope = Slope { inverse: here, right: smaller(step(1, 0), step(-1, 0)), down: smaller(step(0, 1), step(0, -1)) };
            }
        });
        slopes
    }

    /// −ln of the weight of the tap `q`, `(dx, dy)` away from pixel `p`: each must lie in the other's tangent plane, within
    /// `sigma_depth` of the depth, and their normals must agree within `sigma_normal` radians.
    #[inline]
    pub(crate) fn exponent(&self, p: usize, q: Place, dx: isize, dy: isize, sigma_depth: f32, sigma_normal: f32) -> f64 {
        let (a, b) = (self.slope[p], self.slope[q.index]);
        let nearer = a.inverse.max(b.inverse);
        let mut exponent = 0.0;
        if nearer > 0.0 {
            let (dx, dy) = (dx as f64, dy as f64);
            let forward = f64::from(a.inverse) + f64::from(a.right) * dx + f64::from(a.down) * dy - f64::from(b.inverse);
            // Seen from the tap, the pixel lies the other way; beyond a pole rows run backwards, so that "up" stays "up".
            let back_dy = if q.over_pole { dy } else { -dy };
            let backward = f64::from(b.inverse) - f64::from(b.right) * dx + f64::from(b.down) * back_dy - f64::from(a.inverse);
            let residual = forward.abs().max(backward.abs()) / f64::from(nearer);
            exponent += 0.5 * (residual / f64::from(sigma_depth)).powi(2);
        }
        let (n, m) = (self.normal[p].as_dvec3(), self.normal[q.index].as_dvec3());
        let lengths = n.length() * m.length();
        if lengths > 0.0 {
            // 1 − cos φ ≈ φ²/2.
            exponent += (1.0 - n.dot(m) / lengths).max(0.0) / f64::from(sigma_normal).powi(2);
        } else if n != m && sigma_normal.is_finite() {
            return f64::INFINITY;
        }
        exponent
    }
}
