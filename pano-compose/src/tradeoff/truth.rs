//! What errors are measured against.

use super::measure::Bench;
use super::{Choice, TradeoffParams};
use crate::pipeline::{Error, Folder, Result};
use pano_core::{
    image::{Image, RadianceImage},
    io,
    progress::Progress,
    scene::Method,
};

/// The picture errors are measured against.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Two independent pictures, linear radiance, whose mean is the truth; twice the same for a given one.
    pub halves: [RadianceImage; 2],
    /// Standard error of the truth itself, in the unit of [`super::Row::error`]: half the difference of its two halves; `None`
    /// for a given truth.
    pub error: Option<f64>,
    /// Where it came from.
    pub origin: String,
}

/// Scattering events of the converged run, at least.
const BOUNCES: u32 = 8;
/// Seeds of its halves, far from those of the measurements.
const SEEDS: [u32; 2] = [0x7275_7468, 0x7472_7565];

/// The given truth, that of an earlier run in the folder, or a converged run.
pub(super) fn find(bench: &mut Bench<'_>, params: &TradeoffParams, folder: &Folder, progress: &dyn Progress) -> Result<Truth> {
    let size = (bench.camera().width, bench.camera().height);
    if let Some(picture) = &params.truth {
        if picture.size() != size {
            let ((w, h), (tw, th)) = (size, picture.size());
            let problem = format!("the truth is {tw}×{th} and the scene's view {w}×{h}");
            return Err(Error::unsupported(problem, "give a truth of the view's size"));
        }
        return Ok(Truth { halves: [picture.clone(), picture.clone()], error: None, origin: "given".into() });
    }
    let method = if bench.methods().contains(&Method::Dpt) { Method::Dpt } else { bench.resolved() };
    let samples = params.truth_samples.div_ceil(2);
    let bounces = bench.bounces().max(BOUNCES);
    let choice = Choice { method, samples, bounces, denoise: false, settings: vec![] };
    let mut halves = Vec::new();
    for (i, seed) in SEEDS.into_iter().enumerate() {
        let path = folder.path().join(format!("truth-{}.exr", i + 1));
        if !path.exists() {
            let picture = bench.picture(&choice, params.seed ^ seed, progress)?.composite.color;
            io::write_image(&path, &picture, None)?;
        }
        // Read back also what was just written, so that a second run has the same bits.
        let picture = io::read_image(&path)?.radiance;
        if picture.size() != size {
            let problem = "is not of the view's size";
            return Err(pano_core::Error::file(&path, problem, "delete it to make it again").into());
        }
        halves.push(picture);
    }
    let origin = format!("{} with {} samples a pixel and {bounces} bounces, unfiltered", method.name(), 2 * samples);
    let mut halves = halves.into_iter();
    let (Some(a), Some(b)) = (halves.next(), halves.next()) else { unreachable!("one picture a seed") };
    let mut truth = Truth { halves: [a, b], error: None, origin };
    bench.judge_by(&truth);
    truth.error = bench.error_of_truth()?;
    Ok(truth)
}

impl Truth {
    /// Linear radiance.
    pub fn picture(&self) -> RadianceImage {
        let [a, b] = &self.halves;
        Image::from_fn(a.width(), a.height(), |x, y| 0.5 * (a.get(x, y) + b.get(x, y)))
    }
}
