//! The filter on the CPU: one pass for means and second differences, one for the average; rayon over rows.
//!
//! Sums and weights are `f64`, so that no finite input overflows.

use super::{Energy, Guides, Params};
use crate::surfaces::{Place, Surfaces};
use crate::{to_f32, to_vec3};
use glam::{DVec3, Vec3};
use pano_core::image::Image;
use rayon::prelude::*;

/// Half the window's side.
const RADIUS: isize = 2;
/// Raw values may differ by this many standard deviations of the noise before the tap counts less. Chosen empirically: at
/// 6 a step of six standard deviations loses a fifth of its contrast, at 3 one lit pixel in ten is hardly spread.
pub(super) const OUTLIER: f64 = 4.0;
/// The eight neighbours; the second half is opposite to the first, in the same order.
const NEIGHBOURS: [(isize, isize); 8] = [(1, 0), (0, 1), (1, 1), (1, -1), (-1, 0), (0, -1), (-1, -1), (-1, 1)];

/// What is known of one pixel before its average is taken.
#[derive(Clone, Copy, Default)]
struct Local {
    /// Mean of the un-premultiplied layer over the 3×3 pixels of the same surface.
    mean: Vec3,
    /// Root of the squared second difference (RGB norm) along the first four [`NEIGHBOURS`], scaled so that its expected
    /// square is the noise's variance; NaN where a neighbour is not of the same surface.
    residual: [f32; 4],
}

/// Everything the passes read.
struct Frame<'a> {
    params: &'a Params,
    guides: &'a Guides<'a>,
    source: &'a [Vec3],
    /// Share of the pixel, 0 where it is no tap.
    share: Vec<f32>,
    surfaces: Surfaces<'a>,
    width: usize,
}

/// See [`super::filter_layer`]; sizes and sigmas are checked there.
pub(super) fn filter_layer(params: &Params, guides: &Guides<'_>, share: &Image<f32>, layer: &mut Image<Vec3>) -> Energy {
    let (width, height) = layer.size();
    let source = layer.clone();
    let share = share.data().iter().zip(source.data()).map(|(&s, v)| if s > 0.0 && v.is_finite() { s.min(1.0) } else { 0.0 });
    let surfaces = Surfaces::new(guides.depth, guides.normal, params.wrap);
    let frame = Frame { params, guides, source: source.data(), share: share.collect(), surfaces, width };

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
    Energy::between(&source, layer)
}

impl Frame<'_> {
    /// See [`Surfaces::place`].
    #[inline]
    fn place(&self, x: usize, y: usize, dx: isize, dy: isize) -> Option<Place> {
        self.surfaces.place(x, y, dx, dy)
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

    /// −ln of the weight that the guides give the tap `q`, `(dx, dy)` away from `p`; infinite if it is not of the layer.
    #[inline]
    fn guide_exponent(&self, p: usize, q: Place, dx: isize, dy: isize) -> f64 {
        if self.share[q.index] == 0.0 {
            return f64::INFINITY;
        }
        let exponent = self.surfaces.exponent(p, q, dx, dy, self.params.sigma_depth, self.params.sigma_normal);
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
