//! Compositing on the CPU; rayon over rows, sums row by row so that they do not depend on the threads.

use super::{Clamped, Composite, MULTIPLIER_FLOOR};
use glam::{DVec3, Vec3};
use pano_core::color::luminance;
use pano_core::image::RadianceImage;
use pano_core::layers::TracedLayers;
use rayon::prelude::*;

/// See [`super::composite`]; sizes are checked there.
pub(super) fn composite(photo: &RadianceImage, layers: &TracedLayers, out: &mut Composite) -> Clamped {
    let width = photo.width();
    let floor = f64::from(MULTIPLIER_FLOOR) * mean_luminance(photo);
    let rows: Vec<Clamped> = (out.color.data_mut().par_chunks_mut(width))
        .zip(out.multiplier.data_mut().par_chunks_mut(width))
        .enumerate()
        .map(|(y, (colors, multipliers))| {
            let mut clamped = Clamped::default();
            for x in 0..width {
                let (real, delta, coverage) = (photo.get(x, y), layers.delta.get(x, y), layers.coverage.get(x, y));
                if coverage == 0.0 && delta == Vec3::ZERO {
                    (colors[x], multipliers[x]) = (real, Vec3::ONE);
                    continue;
                }
                let (real, delta) = (real.as_dvec3(), delta.as_dvec3());
                let share = 1.0 - f64::from(coverage);
                let sum = real * share + delta + layers.object.get(x, y).as_dvec3();
                if sum.cmplt(DVec3::ZERO).any() {
                    clamped.pixels += 1;
                    clamped.energy -= sum.min(DVec3::ZERO).dot(pano_core::color::LUMINANCE_WEIGHTS.as_dvec3());
                }
                colors[x] = to_radiance(sum);
                multipliers[x] = to_radiance(DVec3::from_array(std::array::from_fn(|c| {
                    let base = real[c].max(floor) * share;
                    // No real surface in the pixel, or a black frame, which has no scale: no ratio either.
                    if base > 0.0 { 1.0 + delta[c] / base } else { 1.0 }
                })));
            }
            clamped
        })
        .collect();
    rows.iter().fold(Clamped::default(), |sum, row| Clamped { pixels: sum.pixels + row.pixels, energy: sum.energy + row.energy })
}

/// Mean luminance over the pixels; 0 for a black picture.
pub(super) fn mean_luminance(photo: &RadianceImage) -> f64 {
    photo.data().iter().map(|&p| f64::from(luminance(p))).filter(|l| l.is_finite()).sum::<f64>() / photo.data().len() as f64
}

/// To `f32`, clamped to what a radiance can be; NaN becomes 0.
fn to_radiance(v: DVec3) -> Vec3 {
    Vec3::from_array(v.to_array().map(|c| if c > 0.0 { c.min(f64::from(f32::MAX)) as f32 } else { 0.0 }))
}
