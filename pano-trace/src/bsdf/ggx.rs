//! The GGX microfacet distribution (Walter et al. 2007) with Smith's masking, in the frame whose z is the normal.

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Density of microfacet normals at cosine `z`.
#[inline]
pub(super) fn distribution(z: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = z * z * (a2 - 1.0) + 1.0;
    a2 / (PI * t * t)
}

/// Smith's Λ at cosine `z` > 0.
#[inline]
fn lambda(z: f32, alpha: f32) -> f32 {
    let z2 = z * z;
    0.5 * ((1.0 + alpha * alpha * (1.0 - z2).max(0.0) / z2).sqrt() - 1.0)
}

/// G₁: share of microfacets seen from cosine `z`.
#[inline]
pub(crate) fn masking(z: f32, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(z, alpha))
}

/// G₂, height-correlated (Heitz 2014): share seen from both cosines.
#[inline]
pub(crate) fn shadowing(o: f32, i: f32, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(o, alpha) + lambda(i, alpha))
}

/// A microfacet normal among those visible from `w` (z ≥ 0), by spherical caps (Dupuy & Benyoub 2023). Its density is
/// D(h)·G₁(w)·⟨w, h⟩/w.z.
#[inline]
pub(crate) fn sample_visible_normal(w: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(w.x * alpha, w.y * alpha, w.z).normalize();
    let z = (1.0 - u.x) * (1.0 + stretched.z) - stretched.z;
    let (sin, cos) = (TAU * u.y).sin_cos();
    let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let cap = Vec3::new(r * cos, r * sin, z) + stretched;
    Vec3::new(cap.x * alpha, cap.y * alpha, cap.z.max(1e-7)).normalize()
}
