//! Worlds as shaders read them, and of them proxies under an environment at infinity.

use super::{ProxyWorld, RealWorld, Reflectance};
use crate::bvh::Tlas;
use bytemuck::Pod;
use glam::Vec3;
use pano_core::gpu::{Constant, Piece, Words};
use pano_core::image::RadianceImage;

/// Words of a rectangle, of a placed mesh, of a surface's reflectance.
const RECTANGLE_WORDS: u32 = 18;
const PLACED_WORDS: u32 = 15;
const REFLECTANCE_WORDS: u32 = 4;

/// What worlds have in common, for shaders to include after [`crate::objects::gpu::OBJECTS`].
pub(crate) const ENVIRONMENT: Piece =
    Piece { text: include_str!("environment.wgsl"), constants: || vec![Constant::u32("AT_ANYTHING", AT_ANYTHING)] };

/// A ray that counts whatever lies on it.
pub(crate) const AT_ANYTHING: u32 = 2;

/// What rays can ask of proxies and of infinity, for shaders to include after [`crate::tracer::gpu::QUESTS`].
pub(crate) const PROXIES: Piece = Piece {
    text: include_str!("proxies.wgsl"),
    constants: || {
        vec![
            Constant::u32("RECTANGLE_WORDS", RECTANGLE_WORDS),
            Constant::u32("PLACED_WORDS", PLACED_WORDS),
            Constant::u32("REFLECTANCE_WORDS", REFLECTANCE_WORDS),
        ]
    },
};

pano_core::uniform! {
    /// `World` of the shader.
    pub(crate) struct World {
        /// Columns of the turn from the world into the panorama's frame.
        pano_x: Vec3,
        rectangles: u32,
        pano_y: Vec3,
        rectangle_count: u32,
        pano_z: Vec3,
        placed: u32,
        capture: Vec3,
        reflectances: u32,
        light_size: [u32; 2],
        light: u32,
        /// Where the irradiance by normal begins among the pictures, of which the environment is the first.
        irradiance: u32,
        size: [u32; 2],
        irradiance_size: [u32; 2],
    }
}

/// A world that shaders know.
pub(crate) trait GpuWorld: RealWorld {
    /// `World` of the shader.
    type Uniform: Pod;

    /// The hierarchy over its meshes, if it has any.
    fn tlas(&self) -> Option<&Tlas>;

    /// Adds its tables to `words` and its pictures to `pictures`, three numbers a pixel.
    fn pack(&self, words: &mut Words, pictures: &mut Vec<f32>) -> Self::Uniform;
}

/// Adds a picture: where it begins, and its size.
pub(crate) fn add_picture(image: &RadianceImage, pictures: &mut Vec<f32>) -> (u32, [u32; 2]) {
    let at = pictures.len() as u32;
    pictures.extend(image.data().iter().flat_map(|p| p.to_array()));
    (at, [image.width() as u32, image.height() as u32])
}

impl GpuWorld for ProxyWorld {
    type Uniform = World;

    fn tlas(&self) -> Option<&Tlas> {
        Some(&self.tlas)
    }

    fn pack(&self, words: &mut Words, pictures: &mut Vec<f32>) -> World {
        let rectangles = words.at();
        for r in &self.rectangles {
            words.matrix(&r.local_from_world.matrix3);
            words.vec3(r.local_from_world.translation.into());
            words.vec3(r.normal);
            words.numbers(r.half.to_array());
            words.word(r.surface);
        }
        let meshes: Vec<[u32; 2]> = self.meshes.iter().map(|(mesh, ..)| mesh.pack(words)).collect();
        let placed = words.at();
        for ((_, place, surface), mesh) in self.meshes.iter().zip(meshes) {
            words.matrix(&place.matrix3);
            words.vec3(place.translation.into());
            words.words(mesh);
            words.word(*surface);
        }
        let reflectances = words.at();
        for reflectance in &self.reflectances {
            match *reflectance {
                Reflectance::Known(rho) => {
                    words.number(-1.0);
                    words.vec3(rho);
                }
                Reflectance::FromPicture { cap } => {
                    words.number(cap);
                    words.vec3(Vec3::ZERO);
                }
            }
        }
        let (light, light_size) = self.light.as_ref().map_or((0, [1, 1]), |light| light.pack(words));
        let (_, size) = add_picture(&self.environment, pictures);
        let (irradiance, irradiance_size) = self.irradiance.as_ref().map_or((0, [1, 1]), |map| add_picture(map, pictures));
        let [pano_x, pano_y, pano_z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.pano_from_world * axis);
        World {
            pano_x,
            rectangles,
            pano_y,
            rectangle_count: self.rectangles.len() as u32,
            pano_z,
            placed,
            capture: self.capture,
            reflectances,
            light_size,
            light,
            irradiance,
            size,
            irradiance_size,
        }
    }
}

impl ProxyWorld {
    /// Whether any proxy is a mesh.
    pub(crate) fn has_meshes(&self) -> bool {
        !self.tlas.is_empty()
    }
}
