//! The captured radiance field as shaders read it. Its tables (irradiance, lamps, light) are made on the CPU.

use super::{AT_CAPTURE, CapturedWorld, LEAVE, hidden, irradiance, lamps, mirrors};
use crate::bvh::Tlas;
use crate::prt::gpu::GpuDepthField;
use crate::world::gpu::GpuWorld;
use crate::world::gpu::add_picture;
use glam::Vec3;
use pano_core::gpu::{Constant, Gpu, GpuResult, Piece, Words};

/// What can be asked of a captured field, for shaders to include after [`crate::world::gpu::ENVIRONMENT`], [`crate::prt::gpu::MARCHING`]
/// and [`crate::cone::CONES`].
pub(crate) const CAPTURED: Piece = Piece {
    text: concat!(include_str!("captured.wgsl"), include_str!("tell.wgsl")),
    constants: || {
        vec![
            Constant::f32("LEAVE", LEAVE),
            Constant::f32("LEAST_ALIKE", irradiance::LEAST_ALIKE),
            Constant::f32("BRIGHTEST_IMAGE", mirrors::BRIGHTEST),
            Constant::u32("TEXEL_WORDS", irradiance::TEXEL_WORDS),
            Constant::u32("LAMP_WORDS", lamps::LAMP_WORDS),
            Constant::f32("AT_CAPTURE", AT_CAPTURE),
            Constant::f32("GLOW", hidden::GLOW),
            Constant::u32("CELL_BITS", hidden::CELL_BITS),
            Constant::u32("NO_INFINITY", NO_INFINITY),
        ]
    },
};

/// [`World`]'s `infinity` if the panorama has depth everywhere.
const NO_INFINITY: u32 = u32::MAX;

pano_core::uniform! {
    /// `World` of the shader.
    pub(crate) struct World {
        pano_x: Vec3,
        cap: f32,
        pano_y: Vec3,
        lamps: u32,
        pano_z: Vec3,
        lamp_count: u32,
        capture: Vec3,
        lamp_share: f32,
        light_size: [u32; 2],
        light: u32,
        infinity: u32,
        size: [u32; 2],
        fine: u32,
        coarse: u32,
        fine_size: [u32; 2],
        coarse_size: [u32; 2],
        hidden_samples: u32,
        mirrors: u32,
        mirrors_size: [u32; 2],
        seed: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

impl GpuWorld for CapturedWorld {
    type Uniform = World;

    fn tlas(&self) -> Option<&Tlas> {
        None
    }

    fn pack(&self, words: &mut Words, pictures: &mut Vec<f32>) -> World {
        let (_, size) = add_picture(&self.radiance, pictures);
        // Which texel it is: one word in place of three numbers, and the largest panorama has a binding to itself.
        let infinity = self.infinity.as_ref().map_or(NO_INFINITY, |shows| words.words(shows.data().iter().copied()));
        let (light, light_size) = self.light.as_ref().map_or((0, [1, 1]), |light| light.pack(words));
        let [(fine, fine_size), (coarse, coarse_size)] = self.irradiance.as_ref().map_or([(0, [0, 0]); 2], |map| map.pack(words));
        let (lamps, lamp_count) = self.lamps.pack(words);
        let (mirrors, mirrors_size) = self.mirrors.as_ref().map_or((0, [0, 0]), |mirrors| {
            let at = words.numbers(mirrors.data().iter().copied());
            (at, [mirrors.width() as u32, mirrors.height() as u32])
        });
        let [pano_x, pano_y, pano_z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.world_from_pano.inverse() * axis);
        World {
            pano_x,
            cap: self.cap,
            pano_y,
            lamps,
            pano_z,
            lamp_count,
            capture: self.capture,
            lamp_share: self.lamps.largest_share(),
            light_size,
            light,
            infinity,
            size,
            fine,
            coarse,
            fine_size,
            coarse_size,
            hidden_samples: self.hidden_samples,
            mirrors,
            mirrors_size,
            seed: self.seed,
            pad0: 0,
            pad1: 0,
            pad2: 0,
        }
    }
}

impl CapturedWorld {
    /// Copies its depth to the GPU.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if it does not fit a binding, or what has become of the device.
    pub(crate) fn field_on(&self, gpu: &Gpu) -> GpuResult<GpuDepthField> {
        GpuDepthField::new(gpu, &self.field)
    }
}
