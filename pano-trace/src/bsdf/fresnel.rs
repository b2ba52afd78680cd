//! Fresnel reflectance.

use glam::Vec3;

/// Unpolarised reflectance of a smooth dielectric boundary; `eta` is the index behind it over the index in front, `cos`
/// the cosine of incidence in [0, 1]. 1 under total internal reflection.
#[inline]
pub(crate) fn dielectric(cos: f32, eta: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Schlick's approximation for a metal that makes up `share` of the surface; `f0` is already scaled by the share.
#[inline]
pub(super) fn schlick(f0: Vec3, share: f32, cos: f32) -> Vec3 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    f0 + (Vec3::splat(share) - f0) * (m2 * m2 * m)
}

/// Reflectance at normal incidence of a real surface with full gloss: that of glass, varnish and water, about.
pub(super) const GLOSS_F0: f32 = 0.04;

/// Schlick's reflectance of a real surface with full gloss.
#[inline]
pub(crate) fn gloss(cos: f32) -> f32 {
    GLOSS_F0 + (1.0 - GLOSS_F0) * (1.0 - cos.clamp(0.0, 1.0)).powi(5)
}
