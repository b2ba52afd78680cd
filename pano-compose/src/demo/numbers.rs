//! What the methods cost and how far they are from the truth.

use super::{Demo, DemoParams, samples_of};
use crate::exposure::{encoded, exposed, white_of};
use crate::pipeline::Result;
use pano_core::{image::RadianceImage, metrics};
use serde::Serialize;

/// How much the crop reaches beyond the objects' bounds on each side, as a share of their extent: room for shadows.
const MARGIN: f32 = 0.3;

/// What a path-traced picture cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceCost {
    /// Milliseconds of wall time, filter included.
    pub ms: f64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Share of the light that the filter lost, most of it outliers that were cut.
    pub lost_light: f64,
}

/// How far a picture is from the truth. SSIM, PSNR and FLIP are of display-encoded values, exposed by [`Numbers::white`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Score {
    /// Structural similarity, at most 1; `None` for a picture smaller than its window.
    pub ssim: Option<f64>,
    /// Peak signal-to-noise ratio, dB.
    pub psnr: f64,
    /// Mean FLIP error, [0, 1].
    pub flip: f64,
    /// Relative root mean squared error of exposed linear radiance.
    pub rel_rmse: f64,
}

/// Scores of the whole view and of the crop around the objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Scores {
    /// Of the whole view.
    pub view: Score,
    /// Of [`Numbers::crop`].
    pub crop: Score,
}

/// One method's row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodNumbers {
    /// Its name.
    pub method: &'static str,
    /// Samples a pixel.
    pub samples: u32,
    /// Milliseconds of wall time from the prepared world to the composite.
    pub ms: f64,
    /// The part of it of the stages that trace rays.
    pub trace_ms: f64,
    /// Rays traced.
    pub rays: u64,
    /// Against the truth with the objects.
    #[serde(flatten)]
    pub scores: Scores,
    /// What the pipeline had to say.
    pub warnings: Vec<String>,
}

/// What `numbers.json` holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Numbers {
    /// Width and height of the panorama.
    pub panorama: [usize; 2],
    /// Samples a pixel of the panorama.
    pub panorama_samples: u32,
    /// Width and height of the view.
    pub size: [usize; 2],
    /// Samples a pixel of the composites, but for those whose row says otherwise.
    pub samples: u32,
    /// Samples a pixel of the truth, which is filtered as the composites are.
    pub truth_samples: u32,
    /// Scattering events after the camera.
    pub bounces: u32,
    /// The seed.
    pub seed: u32,
    /// Radiance shown as white.
    pub white: f32,
    /// Left, top, width and height of the crop around the objects, in pixels of the view.
    pub crop: [usize; 4],
    /// Making the panorama.
    pub capture: ReferenceCost,
    /// Path-tracing the truth.
    pub truth: ReferenceCost,
    /// Path-tracing the truth without the objects.
    pub truth_without: ReferenceCost,
    /// Milliseconds for preparing the captured world, which the methods share.
    pub world_ms: f64,
    /// The photograph against the truth without the objects: what resampling and the capture's noise cost. No method can
    /// be much better.
    pub photo: Scores,
    /// A row a method.
    pub methods: Vec<MethodNumbers>,
    /// What preparing had to say.
    pub warnings: Vec<String>,
    /// Milliseconds of the whole demo, writing not included.
    pub total_ms: f64,
}

/// Compares the demo's pictures; times of what came before are left at 0.
pub(super) fn measure(demo: &Demo, params: &DemoParams) -> Result<Numbers> {
    let white = white_of(&demo.truth);
    let crop = crop_around_objects(demo);
    let truth = exposed(&demo.truth, white);
    let scores = |picture: &RadianceImage, truth: &RadianceImage| -> Result<Scores> {
        let picture = exposed(picture, white);
        Ok(Scores { view: score(&picture, truth)?, crop: score(&cut(&picture, crop), &cut(truth, crop))? })
    };
    let methods = demo
        .composites
        .iter()
        .map(|(method, rendered)| {
            let stats = &rendered.stats;
            Ok(MethodNumbers {
                method: method.name(),
                samples: samples_of(*method, params),
                ms: stats.total_ms,
                trace_ms: stats.stages.iter().filter(|s| s.rays > 0).map(|s| s.ms).sum(),
                rays: stats.stages.iter().map(|s| s.rays).sum(),
                scores: scores(&rendered.composite.color, &truth)?,
                warnings: stats.warnings.clone(),
            })
        })
        .collect::<Result<_>>()?;
    Ok(Numbers {
        panorama: demo.panorama.size().into(),
        panorama_samples: params.panorama_samples,
        size: params.view.into(),
        samples: params.samples,
        truth_samples: params.truth_samples,
        bounces: params.bounces,
        seed: params.seed,
        white,
        crop,
        photo: scores(demo.photo(), &exposed(&demo.truth_without, white))?,
        methods,
        ..Numbers::default()
    })
}

fn score(picture: &RadianceImage, truth: &RadianceImage) -> Result<Score> {
    let (a, b) = (encoded(picture), encoded(truth));
    Ok(Score {
        ssim: metrics::ssim(&a, &b, None)?,
        psnr: metrics::psnr(&a, &b, None)?,
        flip: metrics::flip(&a, &b, None)?,
        rel_rmse: metrics::rel_rmse(picture, truth, None)?,
    })
}

/// The part of a picture that starts at (x, y) with width w and height h.
fn cut(picture: &RadianceImage, [x, y, w, h]: [usize; 4]) -> RadianceImage {
    RadianceImage::from_fn(w, h, |i, j| picture.get(x + i, y + j))
}

/// The objects' bounds in the view, widened by [`MARGIN`] and cut off at the view's edge; never empty.
fn crop_around_objects(demo: &Demo) -> [usize; 4] {
    let camera = &demo.camera;
    let seen = demo.place.object_corners().filter_map(|corner| camera.pixel(corner - camera.position));
    let bounds = seen.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let Some((low, high)) = bounds else { return [0, 0, camera.width, camera.height] };
    let margin = MARGIN * (high - low);
    let within = |low: f32, high: f32, size: usize| {
        let low = (low.max(0.0) as usize).min(size - 1);
        (low, (high.ceil().max(0.0) as usize).clamp(low + 1, size) - low)
    };
    let (x, w) = within(low.x - margin.x, high.x + margin.x, camera.width);
    let (y, h) = within(low.y - margin.y, high.y + margin.y, camera.height);
    [x, y, w, h]
}
