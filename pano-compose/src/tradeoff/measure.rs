//! Renders choices, takes their time and their error.

use super::knobs::{KNOBS, Knob, Scope};
use super::{Choice, Row, TradeoffParams, Truth, suitable};
use crate::exposure::{encoded, exposed, white_of};
use crate::pipeline::{
    Clock, Error, Frame, Inputs, Loader, RenderOptions, Rendered, Result, Settings, World, build_world, prepare_objects,
    resolve_method, shrunk,
};
use glam::Vec3;
use pano_core::{
    camera::Camera,
    image::{Image, RadianceImage},
    metrics::{self, Mask},
    progress::Progress,
    scene::{Method, Scene},
};
use pano_trace::objects::Objects;
use std::borrow::Cow;
use std::time::Instant;

/// Pixels count where truth and photo differ by this much of white, after encoding: two steps of 8 bits.
const CHANGED: f32 = 2.0 / 255.0;

/// A scene in memory, ready to be rendered in many ways.
pub(super) struct Bench<'a> {
    scene: Cow<'a, Scene>,
    params: &'a TradeoffParams,
    inputs: Inputs,
    objects: Objects,
    camera: Camera,
    load_ms: f64,
    /// The world as it was built last.
    world: Option<Prepared>,
    judge: Option<Judge>,
    methods: Vec<Method>,
    resolved: Method,
}

struct Prepared {
    /// Each method asks for its own preparation.
    method: Method,
    settings: Settings,
    seed: u32,
    world: World,
    ms: f64,
}

struct Judge {
    white: f32,
    /// Their mean is the truth; the same twice for a given one.
    halves: [Image<Vec3>; 2],
    mask: Option<Mask>,
    /// Error of the photo without objects, known with the mask.
    untouched: Option<f64>,
}

impl Judge {
    fn truth(&self, x: usize, y: usize) -> Vec3 {
        0.5 * (self.halves[0].get(x, y) + self.halves[1].get(x, y))
    }

    /// Counts only pixels in which truth and `photo` differ, if there are any; and how much they do.
    fn mask_by(&mut self, photo: &RadianceImage) -> Result<()> {
        let shown = encoded(&exposed(photo, self.white));
        let changed = |x, y| (shown.get(x, y) - self.truth(x, y)).abs().max_element() > CHANGED;
        let mask = Mask::from_fn(shown.width(), shown.height(), changed);
        self.mask = mask.data().contains(&true).then_some(mask);
        self.untouched = Some(self.error_of(photo)?);
        Ok(())
    }

    /// Root mean square error of display-encoded values. Against a truth of two independent halves A and B it is the root of
    /// the mean of (p − A)·(p − B), in which their noise cancels: the error against what they converge to.
    fn error_of(&self, picture: &RadianceImage) -> Result<f64> {
        let (p, [a, b]) = (self.codes(picture), &self.halves);
        Ok((0.5 * (self.mse(&p, a)? + self.mse(&p, b)? - self.mse(a, b)?)).max(0.0).sqrt())
    }

    /// Root mean square of what differs from picture to picture: by the unbiased estimate of the variance, which is half the mean
    /// square difference of any two. 0 for one.
    fn noise_of(&self, pictures: &[RadianceImage]) -> Result<f64> {
        let codes: Vec<_> = pictures.iter().map(|picture| self.codes(picture)).collect();
        let (mut sum, mut pairs) = (0.0, 0.0);
        for (i, a) in codes.iter().enumerate() {
            for b in &codes[..i] {
                (sum, pairs) = (sum + 0.5 * self.mse(a, b)?, pairs + 1.0);
            }
        }
        Ok((sum / f64::max(pairs, 1.0)).sqrt())
    }

    fn codes(&self, picture: &RadianceImage) -> Image<Vec3> {
        encoded(&exposed(picture, self.white))
    }

    fn mse(&self, a: &Image<Vec3>, b: &Image<Vec3>) -> Result<f64> {
        Ok(metrics::mse(a, b, self.mask.as_ref())?)
    }
}

/// What one picture took, and how far off it was.
struct Shot {
    ms: f64,
    world_ms: f64,
    trace_ms: f64,
    denoise_ms: f64,
    error: f64,
}

/// The first frame's inputs and objects, and the milliseconds they took.
fn load(scene: &Scene) -> Result<(Inputs, Objects, f64)> {
    let begin = Instant::now();
    let inputs = Loader::default().load(scene, 0)?;
    let objects = prepare_objects(scene, &inputs, 0);
    Ok((inputs, objects, begin.elapsed().as_secs_f64() * 1e3))
}

