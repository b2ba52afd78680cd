//! Lights at infinity: what light detection finds in a panorama, and what casts shadows.

use crate::image::RadianceImage;
use crate::sphere;
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

/// Roughness of each of the glossy maps of [`RadianceMaps`]; between two of them maps are mixed.
pub const GLOSSY_ROUGHNESS: [f32; 4] = [0.25, 0.5, 0.75, 1.0];

/// What image-based lighting looks up: a panorama at infinity, convolved with the lobes of materials. All pictures are
/// equirectangular and in the panorama's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMaps {
    /// By normal: the radiance that a white Lambertian surface sends back, irradiance / π.
    pub diffuse: RadianceImage,
    /// By the mirrored view direction: what a lobe of the roughness in [`GLOSSY_ROUGHNESS`] (GGX with α = roughness²) sees on
    /// the average.
    pub glossy: [RadianceImage; GLOSSY_ROUGHNESS.len()],
    /// By direction: what a mirror sees.
    pub mirror: RadianceImage,
}

impl RadianceMaps {
    /// Radiance that a white Lambertian surface with unit `normal` sends back.
    #[inline]
    pub fn diffuse(&self, normal: Vec3) -> Vec3 {
        sphere::bilinear(&self.diffuse, sphere::uv_from_direction(normal))
    }

    /// Mean radiance in the lobe about unit `direction` of a surface with `roughness` in [0, 1].
    #[inline]
    pub fn specular(&self, direction: Vec3, roughness: f32) -> Vec3 {
        let uv = sphere::uv_from_direction(direction);
        let above = GLOSSY_ROUGHNESS.iter().position(|&r| roughness <= r).unwrap_or(GLOSSY_ROUGHNESS.len() - 1);
        let rough = sphere::bilinear(&self.glossy[above], uv);
        let (lower, smooth) = match above {
            0 => (0.0, sphere::bilinear(&self.mirror, uv)),
            _ => (GLOSSY_ROUGHNESS[above - 1], sphere::bilinear(&self.glossy[above - 1], uv)),
        };
        let t = ((roughness - lower) / (GLOSSY_ROUGHNESS[above] - lower)).clamp(0.0, 1.0);
        smooth.lerp(rough, t)
    }
}
