//! Directions about an axis.

use crate::bsdf::concentric_disc;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Uniform over the cap of directions about `axis`.
pub(crate) fn cap_direction(axis: Vec3, cos_radius: f32, u: Vec2) -> Vec3 {
    let z = 1.0 - u.x * (1.0 - cos_radius);
    around(axis, z, u.y)
}

/// In proportion to the cosine to `normal`.
pub(crate) fn cosine_direction(normal: Vec3, u: Vec2) -> Vec3 {
    let disc = concentric_disc(u);
    let (a, b) = normal.any_orthonormal_pair();
    (a * disc.x + b * disc.y + normal * (1.0 - disc.length_squared()).max(0.0).sqrt()).normalize()
}

/// From the GGX lobe of that roughness about `axis`, as the convolved maps have it: half vectors about the axis.
pub(crate) fn lobe_direction(axis: Vec3, roughness: f32, u: Vec2) -> Vec3 {
    let alpha2 = roughness.powi(4);
    let cos2 = (1.0 - u.x) / (1.0 + (alpha2 - 1.0) * u.x);
    // The angle of the direction is twice that of the half vector; beyond 90° nothing is reflected.
    around(axis, (2.0 * cos2 - 1.0).max(0.0), u.y)
}

/// Density per steradian of [`lobe_direction`].
pub(crate) fn lobe_pdf(axis: Vec3, roughness: f32, direction: Vec3) -> f32 {
    // A smoother lobe has no density that could be looked up.
    let alpha2 = roughness.powi(4).max(1e-6);
    let cos = axis.dot(direction);
    if cos <= 0.0 {
        return 0.0;
    }
    let base = 0.5 * (1.0 + cos) * (alpha2 - 1.0) + 1.0;
    0.25 * FRAC_1_PI * alpha2 / (base * base)
}

/// The mirror image of a ray's `direction` in a surface with unit `normal` on either side.
#[inline]
pub(crate) fn mirrored(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

/// The unit vector whose cosine to `axis` is `z`, turned about it.
fn around(axis: Vec3, z: f32, turn: f32) -> Vec3 {
    let (a, b) = axis.any_orthonormal_pair();
    let (sin, cos) = (turn * TAU).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    (axis * z + (a * cos + b * sin) * r).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobe_directions_have_the_density_stated() {
        for roughness in [0.2f32, 0.4, 0.7] {
            for cos in [0.999f32, 0.98, 0.8, 0.3] {
                // The share of directions within that cosine: u.x falls with it.
                let share = (0..20_000)
                    .filter(|i| lobe_direction(Vec3::Z, roughness, Vec2::new((*i as f32 + 0.5) / 20_000.0, 0.3)).z >= cos);
                let share = share.count() as f32 / 20_000.0;
                let steps = 20_000;
                let height = (1.0 - cos) / steps as f32;
                let at = |i: i32| 1.0 - (i as f32 + 0.5) * height;
                let density = |z: f32| lobe_pdf(Vec3::Z, roughness, Vec3::new((1.0 - z * z).sqrt(), 0.0, z));
                let integral: f32 = (0..steps).map(|i| density(at(i)) * height).sum::<f32>() * TAU;
                assert!((share - integral).abs() < 0.003, "roughness {roughness}, within {cos}: {share} {integral}");
            }
        }
    }
}
