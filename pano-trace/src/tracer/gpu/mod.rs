//! The path tracers on the GPU: [`super::render`] of proxies under an environment at infinity ([`render`]), and of captured radiance
//! ([`render_captured`]).
//!
//! The random numbers, strategies and weights are the CPU's, so that a frame differs by rounding: `f32` sums with fused products, and
//! now and then a path for which rounding turns a choice over (a lobe, an edge) and which ends elsewhere.
//!
//! Departures from the CPU: recursion is a loop from ray to ray (`turn.wgsl`); two-pass rendering does not trace the second pass
//! where an object hides it, as nothing of it is used. How noisy a pixel is, is measured in `f32`; how many samples that calls for, the
//! host settles for the whole frame.

pub(crate) mod scene;
pub(crate) mod wave;

pub use wave::{GpuHit, SHADER as WAVE, captured_hits, render_captured};

use super::adaptive::{self, Noise};
use super::delta::{AROUND, FULL_EFFORT, LEAST_EFFORT, LEAST_EFFORT_ONCE};
use super::delta::{LIGHTS_OF_AN_IMAGE, PATHS_END_SHARE, SECOND_ORDER_EFFORT, SECOND_ORDER_LIGHTS};
use super::influence::{self, Thinned, least_of_neighbours};
use super::path::ROULETTE_FROM;
use super::{Frame, Lights, Method, Mis, Pixel, Sampling, Scene, TraceParams, Traced, layers};
use crate::bsdf::gpu::{BSDF, DIRECTIONS};
use crate::bvh::gpu::TRAVERSAL;
use crate::cone::CONES;
use crate::objects::gpu::OBJECTS;
use crate::objects::{MAX_CLUSTERS, Objects, SURROUNDINGS};
use crate::world::gpu::{ENVIRONMENT, PROXIES, World};
use crate::world::{ProxyWorld, RealWorld};
use bytemuck::{Pod, Zeroable};
use pano_core::camera::{Camera, Projection};
use pano_core::distribution::gpu::DISTRIBUTION;
use pano_core::gpu::{COLOR, Constant, Gpu, GpuBuffer, GpuResult, IMAGE, Kernel, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader};
use pano_core::gpu::{Layout, Specialization, WORDS, flag};
use pano_core::progress::Progress;
use scene::{GpuPixel, GpuScene, Submissions, VIEW, View};

pano_core::uniform! {
    /// `Trace` of the shader.
    pub(crate) struct Trace {
        rows: Rows,
        view: View,
        world: World,
        bounces: u32,
        samples: u32,
        end: u32,
        pad: u32,
        clusters: [u32; 2],
        lights: [u32; 2],
    }
}

/// `Started` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Started {
    pixel: GpuPixel,
    most: u32,
    boost: f32,
    mixed: u32,
    share: f32,
    sum: f32,
    mean: f32,
    squares: f32,
    taken: u32,
}

/// Where the objects' change comes from.
pub(crate) const AIM: Piece = Piece {
    text: include_str!("aim.wgsl"),
    constants: || {
        vec![
            Constant::u32("MAX_CLUSTERS", MAX_CLUSTERS as u32),
            Constant::u32("ROULETTE_FROM", ROULETTE_FROM),
            Constant::f32("FULL_EFFORT", FULL_EFFORT),
            Constant::f32("LEAST_EFFORT", LEAST_EFFORT),
            Constant::f32("LEAST_EFFORT_ONCE", LEAST_EFFORT_ONCE),
            Constant::f32("SECOND_ORDER_EFFORT", SECOND_ORDER_EFFORT),
            Constant::u32("SECOND_ORDER_LIGHTS", SECOND_ORDER_LIGHTS),
            Constant::u32("LIGHTS_OF_AN_IMAGE", LIGHTS_OF_AN_IMAGE),
            Constant::f32("PATHS_END_SHARE", PATHS_END_SHARE),
            Constant::f32("AROUND", AROUND),
            Constant::f32("SPIKY", influence::SPIKY),
            Constant::u32("MOST_THINNING", influence::MOST_THINNING),
            Constant::u32("NO_SAMPLES", influence::NO_SAMPLES),
            Constant::u32("MOST_THINNING_SPIKY", influence::MOST_THINNING_SPIKY),
            Constant::u32("MOST_THINNING_UNAIMED", influence::MOST_THINNING_UNAIMED),
            Constant::f32("SURROUNDINGS", SURROUNDINGS),
            Constant::f32("SECOND_ORDER_SHARE", influence::SECOND_ORDER_SHARE),
        ]
    },
};

/// The bit of every question.
pub(crate) const ASKS: u32 = 1;