impl<'a> Bench<'a> {
    pub(super) fn new(scene: &'a Scene, params: &'a TradeoffParams, progress: &dyn Progress) -> Result<Self> {
        progress.begin("load", 1);
        let (inputs, objects, load_ms) = load(scene)?;
        if objects.is_empty() {
            return Err(Error::unsupported("the scene has no objects, so that nothing changes", "add an [[object]]"));
        }
        let camera = inputs.view(scene);
        let methods = suitable(scene, &inputs);
        let resolved = resolve_method(scene, &inputs, &mut Vec::new())?;
        Ok(Self {
            scene: Cow::Borrowed(scene),
            params,
            inputs,
            objects,
            camera,
            load_ms,
            world: None,
            judge: None,
            methods,
            resolved,
        })
    }

    /// Renders smaller pictures of the same view from now on, of about `pixels` at most. How many times fewer pixels they have.
    pub(super) fn shrink(&mut self, pixels: f64) -> f64 {
        let count = |camera: &Camera| (camera.width * camera.height) as f64;
        let full = count(&self.camera);
        if full > pixels {
            self.scene.to_mut().view.size = Some(shrunk(&self.camera, pixels));
            self.camera = self.inputs.view(&self.scene);
        }
        full / count(&self.camera)
    }

    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Takes the time of reading once more.
    pub(super) fn load_again(&mut self) -> Result<()> {
        self.load_ms = load(&self.scene)?.2;
        Ok(())
    }

    /// Prepares the world anew for the next picture.
    pub(super) fn forget_world(&mut self) {
        self.world = None;
    }

    /// Milliseconds that reading took, which no [`Row`] counts.
    pub(super) fn load_ms(&self) -> f64 {
        self.load_ms
    }

    pub(super) fn methods(&self) -> &[Method] {
        &self.methods
    }

    /// What the scene's own method stands for.
    pub(super) fn resolved(&self) -> Method {
        self.resolved
    }

    /// Whether the scene leaves the method to us.
    pub(super) fn method_is_free(&self) -> bool {
        self.scene.render.method == Method::Auto
    }

    /// Whether there is a captured world to prepare.
    pub(super) fn is_captured(&self) -> bool {
        self.inputs.depth.is_some()
    }

    pub(super) fn bounces(&self) -> u32 {
        self.scene.render.bounces
    }

    /// The defaults of every knob.
    pub(super) fn default_choice(&self, method: Method) -> Choice {
        let default = pano_core::scene::Render::default();
        Choice { method, samples: default.samples, bounces: method.default_bounces(), denoise: true, settings: vec![] }
    }

