//! Interactive panoramic ray tracing on the GPU: the G-buffer with its motion, both passes, the updated panorama.
//!
//! Random numbers, strategies and weights are the CPU's, so that a frame differs by rounding, and by samples for which rounding turns a
//! choice over. Recursion is a loop from ray to ray, as the path tracers have it (`tracer/gpu/wave/follow.wgsl`); what a mirror at an
//! updated surface shows takes turns as well.
//!
//! Screen-space reach ([`super::Reach::Screen`]), a comparison with the paper's way that no pipeline takes, is the CPU's alone.

mod estimate;
mod gbuffer;
mod layout;
mod update;

pub use layout::SHADER;
pub(crate) use layout::layouts;

use super::trace::trace_params;
use super::{Earlier, Frame, Params, Update};
use crate::prt::gpu::GpuDepthField;
use crate::tracer::gpu::scene::{GpuScene, Submissions, View};
use crate::tracer::gpu::specialize;
use crate::tracer::gpu::wave::follow::{ASKED, Asked, FIELD, Kernels, RELITS, Relit};
use crate::tracer::{self, Lights};
use crate::world::captured::gpu::World;
use crate::world::{CapturedWorld, RealWorld};
use bytemuck::{Pod, Zeroable};
use layout::{EstimateLane, Iprt};
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Rows};
use update::GpuUpdate;

/// Samples that call for as many lights as there ever are.
const MOST_SAMPLES: u32 = u32::MAX;

/// The scene of a frame in the GPU's memory, for all its stages.
#[derive(Debug)]
pub struct GpuFrame {
    scene: GpuScene<World>,
    field: GpuDepthField,
    /// An update that knows of no change.
    unchanged: GpuUpdate,
    constants: Vec<(&'static str, f64)>,
    /// All but the rows and what a stage sets.
    uniform: Iprt,
}

impl GpuFrame {
    /// Copies what rays of `frame` ask for, with where the objects were in an `earlier` one.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if the panorama, its depth or a table of the scene does not fit a binding, or what has
    /// become of the device.
    pub fn new(gpu: &Gpu, frame: &Frame<'_>, world: &CapturedWorld, earlier: Option<&Earlier>) -> GpuResult<Self> {
        let of_tracers = of_tracers(frame);
        let (scene, (clusters, lights, moves)) = GpuScene::new(gpu, &of_tracers, world, |packed, words, _| {
            let lights = Lights::of(world, frame.camera.position, MOST_SAMPLES).pack(words);
            (packed.clusters, lights, earlier.map_or(0, |earlier| frame.objects.pack_moves(&earlier.objects, words)))
        })?;
        let field = world.field_on(gpu)?;
        let uniform = Iprt {
            view: scene.view,
            world: scene.world,
            field: field.uniform(),
            clusters,
            lights,
            view_size: [frame.camera.width as u32, frame.camera.height as u32],
            earlier: View::of(earlier.map_or(frame.camera, |earlier| &earlier.camera)),
            has_earlier: u32::from(earlier.is_some()),
            at_capture: u32::from(frame.camera.position == frame.capture),
            moves,
            ..Iprt::zeroed()
        };
        let constants = specialize(frame.objects, world, &trace_params(&Params::default()));
        let unchanged = GpuUpdate::of(gpu, &Update::default())?;
        Ok(Self { scene, field, unchanged, constants, uniform })
    }

    /// Does `work` with the view's `pixels`, band by band, in the GPU's memory; false if it does not end.
    fn over_view<P: Pod>(
        gpu: &Gpu,
        frame: &Frame<'_>,
        pixels: &mut [P],
        mut work: impl FnMut(Rows, &GpuBuffer) -> GpuResult<bool>,
    ) -> GpuResult<bool> {
        let bytes = size_of::<P>().max(size_of::<Asked>()).max(size_of::<EstimateLane>());
        let cut = Submissions::new(gpu, &of_tracers(frame), bytes, 1);
        let mut rest = pixels;
        for band in cut.bands() {
            let rows = cut.rows(&band);
            let (in_band, below) = rest.split_at_mut(rows.pixels());
            rest = below;
            let held = gpu.upload_slice(in_band)?;
            if !work(rows, &held)? {
                return Ok(false);
            }
            in_band.copy_from_slice(&gpu.read_slice(&held, rows.pixels())?);
        }
        Ok(true)
    }

    /// Kernels over some rows, with all that they bind: what rays need, and `own`.
    fn kernels<'a>(
        &'a self,
        gpu: &'a Gpu,
        rows: Rows,
        rays: &'a [(u32, GpuBuffer)],
        own: impl IntoIterator<Item = (u32, &'a GpuBuffer)>,
    ) -> Kernels<'a> {
        let rays = rays.iter().map(|(number, buffer)| (*number, buffer));
        let buffers = self.scene.bindings().chain(self.field.bindings(FIELD)).chain(rays).chain(own).collect();
        Kernels { gpu, shader: &SHADER, constants: &self.constants, buffers, rows }
    }

    /// How many of the lights so many samples call for.
    fn lights(&self, frame: &Frame<'_>, world: &impl RealWorld, samples: u32) -> [u32; 2] {
        [self.uniform.lights[0], Lights::of(world, frame.camera.position, samples).len() as u32]
    }
}

/// Memory of the rays in hand, one a pixel.
fn rays_of(gpu: &Gpu, rows: Rows) -> GpuResult<[(u32, GpuBuffer); 2]> {
    Ok([(ASKED, gpu.buffer::<Asked>(rows.pixels())?), (RELITS, gpu.buffer::<Relit>(rows.pixels())?)])
}

fn of_tracers<'a>(frame: &Frame<'a>) -> tracer::Frame<'a> {
    tracer::Frame { camera: frame.camera, objects: frame.objects, stream: frame.stream }
}