/// Rays and what is asked of them, for shaders to include after [`ENVIRONMENT`].
pub(crate) const QUESTS: Piece = Piece { text: include_str!("quest.wgsl"), constants: || vec![Constant::u32("ASKS", ASKS)] };

/// Paths on their way from ray to ray, for shaders to include after [`AIM`] and [`QUESTS`].
pub(crate) const PATHS: Piece = Piece::plain(concat!(
    include_str!("frame.wgsl"),
    include_str!("walk.wgsl"),
    include_str!("path.wgsl"),
    include_str!("vertex.wgsl"),
));

/// Samples on their way from ray to ray, for shaders to include after [`PATHS`].
const TURNS: Piece = Piece {
    text: concat!(include_str!("point.wgsl"), include_str!("turn.wgsl")),
    constants: || vec![Constant::u32("BATCH", adaptive::BATCH)],
};

/// `trace.wgsl`, with what comes before it.
pub static SHADER: Shader = Shader {
    name: "trace",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        RANDOM,
        WORDS,
        COLOR,
        DISTRIBUTION,
        TRAVERSAL,
        DIRECTIONS,
        CONES,
        BSDF,
        OBJECTS,
        ENVIRONMENT,
        QUESTS,
        PROXIES,
        VIEW,
        AIM,
        PATHS,
        TURNS,
        Piece::plain(include_str!("trace.wgsl")),
    ],
    // Of the many combinations the ends: each method with all effects, and with none.
    specializations: &[
        Specialization { entry: "start", constants: &[] },
        Specialization { entry: "start", constants: LEAST },
        Specialization { entry: "trace", constants: &[("METHOD", 0.0)] },
        Specialization { entry: "trace", constants: &[("METHOD", 1.0), ("POINTS", 0.0)] },
        Specialization { entry: "trace", constants: &[("METHOD", 2.0), ("POINTS", 0.0)] },
        Specialization { entry: "trace", constants: &[("METHOD", 3.0), ("POINTS", 0.0)] },
        Specialization { entry: "trace", constants: LEAST },
    ],
};

/// A scene without any effect that can be left out.
const LEAST: &[(&str, f64)] = &[
    ("GLOSS", 0.0),
    ("BODIES", 0.0),
    ("LIT", 0.0),
    ("PROXY_MESHES", 0.0),
    ("FROM_PICTURE", 0.0),
    ("EMITTERS", 0.0),
    ("TEXTURES", 0.0),
    ("SECOND_ORDER", 0.0),
    ("EVERYWHERE", 1.0),
    ("ADAPTIVE", 0.0),
];

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    [vec![(&SHADER, Trace::LAYOUT), (&SHADER, View::LAYOUT), (&SHADER, World::LAYOUT)], wave::layout::layouts()].concat()
}

/// [`super::render`] on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if a table of the scene does not fit a binding, or what has become of the device.
pub fn render(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &ProxyWorld,
    params: &TraceParams,
    progress: &dyn Progress,
) -> GpuResult<Option<Traced>> {
    let (scene, (clusters, lights)) = GpuScene::new(gpu, frame, world, |packed, words, _| {
        (packed.clusters, Lights::of(world, frame.camera.position, params.samples).pack(words))
    })?;
    let mut constants = specialize(frame.objects, world, params);
    constants.extend([
        ("POINTS", flag(params.method == Method::Dpt)),
        ("PROXY_MESHES", flag(world.has_meshes())),
        ("FROM_PICTURE", flag(world.reflects_picture())),
    ]);
    let cut = Submissions::new(gpu, frame, size_of::<Started>(), params.bounces as usize);
    let run = |entry: &'static str, rows: Rows, held: &GpuBuffer, end: u32| {
        let (bounces, samples) = (params.bounces, params.samples);
        let uniform = Trace { rows, view: scene.view, world: scene.world, bounces, samples, end, pad: 0, clusters, lights };
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        let buffers: Vec<(u32, &GpuBuffer)> = scene.bindings().chain([(6, held)]).collect();
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())
    };
    let (width, height) = (frame.camera.width, frame.camera.height);
    progress.begin("trace", 2 * height as u64);
    let mut pixels: Vec<Started> = Vec::with_capacity(width * height);
    for band in cut.bands() {
        if progress.cancelled() {
            return Ok(None);
        }
        let rows = cut.rows(&band);
        let held = gpu.buffer::<Started>(rows.pixels())?;
        run("start", rows, &held, 0)?;
        pixels.extend(gpu.read_slice::<Started>(&held, rows.pixels())?);
        progress.advance(u64::from(rows.count));
    }
    sample(&mut pixels, frame.camera, params, progress, |pixels| {
        for band in cut.bands() {
            let rows = cut.rows(&band);
            let in_band = &mut pixels[band.start * width..band.end * width];
            let taken = in_band.iter().map(|p| p.taken).min().unwrap_or_default();
            let most = in_band.iter().map(|p| p.most).max().unwrap_or_default();
            let held = gpu.upload_slice(in_band)?;
            for part in cut.samples(rows, most).filter(|part| part.end > taken) {
                if progress.cancelled() {
                    return Ok(false);
                }
                run("trace", rows, &held, part.end)?;
            }
            in_band.copy_from_slice(&gpu.read_slice::<Started>(&held, rows.pixels())?);
            progress.advance(u64::from(rows.count));
        }
        Ok(true)
    })
}

