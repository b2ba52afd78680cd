//! The frame pipeline: reads what a scene names, picks the method, runs the stages in order, and reports what they did.
//!
//! ```text
//! load ──> world (proxies | captured field) ──> trace ──> denoise ──> composite
//! ```

mod error;
mod estimate;
mod folder;
mod iprt;
mod lights;
mod load;
mod output;
mod sequence;
mod settings;
mod stats;
mod world;

pub use error::{Error, Result};
pub use estimate::{Plan, PlannedStage, plan};
pub use folder::Folder;
pub use lights::Detector;
pub use load::{Inputs, Loader, prepare_objects};
pub use output::write_output;
pub use sequence::Sequence;
pub use settings::{SETTINGS, Setting, Settings};
pub use stats::{StageStats, Stats};
pub use world::{World, build_world, resolve_method};

use crate::composite::{Composite, Irradiance, composite};
use crate::plan::EffectPlan;
#[cfg(any(feature = "demo", feature = "tradeoff"))]
pub(crate) use folder::write_text;
use glam::Vec3;
use lights::Lights;
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    io::SourceEncoding,
    layers::TracedLayers,
    progress::Progress,
    random::Stream,
    scene::{Method, Scene},
    sphere,
};
use pano_denoise::cross_bilateral;
use pano_trace::mr360;
use pano_trace::objects::Objects;
use pano_trace::tracer::{self, TraceParams, Traced};
pub(crate) use stats::Clock;

/// Where the stages run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// The fastest there is; so far the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The GPU: refused, as no stage runs there yet.
    Gpu,
}

/// What a caller decides besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// Filter the layers after tracing.
    pub denoise: bool,
    /// Where the stages run.
    pub backend: Backend,
    /// Changes all random numbers.
    pub seed: u32,
    /// Which frame of a sequence, where only one is rendered.
    pub frame: u32,
    /// `--set key=value`.
    pub settings: Settings,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { denoise: true, backend: Backend::Auto, seed: 0, frame: 0, settings: Settings::default() }
    }
}

/// A finished frame.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The view.
    pub camera: Camera,
    /// The real picture in the view.
    pub photo: RadianceImage,
    /// How the panorama's file stored its colours.
    pub encoding: SourceEncoding,
    /// What was traced (and filtered).
    pub layers: TracedLayers,
    /// Irradiance of the real surfaces, of methods that find it.
    pub irradiance: Option<Irradiance>,
    /// Per light, strongest first, the share of it that reaches what the pixel shows; of `mr360` only.
    pub shadows: Vec<Image<f32>>,
    /// The composite.
    pub composite: Composite,
    /// What was done.
    pub stats: Stats,
}

/// Renders one frame of a scene, [`RenderOptions::frame`].
///
/// # Errors
/// Faults of the files the scene names, of the options, or [`Error::Cancelled`].
pub fn render(scene: &Scene, options: &RenderOptions, progress: &dyn Progress) -> Result<Rendered> {
    Sequence::new(scene, options).render(options.frame, progress)
}

/// [`render`] with the world already built: for more than one picture of it.
pub(crate) fn render_in_world(
    scene: &Scene,
    inputs: &Inputs,
    objects: &Objects,
    world: &World,
    options: &RenderOptions,
    clock: Clock,
    progress: &dyn Progress,
) -> Result<Rendered> {
    render_lit(scene, inputs, objects, world, options, &mut Carried::default(), clock, progress)
}

/// [`render_in_world`] as the next frame of those that carry `carried` from one to the next.
#[expect(clippy::too_many_arguments, reason = "what a frame is made of; all callers have it in these variables")]
fn render_lit(
    scene: &Scene,
    inputs: &Inputs,
    objects: &Objects,
    world: &World,
    options: &RenderOptions,
    carried: &mut Carried,
    mut clock: Clock,
    progress: &dyn Progress,
) -> Result<Rendered> {
    let mut warnings = Vec::new();
    let method = resolve_method(scene, inputs, &mut warnings)?;
    let camera = scene.camera(inputs.photo.size());
    let pixels = (camera.width * camera.height) as u64;
    let (photo, lighting) = view_of_photo(scene, inputs, world, &camera)?;
    clock.stage("view", pixels, 0);
    let mut facts = inputs.facts(scene, method);
    facts.no_back_faces = !options.settings.captured.field.back_faces;
    facts.no_sparse = !options.settings.sparse;
    let found = (method == Method::Mr360).then(|| carried.lights.frame(scene, inputs, &options.settings));
    if let Some(found) = &found {
        facts.lights = Some(found.lights.len());
        clock.stage("lights", inputs.photo.data().len() as u64, 0);
    }
    let plan = EffectPlan::for_scene(&facts);

    if method == Method::Iprt {
        let frame = iprt::Frame { scene, inputs, objects, world, options, camera: &camera };
        let traced = iprt::trace(&frame, photo, lighting, &mut carried.past, &mut clock, &mut warnings, progress)?;
        return finish(camera, inputs.encoding, traced, method.name(), plan, warnings, clock);
    }

    let params = TraceParams {
        method: world::tracer_method(method),
        samples: scene.render.samples,
        bounces: scene.render.bounces,
        mis: options.settings.mis,
        second_order: options.settings.second_order,
    };
    let stream = Stream { frame: options.frame, seed: options.seed };
    let frame = tracer::Frame { camera: &camera, objects, stream };
    let mut shadows = Vec::new();
    let Traced { mut layers, rays, discarded } = if objects.is_empty() {
        Traced { layers: TracedLayers::empty(camera.width, camera.height), rays: 0, discarded: 0 }
    } else if let Some(found) = &found {
        let params = mr360::Params {
            samples: scene.render.samples,
            shadows: plan.is_on("light_shadows"),
            ambient_occlusion: plan.is_on("ambient_occlusion"),
            gloss: options.settings.gloss,
            gloss_roughness: options.settings.gloss_roughness,
            photo: &photo,
        };
        let lit = match world {
            World::Proxies(world) => mr360::render(&frame, world.as_ref(), found, &params, progress),
            World::Captured(world) => mr360::render(&frame, world.as_ref(), found, &params, progress),
        };
        let lit = lit.ok_or(Error::Cancelled)?;
        shadows = lit.shadows;
        lit.traced
    } else {
        let traced = match world {
            World::Proxies(world) => tracer::render(&frame, world.as_ref(), &params, progress),
            World::Captured(world) => tracer::render(&frame, world.as_ref(), &params, progress),
        };
        traced.ok_or(Error::Cancelled)?
    };
    if discarded > 0 {
        warnings.push(format!("{discarded} samples were not finite and count as black"));
    }
    clock.stage("trace", pixels, rays);

    // MR360 has the photo itself for the surfaces' colour.
    if let Some(lighting) = lighting.filter(|_| found.is_none()) {
        rescale_delta(&mut layers, &photo, &lighting);
    }
    if options.denoise && !objects.is_empty() {
        progress.begin("denoise", 1);
        let wrap = camera.projection == Projection::Panorama;
        let params = cross_bilateral::Params { wrap, delta_passes: options.settings.delta_passes, ..Default::default() };
        let report = cross_bilateral::filter(&params, &mut layers)?;
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
        clock.stage("denoise", pixels, 0);
    }
    let traced = Filtered { photo, layers, irradiance: None, shadows };
    finish(camera, inputs.encoding, traced, method.name(), plan, warnings, clock)
}

