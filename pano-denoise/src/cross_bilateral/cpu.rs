//! The filter on the CPU: one pass for means and second differences, one for the average; rayon over rows.
//!
//! Sums and weights are `f64`, so that no finite input overflows.

use super::{Energy, Guides, Params};
use glam::{DVec3, Vec3};
use pano_core::color::luminance;
use pano_core::image::Image;
use rayon::prelude::*;

/// Half the window's side.
const RADIUS: isize = 2;
/// Raw values may differ by this many standard deviations of the noise before the tap counts less. Chosen empirically: at
/// 6 a step of six standard deviations loses a fifth of its contrast, at 3 one lit pixel in ten is hardly spread.
const OUTLIER: f64 = 4.0;
/// Smallest depth told apart, in the scene's unit: keeps inverse depths and their differences finite in `f32`.
const MIN_DEPTH: f32 = 1e-30;
/// From here on depth means that nothing is there.
const MAX_DEPTH: f32 = 1e9;
/// The eight neighbours; the second half is opposite to the first, in the same order.
const NEIGHBOURS: [(isize, isize); 8] = [(1, 0), (0, 1), (1, 1), (1, -1), (-1, 0), (0, -1), (-1, -1), (-1, 1)];

/// A tap's place: index, and whether a pole was stepped over on the way (its columns then run backwards).
#[derive(Clone, Copy)]
struct Place {
    index: usize,
    over_pole: bool,
}

/// What is known of one pixel before its average is taken.
#[derive(Clone, Copy, Default)]
struct Local {
    /// Mean of the un-premultiplied layer over the 3×3 pixels of the same surface.
    mean: Vec3,
    /// Root of the squared second difference (RGB norm) along the first four [`NEIGHBOURS`], scaled so that its expected
    /// square is the noise's variance; NaN where a neighbour is not of the same surface.
    residual: [f32; 4],
}

/// Inverse depth and its change per pixel to the right and down.
#[derive(Clone, Copy, Default)]
struct Slope {
    inverse: f32,
    right: f32,
    down: f32,
}

/// Everything the passes read.
struct Frame<'a> {
    params: &'a Params,
    guides: &'a Guides<'a>,
    source: &'a [Vec3],
    /// Share of the pixel, 0 where it is no tap.
    share: Vec<f32>,
    slope: Vec<Slope>,
    width: usize,
    height: usize,
}

/// See [`super::filter_layer`]; sizes and sigmas are checked there.
pub(super) fn filter_layer(params: &Params, guides: &Guides<'_>, share: &Image<f32>, layer: &mut Image<Vec3>) -> Energy {
    let (width, height) = layer.size();
    let source = layer.clone();
    let share = share.data().iter().zip(source.data()).map(|(&s, v)| if s > 0.0 && v.is_finite() { s.min(1.0) } else { 0.0 });
    let mut frame = Frame { params, guides, source: source.data(), share: share.collect(), slope: vec![], width, height };
    frame.slope = frame.slopes();

    let mut local = vec![Local::default(); width * height];
    local.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, l) in row.iter_mut().enumerate() {
            if frame.is_active(x, y, RADIUS) {
                *l = frame.local(x, y);
            }
        }
    });

    let space: Vec<f64> = (0..(2 * RADIUS + 1).pow(2))
        .map(|i| {
            let (dx, dy) = (i % (2 * RADIUS + 1) - RADIUS, i / (2 * RADIUS + 1) - RADIUS);
            0.5 * (dx * dx + dy * dy) as f64 / f64::from(params.sigma_space).powi(2)
        })
        .collect();
    layer.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            if frame.is_active(x, y, RADIUS)
                && let Some(value) = frame.average(x, y, &local, &space)
            {
                *out = value;
            }
        }
    });
    let sum = |image: &Image<Vec3>, f: fn(f64) -> f64| {
        image.data().iter().filter(|v| v.is_finite()).map(|&v| f(f64::from(luminance(v)))).sum()
    };
    Energy { before: sum(&source, |v| v), after: sum(layer, |v| v), magnitude: sum(&source, f64::abs) }
}

