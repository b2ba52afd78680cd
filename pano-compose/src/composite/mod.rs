//! Differential compositing: **composite = photo·(1 − coverage) + delta + object**.
//!
//! `delta` is the signed change of the real surfaces, premultiplied by their share of the pixel, and `object` the objects'
//! radiance, premultiplied by their coverage. Where coverage and delta are 0 the composite is the photo, bit for bit.
//!
//! The multiplier is the same change as a ratio, for compositing by hand: (photo·share + delta) / (photo·share), where
//! share = 1 − coverage. A black photo must not divide by nothing, so the photo counts as at least
//! [`MULTIPLIER_FLOOR`] times the frame's mean luminance in the denominator. In the limit photo → 0 the multiplier is
//! 1 + delta / (share·floor): finite, continuous, and independent of the frame's exposure.

mod channels;
mod cpu;
mod encode;
#[cfg(feature = "gpu")]
pub mod gpu;
mod irradiance;

pub use channels::exr_channels;
pub use encode::encode_ldr;
pub use irradiance::{GLOSS_RADIUS, IRRADIANCE_FLOOR, Irradiance, delta_from_ratio};

use glam::Vec3;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_core::{Error, Result};

/// Least radiance the multiplier divides by, as a fraction of the frame's mean luminance: a thousandth is ten stops below
/// the mean, darker than what an 8-bit picture tells from black.
pub const MULTIPLIER_FLOOR: f32 = 1e-3;

/// The finished picture and its change as a ratio.
#[derive(Clone, Debug, PartialEq)]
pub struct Composite {
    /// Linear radiance, finite and ≥ 0.
    pub color: RadianceImage,
    /// Changed real radiance divided by the photo's, ≥ 0 and finite; 1 where nothing changed or no real surface shows.
    pub multiplier: Image<Vec3>,
}

impl Composite {
    /// A black picture to composite into.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn new(width: usize, height: usize) -> Self {
        Self { color: Image::filled(width, height, Vec3::ZERO), multiplier: Image::filled(width, height, Vec3::ONE) }
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        self.color.size()
    }
}

/// What clamping the composite at 0 changed: noise in `delta` can take away more light than there is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamped {
    /// Pixels with at least one channel below 0.
    pub pixels: usize,
    /// Luminance that clamping added, summed over the pixels.
    pub energy: f64,
}

/// Puts `layers` over `photo` into `out` and tells how much had to be clamped.
///
/// # Errors
/// [`Error::Argument`] if the pictures differ in size.
pub fn composite(photo: &RadianceImage, layers: &TracedLayers, out: &mut Composite) -> Result<Clamped> {
    check_sizes(photo, layers, out)?;
    Ok(cpu::composite(photo, layers, out))
}

/// All pictures have the photo's size, or an error names the one that has not.
fn check_sizes(photo: &RadianceImage, layers: &TracedLayers, out: &Composite) -> Result<()> {
    let size = photo.size();
    for (name, other) in [
        ("object layer", layers.object.size()),
        ("coverage", layers.coverage.size()),
        ("delta layer", layers.delta.size()),
        ("depth", layers.depth.size()),
        ("normal layer", layers.normal.size()),
        ("albedo layer", layers.albedo.size()),
        ("output", out.color.size()),
        ("output's multiplier", out.multiplier.size()),
    ] {
        if other != size {
            return Err(Error::argument(format!(
                "compositing: the {name} has {}×{} pixels, the photo {}×{}",
                other.0, other.1, size.0, size.1
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
