//! What accuracy costs in time: every knob of every method that suits a scene, measured against the truth.
//!
//! ```text
//! scene ──> truth (given, or a converged run) ──┐
//!   └────> method × samples × bounces × filter ─┼──> time, error ──> front, what to choose ──> CSV, SVG, HTML
//!   └────> each other knob by itself ───────────┘
//! ```
//!
//! **Error** is the root mean square difference of display-encoded values (white 1, black 0) over the pixels the objects
//! change. **Time** is the median of repeats, from the prepared scene to the composite; where a panorama has depth it includes
//! preparing the captured world. What was measured is written at once, and a second run goes on where the first stopped.

mod budget;
mod charts;
mod front;
mod knobs;
mod measure;
mod page;
mod record;
mod truth;

pub use budget::{Chosen, Goal, choose};
pub use front::{BUDGETS_MS, Verdict, affordable, front};
use knobs::COMBINED_BOUNCES;
pub use knobs::{Choice, KNOBS, Knob, PREPARATIONS, Scope};
pub use record::Row;
pub use truth::Truth;

use crate::pipeline::{Folder, Result, resolve_method};
use measure::Bench;
use pano_core::{
    image::RadianceImage,
    progress::Progress,
    scene::{Method, Scene},
};
use record::Record;

/// How much is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct TradeoffParams {
    /// Repeats of each measurement, each with a seed and a preparation of its own, ≥ 1; the median time and the mean error count.
    pub repeats: u32,
    /// Samples are raised as long as a picture can be expected to take this many milliseconds, preparing the world left out.
    pub longest_ms: f64,
    /// Samples a pixel of the converged run, ≥ 2, where no truth is given.
    pub truth_samples: u32,
    /// The truth: linear radiance of the view, if it is known.
    pub truth: Option<RadianceImage>,
    /// Changes all random numbers.
    pub seed: u32,
}

impl TradeoffParams {
    /// Minutes to half an hour for a picture of some hundred thousand pixels.
    pub fn full() -> Self {
        Self { repeats: 3, longest_ms: 6_000.0, truth_samples: 1024, truth: None, seed: 0 }
    }

    /// A first look.
    pub fn quick() -> Self {
        Self { repeats: 2, longest_ms: 1_500.0, truth_samples: 128, ..Self::full() }
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// Everything that was measured.
    pub rows: Vec<Row>,
    /// The truth and how sure of it we are.
    pub truth: Truth,
    /// Whether the documented defaults are worth their time here, and whether errors fall as they should.
    pub verdict: Verdict,
    /// The files that were written.
    pub files: Vec<String>,
}

/// Series of a [`Row`] that belongs to the combinations of samples, bounces and filter.
pub const COMBINATION: &str = "combination";

/// How many times as long as the fastest picture the slowest of the scene's own method takes at least, if the knob `samples` goes
/// so far: two decades, over which a front can be seen.
const SPAN: f64 = 100.0;

/// Measures `scene` and writes `results.csv`, charts, pictures and `index.html` into `folder`.
///
/// # Errors
/// Faults of the files the scene names, a truth of the wrong size, results of something else in the folder, or
/// [`crate::pipeline::Error::Cancelled`]; what was measured until then is kept.
pub fn run(
    scene: &Scene,
    scene_text: &str,
    params: &TradeoffParams,
    folder: &Folder,
    progress: &dyn Progress,
) -> Result<Tradeoff> {
    let mut bench = Bench::new(scene, params, progress)?;
    let mut record = Record::open(folder, scene_text, params)?;
    let truth = truth::find(&mut bench, params, folder, progress)?;
    bench.judge_by(&truth);
    let combinations = combinations(&bench);
    let total = combinations.len() * samples().values.len() + bench.single_knobs().map(|k| k.values.len()).sum::<usize>();
    progress.begin("sweep", total as u64);
    bench.warm_up(progress)?;
    for choice in combinations {
        // Once a picture would take too long, more samples would take longer.
        let mut last: Option<Row> = None;
        for count in samples().values {
            let choice = choice.with(samples(), count)?;
            if last.as_ref().is_none_or(|row| expected_ms(row, choice.samples) <= params.longest_ms) {
                last = Some(record.or_measure(COMBINATION, &choice, &mut bench, progress)?);
            }
            progress.advance(1);
        }
    }
    let mut base = bench.default_choice(bench.resolved());
    let default = record.or_measure(COMBINATION, &base, &mut bench, progress)?;
    // The scene's own method goes on until the front has its length.
    let fastest = record.rows().iter().map(|row| row.ms).fold(f64::INFINITY, f64::min);
    for count in samples().values {
        let row = record.or_measure(COMBINATION, &base.with(samples(), count)?, &mut bench, progress)?;
        if row.ms >= SPAN * fastest {
            break;
        }
    }
    // Knobs are turned at fewer samples where the default would take too long.
    while base.samples > 1 && expected_ms(&default, base.samples) > params.longest_ms {
        base.samples = base.samples.div_ceil(FEWER);
    }
    for knob in bench.single_knobs() {
        for value in knob.values {
            record.or_measure(knob.name, &base.with(knob, value)?, &mut bench, progress)?;
            progress.advance(1);
        }
    }
    let verdict = Verdict::new(default, record.rows(), bench.untouched());
    let files = page::write(folder, &mut bench, &record, &truth, &verdict, progress)?;
    Ok(Tradeoff { rows: record.into_rows(), truth, verdict, files })
}

/// What one number of the knob `samples` has for the one before.
const FEWER: u32 = 4;

/// Milliseconds after preparing the world that a picture as `row`, but with `samples`, takes at most.
fn expected_ms(row: &Row, samples: u32) -> f64 {
    (row.ms - row.world_ms) * f64::from(samples) / f64::from(row.samples)
}

/// The knob that every combination is swept along.
fn samples() -> &'static Knob {
    KNOBS.iter().find(|k| k.name == "samples").unwrap_or(&KNOBS[0])
}

/// What is combined with every number of samples: methods, bounces, filter; and cheaper preparations of the scene's own
/// method.
fn combinations(bench: &Bench<'_>) -> Vec<Choice> {
    let mut all = Vec::new();
    for (i, turned) in PREPARATIONS.iter().enumerate() {
        for &method in bench.methods() {
            if i > 0 && !(bench.is_captured() && method == bench.resolved()) {
                continue;
            }
            // These know one bounce only.
            let single = matches!(method, Method::Ibl | Method::Mr360);
            let bounces = COMBINED_BOUNCES.into_iter().filter(|&b| !single || b == method.default_bounces());
            for (bounces, denoise) in bounces.flat_map(|b| [(b, false), (b, true)]) {
                all.push(Choice { bounces, denoise, ..bench.default_choice(method).prepared(turned) });
            }
        }
    }
    all
}

/// The methods that can render this scene, in the order of [`Method::ALL`].
fn suitable(scene: &Scene, inputs: &crate::pipeline::Inputs) -> Vec<Method> {
    let can = |&method: &Method| {
        let mut scene = scene.clone();
        scene.render.method = method;
        method != Method::Auto && resolve_method(&scene, inputs, &mut Vec::new()).is_ok()
    };
    Method::ALL.into_iter().filter(can).collect()
}

#[cfg(test)]
mod tests;
