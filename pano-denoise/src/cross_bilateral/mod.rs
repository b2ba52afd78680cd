//! The 5×5 cross-bilateral filter that delta path tracing runs on its radiance, guided by depth, normal, albedo and
//! coverage.
//!
//! The paper gives the filter's size only; these are its terms here, all multiplied:
//!
//! - **Space**: a Gaussian of [`Params::sigma_space`] pixels.
//! - **Share**: a layer is stored premultiplied by the share of the pixel it belongs to (`coverage` for the objects,
//!   1 − `coverage` for the real surfaces). Taps are averaged as Σ w·layer / Σ w·share and multiplied by the share of the
//!   filtered pixel, so a pixel of the other kind never leaks in, and pixels without a share are left alone.
//! - **Depth**: the tap must lie in the pixel's tangent plane *and* the pixel in the tap's. Planes are straight lines in
//!   inverse depth, so that no ray direction is needed; the residual is relative to the inverse depth, so that the unit
//!   of length does not matter. What has no depth has inverse depth 0.
//! - **Normal** and **albedo**: falling with the difference.
//! - **Radiance**: the 3×3 means around pixel and tap may differ by about the local noise, and their raw values by
//!   four times as much. Noise is measured by second differences along four directions, of which the smallest counts: it is
//!   0 along a shadow's edge and on a gradient. A converged picture is therefore hardly changed, and contact shadows,
//!   shadow edges and mirror images stay sharp without knowing the material.
//!
//! The average is not exactly energy preserving next to edges; [`Report`] tells by how much.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

pub use crate::Energy;

use glam::Vec3;
use pano_core::image::Image;
use pano_core::layers::TracedLayers;
use pano_core::{Error, Result};

/// How strongly each guide stops the filter. Every sigma is > 0; infinity switches its term off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The picture is a whole panorama: taps wrap at ±180° and step over the poles. Default false.
    pub wrap: bool,
    /// Standard deviation of the spatial Gaussian in pixels. Higher averages more. Default 2.
    pub sigma_space: f32,
    /// Relative distance from the tangent plane, as a fraction of the depth, at which a tap counts e^−½. Lower keeps
    /// smaller steps and filters curved surfaces less. Default 0.02.
    pub sigma_depth: f32,
    /// Angle between normals in radians at which a tap counts about e^−½. Default 0.2.
    pub sigma_normal: f32,
    /// Difference of reflectance (Euclidean, RGB) at which a tap counts e^−½. Default 0.1.
    pub sigma_albedo: f32,
    /// Difference of 3×3 means, in standard deviations of the local noise of one pixel, at which a tap counts e^−½.
    /// Higher removes more noise and blurs fine shadows. Default 1.
    pub sigma_radiance: f32,
    /// How often [`filter`] goes over the change of the real surfaces, ≥ 1: it is smoother than what objects show. The paper
    /// filters once. Default 3.
    pub delta_passes: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            wrap: false,
            sigma_space: 2.0,
            sigma_depth: 0.02,
            sigma_normal: 0.2,
            sigma_albedo: 0.1,
            sigma_radiance: 1.0,
            delta_passes: 3,
        }
    }
}

impl Params {
    /// That every sigma is > 0.
    fn check(&self) -> Result<()> {
        for (name, sigma) in [
            ("sigma_space", self.sigma_space),
            ("sigma_depth", self.sigma_depth),
            ("sigma_normal", self.sigma_normal),
            ("sigma_albedo", self.sigma_albedo),
            ("sigma_radiance", self.sigma_radiance),
        ] {
            if sigma.is_nan() || sigma <= 0.0 {
                return Err(Error::argument(format!("cross-bilateral filter: {name} is {sigma}; give a value above 0")));
            }
        }
        Ok(())
    }
}

/// What is seen at each pixel's centre. All pictures have one size.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Distance along the ray; 0, negative, NaN and ≥ 10⁹ mean that nothing is there.
    pub depth: &'a Image<f32>,
    /// World-space normal of any length; zero where there is nothing.
    pub normal: &'a Image<Vec3>,
    /// Reflectance.
    pub albedo: &'a Image<Vec3>,
}

/// What the filter did to the two layers' sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Of [`TracedLayers::object`].
    pub object: Energy,
    /// Of [`TracedLayers::delta`].
    pub delta: Energy,
}

/// Filters `object` and, [`Params::delta_passes`] times, `delta` of `layers`, each by itself; everything else stays.
///
/// # Errors
/// [`Error::Argument`] if a sigma is not > 0 or the layers differ in size.
pub fn filter(params: &Params, layers: &mut TracedLayers) -> Result<Report> {
    let guides = Guides { depth: &layers.depth, normal: &layers.normal, albedo: &layers.albedo };
    let object = filter_layer(params, &guides, &layers.coverage, &mut layers.object)?;
    let real = layers.coverage.map(|c| 1.0 - c);
    let mut delta = filter_layer(params, &guides, &real, &mut layers.delta)?;
    for _ in 1..params.delta_passes {
        delta.after = filter_layer(params, &guides, &real, &mut layers.delta)?.after;
    }
    Ok(Report { object, delta })
}

/// Filters one `layer` that is premultiplied by `share` ([0, 1]; all ones for a layer that is not premultiplied).
///
/// Pixels with share 0 (or less, or NaN), pixels that are not finite, and pixels whose 5×5 neighbourhood is black are
/// left untouched; the former two are no taps either. Finite input gives finite output.
///
/// # Errors
/// [`Error::Argument`] if a sigma is not > 0 or the pictures differ in size.
pub fn filter_layer(params: &Params, guides: &Guides<'_>, share: &Image<f32>, layer: &mut Image<Vec3>) -> Result<Energy> {
    params.check()?;
    crate::check_sizes(
        "cross-bilateral filter",
        layer.size(),
        &[
            ("depth", guides.depth.size()),
            ("normal", guides.normal.size()),
            ("albedo", guides.albedo.size()),
            ("share", share.size()),
        ],
    )?;
    Ok(cpu::filter_layer(params, guides, share, layer))
}

#[cfg(test)]
mod tests;
