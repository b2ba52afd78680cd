//! The stages of interactive panoramic ray tracing, between the view of the photo and the composite.
//!
//! ```text
//! G-buffer ──> real pixels ──> filter ──> update the panorama ──> virtual pixels ──> filter
//! ```
//!
//! The paper filters once, after both passes; here the first pass is filtered before its result is written into the
//! panorama, so that the second one sees it without noise.

use super::{Clock, Error, Filtered, Inputs, RenderOptions, Result, World};
use crate::composite::{Irradiance, delta_from_ratio};
use glam::Vec3;
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    layers::TracedLayers,
    progress::Progress,
    random::Stream,
    scene::Scene,
};
use pano_denoise::{atrous, firefly};
use pano_trace::iprt::{self, GBuffer, RealEstimate, UpdatedWorld, VirtualEstimate};
use pano_trace::objects::Objects;
use pano_trace::world::CapturedWorld;
use std::f32::consts::PI;

/// Base colours below this are not divided by: the filter then works on radiance.
const LEAST_ALBEDO: f32 = 0.02;

/// The first look at the change takes this share of the samples.
const FIRST_LOOK: u32 = 8;
/// Standard deviation, as a share of that measured, that the filter believes of a perfectly smooth surface: most of it is
/// the picture in the mirror. Chosen on a mirror ball.
const MIRROR_NOISE: f32 = 0.125;

/// What the stages read.
pub(super) struct Frame<'a> {
    pub(super) scene: &'a Scene,
    pub(super) inputs: &'a Inputs,
    pub(super) objects: &'a Objects,
    pub(super) world: &'a World,
    pub(super) options: &'a RenderOptions,
    pub(super) camera: &'a Camera,
}

/// Traces and filters a frame over `photo`, the view of the panorama; `lighting` is the view of what lights the scene, if
/// that is another picture.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn trace(
    frame: &Frame<'_>,
    photo: RadianceImage,
    lighting: Option<RadianceImage>,
    clock: &mut Clock,
    warnings: &mut Vec<String>,
    progress: &dyn Progress,
) -> Result<Filtered> {
    let camera = frame.camera;
    let (w, h) = (camera.width, camera.height);
    let pixels = (w * h) as u64;
    let World::Captured(world) = frame.world else {
        return Err(Error::unsupported("method `iprt` needs a panorama with depth", "use dpt"));
    };
    if frame.objects.is_empty() {
        return Ok(Filtered { photo, layers: TracedLayers::empty(w, h), irradiance: None });
    }
    let world: &CapturedWorld = world;
    let params =
        iprt::Params { samples: frame.scene.render.samples, bounces: frame.scene.render.bounces, ..iprt::Params::default() };
    let traced = iprt::Frame {
        camera,
        objects: frame.objects,
        capture: frame.scene.panorama.position,
        stream: Stream { frame: frame.options.frame, seed: frame.options.seed },
    };
    let buffer = GBuffer::new(&traced, world);
    clock.stage("g-buffer", pixels, pixels);

    // What real surfaces change in one another and in what objects send back needs a first look at the change.
    let mut panorama = iprt::Update::default();
    let lit = lighting.as_ref().unwrap_or(&photo);
    let cap = frame.options.settings.captured.reflectance_cap;
    let mut found = None;
    for samples in [params.samples.div_ceil(FIRST_LOOK), params.samples] {
        let params = iprt::Params { samples, ..params };
        let updated = UpdatedWorld::new(world, traced.capture, &panorama);
        let mut real = iprt::trace_real(&traced, &updated, &params, None, |_, _| true, progress).ok_or(Error::Cancelled)?;
        clock.stage("real pixels", pixels, real.rays);
        if frame.options.denoise {
            filter_real(camera, &buffer, &mut real, warnings)?;
            clock.stage("filter real", pixels, 0);
        }
        let irradiance = Irradiance { share: real.share, real: real.irradiance, change: real.change };
        let ratio = irradiance.ratio(lit, cap)?;
        let matte = irradiance.matte(lit, &real.mirror, cap)?;
        panorama = iprt::panorama_update(&traced, world, &buffer, &ratio, &matte, frame.inputs.photo.size());
        clock.stage("update", pixels, 0);
        let mirror = irradiance.mirror_delta(lit, &real.mirrored, &real.mirrored_mixed, cap)?;
        found = Some((irradiance, ratio, mirror));
    }
    let Some((irradiance, ratio, mirror)) = found else { return Err(Error::Cancelled) };

    let updated = UpdatedWorld::new(world, traced.capture, &panorama);
    let mut seen = iprt::trace_virtual(&traced, &updated, &params, progress).ok_or(Error::Cancelled)?;
    clock.stage("virtual pixels", pixels, seen.rays);
    if frame.options.denoise {
        filter_virtual(camera, &buffer, &mut seen, warnings)?;
        clock.stage("filter virtual", pixels, 0);
    }
    let mut delta = delta_from_ratio(&photo, &irradiance.share, &ratio);
    delta.data_mut().iter_mut().zip(mirror.data()).for_each(|(delta, mirror)| *delta += mirror);
    let layers = TracedLayers {
        delta,
        albedo: Image::from_fn(w, h, |x, y| match buffer.thing.get(x, y) {
            0 => reflectance(lit.get(x, y), irradiance.real.get(x, y) / irradiance.share.get(x, y)),
            _ => buffer.albedo.get(x, y),
        }),
        object: seen.radiance,
        coverage: seen.coverage,
        depth: buffer.depth,
        normal: buffer.normal,
    };
    Ok(Filtered { photo, layers, irradiance: Some(irradiance) })
}

