//! MR360's tracer on the GPU: [`super::render`] over proxies under an environment at infinity ([`render`]), and over captured radiance
//! ([`render_captured`]).
//!
//! The random numbers and what is made of them are the CPU's, so that a frame differs by rounding. Recursion is a loop from question to
//! question (`ask.wgsl`): over proxies in one kernel, over captured radiance in small ones that take turns
//! (`tracer/gpu/wave/follow.wgsl`).

mod captured;
pub(crate) mod lighting;
mod proxies;

pub use captured::{SHADER as CAPTURED, render_captured};
pub use proxies::{SHADER, render};

use super::frame::{MAX_LIGHTS, no_darker_than_black};
use super::shade::{BEHIND_ROUGHNESS, MAX_DEPTH};
use super::{Lit, Params};
use crate::tracer::gpu::scene::{GpuPixel, Submissions};
use crate::tracer::{Frame, Pixel, Traced, layers};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lighting::{LIGHTING, Lighting, MAPS};
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Layout, Piece, Rows, Shader, flag};
use pano_core::image::Image;

/// `LitPixel` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct LitPixel {
    pixel: GpuPixel,
    photo: Vec3,
    mixed: u32,
}

/// Samples on their way from question to question, for shaders to include after [`LIGHTING`].
const QUESTIONS: Piece = Piece {
    text: include_str!("ask.wgsl"),
    constants: || vec![Constant::u32("MAX_DEPTH", MAX_DEPTH), Constant::f32("BEHIND_ROUGHNESS", BEHIND_ROUGHNESS)],
};

/// Light without shadows.
const NO_EFFECTS: &[(&str, f64)] = &[("SHADOWS", 0.0), ("AMBIENT_OCCLUSION", 0.0), ("MIRRORING", 0.0)];

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    proxies::layouts().into_iter().chain(captured::layouts()).collect()
}

/// What this frame calls for over any world; the rest is not compiled.
fn overrides(frame: &Frame<'_>, params: &Params<'_>) -> Vec<(&'static str, f64)> {
    vec![
        ("GLOSS", flag(frame.objects.gloss())),
        ("BODIES", flag(frame.objects.transmit())),
        ("TEXTURES", flag(frame.objects.textured())),
        ("SHADOWS", flag(params.shadows)),
        ("AMBIENT_OCCLUSION", flag(params.ambient_occlusion)),
        ("MIRRORING", flag(params.gloss > 0.0)),
    ]
}

const PIXELS: u32 = 6;
const REACHED: u32 = 9;

/// A frame's pixels, and how many samples reach each lamp, as the bands come.
struct Finished {
    size: (usize, usize),
    lamps: usize,
    pixels: Vec<LitPixel>,
    reached: Vec<u32>,
}

impl Finished {
    /// Nothing of a frame with so many `lamps`.
    fn new(frame: &Frame<'_>, lamps: usize) -> Self {
        Self { size: (frame.camera.width, frame.camera.height), lamps, pixels: Vec::new(), reached: Vec::new() }
    }

    /// Does `work` with each band in the GPU's memory, its pixels and counts among it; false if it does not end.
    fn over_bands(
        &mut self,
        gpu: &Gpu,
        cut: Submissions,
        params: &Params<'_>,
        mut work: impl FnMut(Rows, &[(u32, GpuBuffer)]) -> GpuResult<bool>,
    ) -> GpuResult<bool> {
        for band in cut.bands() {
            let rows = cut.rows(&band);
            let photo = &params.photo.data()[band.start * self.size.0..band.end * self.size.0];
            let before = photo.iter().map(|&photo| LitPixel { photo, ..LitPixel::zeroed() });
            let counts = rows.pixels() * self.lamps;
            let [pixels, reached] = [gpu.upload_slice(&before.collect::<Vec<_>>())?, gpu.buffer::<u32>(counts.max(1))?];
            let held = [(PIXELS, pixels), (REACHED, reached)];
            if !work(rows, &held)? {
                return Ok(false);
            }
            self.pixels.extend(gpu.read_slice::<LitPixel>(&held[0].1, rows.pixels())?);
            self.reached.extend(gpu.read_slice::<u32>(&held[1].1, counts)?);
        }
        Ok(true)
    }

    /// What the whole frame has come to.
    fn lit(self, frame: &Frame<'_>, samples: u32) -> Lit {
        let share = 1.0 / samples as f32;
        let (width, height) = self.size;
        let shadow =
            |lamp: usize| Image::from_fn(width, height, |x, y| self.reached[(y * width + x) * self.lamps + lamp] as f32 * share);
        let finished: Vec<Pixel> = self.pixels.iter().map(|p| no_darker_than_black(p.pixel.finish(samples))).collect();
        let traced = Traced {
            layers: layers(frame.camera, finished.iter()),
            rays: self.pixels.iter().map(|p| u64::from(p.pixel.rays)).sum(),
            discarded: self.pixels.iter().map(|p| u64::from(p.pixel.discarded)).sum(),
            sampling: None,
        };
        Lit { traced, shadows: (0..self.lamps).map(shadow).collect() }
    }
}
