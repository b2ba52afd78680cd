//! RT²AR's tracer on the GPU: [`super::render`] over proxies under an environment at infinity.
//!
//! The random numbers and what is made of them are the CPU's, so that a frame differs by rounding. Surfaces that call each other there
//! wait on a stack here (`stack.wgsl`), each with the bodies its ray is in, and the samples of a lamp are asked one by one
//! (`survey.wgsl`): a pixel goes from ray to ray, and after some rays waits in memory for the next submission, as no submission may be
//! long. The host settles which pixels are in doubt.
//!
//! Worlds that are no proxies stay on the CPU.

mod layout;
mod tables;

pub use layout::SHADER;
pub(crate) use layout::layouts;

use super::frame::{Center, MAX_LIGHTS, Shaded, brightest, is_untouched, probes, settle_doubts};
use super::lights::SphericalLight;
use super::shadow::Verdicts;
use super::{Lighting, Params, Rendered, Shadow};
use crate::tracer::Frame;
use crate::tracer::gpu::scene::{GpuScene, Submissions};
use crate::world::ProxyWorld;
use crate::world::gpu::World;
use bytemuck::{Zeroable, bytes_of};
use layout::{Held, NOTES, REACHED, Recursion, Seen, Waiting, Walk};
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Kernel, Rows, flag};
use pano_core::progress::Progress;
use pano_core::texture::MAX_ANISOTROPY;
use std::ops::Range;
use tables::Tables;

/// Kernels, and what each binds beside the scene's tables.
const LOOK: (&str, &[u32]) = ("look", &[1, 2, 3, 4, 5, PIXELS]);
const TRACE: (&str, &[u32]) = ("trace", &[1, 2, 3, 4, 5, PIXELS, STACK, NOTED]);
const COUNT: (&str, &[u32]) = ("count", &[PIXELS, UNDER_WAY]);

const PIXELS: u32 = 6;
const STACK: u32 = 7;
const UNDER_WAY: u32 = 8;
const NOTED: u32 = 9;

/// Rays of one submission, over all its pixels: some ten milliseconds of a slow GPU.
const RAYS: usize = 1 << 20;
/// The same of one pixel, at least and at most: Mesa's lavapipe leaves a kernel's loops after 65 535 rounds, those through the trees
/// counted.
const RAYS_OF_PIXEL: [usize; 2] = [4, 32];
/// Submissions after which the pixels under way are counted, at most.
const SUBMISSIONS: usize = 16;

/// Whether textures are averaged over what rays cover of them.
fn is_filtered(frame: &Frame<'_>, params: &Params<'_>) -> bool {
    params.max_anisotropy > 0 && frame.objects.textured()
}

/// [`super::render`] on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if a table of the scene does not fit a binding, or what has become of the device.
pub fn render(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &ProxyWorld,
    lighting: &Lighting,
    lights: &[SphericalLight],
    params: &Params<'_>,
    progress: &dyn Progress,
) -> GpuResult<Option<Rendered>> {
    let lights = &lights[..lights.len().min(MAX_LIGHTS)];
    let pyramids = is_filtered(frame, params);
    let (scene, (clusters, tables)) = GpuScene::with_pyramids(gpu, frame, world, pyramids, |packed, words, pictures| {
        (packed.clusters, Tables::pack(lights, lighting, params, words, pictures))
    })?;
    let shadow_samples = tables.patterns[1] as usize;
    let levels = params.depth as usize + 1;
    let of_notes = size_of::<[u32; 4]>() * (lights.len() * NOTES + shadow_samples);
    let bytes = size_of::<Held>().max(levels * size_of::<Waiting>()).max(of_notes);
    let work = Work {
        gpu,
        frame,
        params,
        constants: specialize(frame, world, params),
        cut: Submissions::new(gpu, frame, bytes, 1),
        scene,
        clusters,
        tables,
        brightest: brightest(lighting),
        lights: lights.len(),
        levels,
    };
    progress.begin("trace", 2 * frame.camera.height as u64);
    let Some(mut seen) = work.look(progress)? else { return Ok(None) };
    let size = (frame.camera.width, frame.camera.height);
    let centers: Vec<Center> = seen.iter().map(Seen::center).collect();
    let untouched = |i: &usize| is_untouched(*i, size, params, |i| centers[i].quiet);
    let due: Vec<usize> = (0..seen.len()).filter(|i| !untouched(i)).collect();
    let mut traced: Vec<Shaded> = centers.iter().map(|center| center.unchanged(lights.len())).collect();
    let Some(found) = work.trace(&mut seen, &due, false, progress)? else { return Ok(None) };
    due.into_iter().zip(found).for_each(|(i, pixel)| traced[i] = pixel);
    let doubted = settle_doubts(&mut traced, size, params, |again| work.trace(&mut seen, again, true, progress))?;
    Ok(doubted.map(|doubted| Rendered::of(frame.camera, &traced, lights.len(), doubted)))
}

