//! Lights at infinity: what light detection finds in a panorama, and what casts shadows.

use glam::Vec3;
use std::f32::consts::TAU;

/// A patch of a panorama that shines so much brighter than the rest that it casts a shadow of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Unit direction towards the light, in the frame of the panorama it was found in.
    pub direction: Vec3,
    /// Irradiance in W/m² (in units of the panorama) on a surface that faces the light.
    pub irradiance: Vec3,
    /// Solid angle of the patch in steradians, (0, 4π); it widens the penumbra.
    pub solid_angle: f32,
    /// The irradiance to render with. It differs from `irradiance` where clipping is known to have taken light away.
    pub intensity: Vec3,
}

impl DirectionalLight {
    /// Cosine of the angular radius of the cap that has the light's solid angle, in [−1, 1).
    pub fn cos_radius(&self) -> f32 {
        1.0 - self.solid_angle / TAU
    }

    /// The light seen from a frame that `rotation` turns into.
    pub fn rotated(self, rotation: glam::Quat) -> Self {
        Self { direction: rotation * self.direction, ..self }
    }
}
