//! The main job on a built-in room: photograph it as a panorama with depth, put objects into the photograph by every method,
//! path-trace the truth with the objects really in the room, and compare.
//!
//! ```text
//! room ──> panorama + depth ──> view with objects, by each method ──┐
//!   └────> the same view, path-traced, with and without objects ────┴──> errors, contact sheet
//! ```
//!
//! Everything goes through [`pipeline`], as `pano render` does.

mod cases;
mod files;
mod numbers;
mod place;
mod reference;
mod sheet;
mod smooth;
mod survey;

pub use cases::{Case, CaseParams, cases};
pub use numbers::{MethodNumbers, Numbers, ReferenceCost, Score, Scores};

use crate::pipeline::{self, Clock, Error, Frame, Inputs, RenderOptions, Rendered, Result};
use pano_core::{
    camera::Camera,
    image::{Image, RadianceImage},
    io::SourceEncoding,
    progress::Progress,
    random::Stream,
    scene::{Method, Scene},
};
use pano_trace::objects::Objects;
use place::{Place, SCENE_FILE};
use reference::Quality;
use std::sync::Arc;
use std::time::Instant;

/// The methods the demo compares, in this order: all there are.
pub const METHODS: [Method; 7] =
    [Method::Dpt, Method::Iprt, Method::Mr360, Method::Rt2ar, Method::Onepass, Method::Twopass, Method::Ibl];

/// The baselines get this part of the others' samples, for which they take about as long.
const BASELINE_SHARE: u32 = 4;

/// Pixels between the taps of the widest filter: the capture has few samples and smooth light, the truth is to be trusted.
const CAPTURE_FILTER: isize = 8;
const TRUTH_FILTER: isize = 4;

/// Sizes and samples of a demo. Time is proportional to pixels × samples of each picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DemoParams {
    /// Columns of the captured panorama (rows: half), even and ≥ 2. Higher gives a sharper background.
    pub panorama_width: usize,
    /// Samples a pixel of the panorama, ≥ 1; rounded up to an even number.
    pub panorama_samples: u32,
    /// Width and height of the view, ≥ 1.
    pub view: (usize, usize),
    /// Samples a pixel of each composite, ≥ 1; `onepass` and `twopass` get a quarter.
    pub samples: u32,
    /// Samples a pixel of the truth, ≥ 1; rounded up to an even number.
    pub truth_samples: u32,
    /// Scattering events after the camera, in the capture, the composites and the truth; ≥ 1.
    pub bounces: u32,
    /// Changes all random numbers.
    pub seed: u32,
}

impl DemoParams {
    /// Under two minutes on two cores.
    pub const fn full() -> Self {
        Self { panorama_width: 1024, panorama_samples: 16, view: (400, 300), samples: 16, truth_samples: 32, bounces: 5, seed: 0 }
    }

    /// Some twenty seconds on two cores: coarser and noisier.
    pub const fn quick() -> Self {
        Self { panorama_width: 1024, panorama_samples: 4, view: (240, 180), samples: 16, truth_samples: 24, bounces: 5, seed: 0 }
    }

    fn validate(&self) -> Result<()> {
        let (w, h) = self.view;
        let counts = [self.samples, self.panorama_samples, self.truth_samples, self.bounces];
        if self.panorama_width < 2 || !self.panorama_width.is_multiple_of(2) || w == 0 || h == 0 || counts.contains(&0) {
            let problem = format!("the demo needs an even panorama width and at least one pixel, sample and bounce: {self:?}");
            return Err(pano_core::Error::argument(problem).into());
        }
        Ok(())
    }
}

impl Default for DemoParams {
    fn default() -> Self {
        Self::full()
    }
}

/// Everything the demo makes.
#[derive(Clone, Debug)]
pub struct Demo {
    /// The captured panorama.
    pub panorama: Arc<RadianceImage>,
    /// Its distance along the ray in metres; infinite in the window.
    pub depth: Arc<Image<f32>>,
    /// The view onto the table.
    pub camera: Camera,
    /// The composites, in the order of [`METHODS`].
    pub composites: Vec<(Method, Rendered)>,
    /// The view, path-traced with the objects in the room; filtered.
    pub truth: RadianceImage,
    /// The view, path-traced without them; filtered.
    pub truth_without: RadianceImage,
    /// Times and errors.
    pub numbers: Numbers,
    place: Place,
    scene_text: String,
}

impl Demo {
    /// What the panorama shows in the view.
    pub fn photo(&self) -> &RadianceImage {
        &self.composites[0].1.photo
    }
}

