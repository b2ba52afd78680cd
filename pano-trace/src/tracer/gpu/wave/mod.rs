//! The path tracers on the GPU over a captured radiance field ([`CapturedWorld`]): [`crate::tracer::render`] in small kernels that take
//! turns (`wave.wgsl`).
//!
//! Random numbers, strategies and weights are the CPU's. The light on a back face is estimated with random numbers that are drawn from
//! its place, in cells as small as a tenth of a pixel: where rounding moves one of a hundred of them into another cell, the estimate is
//! another one than the CPU's, as good as that.
//!
//! The panorama, its depth and what is measured of its light must each fit a binding of the GPU.

pub(crate) mod follow;
mod hits;
pub(crate) mod layout;

pub use hits::{GpuHit, captured_hits};
pub use layout::SHADER;

use super::scene::{GpuScene, Submissions};
use super::{Started, sample, specialize};
use crate::prt::gpu::GpuDepthField;
use crate::tracer::{Frame, Lights, Method, TraceParams, Traced};
use crate::world::CapturedWorld;
use crate::world::captured::gpu::World;
use follow::{ASKED, Asked, Entry, FIELD, Kernels, RELITS, Relit, SIGHT};
use layout::{ADVANCE, BEGIN, LANES, Lane, PIXELS, Point, START, WAITING, Wave};
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Rows, flag};
use pano_core::progress::Progress;

/// [`crate::tracer::render`] of a captured field on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if the panorama, its depth or a table of the scene does not fit a binding, or what has become
/// of the device.
pub fn render_captured(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &CapturedWorld,
    params: &TraceParams,
    progress: &dyn Progress,
) -> GpuResult<Option<Traced>> {
    let held = Held::new(gpu, frame, world, params)?;
    let lane = held.waiting_bytes().max(size_of::<Lane>()).max(size_of::<Asked>());
    let cut = Submissions::new(gpu, frame, lane, 1);
    let (width, height) = (frame.camera.width, frame.camera.height);
    progress.begin("trace", 2 * height as u64);
    let mut pixels: Vec<Started> = Vec::with_capacity(width * height);
    for rows in cut.bands().map(|band| cut.rows(&band)) {
        let count = rows.pixels();
        let band = held.band(rows, gpu.buffer::<Started>(count)?, gpu.buffer::<Asked>(count)?)?;
        band.run(SIGHT)?;
        if !band.follow(&[], progress)? {
            return Ok(None);
        }
        band.run(START)?;
        pixels.extend(gpu.read_slice::<Started>(band.buffer(PIXELS), count)?);
        progress.advance(u64::from(rows.count));
    }
    sample(&mut pixels, frame.camera, params, progress, |pixels| {
        for range in cut.bands() {
            let rows = cut.rows(&range);
            let in_band = &mut pixels[range.start * width..range.end * width];
            let band = held.band(rows, gpu.upload_slice(in_band)?, gpu.buffer::<Asked>(rows.pixels())?)?;
            band.run(BEGIN)?;
            if !band.follow(&[ADVANCE], progress)? {
                return Ok(false);
            }
            in_band.copy_from_slice(&gpu.read_slice::<Started>(band.buffer(PIXELS), rows.pixels())?);
            progress.advance(u64::from(rows.count));
        }
        Ok(true)
    })
}

/// A frame's scene in the GPU's memory.
struct Held<'a> {
    gpu: &'a Gpu,
    scene: GpuScene<World>,
    field: GpuDepthField,
    constants: Vec<(&'static str, f64)>,
    /// All but the rows and the turn.
    uniform: Wave,
}

impl<'a> Held<'a> {
    fn new(gpu: &'a Gpu, frame: &Frame<'_>, world: &CapturedWorld, params: &TraceParams) -> GpuResult<Self> {
        let (scene, (clusters, lights)) = GpuScene::new(gpu, frame, world, |packed, words, _| {
            (packed.clusters, Lights::of(world, frame.camera.position, params.samples).pack(words))
        })?;
        let field = world.field_on(gpu)?;
        let mut constants = specialize(frame.objects, world, params);
        constants.push(("POINTS", flag(params.method != Method::Ibl)));
        let uniform = Wave {
            rows: Rows::all((0, 0)),
            view: scene.view,
            world: scene.world,
            field: field.uniform(),
            bounces: params.bounces,
            samples: params.samples,
            turn: 0,
            // A point that waits has three bounces at least, and what it waits for two less.
            most_waiting: (params.bounces.saturating_sub(1) / 2).max(1),
            clusters,
            lights,
        };
        Ok(Self { gpu, scene, field, constants, uniform })
    }

    /// Of the points of a pixel that may wait.
    fn waiting_bytes(&self) -> usize {
        self.uniform.most_waiting as usize * size_of::<Point>()
    }

    /// Some rows, with their pixels and questions.
    fn band(&self, rows: Rows, pixels: GpuBuffer, asked: GpuBuffer) -> GpuResult<Band<'_>> {
        let count = rows.pixels();
        let own = [
            (PIXELS, pixels),
            (ASKED, asked),
            (LANES, self.gpu.buffer::<Lane>(count)?),
            (WAITING, self.gpu.buffer::<Point>(count * self.uniform.most_waiting as usize)?),
            (RELITS, self.gpu.buffer::<Relit>(count)?),
        ];
        Ok(Band { held: self, rows, own })
    }
}

/// Some rows of a frame under way.
struct Band<'a> {
    held: &'a Held<'a>,
    rows: Rows,
    own: [(u32, GpuBuffer); 5],
}

impl Band<'_> {
    /// What is bound at `number`.
    ///
    /// # Panics
    /// If nothing is.
    fn buffer(&self, number: u32) -> &GpuBuffer {
        self.own.iter().find(|b| b.0 == number).map(|b| &b.1).expect("the number is one of a band's own")
    }

    fn kernels(&self) -> Kernels<'_> {
        let own = self.own.iter().map(|(number, buffer)| (*number, buffer));
        let buffers = self.held.scene.bindings().chain(self.held.field.bindings(FIELD)).chain(own).collect();
        Kernels { gpu: self.held.gpu, shader: &SHADER, constants: &self.held.constants, buffers, rows: self.rows }
    }

    fn uniform(&self, turn: u32) -> Wave {
        Wave { rows: self.rows, turn, ..self.held.uniform }
    }

    /// Runs a kernel.
    fn run(&self, entry: Entry) -> GpuResult<()> {
        self.kernels().run(entry, bytemuck::bytes_of(&self.uniform(0)))
    }

    /// Answers all rays, with `then` after each turn, until there are none; false if `progress` cancels.
    fn follow(&self, then: &[Entry], progress: &dyn Progress) -> GpuResult<bool> {
        self.kernels().follow(then, |turn| self.uniform(turn), progress)
    }
}
