//! Directions about an axis.

use crate::bsdf::concentric_disc;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

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
