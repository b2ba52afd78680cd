//! Brightness of lights that clipping has dimmed, guessed from their size (MR360, section 4.1, "ad-hoc mapping").

/// What to multiply the irradiance of a light found in an LDR picture by, given its solid angle in steradians.
pub fn intensity_factor(solid_angle: f32) -> f32 {
    let _ = solid_angle;
    1.0
}