/// ρ = π·L / E, within [0, 1]; 0 where nothing arrives.
fn reflectance(radiance: Vec3, irradiance: Vec3) -> Vec3 {
    let rho = radiance * PI / irradiance;
    if rho.is_finite() { rho.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
}

fn filter_real(camera: &Camera, buffer: &GBuffer, real: &mut RealEstimate, warnings: &mut Vec<String>) -> Result<()> {
    let wrap = camera.projection == Projection::Panorama;
    let guides = atrous::Guides { depth: &buffer.depth, normal: &buffer.normal };
    let params = atrous::Params { wrap, ..atrous::Params::default() };
    // The change keeps its fireflies' energy: a firefly there is a caustic.
    clamp_fireflies("irradiance", wrap, &real.share, &mut real.irradiance, warnings)?;
    atrous::filter(&params, &guides, &real.share, &mut real.irradiance_variance, &mut real.irradiance)?;
    atrous::filter(&params, &guides, &real.share, &mut real.change_variance, &mut real.change)?;
    Ok(())
}

fn filter_virtual(camera: &Camera, buffer: &GBuffer, seen: &mut VirtualEstimate, warnings: &mut Vec<String>) -> Result<()> {
    let wrap = camera.projection == Projection::Panorama;
    clamp_fireflies("object", wrap, &seen.coverage, &mut seen.radiance, warnings)?;
    let albedo = buffer.albedo.map(|a| if a.min_element() >= LEAST_ALBEDO { a } else { Vec3::ONE });
    for (radiance, &albedo) in seen.radiance.data_mut().iter_mut().zip(albedo.data()) {
        *radiance /= albedo;
    }
    for (variance, &albedo) in seen.variance.data_mut().iter_mut().zip(albedo.data()) {
        *variance /= pano_core::color::luminance(albedo).powi(2);
    }
    for (variance, &smooth) in seen.variance.data_mut().iter_mut().zip(buffer.smooth.data()) {
        *variance *= if smooth { MIRROR_NOISE * MIRROR_NOISE } else { 1.0 };
    }
    let guides = atrous::Guides { depth: &buffer.depth, normal: &buffer.normal };
    let params = atrous::Params { wrap, ..atrous::Params::default() };
    atrous::filter(&params, &guides, &seen.coverage, &mut seen.variance, &mut seen.radiance)?;
    for (radiance, &albedo) in seen.radiance.data_mut().iter_mut().zip(albedo.data()) {
        *radiance *= albedo;
    }
    Ok(())
}

fn clamp_fireflies(
    layer: &str,
    wrap: bool,
    share: &Image<f32>,
    signal: &mut Image<Vec3>,
    warnings: &mut Vec<String>,
) -> Result<()> {
    let clamped = firefly::clamp(&firefly::Params { wrap, ..firefly::Params::default() }, share, signal)?;
    // Less than a thousandth is what rounds away at the edges of highlights.
    if clamped.energy > 1e-3 * clamped.before {
        warnings.push(format!(
            "clamping fireflies took {:.1} % of the {layer} layer's light, in {} pixels",
            100.0 * clamped.energy / clamped.before,
            clamped.pixels
        ));
    }
    Ok(())
}
