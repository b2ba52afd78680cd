//! The path tracers on the GPU over a captured radiance field ([`CapturedWorld`]): [`crate::tracer::render`] in small kernels that take
//! turns (`wave.wgsl`).
//!
//! Random numbers, strategies and weights are the CPU's. The light on a back face is estimated with random numbers that are drawn from
//! its place, in cells as small as a tenth of a pixel: where rounding moves one of a hundred of them into another cell, the estimate is
//! another one than the CPU's, as good as that.
//!
//! The panorama, its depth and what is measured of its light must each fit a binding of the GPU.

mod hits;
pub(crate) mod layout;

pub use hits::{GpuHit, captured_hits};
pub use layout::SHADER;

use super::scene::{GpuScene, Submissions};
use super::{Started, settle, specialize, traced};
use crate::prt::gpu::GpuDepthField;
use crate::tracer::{Frame, Lights, Method, TraceParams, Traced};
use crate::world::CapturedWorld;
use crate::world::captured::gpu::World;
use layout::{
    ADVANCE, ASKED, Asked, BEGIN, COUNTS, ENCOUNTER, Entry, FIELD, LANES, Lane, MARCH, PIXELS, Point, RELITS, Relit, SIGHT,
};
use layout::{START, TELL, WAITING, Wave};
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Kernel, Rows, flag};
use pano_core::progress::Progress;

/// Turns after which the rays under way are counted, at most: turns in which there are none cost little.
const TURNS: usize = 16;

/// [`crate::tracer::render`] of a captured field on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if the panorama, its depth or a table of the scene does not fit a binding, or what has become
/// of the device.
///
/// # Panics
/// If [`super::missing`] something.
pub fn render_captured(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &CapturedWorld,
    params: &TraceParams,
    progress: &dyn Progress,
) -> GpuResult<Option<Traced>> {
    assert_eq!(super::missing(params), None, "the caller asks before");
    let held = Held::new(gpu, frame, world, params)?;
    let lane = held.waiting_bytes().max(size_of::<Lane>()).max(size_of::<Asked>());
    let cut = Submissions::new(gpu, frame, lane, 1);
    let (width, height) = (frame.camera.width, frame.camera.height);
    progress.begin("trace", 2 * height as u64);
    let mut pixels: Vec<Started> = Vec::with_capacity(width * height);
    for rows in cut.bands().map(|band| cut.rows(&band)) {
        let count = rows.pixels();
        let band = held.band(rows, gpu.buffer::<Started>(count)?, gpu.buffer::<Asked>(count)?)?;
        band.run(SIGHT, 0, None)?;
        if !band.follow(&[], progress)? {
            return Ok(None);
        }
        band.run(START, 0, None)?;
        pixels.extend(gpu.read_slice::<Started>(band.buffer(PIXELS), count)?);
        progress.advance(u64::from(rows.count));
    }
    settle(&mut pixels, frame.camera, params.samples);
    for range in cut.bands() {
        let rows = cut.rows(&range);
        let in_band = &mut pixels[range.start * width..range.end * width];
        let band = held.band(rows, gpu.upload_slice(in_band)?, gpu.buffer::<Asked>(rows.pixels())?)?;
        band.run(BEGIN, 0, None)?;
        if !band.follow(&[ADVANCE], progress)? {
            return Ok(None);
        }
        in_band.copy_from_slice(&gpu.read_slice::<Started>(band.buffer(PIXELS), rows.pixels())?);
        progress.advance(u64::from(rows.count));
    }
    Ok(Some(traced(frame.camera, &pixels)))
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
    /// All that kernels can bind; `counts` of the rays in each turn.
    fn buffers<'b>(&'b self, counts: Option<&'b GpuBuffer>) -> impl Iterator<Item = (u32, &'b GpuBuffer)> {
        let own = self.own.iter().map(|(number, buffer)| (*number, buffer));
        let shared = self.held.scene.bindings().chain(self.held.field.bindings(FIELD));
        shared.chain(own).chain(counts.map(|counts| (COUNTS, counts)))
    }

    /// What is bound at `number`.
    ///
    /// # Panics
    /// If nothing is.
    fn buffer(&self, number: u32) -> &GpuBuffer {
        self.buffers(None).find(|b| b.0 == number).map(|b| b.1).expect("the number is one of a band's own")
    }

    /// Runs a kernel; in which turn, and where rays are counted.
    fn run(&self, (entry, bound, depends): Entry, turn: usize, counts: Option<&GpuBuffer>) -> GpuResult<()> {
        let buffers: Vec<(u32, &GpuBuffer)> = self.buffers(counts).filter(|(number, _)| bound.contains(number)).collect();
        let constants = self.held.constants.iter().filter(|(name, _)| depends.is_none_or(|names| names.contains(name)));
        let constants: Vec<(&'static str, f64)> = constants.copied().collect();
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        let uniform = Wave { rows: self.rows, turn: turn as u32, ..self.held.uniform };
        self.held.gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, self.rows.groups())
    }

    /// Answers all rays, with `then` after each turn, until there are none; false if `progress` cancels.
    fn follow(&self, then: &[Entry], progress: &dyn Progress) -> GpuResult<bool> {
        let gpu = self.held.gpu;
        let mut turns = 2;
        while !progress.cancelled() {
            let counts = gpu.upload_slice(&vec![0u32; turns])?;
            for turn in 0..turns {
                for entry in [ENCOUNTER, MARCH, TELL].iter().chain(then) {
                    self.run(*entry, turn, Some(&counts))?;
                }
            }
            if gpu.read_slice::<u32>(&counts, turns)?.last() == Some(&0) {
                return Ok(true);
            }
            turns = (2 * turns).min(TURNS);
        }
        Ok(false)
    }
}