/// Runs the demo in memory.
///
/// # Errors
/// [`Error::Cancelled`], or [`Error::Core`] if a size or a number of samples in `params` is 0.
pub fn run(params: &DemoParams, progress: &dyn Progress) -> Result<Demo> {
    params.validate()?;
    let begin = Instant::now();
    let place = Place::new()?;
    // Every picture has random numbers of its own; the composites' are those of frame 0.
    let streams = |picture: u32| [2 * picture - 1, 2 * picture].map(|frame| Stream { frame, seed: params.seed });
    let quality = |samples: u32, coarsest: isize, picture: u32| Quality {
        samples: samples.div_ceil(2),
        bounces: params.bounces,
        coarsest,
        streams: streams(picture),
    };
    let trace = |name: &str, objects: &Objects, camera: &Camera, quality: &Quality| {
        let clock = Instant::now();
        let traced = reference::trace(objects, camera, quality, &Step { progress, name })?;
        Ok::<_, Error>((
            traced.radiance,
            ReferenceCost { ms: clock.elapsed().as_secs_f64() * 1e3, rays: traced.rays, lost_light: traced.lost_light },
        ))
    };

    let (empty, full) = (place.without_objects(), place.with_objects());
    let panorama = place.panorama(params.panorama_width);
    let (radiance, capture_cost) = trace("capture", &empty, &panorama, &quality(params.panorama_samples, CAPTURE_FILTER, 1))?;
    let depth = reference::depth(&empty, &panorama, |triangle| place.is_window(triangle));
    let inputs = Inputs {
        photo: Arc::new(radiance),
        lighting: None,
        encoding: SourceEncoding::LinearFloat,
        depth: Some(Arc::new(depth)),
        camera: None,
        meshes: place.objects.clone(),
        proxy_meshes: Vec::new(),
        markers: Vec::new(),
        warnings: Vec::new(),
    };

    let scene_text = place.scene_file(params);
    let mut scene = Scene::parse(&scene_text, SCENE_FILE)?;
    let objects = pipeline::prepare_objects(&scene, &inputs, 0);
    let options = RenderOptions { seed: params.seed, ..RenderOptions::default() };
    let clock = Instant::now();
    let mut warnings = Vec::new();
    let step = Step { progress, name: "world" };
    let world = pipeline::build_world(&scene, &inputs, &objects, &options, &mut warnings, &step)?;
    let world_ms = clock.elapsed().as_secs_f64() * 1e3;
    let mut composites = Vec::new();
    for method in METHODS {
        scene.render.method = method;
        scene.render.samples = samples_of(method, params);
        let step = Step { progress, name: method.name() };
        composites.push((method, Frame::new(&scene, &inputs, &objects, &world, &options).render(Clock::new(), &step)?));
    }

    let camera = place.view(params.view);
    let (truth, truth_cost) = trace("truth", &full, &camera, &quality(params.truth_samples, TRUTH_FILTER, 2))?;
    let (truth_without, without_cost) = trace("empty truth", &empty, &camera, &quality(params.truth_samples, TRUTH_FILTER, 3))?;

    let mut demo = Demo {
        panorama: inputs.photo,
        depth: inputs.depth.unwrap_or_else(|| Arc::new(Image::filled(1, 1, f32::INFINITY))),
        camera,
        composites,
        truth,
        truth_without,
        numbers: Numbers::default(),
        place,
        scene_text,
    };
    demo.numbers = numbers::measure(&demo, params)?;
    let numbers = &mut demo.numbers;
    (numbers.capture, numbers.truth, numbers.truth_without) = (capture_cost, truth_cost, without_cost);
    (numbers.world_ms, numbers.warnings) = (world_ms, warnings);
    demo.numbers.total_ms = begin.elapsed().as_secs_f64() * 1e3;
    Ok(demo)
}

/// Samples a pixel of a method's composite.
fn samples_of(method: Method, params: &DemoParams) -> u32 {
    match method {
        Method::Onepass | Method::Twopass => params.samples.div_ceil(BASELINE_SHARE),
        _ => params.samples,
    }
}

/// Distance along the ray in metres of the demo's panorama, `width` (even, ≥ 2) columns wide; infinite in the window.
///
/// # Errors
/// [`Error::Core`] if `width` is odd or 0.
pub fn room_depth(width: usize) -> Result<Image<f32>> {
    DemoParams { panorama_width: width, ..DemoParams::full() }.validate()?;
    let place = Place::new()?;
    Ok(reference::depth(&place.without_objects(), &place.panorama(width), |triangle| place.is_window(triangle)))
}

/// Says which step of the demo a stage belongs to.
struct Step<'a> {
    progress: &'a dyn Progress,
    name: &'a str,
}

impl Progress for Step<'_> {
    fn begin(&self, stage: &str, total: u64) {
        self.progress.begin(&format!("{}: {stage}", self.name), total);
    }

    fn advance(&self, units: u64) {
        self.progress.advance(units);
    }

    fn cancelled(&self) -> bool {
        self.progress.cancelled()
    }
}

#[cfg(test)]
mod tests;
