//! Clamps fireflies: single samples of rare bright paths that no filter can spread far enough. What they carried is lost,
//! and told.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use glam::Vec3;
use pano_core::image::Image;
use pano_core::{Error, Result};

/// What counts as a firefly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The picture is a whole panorama: neighbours wrap at ±180° and step over the poles. Default false.
    pub wrap: bool,
    /// A pixel may be this many times as bright as the brightest of its neighbours, ≥ 1. Higher keeps more energy and more
    /// fireflies. Default 2: a highlight of one pixel between others of half its brightness is left alone.
    pub factor: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { wrap: false, factor: 2.0 }
    }
}

impl Params {
    /// That the factor is in its range.
    fn check(&self) -> Result<()> {
        if self.factor.is_nan() || self.factor < 1.0 {
            return Err(Error::argument(format!("firefly clamp: factor is {}; give at least 1", self.factor)));
        }
        Ok(())
    }
}

/// What clamping took away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamped {
    /// Pixels made darker.
    pub pixels: usize,
    /// Luminance they lost, summed over the pixels (of a signed layer: of its magnitude).
    pub energy: f64,
    /// The layer's luminance before, the same way.
    pub before: f64,
}

/// Scales each pixel of `signal` whose luminance (its magnitude, for signed layers) exceeds `factor` times the greatest
/// among its eight neighbours down to that. `signal` is premultiplied by `share` ([0, 1]): neighbours without a share do
/// not count, and a pixel without a neighbour that does is left alone.
///
/// # Errors
/// [`Error::Argument`] if the factor is below 1 or the pictures differ in size.
pub fn clamp(params: &Params, share: &Image<f32>, signal: &mut Image<Vec3>) -> Result<Clamped> {
    params.check()?;
    crate::check_sizes("firefly clamp", signal.size(), &[("share", share.size())])?;
    Ok(cpu::clamp(params, share, signal))
}

#[cfg(test)]
mod tests;
