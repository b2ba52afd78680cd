//! The stages of interactive panoramic ray tracing, between the view of the photo and the composite.
//!
//! ```text
//! G-buffer ─> (mask) ─> real pixels ─> (interpolation) ─> history ─> filter
//!          ─> update of the panorama ─> virtual pixels ─> history ─> filter
//! ```
//!
//! The paper filters once, after both passes; here the first pass is filtered before its result is written into the
//! panorama, so that the second one sees it without noise. The first frame has no past: it takes a first look at the real
//! pixels, as what objects send back shows the surfaces that they change. Later frames use what the frame before has found.

mod filter;
mod state;

pub(super) use state::State;

use super::device::Device;
use super::device::iprt::{Scene, Shown};
use super::frame::{Filtered, Frame, View};
use super::{Clock, Error, Result, World};
use crate::composite::{Irradiance, delta_from_ratio};
use filter::{Filters, Histories};
use glam::Vec3;
use pano_core::{
    camera::Projection,
    image::{Image, RadianceImage},
    layers::TracedLayers,
    progress::Progress,
    random::Stream,
};
use pano_trace::iprt::{self, GBuffer, RealEstimate, Update};
use pano_trace::sparse;
use std::f32::consts::PI;

/// The first look at the change takes this share of the samples.
const FIRST_LOOK: u32 = 8;
/// With fewer samples than this the share of a pixel that shows an object is measured apart, by 4×4 points.
const SAMPLES_THAT_COVER: u32 = 16;
/// Points of a pixel that are tried for one that shows what is looked for: at a coverage of 1/16 two in three are found.
const ATTEMPTS: u32 = 16;

/// When nothing has moved for so many frames, mirrors show what they showed: in the first, history still holds what did.
const SETTLED: u32 = 2;

/// One of something for each signal that is traced, filtered and remembered.
#[derive(Clone, Debug, Default)]
struct Signals<T> {
    /// E_R.
    irradiance: T,
    /// E_RV − E_R.
    change: T,
    /// The change of mirror images.
    mirror: T,
    /// The objects' radiance.
    object: T,
}

/// What the first pass has come to.
struct RealResult {
    irradiance: Irradiance,
    ratio: Image<Vec3>,
    mirror: Image<Vec3>,
    update: Update,
    touched: Image<bool>,
}

/// The stages at work on one frame.
struct Stages<'a> {
    frame: &'a Frame<'a>,
    scene: Scene<'a>,
    params: iprt::Params,
    buffer: GBuffer,
    /// The share of each pixel that shows an object, where samples do not tell it.
    coverage: Option<Image<f32>>,
    /// Where the pixels' points were in the frame before, and how far away.
    motion: Option<iprt::Motion>,
    /// Frames since anything has moved.
    still: u32,
    /// The picture from which irradiance is found.
    lit: &'a RadianceImage,
    pixels: u64,
}

