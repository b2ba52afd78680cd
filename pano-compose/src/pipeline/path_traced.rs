//! Frames of the methods that make their layers in one go, each frame by itself: the path tracers and mr360.

use super::device::Device;
use super::frame::{Filtered, Frame, View};
use super::view::{rescale_delta, rescale_error};
use super::world::tracer_method;
use super::{Clock, Error, Result};
use crate::plan::EffectPlan;
use pano_core::color::luminance;
use pano_core::image::RadianceImage;
use pano_core::{camera::Projection, layers::TracedLayers, progress::Progress, random::Stream, scene::Method};
use pano_denoise::cross_bilateral;
use pano_trace::mr360;
use pano_trace::tracer::{self, Sampling, TraceParams, Traced};

/// Traces and filters a frame; `lights` are those of mr360, with the plan that says what becomes of them. Also how the frame
/// was sampled, if that was adaptive.
#[expect(clippy::too_many_arguments, reason = "each is another stage's")]
pub(super) fn trace(
    frame: &Frame<'_>,
    method: Method,
    view: View,
    lights: Option<(&mr360::Lighting, &EffectPlan)>,
    device: &mut Device,
    clock: &mut Clock,
    warnings: &mut Vec<String>,
    progress: &dyn Progress,
) -> Result<(Filtered, Option<Sampling>)> {
    let pixels = frame.pixels();
    let params = TraceParams {
        method: tracer_method(method),
        samples: frame.scene.render.samples,
        bounces: bounces(frame),
        mis: frame.options.settings.mis,
        second_order: frame.options.settings.second_order,
        everywhere: frame.options.forced.contains(&("influence", false)),
        error_target: error_target(frame, view.lighting.as_ref().unwrap_or(&view.photo)),
    };
    let stream = Stream { frame: frame.options.frame, seed: frame.options.seed };
    let traced_frame = tracer::Frame { camera: &frame.camera, objects: frame.objects, stream };
    let mut shadows = Vec::new();
    let Traced { mut layers, rays, discarded, mut sampling } = if frame.objects.is_empty() {
        let layers = TracedLayers::empty(frame.camera.width, frame.camera.height);
        Traced { layers, rays: 0, discarded: 0, sampling: None }
    } else if let Some((found, plan)) = lights {
        let params = mr360::Params {
            samples: frame.scene.render.samples,
            shadows: plan.is_on("light_shadows"),
            ambient_occlusion: plan.is_on("ambient_occlusion"),
            gloss: frame.options.settings.gloss,
            gloss_roughness: frame.options.settings.gloss_roughness,
            photo: &view.photo,
        };
        let lit = device.trace_lit(&traced_frame, frame.world, found, &params, progress)?.ok_or(Error::Cancelled)?;
        shadows = lit.shadows;
        lit.traced
    } else {
        device.trace(&traced_frame, frame.world, &params, progress)?.ok_or(Error::Cancelled)?
    };
    if discarded > 0 {
        warnings.push(format!("{discarded} samples were not finite and count as black"));
    }
    clock.stage_on(device.last(), "trace", pixels, rays);

    // MR360 has the photo itself for the surfaces' colour.
    if let Some(lighting) = view.lighting.filter(|_| lights.is_none()) {
        rescale_delta(&mut layers, &view.photo, &lighting);
        if let Some(sampling) = &mut sampling {
            rescale_error(&mut sampling.error, &layers, &view.photo, &lighting);
        }
    }
    if frame.options.denoise && !frame.objects.is_empty() {
        progress.begin("denoise", 1);
        let wrap = frame.camera.projection == Projection::Panorama;
        let params = cross_bilateral::Params { wrap, delta_passes: frame.options.settings.delta_passes, ..Default::default() };
        let report = device.denoise(&params, &view.photo, &mut layers)?;
        for (layer, energy) in [("object", report.object), ("delta", report.delta)] {
            // The filter conserves energy but for edges; more than this would be visible.
            if energy.relative_change().abs() > 0.02 {
                warnings.push(format!(
                    "the filter changed the sum of the {layer} layer by {:.1} %",
                    energy.relative_change() * 100.0
                ));
            }
        }
        progress.advance(1);
        clock.stage_on(device.last(), "denoise", pixels, 0);
    }
    Ok((Filtered { photo: view.photo, layers, irradiance: None, shadows }, sampling))
}

/// The setting, relative to the mean luminance of what lights the frame, as radiance.
fn error_target(frame: &Frame<'_>, lighting: &RadianceImage) -> Option<f32> {
    let target = frame.options.settings.error_target?;
    let sum: f64 = lighting.data().iter().map(|p| f64::from(luminance(*p))).sum();
    Some(target * (sum / lighting.data().len() as f64) as f32)
}

/// The scene's, unless several are forced off or on.
pub(super) fn bounces(frame: &Frame<'_>) -> u32 {
    let forced = frame.options.forced.iter().find(|(effect, _)| *effect == "multi_bounce");
    match (forced, frame.scene.render.bounces) {
        (Some((_, false)), _) => 1,
        (Some((_, true)), bounces) => bounces.max(2),
        (None, bounces) => bounces,
    }
}
