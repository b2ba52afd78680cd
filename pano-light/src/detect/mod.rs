//! Stage: finds the lights of a panorama that cast visible shadows (MR360, section 4.1).
//!
//! Luminance of the upper half is blurred by a 5×5 box; pixels above μ + 2σ of the blurred luminance form a mask, and
//! each connected component of it is a light. What exceeds the threshold in it, E_p = Ω_p·(L_p − L_p·min(1, Y_t/Y_p)), is
//! the light's irradiance; what does not stays in the map ([`Detection::clamped`]), so that lights and map together are what
//! was given. The strongest lights that have 90 % of the light are kept.
//!
//! Departures from the paper: components and blur wrap around the seam; a light's direction is a mean of unit vectors, as a
//! mean of angles breaks at the seam and at the zenith; only pixels of lights that are kept are clamped, as the others' light
//! would be lost.
//!
//! ```
//! use glam::Vec3;
//! use pano_core::image::Image;
//! use pano_light::{WorkingMap, detect::{Params, detect}};
//!
//! let mut sky = Image::filled(64, 32, Vec3::ONE);
//! sky.set(40, 6, Vec3::splat(1e5));
//! let found = detect(&WorkingMap::from_hdr(&sky), &Params::default());
//! assert_eq!(found.lights.len(), 1);
//! ```

mod components;
mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

pub(crate) use components::components;
pub(crate) use cpu::{Statistics, strongest};

use crate::WorkingMap;
use glam::Vec3;
use pano_core::image::{Image, RadianceImage};
use pano_core::light::DirectionalLight;

/// Knobs of the detection. The defaults are the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The threshold lies this many standard deviations above the mean. Lower finds more and larger lights.
    pub sigmas: f64,
    /// Half the width of the box blur in pixels, ≥ 0: 2 is 5×5. A wider blur joins patches and loses small lights.
    pub blur_radius: usize,
    /// Share of the light of all components that the kept lights have at least, (0, 1].
    pub keep: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { sigmas: 2.0, blur_radius: 2, keep: 0.9 }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// μ + 2σ: blurred luminance above which a pixel belongs to a light, in units of the map.
    pub threshold: f64,
    /// Mean of the blurred luminance of the upper half, every pixel counting alike.
    pub mean: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Components before the weak ones were left out.
    pub found: usize,
    /// Strongest first. Directions are in the panorama's frame.
    pub lights: Vec<DirectionalLight>,
    /// Per pixel of the upper half: whether it belongs to one of `lights`.
    pub(crate) lit: Image<bool>,
}

/// Finds the lights of `map`.
pub fn detect(map: &WorkingMap, params: &Params) -> Detection {
    cpu::detect(map, params, Statistics::of(map, params))
}

impl Detection {
    /// The map without its lights: pixels of a light are scaled down to the threshold's luminance, all others stay.
    pub fn clamped(&self, map: &WorkingMap) -> RadianceImage {
        let mut clamped = map.radiance().clone();
        for (pixel, &lit) in clamped.data_mut().iter_mut().zip(self.lit.data()) {
            if lit {
                *pixel -= excess(*pixel, self.threshold as f32);
            }
        }
        clamped
    }

    /// Which pixels of the upper half, [`WorkingMap::WIDTH`] wide, belong to a light that was kept.
    pub fn lit(&self) -> &Image<bool> {
        &self.lit
    }
}

/// What of a pixel's radiance exceeds the luminance `threshold`: L − L·min(1, Y_t/Y).
#[inline]
pub(crate) fn excess(radiance: Vec3, threshold: f32) -> Vec3 {
    let y = radiance.dot(crate::expand::LUMA_WEIGHTS);
    if y > threshold { radiance * (1.0 - threshold / y) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests;
