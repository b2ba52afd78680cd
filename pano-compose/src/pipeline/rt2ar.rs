//! Frames of rt2ar: recursive rays, then the mean filter over penumbrae.

use super::device::Device;
use super::frame::{Filtered, Frame, View};
use super::path_traced::bounces;
use super::{Clock, Error, Result};
use crate::plan::EffectPlan;
use pano_core::{camera::Projection, layers::TracedLayers, progress::Progress, random::Stream};
use pano_denoise::mean;
use pano_trace::mr360::Lighting;
use pano_trace::rt2ar::{Params, Rendered, Shadow};
use pano_trace::tracer;

/// Traces a frame lit by the lights that stand out of the panorama and the maps of what is left; the plan says what becomes
/// of them.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn trace(
    frame: &Frame<'_>,
    view: View,
    (lighting, plan): (&Lighting, &EffectPlan),
    device: &mut Device,
    clock: &mut Clock,
    warnings: &mut Vec<String>,
    progress: &dyn Progress,
) -> Result<Filtered> {
    let (photo, settings) = (view.photo, &frame.options.settings);
    if frame.objects.is_empty() {
        let layers = TracedLayers::empty(frame.camera.width, frame.camera.height);
        clock.stage("trace", frame.pixels(), 0);
        return Ok(Filtered { photo, layers, irradiance: None, shadows: Vec::new() });
    }
    let params = Params {
        samples: frame.scene.render.samples,
        depth: bounces(frame),
        shadows: plan.is_on("light_shadows"),
        shadow: settings.shadow,
        shadow_samples: settings.shadow_samples,
        probes: settings.probes,
        spread: settings.probe_neighbours,
        gloss: settings.gloss,
        gloss_roughness: settings.gloss_roughness,
        reflectance_cap: settings.captured.reflectance_cap,
        max_anisotropy: settings.anisotropy,
        photo: &photo,
    };
    let stream = Stream { frame: frame.options.frame, seed: frame.options.seed };
    let to_trace = tracer::Frame { camera: &frame.camera, objects: frame.objects, stream };
    let rendered = device.trace_recursively(&to_trace, frame.world, lighting, &params, progress)?;
    let Rendered { traced, shadows, penumbra, .. } = rendered.ok_or(Error::Cancelled)?;
    let mut layers = traced.layers;
    if traced.discarded > 0 {
        warnings.push(format!("{} samples were not finite and count as black", traced.discarded));
    }
    clock.stage_on(device.last(), "trace", frame.pixels(), traced.rays);
    if frame.options.denoise && params.shadows && params.shadow != Shadow::Hard && settings.penumbra_radius > 0 {
        let wrap = frame.camera.projection == Projection::Panorama;
        let params = mean::Params { wrap, radius: settings.penumbra_radius, ..mean::Params::default() };
        device.mean(&params, &penumbra, &photo, &mut layers)?;
        clock.stage_on(device.last(), "mean", penumbra.data().iter().filter(|p| **p).count() as u64, 0);
    }
    Ok(Filtered { photo, layers, irradiance: None, shadows })
}