/// Traces and filters a frame over `photo`, the view of the panorama; `lighting` is the view of what lights the scene, if
/// that is another picture. `past` is that of the sequence, and becomes the next frame's.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn trace(
    frame: &Frame<'_>,
    View { photo, lighting }: View,
    past: &mut Option<State>,
    device: &mut Device,
    clock: &mut Clock,
    warnings: &mut Vec<String>,
    progress: &dyn Progress,
) -> Result<Filtered> {
    let (w, h) = (frame.camera.width, frame.camera.height);
    let World::Captured(world) = frame.world else {
        return Err(Error::unsupported("method `iprt` needs a panorama with depth", "use dpt"));
    };
    let past_frame = past.take().filter(|p| p.continues(frame));
    if frame.objects.is_empty() {
        return Ok(Filtered { photo, layers: TracedLayers::empty(w, h), irradiance: None, shadows: Vec::new() });
    }
    let traced = iprt::Frame {
        camera: &frame.camera,
        objects: frame.objects,
        capture: frame.scene.panorama.position,
        stream: Stream { frame: frame.options.frame, seed: frame.options.seed },
    };
    let samples = frame.scene.render.samples;
    let few = samples < SAMPLES_THAT_COVER;
    let still = past_frame.as_ref().map_or(0, |p| p.still_until(frame));
    let (earlier, mut histories, mut update, mut active) = match past_frame {
        Some(past) => (Some(past.earlier), past.histories, past.update, past.active),
        None => (None, Histories::default(), Update::default(), Image::filled(w, h, 0)),
    };
    let scene = Scene { frame: traced, world, earlier: earlier.as_ref() };
    let Shown { buffer, motion, coverage } = device.gbuffer(&scene, few)?;
    let stages = Stages {
        frame,
        scene,
        params: iprt::Params {
            samples,
            attempts: if few { ATTEMPTS } else { 1 },
            bounces: frame.scene.render.bounces,
            ..iprt::Params::default()
        },
        coverage,
        motion,
        still,
        buffer,
        lit: lighting.as_ref().unwrap_or(&photo),
        pixels: (w * h) as u64,
    };
    clock.stage_on(device.last(), "g-buffer", stages.pixels, stages.pixels);

    let levels = if frame.options.settings.sparse && stages.motion.is_some() {
        let (position, normal) = (&stages.buffer.position, &stages.buffer.normal);
        let levels = device.sparse_levels(&sparse::Params::default(), position, normal, &active)?;
        clock.stage_on(device.last(), "sparse mask", stages.pixels, 0);
        levels
    } else {
        Image::filled(w, h, 0)
    };
    if stages.motion.is_none() {
        let params = iprt::Params { samples: samples.div_ceil(FIRST_LOOK), ..stages.params };
        // Other random numbers, or the second look would repeat the first one's errors.
        let look = iprt::Frame { stream: Stream { seed: frame.options.seed ^ 0x5bd1_e995, ..traced.stream }, ..traced };
        let no_past = &mut Histories::default();
        let first = stages.real(&look, &params, &update, &levels, no_past, device, clock, &mut Vec::new(), progress)?;
        update = first.update;
    }
    let real = stages.real(&traced, &stages.params, &update, &levels, &mut histories, device, clock, warnings, progress)?;
    sparse::update_activity(&sparse::Params::default(), &levels, &real.touched, &mut active);

    let seen = device.trace_virtual(&stages.scene, &real.update, &stages.params, progress)?;
    let mut seen = seen.ok_or(Error::Cancelled)?;
    clock.stage_on(device.last(), "virtual pixels", stages.pixels, seen.rays);
    let mut filters = stages.filters(samples, device, "history virtual");
    if frame.options.denoise {
        filters.tame_seen(&mut seen, warnings)?;
    }
    let coverage = stages.coverage.clone().unwrap_or_else(|| seen.coverage.clone());
    let shares = (&seen.coverage, &coverage);
    let noise = filters.remember(shares, Some(&seen.variance), &mut seen.radiance, &mut histories.object)?;
    clock.stage_on(filters.device.last(), "history virtual", stages.pixels, 0);
    if frame.options.denoise {
        filters.stage = "filter virtual";
        filters.spread_seen(&noise, &mut seen.radiance)?;
        filters.color(&mut seen.radiance);
        clock.stage_on(device.last(), "filter virtual", stages.pixels, 0);
    }

    let mut delta = delta_from_ratio(&photo, &real.irradiance.share, &real.ratio);
    delta.data_mut().iter_mut().zip(real.mirror.data()).for_each(|(delta, mirror)| *delta += mirror);
    let layers = TracedLayers {
        delta,
        albedo: Image::from_fn(w, h, |x, y| match stages.buffer.thing.get(x, y) {
            0 => reflectance(stages.lit.get(x, y), real.irradiance.real.get(x, y) / real.irradiance.share.get(x, y)),
            _ => stages.buffer.albedo.get(x, y),
        }),
        object: seen.radiance,
        coverage,
        depth: stages.buffer.depth,
        normal: stages.buffer.normal,
    };
    *past = Some(State::new(frame, stages.still, histories, real.update, active));
    Ok(Filtered { photo, layers, irradiance: Some(real.irradiance), shadows: Vec::new() })
}

