//! The equirectangular picture as a sphere of directions.
//!
//! λ = (u − ½)·2π, θ = v·π, **d = (sin θ sin λ, cos θ, −sin θ cos λ)**: the picture's centre looks to −Z, u grows to the
//! right, +X is at u = ¾.

mod convention;
mod lookup;
pub mod resample;

pub use convention::Convention;
pub use lookup::wrap_texel;
pub use lookup::{Tap, bilinear, bilinear_of, bilinear_taps};

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Direction of the point (u, v) of an equirectangular picture; u outside [0, 1) wraps by periodicity.
#[inline]
pub fn direction_from_uv(uv: Vec2) -> Vec3 {
    let (sin_l, cos_l) = ((uv.x - 0.5) * TAU).sin_cos();
    let (sin_t, cos_t) = (uv.y * PI).sin_cos();
    Vec3::new(sin_t * sin_l, cos_t, -sin_t * cos_l)
}

/// The point (u, v) at which the equirectangular picture shows direction `d` (any length > 0); u ∈ [0, 1), v ∈ [0, 1].
/// At a pole u is 0.5.
#[inline]
pub fn uv_from_direction(d: Vec3) -> Vec2 {
    let horizontal = d.x.hypot(d.z);
    // atan2 keeps full precision at the poles, where acos(y) does not.
    let v = horizontal.atan2(d.y) / PI;
    let u = if horizontal == 0.0 { 0.5 } else { 0.5 + d.x.atan2(-d.z) / TAU };
    Vec2::new(if u >= 1.0 { u - 1.0 } else { u }, v)
}

/// Solid angle in steradians of one pixel of row `row`: (2π/W)·(cos θ_j − cos θ_{j+1}), exact, so that the whole
/// picture sums to 4π.
#[inline]
pub fn pixel_solid_angle(width: usize, height: usize, row: usize) -> f64 {
    use std::f64::consts::{PI, TAU};
    let (top, bottom) = (row as f64 / height as f64 * PI, (row + 1) as f64 / height as f64 * PI);
    // cos a − cos b as a product: no cancellation in thin rows.
    TAU / width as f64 * 2.0 * (0.5 * (top + bottom)).sin() * (0.5 * (bottom - top)).sin()
}

#[cfg(test)]
mod tests;
