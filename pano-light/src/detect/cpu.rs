//! Blur, statistics, mask, components, lights. On one thread: at 600×150 pixels, threads would cost more than they save.

use super::components::components;
use super::{Detection, Params, excess};
use crate::WorkingMap;
use crate::expand::LUMA_WEIGHTS;
use crate::grid::grid;
use crate::remap::intensity_factor;
use glam::DVec3;
use pano_core::image::Image;
use pano_core::light::DirectionalLight;

/// The upper half's size.
pub(super) const SIZE: (usize, usize) = (WorkingMap::WIDTH, WorkingMap::HEIGHT / 2);

/// A standard deviation below this share of the mean is one of rounding: a constant map that was resampled has no lights.
const ROUNDING: f64 = 1e-5;

/// The threshold, and what it is made of.
#[derive(Clone, Debug)]
pub(crate) struct Statistics {
    pub(crate) mean: f64,
    pub(crate) sigma: f64,
    /// Luminance of the upper half after the blur.
    blurred: Image<f32>,
}

impl Statistics {
    /// Of the upper half of `map`.
    pub(crate) fn of(map: &WorkingMap, params: &Params) -> Self {
        let (w, h) = SIZE;
        let luminance = Image::from_fn(w, h, |x, y| map.radiance().get(x, y).dot(LUMA_WEIGHTS));
        Self::of_blurred(box_blur(&luminance, params.blur_radius))
    }

    /// Of the blurred luminance itself.
    pub(super) fn of_blurred(blurred: Image<f32>) -> Self {
        let n = blurred.data().len() as f64;
        let mean = blurred.data().iter().map(|&y| f64::from(y)).sum::<f64>() / n;
        // In two passes: the mean of squares minus the square of the mean cancels in a constant map, which has no lights.
        let variance = blurred.data().iter().map(|&y| (f64::from(y) - mean).powi(2)).sum::<f64>() / n;
        Self { mean, sigma: variance.sqrt(), blurred }
    }
}

/// See [`super::detect`].
pub(super) fn detect(map: &WorkingMap, params: &Params, statistics: Statistics) -> Detection {
    let (w, h) = SIZE;
    let Statistics { mean, sigma, blurred } = statistics;
    let threshold = mean + params.sigmas * sigma;
    let flat = sigma <= ROUNDING * mean;
    let mask = blurred.map(|y| !flat && f64::from(y) > threshold);
    let components = components(&mask);
    // A component in which only the blur exceeds the threshold gives no light.
    let mut lights: Vec<(DirectionalLight, usize)> =
        components.iter().enumerate().filter_map(|(i, pixels)| Some((light(map, pixels, threshold as f32)?, i))).collect();
    let found = lights.len();
    // Stable: of equal lights the first pixel decides.
    lights.sort_by(|(a, _), (b, _)| luma(b).total_cmp(&luma(a)));
    lights.truncate(strongest(lights.iter().map(|(light, _)| luma(light)), params.keep));

    let mut lit = Image::filled(w, h, false);
    for &pixel in lights.iter().flat_map(|&(_, i)| &components[i]) {
        lit.data_mut()[pixel] = true;
    }
    let lights = lights.into_iter().map(|(light, _)| light).collect();
    Detection { threshold, mean, sigma, found, lights, lit }
}

/// Luminance of a light's irradiance.
fn luma(light: &DirectionalLight) -> f32 {
    light.irradiance.dot(LUMA_WEIGHTS)
}

/// How many of the lights, strongest first, have the share `keep` of the light of all.
pub(crate) fn strongest(irradiances: impl Iterator<Item = f32> + Clone, keep: f32) -> usize {
    let total: f64 = irradiances.clone().map(f64::from).sum();
    let mut sum = 0.0;
    let enough = |y: f32| {
        sum += f64::from(y);
        sum >= f64::from(keep) * total
    };
    let all = irradiances.clone().count();
    irradiances.map(enough).position(|enough| enough).map_or(all, |i| i + 1)
}

/// One component's light; `None` if none of its pixels exceeds the threshold.
fn light(map: &WorkingMap, pixels: &[usize], threshold: f32) -> Option<DirectionalLight> {
    // f64: thousands of dim pixels beside a sun of 1e5.
    let grid = grid();
    let (mut irradiance, mut axis, mut solid_angle) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for &pixel in pixels {
        let area = grid.solid_angle(pixel);
        let e = excess(map.radiance().data()[pixel], threshold).as_dvec3() * area;
        irradiance += e;
        axis += grid.direction(pixel).as_dvec3() * e.dot(LUMA_WEIGHTS.as_dvec3());
        solid_angle += area;
    }
    let irradiance = irradiance.as_vec3();
    // Every direction of the upper half has a part upwards, so that the sum vanishes only with the light.
    let direction = axis.try_normalize()?.as_vec3();
    let factor = if map.is_from_ldr() { intensity_factor(solid_angle as f32) } else { 1.0 };
    (irradiance.dot(LUMA_WEIGHTS) > 0.0 && irradiance.is_finite()).then_some(DirectionalLight {
        direction,
        irradiance,
        solid_angle: solid_angle as f32,
        intensity: irradiance * factor,
    })
}

/// Mean over (2·radius + 1)² pixels, wrapping from left to right, the first and the last row repeated.
fn box_blur(image: &Image<f32>, radius: usize) -> Image<f32> {
    let (w, h) = image.size();
    let width = 2 * radius + 1;
    let share = 1.0 / (width * width) as f32;
    let mut across = Image::filled(w, h, 0.0);
    for y in 0..h {
        let row = image.row(y);
        // The row with its ends repeated on the other side: every sum is over neighbours, in the same order, so that a constant
        // picture stays exactly constant.
        let padded: Vec<f32> = (0..w + 2 * radius).map(|i| row[(i + w * radius - radius) % w]).collect();
        for (out, window) in across.data_mut()[y * w..][..w].iter_mut().zip(padded.windows(width)) {
            *out = window.iter().sum();
        }
    }
    let mut blurred = Image::filled(w, h, 0.0);
    for (y, out) in blurred.data_mut().chunks_exact_mut(w).enumerate() {
        for j in 0..width {
            let source = across.row((y + j).saturating_sub(radius).min(h - 1));
            for (out, s) in out.iter_mut().zip(source) {
                *out += s;
            }
        }
        out.iter_mut().for_each(|out| *out *= share);
    }
    blurred
}