/// What this frame calls for; the rest is not compiled.
fn specialize(frame: &Frame<'_>, world: &ProxyWorld, params: &Params<'_>) -> Vec<(&'static str, f64)> {
    let shadow = match params.shadow {
        Shadow::Hard => 0,
        Shadow::Soft => 1,
        Shadow::Adaptive => 2,
    };
    vec![
        ("GLOSS", flag(frame.objects.gloss())),
        ("BODIES", flag(frame.objects.transmit())),
        ("TEXTURES", flag(frame.objects.textured())),
        ("FILTERED", flag(is_filtered(frame, params))),
        ("PROXY_MESHES", flag(world.has_meshes())),
        ("FROM_PICTURE", flag(world.reflects_picture())),
        ("SHADOWS", flag(params.shadows)),
        ("SHADOW", f64::from(shadow)),
        ("MIRRORING", flag(params.gloss > 0.0)),
    ]
}

impl Seen {
    fn center(&self) -> Center {
        Center { guides: self.pixel.finish(1), look: self.looks == 1, quiet: self.quiet == 1, bright: self.bright }
    }

    /// Before its first sample.
    fn anew(self, thorough: bool) -> Self {
        let thorough = u32::from(thorough);
        let nothing = Self { bright: 0, dark: 0, penumbra: 0, taken: 0, shadow_rays: 0, ..self };
        Self { pixel: self.pixel.anew(), thorough, due: 1, ..nothing }
    }

    /// What it has come to; `reached` is the sum over its samples of what reaches them, of each lamp.
    fn shaded(&self, reached: impl Iterator<Item = f32>) -> Shaded {
        let share = 1.0 / self.taken.max(1) as f32;
        let mut shadows = [0.0; MAX_LIGHTS];
        shadows.iter_mut().zip(reached).for_each(|(shadow, reached)| *shadow = reached * share);
        Shaded {
            pixel: self.pixel.finish(self.taken),
            shadows,
            verdicts: Verdicts { bright: self.bright, dark: self.dark, penumbra: self.penumbra },
            rays: u64::from(self.pixel.rays),
            shadow_rays: u64::from(self.shadow_rays),
            discarded: u64::from(self.pixel.discarded),
        }
    }
}

/// A band's pixels, and what is noted about the lamps at each.
type Traced = (Vec<Held>, Vec<[u32; 4]>);

/// A frame's kernels and what they share.
struct Work<'a> {
    gpu: &'a Gpu,
    frame: &'a Frame<'a>,
    params: &'a Params<'a>,
    constants: Vec<(&'static str, f64)>,
    cut: Submissions,
    scene: GpuScene<World>,
    clusters: [u32; 2],
    tables: Tables,
    brightest: f32,
    lights: usize,
    levels: usize,
}

