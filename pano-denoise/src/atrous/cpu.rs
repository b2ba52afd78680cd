//! The passes on the CPU, rayon over rows. Sums are `f64`, so that no finite input overflows.

use super::{Guides, Params};
use crate::surfaces::Surfaces;
use crate::{Energy, bright, to_f32, to_vec3};
use glam::{DVec3, Vec3};
use pano_core::image::Image;
use rayon::prelude::*;

/// The B-spline of a 5-tap row.
pub(super) const SPLINE: [f64; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];
/// e to minus this is nothing beside the weight of the pixel itself.
const NOTHING: f64 = 40.0;
/// Standard deviations below this share of the luminance are rounding.
pub(super) const ROUNDING: f64 = 1e-6;

/// One pixel of the signal between passes.
#[derive(Clone, Copy, Default)]
struct Pixel {
    /// Without the premultiplication.
    value: DVec3,
    luminance: f64,
    variance: f64,
    /// Of the pixel, 0 where it takes no part.
    share: f64,
}

/// See [`super::filter`]; arguments are checked there.
pub(super) fn filter(
    params: &Params,
    guides: &Guides<'_>,
    share: &Image<f32>,
    variance: &mut Image<f32>,
    signal: &mut Image<Vec3>,
) -> Energy {
    let width = signal.width();
    let surfaces = Surfaces::new(guides.depth, guides.normal, params.wrap);
    let before = signal.clone();
    let mut pixels: Vec<Pixel> = (signal.data().iter().zip(share.data()).zip(variance.data()))
        .map(|((&value, &share), &variance)| {
            if !(share > 0.0 && value.is_finite()) {
                return Pixel::default();
            }
            let share = f64::from(share.min(1.0));
            let value = value.as_dvec3() / share;
            let variance = if variance.is_finite() { f64::from(variance).max(0.0) } else { 0.0 };
            Pixel { value, luminance: bright(value), variance, share }
        })
        .collect();
    for level in 0..params.levels {
        pixels = pass(params, &surfaces, &pixels, width, 1 << level);
    }
    for ((pixel, value), variance) in pixels.iter().zip(signal.data_mut()).zip(variance.data_mut()) {
        if pixel.share > 0.0 {
            *value = to_vec3(pixel.value * pixel.share);
            *variance = to_f32(pixel.variance);
        }
    }
    Energy::between(&before, signal)
}

/// One pass with taps `step` pixels apart.
fn pass(params: &Params, surfaces: &Surfaces<'_>, pixels: &[Pixel], width: usize, step: isize) -> Vec<Pixel> {
    let mut out = pixels.to_vec();
    out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if pixel.share > 0.0 {
                average(params, surfaces, pixels, (x, y), y * width + x, step, pixel);
            }
        }
    });
    out
}

fn average(
    params: &Params,
    surfaces: &Surfaces<'_>,
    pixels: &[Pixel],
    (x, y): (usize, usize),
    p: usize,
    step: isize,
    out: &mut Pixel,
) {
    let center = pixels[p];
    let mut places = [None; 25];
    let mut black = center.value == DVec3::ZERO;
    for (i, place) in places.iter_mut().enumerate() {
        let (dx, dy) = (i as isize % 5 - 2, i as isize / 5 - 2);
        *place = surfaces.place(x, y, dx * step, dy * step).filter(|q| pixels[q.index].share > 0.0);
        black &= place.is_none_or(|q| pixels[q.index].value == DVec3::ZERO);
    }
    // Most of the change is nothing.
    if black {
        return;
    }
    // Index, weight in space, and −ln of that of the surfaces.
    let mut taps = [(0usize, 0.0f64, 0.0f64); 25];
    let (mut spread, mut count, mut used) = (0.0, 0.0, 0);
    for (i, place) in places.iter().enumerate() {
        let Some(place) = *place else { continue };
        let (dx, dy) = (i as isize % 5 - 2, i as isize / 5 - 2);
        let guide = surfaces.exponent(p, place, dx * step, dy * step, params.sigma_depth, params.sigma_normal);
        let weight = SPLINE[i % 5] * SPLINE[i / 5];
        taps[used] = (place.index, weight, guide);
        used += 1;
        // Variances are noisy themselves: a 3×3 mean over the same surface.
        if dx.abs() <= 1 && dy.abs() <= 1 {
            let weight = weight * (-guide).exp();
            spread += pixels[place.index].variance * weight;
            count += weight;
        }
    }
    let deviation = if count > 0.0 { (spread / count).sqrt() } else { 0.0 };
    let scale = f64::from(params.sigma_luminance) * deviation + ROUNDING * center.luminance.abs() + f64::MIN_POSITIVE;
    let (mut sum, mut weights, mut variance) = (DVec3::ZERO, 0.0, 0.0);
    for &(q, weight, guide) in &taps[..used] {
        let tap = pixels[q];
        let exponent = guide + (tap.luminance - center.luminance).abs() / scale;
        // A larger share of the pixel is a better known value.
        let weight = if exponent < NOTHING { weight * tap.share * (-exponent).exp() } else { 0.0 };
        if weight > 0.0 {
            sum += tap.value * weight;
            weights += weight;
            variance += tap.variance * weight * weight;
        }
    }
    if weights > 0.0 && sum.is_finite() {
        out.value = sum / weights;
        out.luminance = bright(out.value);
        out.variance = variance / (weights * weights);
    }
}