impl Stages<'_> {
    fn filters<'a>(&'a self, samples: u32, device: &'a mut Device, stage: &'static str) -> Filters<'a> {
        let wrap = self.frame.camera.projection == Projection::Panorama;
        let (motion, settled) = (self.motion.as_ref(), self.still >= SETTLED);
        Filters { buffer: &self.buffer, samples, motion, settled, level: None, wrap, device, stage }
    }

    /// The first pass with all that belongs to it, in a world as `known` so far.
    #[expect(clippy::too_many_arguments, reason = "each is another stage's")]
    fn real(
        &self,
        traced: &iprt::Frame<'_>,
        params: &iprt::Params,
        known: &Update,
        levels: &Image<u8>,
        histories: &mut Histories,
        device: &mut Device,
        clock: &mut Clock,
        warnings: &mut Vec<String>,
        progress: &dyn Progress,
    ) -> Result<RealResult> {
        let wanted = |x: usize, y: usize| sparse::is_traced(levels.get(x, y), x, y);
        let real = device.trace_real(&self.scene, traced, known, params, wanted, progress)?;
        let mut real = real.ok_or(Error::Cancelled)?;
        clock.stage_on(device.last(), "real pixels", self.pixels, real.rays);
        if levels.data().iter().any(|&l| l > 0) {
            self.fill(levels, &mut real, device)?;
            clock.stage_on(device.last(), "interpolation", self.pixels, 0);
        }
        let share = match &self.coverage {
            Some(coverage) => Image::from_fn(coverage.width(), coverage.height(), |x, y| {
                if self.buffer.depth.get(x, y).is_finite() { 1.0 - coverage.get(x, y) } else { 0.0 }
            }),
            None => real.share.clone(),
        };
        let level = Image::from_fn(levels.width(), levels.height(), |x, y| if wanted(x, y) { 0 } else { levels.get(x, y) });
        let mut filters = Filters { level: Some(&level), ..self.filters(params.samples, device, "history real") };
        if self.frame.options.denoise {
            filters.tame_real(&mut real, warnings)?;
        }
        let shares = (&real.share, &share);
        let (all, change) = (&mut histories.irradiance, &mut histories.change);
        let all = filters.remember(shares, Some(&real.irradiance_variance), &mut real.irradiance, all)?;
        if self.frame.options.denoise {
            filters.tame_change((&real.irradiance, &share), &real.share, &mut real.change)?;
        }
        let change = filters.remember(shares, Some(&real.change_variance), &mut real.change, change)?;
        clock.stage_on(filters.device.last(), "history real", self.pixels, 0);
        if self.frame.options.denoise {
            filters.stage = "filter real";
            filters.spread(all, &mut real.irradiance)?;
            filters.spread(change, &mut real.change)?;
            clock.stage_on(filters.device.last(), "filter real", self.pixels, 0);
        }
        let cap = self.frame.options.settings.captured.reflectance_cap;
        let irradiance = Irradiance { share, real: real.irradiance, change: real.change };
        let gloss = irradiance.gloss(self.lit, &real.mirror, cap)?;
        let mut mirror = irradiance.mirror_delta(self.lit, &gloss, &real.mirrored, &real.mirrored_mixed)?;
        filters.stage = "history real";
        let share = &irradiance.share;
        filters.remember((share, share), None, &mut mirror, &mut histories.mirror)?;
        clock.stage_on(filters.device.last(), "history real", self.pixels, 0);
        let ratio = irradiance.ratio(self.lit, cap)?;
        let size = self.frame.inputs.photo.size();
        let update = filters.device.panorama_update(&self.scene, &self.buffer, &ratio, &gloss, size)?;
        clock.stage_on(filters.device.last(), "update", self.pixels, 0);
        Ok(RealResult { irradiance, ratio, mirror, update, touched: real.touched })
    }

    /// Fills the pixels that were not traced.
    fn fill(&self, levels: &Image<u8>, real: &mut RealEstimate, device: &mut Device) -> Result<()> {
        let shows_real = |x: usize, y: usize| self.buffer.shows_real(x, y);
        let signals =
            &mut [&mut real.irradiance, &mut real.change, &mut real.mirror, &mut real.mirrored, &mut real.mirrored_mixed];
        device.interpolate(levels, shows_real, &mut real.share, signals)
    }
}

/// ρ = π·L / E, within [0, 1]; 0 where nothing arrives.
fn reflectance(radiance: Vec3, irradiance: Vec3) -> Vec3 {
    let rho = radiance * PI / irradiance;
    if rho.is_finite() { rho.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
}