impl Work<'_> {
    fn run(&self, (entry, bound): (&'static str, &[u32]), rows: Rows, own: &[(u32, &GpuBuffer)]) -> GpuResult<()> {
        let [least, most] = RAYS_OF_PIXEL;
        let [patterns, shadow_samples] = self.tables.patterns;
        let [response, response_count] = self.tables.response;
        let uniform = Recursion {
            rows,
            view: self.scene.view,
            world: self.scene.world,
            lighting: self.tables.lighting,
            clusters: self.clusters,
            samples: self.params.samples,
            deepest: self.params.depth,
            levels: self.levels as u32,
            rounds: (RAYS / rows.pixels()).clamp(least, most) as u32,
            shadow_samples,
            probes: probes(self.params),
            patterns,
            response,
            response_count,
            answers: (rows.pixels() * self.lights * NOTES) as u32,
            reflectance_cap: self.params.reflectance_cap,
            brightest: self.brightest,
            most_anisotropy: self.params.max_anisotropy.clamp(1, MAX_ANISOTROPY),
            pad: 0,
        };
        let kernel = Kernel { shader: &SHADER, entry, constants: &self.constants };
        let buffers: Vec<(u32, &GpuBuffer)> =
            self.scene.bindings().chain(own.iter().copied()).filter(|(number, _)| bound.contains(number)).collect();
        self.gpu.dispatch(&kernel, bytes_of(&uniform), &buffers, rows.groups())
    }

    /// What is at all pixels' centres.
    fn look(&self, progress: &dyn Progress) -> GpuResult<Option<Vec<Seen>>> {
        let photo = self.params.photo.data();
        let width = self.frame.camera.width;
        let mut seen = Vec::with_capacity(photo.len());
        for band in self.cut.bands() {
            if progress.cancelled() {
                return Ok(None);
            }
            let rows = self.cut.rows(&band);
            let photo = photo[band.start * width..band.end * width].iter();
            let before = photo.map(|&photo| Held { seen: Seen { photo, ..Seen::zeroed() }, walk: Walk::zeroed() });
            let held = self.gpu.upload_slice(&before.collect::<Vec<_>>())?;
            self.run(LOOK, rows, &[(PIXELS, &held)])?;
            seen.extend(self.gpu.read_slice::<Held>(&held, rows.pixels())?.into_iter().map(|held| held.seen));
            progress.advance(u64::from(rows.count));
        }
        Ok(Some(seen))
    }

    /// Traces the pixels that are `due`, in order.
    fn trace(&self, seen: &mut [Seen], due: &[usize], thorough: bool, progress: &dyn Progress) -> GpuResult<Option<Vec<Shaded>>> {
        seen.iter_mut().for_each(|seen| seen.due = 0);
        due.iter().for_each(|&i| seen[i] = seen[i].anew(thorough));
        let width = self.frame.camera.width;
        let mut found = Vec::with_capacity(due.len());
        for band in self.cut.bands() {
            let held = band.start * width..band.end * width;
            let in_band = &due[due.partition_point(|&i| i < held.start)..due.partition_point(|&i| i < held.end)];
            if !in_band.is_empty() {
                let Some((held, notes)) = self.trace_band(&band, &seen[held.clone()], progress)? else { return Ok(None) };
                for i in in_band.iter().map(|i| i - band.start * width) {
                    let reached = notes[i * self.lights * NOTES..].chunks(NOTES).take(self.lights);
                    found.push(held[i].seen.shaded(reached.map(|note| f32::from_bits(note[REACHED][0]))));
                }
            }
            if !thorough {
                progress.advance(band.len() as u64);
            }
        }
        Ok(Some(found))
    }

    /// Traces the pixels of a band that are due.
    fn trace_band(&self, band: &Range<usize>, seen: &[Seen], progress: &dyn Progress) -> GpuResult<Option<Traced>> {
        let rows = self.cut.rows(band);
        let held: Vec<Held> = seen.iter().map(|&seen| Held { seen, walk: Walk::zeroed() }).collect();
        let notes = rows.pixels() * self.lights * NOTES;
        let answers = rows.pixels() * self.tables.patterns[1] as usize;
        let held = self.gpu.upload_slice(&held)?;
        let stack = self.gpu.buffer::<Waiting>(rows.pixels() * self.levels)?;
        let noted = self.gpu.buffer::<[u32; 4]>(notes + answers)?;
        let mut submissions = 1;
        loop {
            if progress.cancelled() {
                return Ok(None);
            }
            for _ in 0..submissions {
                self.run(TRACE, rows, &[(PIXELS, &held), (STACK, &stack), (NOTED, &noted)])?;
            }
            let under_way = self.gpu.upload_slice(&[0u32])?;
            self.run(COUNT, rows, &[(PIXELS, &held), (UNDER_WAY, &under_way)])?;
            if self.gpu.read_slice::<u32>(&under_way, 1)? == [0] {
                break;
            }
            submissions = (2 * submissions).min(SUBMISSIONS);
        }
        Ok(Some((self.gpu.read_slice(&held, rows.pixels())?, self.gpu.read_slice(&noted, notes)?)))
    }
}
