//! Brightness of lights that clipping has dimmed, guessed from their size (MR360, section 4.1).
//!
//! The paper brightens small patches, which are likely lamps, and dims very large ones, which may be clouds, by a mapping it
//! does not print. Here it is a power law of the solid angle that leaves 0.1 sr alone and halves the light at 0.6 sr, the
//! range in which the paper maps solid angles (section 6.3), and ends at factors of ½ and 4. It is a gentle one on purpose:
//! among the clipped patches of eighteen HDR panoramas the true factor of equally large ones varies a hundredfold.

/// Solid angle in steradians of a light that keeps its irradiance.
const NEUTRAL: f32 = 0.1;
/// ln ½ / ln 6.
const EXPONENT: f32 = -0.386_85;
/// Smallest and largest factor.
const RANGE: [f32; 2] = [0.5, 4.0];

/// What to multiply the irradiance of a light found in an LDR picture by, given its solid angle in steradians, ≥ 0.
pub fn intensity_factor(solid_angle: f32) -> f32 {
    // 0 to a negative power is infinite, which is clamped.
    (solid_angle / NEUTRAL).powf(EXPONENT).clamp(RANGE[0], RANGE[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lights_gain_and_large_ones_lose() {
        for (solid_angle, factor) in [(0.0, 4.0), (1e-4, 4.0), (0.1, 1.0), (0.6, 0.5), (12.0, 0.5)] {
            assert!((intensity_factor(solid_angle) - factor).abs() < 1e-4, "{solid_angle}: {}", intensity_factor(solid_angle));
        }
        let sizes: Vec<f32> = (1..100).map(|i| intensity_factor(i as f32 * 0.01)).collect();
        assert!(sizes.windows(2).all(|w| w[0] >= w[1]));
    }
}