impl Frame<'_> {
    /// The pixel `(dx, dy)` away from `(x, y)`; `None` outside a picture that does not wrap.
    #[inline]
    fn place(&self, x: usize, y: usize, dx: isize, dy: isize) -> Option<Place> {
        let (w, h) = (self.width as isize, self.height as isize);
        let (x, y) = (x as isize + dx, y as isize + dy);
        if (0..w).contains(&x) && (0..h).contains(&y) {
            return Some(Place { index: (y * w + x) as usize, over_pole: false });
        }
        if !self.params.wrap {
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

    /// Whether the pixel belongs to the layer and anything within `radius` is not black.
    fn is_active(&self, x: usize, y: usize, radius: isize) -> bool {
        let here = y * self.width + x;
        self.share[here] > 0.0
            && (self.source[here] != Vec3::ZERO
                || (-radius..=radius).any(|dy| {
                    (-radius..=radius).any(|dx| {
                        self.place(x, y, dx, dy).is_some_and(|q| self.share[q.index] > 0.0 && self.source[q.index] != Vec3::ZERO)
                    })
                }))
    }

    /// Inverse depth everywhere with its smaller one-sided difference: at a silhouette that is the one on the surface.
    fn slopes(&self) -> Vec<Slope> {
        let inverse = |d: f32| if d > 0.0 && d < MAX_DEPTH { 1.0 / d.max(MIN_DEPTH) } else { 0.0 };
        let depth = self.guides.depth.data();
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

    /// −ln of the weight that the guides give the tap `q`, `(dx, dy)` away from `p`; infinite if it is not of the layer.
    #[inline]
    fn guide_exponent(&self, p: usize, q: Place, dx: isize, dy: isize) -> f64 {
        if self.share[q.index] == 0.0 {
            return f64::INFINITY;
        }
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
            exponent += 0.5 * (residual / f64::from(self.params.sigma_depth)).powi(2);
        }
        let (n, m) = (self.guides.normal.data()[p].as_dvec3(), self.guides.normal.data()[q.index].as_dvec3());
        let lengths = n.length() * m.length();
        if lengths > 0.0 {
            // 1 − cos φ ≈ φ²/2.
            exponent += (1.0 - n.dot(m) / lengths).max(0.0) / f64::from(self.params.sigma_normal).powi(2);
        } else if n != m && self.params.sigma_normal.is_finite() {
            return f64::INFINITY;
        }
        let albedo = self.guides.albedo.data()[p].as_dvec3() - self.guides.albedo.data()[q.index].as_dvec3();
        exponent + 0.5 * albedo.length_squared() / f64::from(self.params.sigma_albedo).powi(2)
    }

    /// The layer's value at `i` without the premultiplication; the share there is above 0.
    #[inline]
    fn value(&self, i: usize) -> DVec3 {
        self.source[i].as_dvec3() / f64::from(self.share[i])
    }

    /// Mean and second differences around a pixel of the layer.
    fn local(&self, x: usize, y: usize) -> Local {
        let p = y * self.width + x;
        let here = self.value(p);
        let (mut sum, mut shares) = (self.source[p].as_dvec3(), f64::from(self.share[p]));
        let values = NEIGHBOURS.map(|(dx, dy)| {
            let q = self.place(x, y, dx, dy)?;
            let weight = (-self.guide_exponent(p, q, dx, dy)).exp();
            if weight > 0.0 {
                sum += self.source[q.index].as_dvec3() * weight;
                shares += f64::from(self.share[q.index]) * weight;
            }
            (weight > 0.5).then(|| self.value(q.index))
        });
        let residual = std::array::from_fn(|d| match (values[d], values[d + 4]) {
            // The variance of a − 2b + c is 6 times that of a, b, c.
            (Some(a), Some(c)) => to_f32((a - 2.0 * here + c).length() / 6f64.sqrt()),
            _ => f32::NAN,
        });
        Local { mean: to_vec3(sum / shares), residual }
    }

    /// The filtered value, or `None` if no tap but the pixel itself counts.
    fn average(&self, x: usize, y: usize, local: &[Local], space: &[f64]) -> Option<Vec3> {
        let p = y * self.width + x;
        let side = 2 * RADIUS + 1;
        let mut taps = [(0usize, f64::INFINITY); 25];
        // Noise variance along the four directions: weighted sums of squares, and of weights.
        let mut noise = [(0.0f64, 0.0f64); 4];
        for (i, tap) in taps.iter_mut().enumerate() {
            let (dx, dy) = (i as isize % side - RADIUS, i as isize / side - RADIUS);
            let Some(q) = self.place(x, y, dx, dy) else { continue };
            *tap = (q.index, self.guide_exponent(p, q, dx, dy));
            let weight = (-tap.1).exp();
            for (n, &r) in noise.iter_mut().zip(&local[q.index].residual) {
                if weight > 0.0 && !r.is_nan() {
                    *n = (n.0 + weight * f64::from(r).powi(2), n.1 + weight);
                }
            }
        }
        // Without a single straight line of three pixels nothing is known of the noise: leave the pixel alone.
        let variance = noise.iter().filter(|n| n.1 > 0.0).map(|n| n.0 / n.1).min_by(f64::total_cmp)?;
        let centre = self.value(p);
        let mean = local[p].mean.as_dvec3();
        let ranged = self.params.sigma_radiance.is_finite();
        let spread = variance * f64::from(self.params.sigma_radiance).powi(2);

        let (mut sum, mut shares, mut others) = (self.source[p].as_dvec3(), f64::from(self.share[p]), false);
        for (i, &(q, guide)) in taps.iter().enumerate() {
            if i == taps.len() / 2 || guide == f64::INFINITY {
                continue;
            }
            let mut exponent = guide + space[i];
            if ranged {
                let apart = ratio((local[q].mean.as_dvec3() - mean).length_squared(), spread);
                let raw = ratio((self.value(q) - centre).length_squared(), 2.0 * spread);
                exponent += 0.5 * apart + 0.5 * (raw - OUTLIER * OUTLIER).max(0.0);
            }
            let weight = (-exponent).exp();
            if weight > 0.0 {
                others = true;
                sum += self.source[q].as_dvec3() * weight;
                shares += f64::from(self.share[q]) * weight;
            }
        }
        others.then(|| to_vec3(sum / shares * f64::from(self.share[p])))
    }
}

/// `a / b` for a, b ≥ 0, with 0/0 = 0.
#[inline]
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// To `f32`, at most its largest value: dividing by a tiny share may exceed it.
#[inline]
fn to_f32(v: f64) -> f32 {
    v.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// [`to_f32`] of each channel.
#[inline]
fn to_vec3(v: DVec3) -> Vec3 {
    Vec3::new(to_f32(v.x), to_f32(v.y), to_f32(v.z))
}
