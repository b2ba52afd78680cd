//! The à-trous joint bilateral filter of IPRT: a 65×65 window in [`Params::levels`] passes of 5×5 taps, the holes between
//! which double from pass to pass (Dammertz et al. 2010), guided by normal, depth and luminance variance (Schied et al.
//! 2017, "Spatiotemporal variance-guided filtering", which the paper follows).
//!
//! The terms of a tap's weight, all multiplied:
//!
//! - **Space**: the B-spline (1, 4, 6, 4, 1)/16 along both axes.
//! - **Share**: as in [`crate::cross_bilateral`], layers are premultiplied by the share of the pixel that they belong to.
//! - **Depth** and **normal**: each pixel must lie in the other's tangent plane, and normals must agree.
//! - **Luminance**: exp(−|l_p − l_q| / (σ_l·σ)), with σ the standard deviation of the pixel's value, from the variance of its
//!   samples, blurred 3×3. The filter works on irradiance, so that texture is no luminance difference.
//!
//! Variances are filtered along (Σ w²·var / (Σ w)²), so that each pass stops earlier than the one before.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use crate::Energy;
use glam::Vec3;
use pano_core::image::Image;
use pano_core::{Error, Result};

/// How strongly each guide stops the filter. Every sigma is > 0; infinity switches its term off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The picture is a whole panorama: taps wrap at ±180° and step over the poles. Default false.
    pub wrap: bool,
    /// Passes, 0–8. The window is 2^(levels + 1) + 1 wide in its last pass: 5 levels are the paper's 65×65. Each level more
    /// halves noise about once more and costs 25 taps a pixel. Default 5.
    pub levels: u32,
    /// Relative distance from the tangent plane at which a tap counts e^−½. Lower keeps smaller steps. Default 0.02.
    pub sigma_depth: f32,
    /// Angle between normals in radians at which a tap counts about e^−½. Default 0.15: cos^128 of the SVGF paper falls to
    /// e^−½ at 0.09; curved objects need more.
    pub sigma_normal: f32,
    /// Difference of luminance, in standard deviations of the pixel's value, at which a tap counts e^−1. Higher removes
    /// more noise and blurs shadows. Default 4 (SVGF).
    pub sigma_luminance: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { wrap: false, levels: 5, sigma_depth: 0.02, sigma_normal: 0.15, sigma_luminance: 4.0 }
    }
}

/// What is seen at each pixel's centre. Both pictures have the signal's size.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Distance along the ray; 0, negative, NaN and ≥ 10⁹ mean that nothing is there.
    pub depth: &'a Image<f32>,
    /// World-space normal of any length; zero where there is nothing.
    pub normal: &'a Image<Vec3>,
}

impl Params {
    /// That every value is in its range.
    fn check(&self) -> Result<()> {
        let sigmas =
            [("sigma_depth", self.sigma_depth), ("sigma_normal", self.sigma_normal), ("sigma_luminance", self.sigma_luminance)];
        for (name, sigma) in sigmas {
            if sigma.is_nan() || sigma <= 0.0 {
                return Err(Error::argument(format!("à-trous filter: {name} is {sigma}; give a value above 0")));
            }
        }
        if self.levels > 8 {
            return Err(Error::argument(format!("à-trous filter: {} levels; give at most 8", self.levels)));
        }
        Ok(())
    }
}

impl Guides<'_> {
    /// That all pictures have the signal's size.
    fn check(&self, size: (usize, usize), share: &Image<f32>, variance: &Image<f32>) -> Result<()> {
        let pictures = [
            ("depth", self.depth.size()),
            ("normal", self.normal.size()),
            ("share", share.size()),
            ("variance", variance.size()),
        ];
        crate::check_sizes("à-trous filter", size, &pictures)
    }
}

/// Filters `signal`, which is premultiplied by `share` ([0, 1]; all ones for one that is not), and along with it `variance`:
/// the variance (≥ 0) of the luminance of each pixel's un-premultiplied value.
///
/// Where samples are too few to know it, [`crate::temporal::accumulate`] finds the variance from neighbours.
///
/// Pixels with share 0 and values that are not finite are left alone and are no taps. Finite input gives finite output.
///
/// # Errors
/// [`Error::Argument`] if a sigma is not > 0, there are more than 8 levels, or the pictures differ in size.
pub fn filter(
    params: &Params,
    guides: &Guides<'_>,
    share: &Image<f32>,
    variance: &mut Image<f32>,
    signal: &mut Image<Vec3>,
) -> Result<Energy> {
    params.check()?;
    guides.check(signal.size(), share, variance)?;
    Ok(cpu::filter(params, guides, share, variance, signal))
}

#[cfg(test)]
mod tests;