/// Takes the samples of pixels whose centres are known. `take` goes on with each until it has its [`Started::most`]; false if it was
/// cancelled, upon which there is no frame.
fn sample(
    pixels: &mut [Started],
    camera: &Camera,
    params: &TraceParams,
    progress: &dyn Progress,
    mut take: impl FnMut(&mut [Started]) -> GpuResult<bool>,
) -> GpuResult<Option<Traced>> {
    // Where noise is to be measured, there are enough samples for that.
    let pilot = if params.error_target.is_some() { adaptive::PILOT.min(params.samples) } else { 0 };
    settle(pixels, camera, params.samples, pilot);
    let Some(target) = params.error_target else {
        return Ok(take(pixels)?.then(|| traced(camera, pixels, None)));
    };
    let most: Vec<u32> = pixels.iter().map(|p| p.most).collect();
    pixels.iter_mut().for_each(|p| p.most = pilot);
    if !take(pixels)? {
        return Ok(None);
    }
    let wrap = camera.projection == Projection::Panorama;
    let counts = adaptive::settle(&noise(pixels), &most, target, camera.width, wrap);
    pixels.iter_mut().zip(&counts).for_each(|(p, count)| p.most = *count);
    progress.begin("refine", camera.height as u64);
    Ok(take(pixels)?.then(|| traced(camera, pixels, Some(Sampling::of(&noise(pixels), &counts, camera)))))
}

/// How noisy pixels are.
fn noise(pixels: &[Started]) -> Vec<Noise> {
    pixels.iter().map(|p| Noise::measured(p.taken, p.mean, p.squares)).collect()
}

/// Settles the samples of pixels from what their centres ask for: at `least` so many, if any.
fn settle(pixels: &mut [Started], camera: &Camera, samples: u32, least: u32) {
    let wrap = camera.projection == Projection::Panorama;
    let thinning: Vec<u32> = pixels.iter().map(|p| p.most).collect();
    for (pixel, thinning) in pixels.iter_mut().zip(least_of_neighbours(&thinning, camera.width, wrap)) {
        let scene = if pixel.mixed == 1 { Scene::Mixed } else { Scene::Real };
        let Thinned { samples, boost, share } = Thinned::of(scene, samples, thinning, least);
        (pixel.most, pixel.boost, pixel.share) = (samples, boost, share);
    }
}

/// What a frame's pixels have come to.
fn traced(camera: &Camera, pixels: &[Started], sampling: Option<Sampling>) -> Traced {
    let finished: Vec<Pixel> = pixels.iter().map(|p| p.pixel.finish(p.most)).collect();
    Traced {
        layers: layers(camera, finished.iter()),
        rays: pixels.iter().map(|p| u64::from(p.pixel.rays)).sum(),
        discarded: pixels.iter().map(|p| u64::from(p.pixel.discarded)).sum(),
        sampling,
    }
}

/// What this scene calls for over any world; the rest is not compiled.
pub(crate) fn specialize(objects: &Objects, world: &impl RealWorld, params: &TraceParams) -> Vec<(&'static str, f64)> {
    let method = match params.method {
        Method::Dpt => 0,
        Method::OnePass => 1,
        Method::TwoPass => 2,
        Method::Ibl => 3,
    };
    let mis = match params.mis {
        Mis::Balance => 0,
        Mis::LightOnly => 1,
        Mis::BsdfOnly => 2,
    };
    vec![
        ("METHOD", f64::from(method)),
        ("MIS", f64::from(mis)),
        ("GLOSS", flag(objects.gloss())),
        ("BODIES", flag(objects.transmit())),
        ("EMITTERS", flag(objects.emit())),
        ("TEXTURES", flag(objects.textured())),
        ("EVERYWHERE", flag(params.everywhere)),
        ("SECOND_ORDER", flag(params.second_order && world.sees_itself())),
        ("LIT", flag(world.environment().light.is_some())),
        ("ADAPTIVE", flag(params.error_target.is_some())),
    ]
}