    /// Knobs that are swept by themselves, for the scene's own method.
    pub(super) fn single_knobs(&self) -> impl Iterator<Item = &'static Knob> + use<> {
        let (captured, delta) = (self.inputs.depth.is_some(), self.resolved == Method::Dpt);
        let recursive = self.resolved == Method::Rt2ar;
        let paths = matches!(self.resolved, Method::Dpt | Method::Onepass | Method::Twopass | Method::Ibl);
        KNOBS.iter().filter(move |knob| {
            let combined = ["samples", "denoise"].contains(&knob.name);
            let applies = match knob.scope {
                Scope::All => true,
                Scope::Captured => captured,
                Scope::Delta => delta,
                Scope::Paths => paths,
                Scope::Rt2ar => recursive,
            };
            !combined && applies
        })
    }

    /// Errors are taken against `truth` from now on, over the pixels in which it is not the photo.
    pub(super) fn judge_by(&mut self, truth: &Truth) {
        let white = white_of(&truth.halves[0]);
        let halves = truth.halves.each_ref().map(|half| encoded(&exposed(half, white)));
        self.judge = Some(Judge { white, halves, mask: None, untouched: None });
    }

    /// The error of the photo without objects, once a picture has been judged.
    pub(super) fn untouched(&self) -> f64 {
        self.judge.as_ref().and_then(|judge| judge.untouched).unwrap_or(f64::INFINITY)
    }

    /// See [`Judge::error_of`]; NaN without a truth.
    pub(super) fn error_of(&self, picture: &RadianceImage) -> Result<f64> {
        self.judge.as_ref().map_or(Ok(f64::NAN), |judge| judge.error_of(picture))
    }

    /// Standard error of the mean of the truth's halves, in the same unit; `None` for a given truth.
    pub(super) fn error_of_truth(&self) -> Result<Option<f64>> {
        let Some(Judge { halves: [a, b], mask, .. }) = &self.judge else { return Ok(None) };
        let squared = metrics::mse(a, b, mask.as_ref())?;
        Ok((squared > 0.0).then(|| 0.5 * squared.sqrt()))
    }

    /// The picture as it is shown, and its error in false colours, white at a tenth of white or more.
    pub(super) fn shown(&self, picture: &RadianceImage) -> (RadianceImage, RadianceImage) {
        let white = self.judge.as_ref().map_or(1.0, |j| j.white);
        let shown = exposed(picture, white);
        let map = match &self.judge {
            None => shown.clone(),
            Some(judge) => {
                let codes = encoded(&shown);
                Image::from_fn(codes.width(), codes.height(), |x, y| {
                    heat((codes.get(x, y) - judge.truth(x, y)).length() / 3f32.sqrt() * 10.0)
                })
            }
        };
        (shown, map)
    }

    /// Renders one picture.
    pub(super) fn picture(&mut self, choice: &Choice, seed: u32, progress: &dyn Progress) -> Result<Rendered> {
        let (rendered, _) = self.render(choice, seed, progress)?;
        Ok(rendered)
    }

    fn render(&mut self, choice: &Choice, seed: u32, progress: &dyn Progress) -> Result<(Rendered, f64)> {
        let (mut scene, mut options) = (Scene::clone(&self.scene), RenderOptions { seed, ..RenderOptions::default() });
        choice.apply(&mut scene, &mut options)?;
        let settings = options.settings;
        let prepared = match self.world.take() {
            Some(prepared) if (prepared.method, prepared.settings, prepared.seed) == (choice.method, settings, seed) => prepared,
            _ => {
                let begin = Instant::now();
                let world = build_world(&scene, &self.inputs, &self.objects, &options, &mut Vec::new(), progress)?;
                Prepared { method: choice.method, settings, seed, world, ms: begin.elapsed().as_secs_f64() * 1e3 }
            }
        };
        let rendered =
            Frame::new(&scene, &self.inputs, &self.objects, &prepared.world, &options).render(Clock::new(), progress)?;
        let world_ms = prepared.ms;
        self.world = Some(prepared);
        if let Some(judge) = self.judge.as_mut().filter(|judge| judge.untouched.is_none()) {
            judge.mask_by(&rendered.photo)?;
        }
        Ok((rendered, world_ms))
    }

    /// A cheap picture whose time does not count.
    pub(super) fn warm_up(&mut self, progress: &dyn Progress) -> Result<()> {
        let choice = Choice { samples: 1, ..self.default_choice(self.resolved) };
        self.picture(&choice, 0, &Quiet(progress)).map(|_| ())
    }

    /// Takes time and error of a choice.
    pub(super) fn measure(&mut self, choice: &Choice, progress: &dyn Progress) -> Result<Row> {
        let (mut shots, mut pictures): (Vec<Shot>, Vec<RadianceImage>) = Default::default();
        for repeat in 0..self.params.repeats.max(1) {
            let (rendered, world_ms) = self.render(choice, self.params.seed.wrapping_add(repeat), &Quiet(progress))?;
            let of = |work: Work| {
                rendered.stats.stages.iter().filter(|s| Work::of(s.name) == work).map(|s| s.ms).fold(0.0, |sum, ms| sum + ms)
            };
            let (trace_ms, denoise_ms, ms) = (of(Work::Tracing), of(Work::Filtering), rendered.stats.total_ms + world_ms);
            let error = self.error_of(&rendered.composite.color)?;
            shots.push(Shot { ms, world_ms, trace_ms, denoise_ms, error });
            pictures.push(rendered.composite.color);
        }
        let noise = self.judge.as_ref().map_or(Ok(f64::NAN), |judge| judge.noise_of(&pictures))?;
        let n = shots.len() as f64;
        let error = shots.iter().map(|s| s.error).sum::<f64>() / n;
        let variance = shots.iter().map(|s| (s.error - error).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let median = |of: fn(&Shot) -> f64| {
            let mut values: Vec<f64> = shots.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
        };
        Ok(Row {
            series: String::new(),
            arguments: choice.arguments(),
            method: choice.method.name().into(),
            samples: choice.samples,
            bounces: choice.bounces,
            denoise: choice.denoise,
            value: String::new(),
            ms: median(|s| s.ms),
            world_ms: median(|s| s.world_ms),
            trace_ms: median(|s| s.trace_ms),
            denoise_ms: median(|s| s.denoise_ms),
            error,
            error_se: (variance / n).sqrt(),
            noise,
            repeats: shots.len() as u32,
        })
    }
}

/// What kind of work a stage is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    Tracing,
    Filtering,
    Other,
}

impl Work {
    /// That of the stage called `name` in `--stats`.
    fn of(name: &str) -> Self {
        match name {
            "trace" | "g-buffer" | "real pixels" | "virtual pixels" | "update" => Self::Tracing,
            "denoise" | "mean" | "sparse mask" | "interpolation" => Self::Filtering,
            _ if name.starts_with("filter ") || name.starts_with("history ") => Self::Filtering,
            _ => Self::Other,
        }
    }
}

/// Passes on only that the work should stop: a sweep has a bar of its own.
struct Quiet<'a>(&'a dyn Progress);

impl Progress for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Black, red, yellow, white for 0 to 1.
fn heat(value: f32) -> Vec3 {
    let v = 3.0 * value.clamp(0.0, 1.0);
    let encoded = Vec3::new(v, v - 1.0, v - 2.0).clamp(Vec3::ZERO, Vec3::ONE);
    encoded.map(pano_core::color::srgb_to_linear)
}
