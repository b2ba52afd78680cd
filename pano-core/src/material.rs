//! Surface materials in glTF's metallic-roughness terms, with textures.

use crate::image::Image;
use glam::{Affine2, Vec2, Vec3, Vec4};
use std::sync::Arc;

/// What a texture shows outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    Mirror,
    /// The border pixel goes on.
    Clamp,
}

/// A picture on a surface. Values are linear (colour textures are decoded when they are loaded).
#[derive(Clone, Debug)]
pub struct Texture {
    /// Linear RGBA, row 0 on top, shared between materials.
    pub image: Arc<Image<Vec4>>,
    /// Outside [0, 1] horizontally.
    pub wrap_u: Wrap,
    /// Outside [0, 1] vertically.
    pub wrap_v: Wrap,
    /// Applied to the mesh's (u, v) before the lookup (KHR_texture_transform).
    pub texture_from_mesh: Affine2,
}

impl Texture {
    /// A texture that repeats, without a transform.
    pub fn new(image: Arc<Image<Vec4>>) -> Self {
        Self { image, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, texture_from_mesh: Affine2::IDENTITY }
    }

    /// Bilinear lookup; (0, 0) is the picture's top left corner, as in glTF. A non-finite `uv` reads the corner.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let uv = self.texture_from_mesh.transform_point2(uv);
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let (w, h) = self.image.size();
        // One period is enough and keeps the float → integer conversion exact for far-away coordinates.
        let fold = |t: f32, wrap: Wrap, n: usize| match wrap {
            Wrap::Repeat => t.rem_euclid(1.0) * n as f32 - 0.5,
            Wrap::Mirror => t.rem_euclid(2.0) * n as f32 - 0.5,
            Wrap::Clamp => t.clamp(0.0, 1.0) * n as f32 - 0.5,
        };
        let index = |i: isize, wrap: Wrap, n: usize| match wrap {
            Wrap::Repeat => i.rem_euclid(n as isize) as usize,
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n as isize) as usize;
                i.min(2 * n - 1 - i)
            }
            Wrap::Clamp => i.clamp(0, n as isize - 1) as usize,
        };
        let (x, y) = (fold(uv.x, self.wrap_u, w), fold(uv.y, self.wrap_v, h));
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: isize, dy: isize| {
            self.image.get(index(x0 as isize + dx, self.wrap_u, w), index(y0 as isize + dy, self.wrap_v, h))
        };
        at(0, 0).lerp(at(1, 0), fx).lerp(at(0, 1).lerp(at(1, 1), fx), fy)
    }
}

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
