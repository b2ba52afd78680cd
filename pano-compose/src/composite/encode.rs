//! 8-bit output.

use pano_core::color::linear_to_srgb;
use pano_core::image::{Image, RadianceImage};

/// `linear` as 8-bit sRGB, rounded to the nearest code; values above 1 clip to 255, below 0 and NaN to 0. No tone mapping.
///
/// Decoding an 8-bit sRGB picture with [`pano_core::color::srgb_to_linear`] and encoding it here gives every code back,
/// so that pixels the composite left untouched keep the codes of the source.
pub fn encode_ldr(linear: &RadianceImage) -> Image<[u8; 3]> {
    Image::par_from_fn(linear.width(), linear.height(), |x, y| {
        linear.get(x, y).to_array().map(|c| (linear_to_srgb(c) * 255.0).round() as u8)
    })
}
