//! Inverse tone mapping: from a picture of low dynamic range to radiance that lights believably.
//!
//! MR360, equations 1–3: every pixel's linear colour is multiplied by k = 10·Y¹⁰ + 1.8 with Y = 0.3 R + 0.59 G + 0.11 B.
//! The operator looks at one pixel at a time, so it does not flicker in video. White becomes 11.8, mid-grey is little
//! more than scaled by 1.8. Clipped lights stay dimmer than in the world: nothing in the picture tells how bright they
//! were.
//!
//! The paper does not say in which encoding its colours are; here they are linear light, as all rendering needs.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use glam::Vec3;
use pano_core::image::RadianceImage;
use pano_core::{Error, Result};

/// Weights of the luminance Y that the operator and MR360's light detection use.
pub const LUMA_WEIGHTS: Vec3 = Vec3::new(0.3, 0.59, 0.11);

/// What white adds to k.
const GAIN: f32 = 10.0;
/// k of black.
const BASE: f32 = 1.8;

/// The factor k that multiplies a linear colour in [0, 1]; from 1.8 (black) to 11.8 (white).
#[inline]
pub fn factor(rgb: Vec3) -> f32 {
    // Four products; `powi` is a call and a loop, and a frame has millions of pixels.
    let y = rgb.dot(LUMA_WEIGHTS);
    let y2 = y * y;
    let y4 = y2 * y2;
    GAIN * (y4 * y4 * y2) + BASE
}

/// Expands one linear colour. Channels are clamped to [0, 1] first, NaN counts as 0.
#[inline]
pub fn pixel(rgb: Vec3) -> Vec3 {
    // `f32::clamp` would let NaN through.
    let rgb = Vec3::from_array(rgb.to_array().map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 }));
    rgb * factor(rgb)
}

/// Expands `ldr`, linear in [0, 1], into `hdr`. Values outside [0, 1] are clamped to it first, and NaN counts as 0, so that
/// the output lies in [0, 11.8]: the tenth power would turn a picture that is no LDR picture into nonsense.
///
/// # Errors
/// [`Error::Argument`] if the pictures differ in size.
pub fn expand(ldr: &RadianceImage, hdr: &mut RadianceImage) -> Result<()> {
    check_sizes(ldr, hdr)?;
    cpu::expand(ldr, hdr);
    Ok(())
}

/// That both pictures have one size.
fn check_sizes(ldr: &RadianceImage, hdr: &RadianceImage) -> Result<()> {
    if ldr.size() == hdr.size() {
        return Ok(());
    }
    let ((w, h), (v, g)) = (ldr.size(), hdr.size());
    Err(Error::argument(format!("inverse tone mapping: the input has {w}×{h} pixels, the output {v}×{g}")))
}

#[cfg(test)]
mod tests;
