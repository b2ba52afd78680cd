//! Surface materials in glTF's metallic-roughness terms, with textures.

pub use crate::texture::{Texture, Wrap};

use glam::Vec3;

/// A surface material, in the terms of glTF 2.0 and its KHR extensions. Factors multiply their texture where there is one.
#[derive(Clone, Debug)]
pub struct Material {
    /// Diffuse reflectance of dielectrics, reflectance at normal incidence of metals, tint of transmission. Linear, [0, 1].
    pub base_color: Vec3,
    /// RGB multiplies `base_color`.
    pub base_color_texture: Option<Texture>,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// glTF roughness in [0, 1]; the GGX width is its square. 0 is a perfect mirror.
    pub roughness: f32,
    /// G multiplies `roughness`, B multiplies `metallic`.
    pub metallic_roughness_texture: Option<Texture>,
    /// Strength of the dielectric's specular lobe in [0, 1] (KHR_materials_specular); 0 is pure Lambert.
    pub specular: f32,
    /// Colour of the dielectric's specular lobe at normal incidence, [0, 1].
    pub specular_color: Vec3,
    /// Refractive index, ≥ 1.
    pub ior: f32,
    /// Share of light that enters the body instead of being scattered diffusely, [0, 1].
    pub transmission: f32,
    /// A thin sheet: light passes straight through. Otherwise the mesh bounds a solid body.
    pub thin: bool,
    /// Colour of white light after `attenuation_distance` in the body (KHR_materials_volume).
    pub attenuation_color: Vec3,
    /// Metres; infinite for a clear body.
    pub attenuation_distance: f32,
    /// Emitted radiance, ≥ 0, may exceed 1.
    pub emissive: Vec3,
    /// RGB multiplies `emissive`.
    pub emissive_texture: Option<Texture>,
    /// Tangent-space normals in RGB, 0.5 meaning 0.
    pub normal_texture: Option<Texture>,
    /// Scales the x and y of the normal texture.
    pub normal_scale: f32,
}

impl Default for Material {
    /// A rough white dielectric: base colour 0.8, roughness 1, ior 1.5, specular 1.
    fn default() -> Self {
        Self {
            base_color: Vec3::splat(0.8),
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            specular: 1.0,
            specular_color: Vec3::ONE,
            ior: 1.5,
            transmission: 0.0,
            thin: false,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

impl Material {
    /// Pure Lambert with the given reflectance.
    pub fn diffuse(base_color: Vec3) -> Self {
        Self { base_color, specular: 0.0, ..Self::default() }
    }

    /// A metal with the given reflectance at normal incidence and glTF roughness.
    pub fn metal(base_color: Vec3, roughness: f32) -> Self {
        Self { base_color, metallic: 1.0, roughness, ..Self::default() }
    }

    /// Clear solid glass.
    pub fn glass(ior: f32, roughness: f32) -> Self {
        Self { base_color: Vec3::ONE, transmission: 1.0, roughness, ior, ..Self::default() }
    }

    /// A black body that emits `radiance`.
    pub fn emitter(radiance: Vec3) -> Self {
        Self { base_color: Vec3::ZERO, specular: 0.0, emissive: radiance, ..Self::default() }
    }
}
