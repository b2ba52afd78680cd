//! What will run for a scene, why, and about what it costs: from a small picture of the same scene.

use super::{Clock, Frame, Loader, RenderOptions, Result, Stats, World, build_world, prepare_objects, resolve_method};
use crate::plan::{EffectPlan, PlannedEffect};
use pano_core::{
    camera::Camera,
    progress::Progress,
    scene::{Method, Scene},
};
use pano_trace::world::CapturedOptions;
use serde::Serialize;
use std::time::Instant;

/// One stage that will run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedStage {
    /// Its name in `--stats`.
    pub name: &'static str,
    /// What for.
    pub why: String,
    /// Expected milliseconds on this machine, good to about a third.
    pub ms: f64,
}

/// What a render will do.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// The method.
    pub method: &'static str,
    /// Which effects are on, and why.
    pub plan: Vec<PlannedEffect>,
    /// Stages in the order they run; what does not run is not there.
    pub stages: Vec<PlannedStage>,
}

/// Pixels and samples of the small picture.
const PIXELS: f64 = 4096.0;
const SAMPLES: u32 = 8;
/// Widths and samples of two small irradiance maps, whose times tell the fixed part from the one that grows.
const WIDTHS: [usize; 2] = [64, 192];
const PAIRS: u32 = 4;

/// Plans frame [`RenderOptions::frame`] of `scene` and times its stages on a small picture.
///
/// # Errors
/// As [`super::render`].
pub fn plan(scene: &Scene, options: &RenderOptions, progress: &dyn Progress) -> Result<Plan> {
    let mut clock = Clock::new();
    let inputs = Loader::default().load(scene, options.frame)?;
    let objects = prepare_objects(scene, &inputs, options.frame);
    clock.stage("load", 0, 0);
    let method = resolve_method(scene, &inputs, &mut Vec::new())?;

    let full = options.settings.captured;
    let build = |width: usize| -> Result<(World, f64, f64)> {
        let mut options = options.clone();
        let captured = &mut options.settings.captured;
        captured.irradiance_width = width.min(full.irradiance_width);
        captured.irradiance_samples = PAIRS.min(full.irradiance_samples);
        let rays = work(captured);
        let begin = Instant::now();
        let world = build_world(scene, &inputs, &objects, &options, &mut Vec::new(), progress)?;
        Ok((world, rays, begin.elapsed().as_secs_f64() * 1e3))
    };
    let (world, w1, t1) = build(WIDTHS[1])?;
    let mut world_ms = t1;
    if matches!(world, World::Captured(_)) && method != Method::Ibl {
        // A fixed part, and one in proportion to the texels and samples of the irradiance map.
        let (_, w0, t0) = build(WIDTHS[0])?;
        let rate = if w1 > w0 { ((t1 - t0) / (w1 - w0)).max(0.0) } else { 0.0 };
        world_ms += rate * (work(&full) - w1).max(0.0);
    }

    let camera = inputs.view(scene);
    let pixels = (camera.width * camera.height) as f64;
    let size = shrunk(&camera, PIXELS);
    let mut small = scene.clone();
    small.view.size = Some(size);
    small.render.samples = scene.render.samples.min(SAMPLES);
    let stats: Stats = Frame::new(&small, &inputs, &objects, &world, options).render(clock, progress)?.stats;

    let by_pixels = pixels / (size.0 * size.1) as f64;
    let by_samples = f64::from(scene.render.samples) / f64::from(small.render.samples);
    let mut stages = Vec::new();
    for stage in &stats.stages {
        let scale = match (stage.pixels, stage.rays) {
            (0, 0) => 1.0,
            (_, 0) => by_pixels,
            _ => by_pixels * by_samples,
        };
        stages.push(PlannedStage { name: stage.name, why: why(stage.name, scene, &stats.plan), ms: stage.ms * scale });
        if stage.name == "load" {
            stages.push(PlannedStage { name: "world", why: why("world", scene, &stats.plan), ms: world_ms });
        }
    }
    // The small picture had a plan of its own size; every effect is decided by the scene alone.
    Ok(Plan { method: method.name(), plan: stats.plan.effects().to_vec(), stages })
}

/// Width and height of a picture of the same shape with at most about `pixels`.
pub(crate) fn shrunk(camera: &Camera, pixels: f64) -> (usize, usize) {
    let shrink = (pixels / (camera.width * camera.height) as f64).sqrt().min(1.0);
    let side = |n: usize| ((n as f64 * shrink).round() as usize).max(1);
    (side(camera.width), side(camera.height))
}

/// Texels times samples of an irradiance map.
fn work(options: &CapturedOptions) -> f64 {
    options.irradiance_width.pow(2) as f64 * f64::from(options.irradiance_samples)
}

/// What a stage is for.
fn why(stage: &str, scene: &Scene, plan: &EffectPlan) -> String {
    let render = &scene.render;
    match stage {
        "load" => "panorama, depth and meshes are read, meshes get their hierarchy".into(),
        "world" if scene.panorama.depth.is_some() => {
            "depth becomes a surface; irradiance near the objects tells reflectance".into()
        }
        "world" => "the picture becomes light from infinity, proxies become surfaces".into(),
        "view" => "the picture as the view shows it".into(),
        "trace" if plan.is_on("multi_bounce") => format!("{} samples a pixel, {} bounces", render.samples, render.bounces),
        "trace" => format!("{} samples a pixel, direct light", render.samples),
        "denoise" => "what is traced is noisy".into(),
        "composite" => "photo, objects and their change are put together".into(),
        name => format!("part of the method: {name}"),
    }
}
