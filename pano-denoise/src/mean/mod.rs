//! The mean filter of penumbrae that ends RT²AR's soft shadows (Santos et al. 2012, section IV.E): it evens out the steps that
//! a light's few samples leave.
//!
//! Only pixels that show a penumbra change. *Departures* from a plain mean: the change of the real surfaces is averaged as a
//! ratio to the photo, so that the photo's detail stays; taps count as far as they lie on the same surface (tangent planes,
//! normals, reflectance) and by their share of the layer, so that nothing bleeds from objects into real surfaces.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use crate::Energy;
use glam::Vec3;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_core::{Error, Result};

/// How far is averaged, and what stops it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The picture is a whole panorama: taps wrap at ±180° and step over the poles. Default false.
    pub wrap: bool,
    /// Pixels to each side, ≤ 16. Higher is smoother and softens narrow penumbrae; cost grows with the square. Default 1: 3×3.
    pub radius: usize,
    /// Relative distance from the tangent plane at which a tap counts e^−½, > 0. Default 0.02.
    pub sigma_depth: f32,
    /// Angle between normals in radians at which a tap counts about e^−½, > 0. Default 0.2.
    pub sigma_normal: f32,
    /// Difference of reflectance (Euclidean, RGB) at which a tap counts e^−½, > 0. Default 0.1.
    pub sigma_albedo: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { wrap: false, radius: 1, sigma_depth: 0.02, sigma_normal: 0.2, sigma_albedo: 0.1 }
    }
}

impl Params {
    /// That every value is in its range.
    fn check(&self) -> Result<()> {
        for (name, sigma) in
            [("sigma_depth", self.sigma_depth), ("sigma_normal", self.sigma_normal), ("sigma_albedo", self.sigma_albedo)]
        {
            if sigma.is_nan() || sigma <= 0.0 {
                return Err(Error::argument(format!("mean filter: {name} is {sigma}; give a value above 0")));
            }
        }
        if self.radius > MAX_RADIUS {
            return Err(Error::argument(format!("mean filter: radius is {}; give at most {MAX_RADIUS}", self.radius)));
        }
        Ok(())
    }
}

/// Largest [`Params::radius`].
pub const MAX_RADIUS: usize = 16;

/// What the filter did to the layers' sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Of the objects.
    pub object: Energy,
    /// Of the change of real surfaces.
    pub delta: Energy,
}

/// Averages `object` and `delta` of `layers` where `penumbra` says so; `photo` is what the view shows without objects. Finite
/// input gives finite output; what is no number is left alone and does not count.
///
/// # Errors
/// [`Error::Argument`] if a parameter is out of range or the pictures differ in size.
pub fn filter(params: &Params, penumbra: &Image<bool>, photo: &RadianceImage, layers: &mut TracedLayers) -> Result<Report> {
    params.check()?;
    check_sizes(penumbra, photo, layers)?;
    Ok(cpu::filter(params, penumbra, photo, layers))
}

/// All pictures are of one size.
fn check_sizes(penumbra: &Image<bool>, photo: &RadianceImage, layers: &TracedLayers) -> Result<()> {
    let sizes = [("the penumbra", penumbra.size()), ("the photo", photo.size())];
    crate::check_sizes("mean filter", layers.size(), &sizes)
}

/// A layer on its way through the filter.
#[derive(Clone, Copy)]
struct Signal<'a> {
    /// Premultiplied by `share`.
    values: &'a [Vec3],
    share: &'a [f32],
    /// What values are in proportion to, pixel by pixel; `None`: nothing.
    base: Option<&'a [Vec3]>,
}

#[cfg(test)]
mod tests;