/// What a sequence carries from frame to frame.
#[derive(Debug)]
struct Carried {
    /// The lights that mr360 follows.
    lights: Lights,
    /// The past of iprt.
    past: Option<iprt::State>,
}

impl Default for Carried {
    fn default() -> Self {
        Self { lights: Lights::new(), past: None }
    }
}

/// A frame before it is composited.
struct Filtered {
    photo: RadianceImage,
    layers: TracedLayers,
    irradiance: Option<Irradiance>,
    shadows: Vec<Image<f32>>,
}

/// The last stage.
fn finish(
    camera: Camera,
    encoding: SourceEncoding,
    Filtered { photo, layers, irradiance, shadows }: Filtered,
    method: &str,
    plan: EffectPlan,
    mut warnings: Vec<String>,
    mut clock: Clock,
) -> Result<Rendered> {
    let mut out = Composite::new(camera.width, camera.height);
    let clamped = composite(&photo, &layers, &mut out)?;
    if clamped.pixels > 0 {
        warnings.push(format!(
            "{} pixels of the composite were below 0 by {:.3e} in all and were set to 0",
            clamped.pixels, clamped.energy
        ));
    }
    clock.stage("composite", (camera.width * camera.height) as u64, 0);
    let stats = clock.finish(method, plan, warnings);
    Ok(Rendered { camera, photo, encoding, layers, irradiance, shadows, composite: out, stats })
}

/// The photo in the view and, for LDR input, the inversely tone-mapped one that lights the objects.
fn view_of_photo(
    scene: &Scene,
    inputs: &Inputs,
    world: &World,
    camera: &Camera,
) -> Result<(RadianceImage, Option<RadianceImage>)> {
    let turn = scene.panorama.world_from_pano();
    let capture = scene.panorama.position;
    let moved = camera.position.distance(capture) > 1e-4;
    let view = |picture: &RadianceImage| -> Result<RadianceImage> {
        if moved {
            // Another place sees the surface from elsewhere: each pixel shows what the panorama shows of its point.
            return Ok(RadianceImage::par_from_fn(camera.width, camera.height, |x, y| {
                let d = camera.direction(glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                let seen = world.hit_position(camera.position, d).map_or(d, |p| p - capture);
                sphere::bilinear(picture, sphere::uv_from_direction(turn.inverse() * seen))
            }));
        }
        let mut out = RadianceImage::filled(camera.width, camera.height, Vec3::ZERO);
        sphere::resample::view_from_panorama(picture, turn, camera, &mut out)?;
        Ok(out)
    };
    let lighting = match &inputs.lighting {
        Some(lighting) if world.reflects_picture() => Some(view(lighting)?),
        _ => None,
    };
    Ok((view(&inputs.photo)?, lighting))
}

/// Where reflectance was read off an inversely tone-mapped picture, the change is relative to that picture: brings it to the
/// photo's scale, L_photo·ΔE/E.
fn rescale_delta(layers: &mut TracedLayers, photo: &RadianceImage, lighting: &RadianceImage) {
    for ((delta, photo), lighting) in layers.delta.data_mut().iter_mut().zip(photo.data()).zip(lighting.data()) {
        let ratio = |p: f32, l: f32| if l > 0.0 { p / l } else { 1.0 };
        *delta *= Vec3::new(ratio(photo.x, lighting.x), ratio(photo.y, lighting.y), ratio(photo.z, lighting.z));
    }
}

#[cfg(test)]
mod tests;
