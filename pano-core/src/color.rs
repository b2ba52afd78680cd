//! Colour: luminance and the sRGB transfer curve (IEC 61966-2-1).

use glam::Vec3;

/// Rec.709 luminance weights of linear RGB.
pub const LUMINANCE_WEIGHTS: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Rec.709 luminance of a linear colour.
#[inline]
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(LUMINANCE_WEIGHTS)
}

/// One sRGB-encoded channel in [0, 1] to linear.
#[inline]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// One linear channel to sRGB-encoded; the input is clamped to [0, 1] (NaN becomes 0).
#[inline]
pub fn linear_to_srgb(linear: f32) -> f32 {
    let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_and_16_bit_code_survives_the_round_trip() {
        for max in [255u32, 65535] {
            for code in 0..=max {
                let back = linear_to_srgb(srgb_to_linear(code as f32 / max as f32)) * max as f32;
                assert_eq!(back.round() as u32, code, "of {max}");
            }
        }
    }

    #[test]
    fn nan_and_out_of_range_values_are_clamped() {
        assert_eq!(linear_to_srgb(f32::NAN), 0.0);
        assert_eq!(linear_to_srgb(-1.0), 0.0);
        assert_eq!(linear_to_srgb(7.0), linear_to_srgb(1.0));
    }
}
