//! Settings for a wanted time or a wanted error, from a short calibration on this machine and this scene.

use super::measure::Bench;
use super::{Choice, PREPARATIONS, TradeoffParams, Truth};
use crate::pipeline::{Error, Result};
use pano_core::{
    progress::Progress,
    scene::{Method, Render, Scene},
};

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// At most about this many milliseconds, reading included, writing not.
    Time(f64),
    /// An error of about this much, as [`super::Row::error`].
    Error(f64),
}

/// What was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// Where the knobs stand.
    pub choice: Choice,
    /// Milliseconds it should take.
    pub expected_ms: f64,
    /// Error it should have; `None` where only time was asked for.
    pub expected_error: Option<f64>,
    /// Why the goal cannot be met, if it cannot.
    pub caveat: Option<String>,
}

/// The share of a time budget that the longest calibrating picture should take.
const CALIBRATION_SHARE: f64 = 0.05;
/// Samples of the two calibrating pictures. Below four, pixels that need few samples do not get fewer.
const FEW: u32 = 4;
const MORE: u32 = 16;
/// Pictures of less than this many milliseconds are timed as often as [`REPEATS`] says, and the median counts…
const BRIEF_MS: f64 = 400.0;
/// …since beside so little work whatever else the machine does weighs much.
const REPEATS: usize = 3;
/// What is chosen for a budget below this many milliseconds is itself rendered and timed before it is called chosen…
const SETTLED_MS: f64 = 2_000.0;
/// …at most this often, until it takes what is wanted but for…
const SETTLING: u32 = 3;
/// …this share.
const SETTLED: f64 = 0.06;
/// No more than this many times the samples that were timed are foreseen: where the clock's noise hides what a sample takes, any number
/// would seem to fit.
const FARTHEST: u32 = 32;
/// The share of a time budget that preparing the captured world may take.
const PREPARATION_SHARE: f64 = 0.4;
/// One sample should take less than this share of the budget where a cheaper preparation can make it; all of it where only a method
/// that shows less would be faster.
const ROOM: f64 = 0.8;
/// Bounces of the leanest recursive picture: a ray through a body of glass and what lies behind it.
const LEAN_BOUNCES: u32 = 3;
/// Samples of each half of the reference that errors are calibrated against.
const REFERENCE: u32 = 96;
/// Bounces of that reference, at least.
const REFERENCE_BOUNCES: u32 = 6;
/// Each calibrating picture has this many times the samples of the one before…
const STEP: u32 = 4;
/// …unless it would take this many milliseconds.
const LONGEST_MS: f64 = 30_000.0;
/// Beyond this many times the samples of the last one nothing is foreseen.
const REACH: u32 = 16;
/// Errors are calibrated on a picture of at most as many pixels.
const CALIBRATION_PIXELS: f64 = 262_144.0;
/// Seeds of the reference.
const SEEDS: [u32; 2] = [0x6361_6c31, 0x6361_6c32];

/// Chooses settings for frame 0 of `scene`, with the scene's own method and number of bounces, and the filter if `denoise`.
///
/// # Errors
/// As [`super::run`].
pub fn choose(scene: &Scene, goal: Goal, denoise: bool, progress: &dyn Progress) -> Result<Chosen> {
    let wanted = match goal {
        Goal::Time(ms) => ms,
        Goal::Error(error) => error,
    };
    if !(wanted.is_finite() && wanted > 0.0) {
        return Err(Error::unsupported("a goal must be above 0", "ask for a time like 500ms or an error like 0.02"));
    }
    let params = TradeoffParams { repeats: 1, ..TradeoffParams::quick() };
    let mut bench = Bench::new(scene, &params, progress)?;
    let base = Choice { bounces: scene.render.bounces, denoise, ..bench.default_choice(bench.resolved()) };
    match goal {
        Goal::Time(ms) => for_time(&mut bench, &base, ms, progress),
        Goal::Error(error) => {
            let by_pixels = bench.shrink(CALIBRATION_PIXELS);
            for_error(&mut bench, &base, error, by_pixels, progress)
        }
    }
}

/// The dearest preparation that leaves time for tracing, and as many samples as fit. Where not even one fits, fewer bounces; and
/// if the scene leaves the method to us, recursive rays where paths would be fewer than a handful, or image-based lighting without
/// shadows.
fn for_time(bench: &mut Bench<'_>, base: &Choice, budget_ms: f64, progress: &dyn Progress) -> Result<Chosen> {
    progress.begin("calibrate", 3);
    let mut prepared_by_cost = Vec::new();
    if bench.is_captured() {
        // From cheap to dear, as long as the next one, whose work is known, can be expected to fit.
        for turned in PREPARATIONS.iter().rev() {
            let next = base.prepared(turned);
            let ms = bench.measure(&Choice { samples: 1, denoise: false, ..next.clone() }, progress)?.world_ms;
            let fits = ms <= PREPARATION_SHARE * budget_ms;
            if fits || prepared_by_cost.is_empty() {
                prepared_by_cost.push(next);
            }
            // The next dearer one takes at least four times as long.
            if !fits || 4.0 * ms > PREPARATION_SHARE * budget_ms {
                break;
            }
        }
    } else {
        bench.warm_up(progress)?;
        prepared_by_cost.push(base.clone());
    }
    // What a scene leaves to us may also become a cheaper picture of fewer bounces, or of another method.
    let cheapest = prepared_by_cost[0].clone();
    prepared_by_cost.splice(0..0, cheaper(&cheapest, bench.method_is_free(), bench.is_captured()));
    progress.advance(1);
    let time = |bench: &mut Bench<'_>, prepared: &Choice, samples: u32| -> Result<f64> {
        let mut times: Vec<f64> = Vec::new();
        while times.len() < if times.first().is_some_and(|&ms| ms < BRIEF_MS) { REPEATS } else { 1 } {
            // A single picture finds nothing read and no world prepared.
            bench.forget_world();
            if bench.load_ms() < BRIEF_MS {
                bench.load_again()?;
            }
            let row = bench.measure(&Choice { samples, ..prepared.clone() }, progress)?;
            times.push(row.ms + bench.load_ms());
        }
        times.sort_by(f64::total_cmp);
        Ok(times[times.len() / 2])
    };
    // If one sample leaves no time for a second one, a cheaper preparation does.
    let (mut prepared, mut one) = (base.clone(), f64::INFINITY);
    while let Some(dearest) = prepared_by_cost.pop() {
        prepared = dearest;
        one = time(bench, &prepared, 1)?;
        // Where another method is at hand, a handful of samples or it.
        let other = prepared.method == base.method && prepared_by_cost.iter().any(|next| next.method != base.method);
        let room = match prepared_by_cost.last() {
            Some(next) if next.method != prepared.method => 1.0,
            _ => ROOM,
        };
        let fits = if other { one < budget_ms && time(bench, &prepared, FEW)? <= budget_ms } else { one < room * budget_ms };
        if fits {
            break;
        }
    }
    progress.advance(1);
    let mut chosen =
        Chosen { choice: Choice { samples: 1, ..prepared.clone() }, expected_ms: one, expected_error: None, caveat: None };
    if one > budget_ms {
        chosen.caveat = Some(format!("even one sample a pixel takes {one:.0} ms here"));
        return Ok(chosen);
    }
    // More samples until what is measured is a fair share of what is wanted, and not the clock's own noise.
    let ((mut few, mut few_ms), (mut more, mut more_ms)) = ((1, one), (FEW, time(bench, &prepared, FEW)?));
    while more_ms < CALIBRATION_SHARE * budget_ms && more <= Render::MAX_SAMPLES / 4 {
        (few, few_ms) = (more, more_ms);
        more *= 4;
        more_ms = time(bench, &prepared, more)?;
    }
    progress.advance(1);
    let (mut samples, mut expected_ms) = extrapolate((few, few_ms), (more, more_ms), budget_ms);
    for _ in 0..if budget_ms < SETTLED_MS { SETTLING } else { 0 } {
        expected_ms = time(bench, &prepared, samples)?;
        let settled = expected_ms <= budget_ms && expected_ms >= (1.0 - SETTLED) * budget_ms;
        if settled || samples == 1 {
            break;
        }
        let (next, next_ms) = extrapolate((1, one), (samples, expected_ms), budget_ms);
        if next == samples {
            break;
        }
        (samples, expected_ms) = (next, next_ms);
    }
    chosen.choice.samples = samples;
    chosen.expected_ms = expected_ms;
    Ok(chosen)
}

/// Cheaper pictures than `choice`, from the cheapest on; of other methods only if that is `free`; a `captured` world may be coarse.
fn cheaper(choice: &Choice, free: bool, captured: bool) -> Vec<Choice> {
    let few = choice.method.default_bounces();
    let mut all = Vec::new();
    if free && choice.method != Method::Ibl {
        let other = |method: Method| {
            let bounces = method.default_bounces();
            Choice { method, bounces, settings: Vec::new(), ..choice.clone() }
        };
        // Of the preparations they have the surfaces only.
        let surfaces = PREPARATIONS.iter().rev().flat_map(|p| p.iter()).find(|(key, _)| *key == "field_resolution");
        let coarse = |choice: &Choice| Choice { settings: surfaces.into_iter().copied().collect(), ..choice.clone() };
        let (ibl, recursive) = (other(Method::Ibl), other(Method::Rt2ar));
        all.extend(captured.then(|| Choice { denoise: false, ..coarse(&ibl) }));
        all.extend(choice.denoise.then(|| Choice { denoise: false, ..ibl.clone() }));
        all.push(ibl);
        if choice.method == Method::Dpt {
            let lean = Choice { bounces: LEAN_BOUNCES, denoise: false, ..recursive.clone() };
            all.push(if captured { coarse(&lean) } else { lean });
            all.extend(captured.then(|| coarse(&recursive)));
            all.push(recursive);
        }
    }
    if choice.bounces > few {
        all.push(Choice { bounces: few, ..choice.clone() });
    }
    all
}

/// The samples for which the line through two (samples, milliseconds) reaches `budget_ms`, at least 1 and at most [`FARTHEST`] times
/// `more`, and its time there.
fn extrapolate((few, few_ms): (u32, f64), (more, more_ms): (u32, f64), budget_ms: f64) -> (u32, f64) {
    let slope = ((more_ms - few_ms) / f64::from(more - few)).max(1e-6);
    let fit = f64::from(more) + (budget_ms - more_ms) / slope;
    let samples = fit.clamp(1.0, f64::from(Render::MAX_SAMPLES.min(FARTHEST * more))) as u32;
    (samples, more_ms + slope * (f64::from(samples) - f64::from(more)))
}

/// A calibrating picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    samples: u32,
    error: f64,
    /// Of the calibrating size, preparation of the world included.
    ms: f64,
}

/// How the error falls with the samples: a power law through two points.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Law {
    last: Point,
    power: f64,
}

impl Law {
    /// Filters and the error of the method itself make errors fall more slowly than with the square root.
    fn through(few: Point, more: Point) -> Self {
        let ratio = f64::from(more.samples) / f64::from(few.samples);
        let power = if more.error > 0.0 { ((few.error / more.error).ln() / ratio.ln()).clamp(0.02, 0.6) } else { 0.5 };
        Self { last: more, power }
    }

    /// As few samples as the error allows.
    fn samples_for(&self, error: f64) -> f64 {
        (f64::from(self.last.samples) * (self.last.error / error).powf(1.0 / self.power)).ceil().max(1.0)
    }

    fn error_at(&self, samples: f64) -> f64 {
        self.last.error * (f64::from(self.last.samples) / samples).powf(self.power)
    }
}

/// As few samples as the error allows: pictures of ever more samples, until the last two tell how many.
fn for_error(bench: &mut Bench<'_>, base: &Choice, wanted: f64, by_pixels: f64, progress: &dyn Progress) -> Result<Chosen> {
    progress.begin("calibrate", 4);
    let reference = Choice { samples: REFERENCE, bounces: base.bounces.max(REFERENCE_BOUNCES), denoise: false, ..base.clone() };
    let mut half = |seed: u32| -> Result<_> {
        let picture = bench.picture(&reference, seed, progress)?.composite.color;
        progress.advance(1);
        Ok(picture)
    };
    let halves = [half(SEEDS[0])?, half(SEEDS[1])?];
    bench.judge_by(&Truth { halves, error: None, origin: String::new() });
    let mut world_ms = 0.0;
    let mut at = |samples: u32| -> Result<Point> {
        let row = bench.measure(&Choice { samples, ..base.clone() }, progress)?;
        progress.advance(1);
        world_ms = row.world_ms;
        Ok(Point { samples, error: row.error, ms: row.ms })
    };
    let (mut few, mut more) = (at(FEW)?, at(MORE)?);
    let mut law = Law::through(few, more);
    // Never guess farther than one step if there is time: what a step takes is less than the picture that is wanted.
    while law.samples_for(wanted) > f64::from(STEP * more.samples)
        && STEP * more.samples <= Render::MAX_SAMPLES
        && f64::from(STEP) * more.ms < LONGEST_MS
    {
        (few, more) = (more, at(STEP * more.samples)?);
        law = Law::through(few, more);
    }
    let slope = (more.ms - few.ms) / f64::from(more.samples - few.samples);
    let load_ms = bench.load_ms();
    let expected = |samples: f64| {
        let traced = more.ms - world_ms + slope * (samples - f64::from(more.samples));
        (by_pixels * traced.max(0.0) + world_ms + load_ms, law.error_at(samples))
    };
    let needed = law.samples_for(wanted);
    let reachable = needed <= f64::from(REACH * more.samples).min(f64::from(Render::MAX_SAMPLES));
    let samples = if reachable { needed } else { f64::from(more.samples) };
    let caveat = (!reachable).then(|| {
        let (samples, error) = (more.samples, more.error);
        format!("with {samples} samples the error is {error:.4}, and it falls too slowly to foresee how many reach {wanted}")
    });
    let (expected_ms, error) = expected(samples);
    Ok(Chosen { choice: Choice { samples: samples as u32, ..base.clone() }, expected_ms, expected_error: Some(error), caveat })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_two_times_reaches_the_budget() {
        assert_eq!(extrapolate((1, 20.0), (16, 50.0), 150.0), (66, 150.0));
        assert_eq!(extrapolate((1, 20.0), (4, 80.0), 40.0).0, 2);
        // A clock that runs backwards, and a budget without end.
        assert_eq!(extrapolate((1, 20.0), (4, 19.0), 1e12).0, 128);
        assert_eq!(extrapolate((1, 20.0), (16_384, 19.0), 1e12).0, Render::MAX_SAMPLES);
        assert_eq!(extrapolate((1, 20.0), (4, 80.0), 1.0).0, 1);
    }

    #[test]
    fn cheaper_pictures_keep_to_what_was_asked_for() {
        let choice =
            Choice { method: Method::Dpt, samples: 1, bounces: 5, denoise: true, settings: vec![("back_faces", "false")] };
        let told =
            |free: bool| cheaper(&choice, free, false).iter().map(|c| (c.method, c.bounces, c.denoise)).collect::<Vec<_>>();
        assert_eq!(told(false), [(Method::Dpt, 3, true)]);
        assert_eq!(
            told(true),
            [
                (Method::Ibl, 3, false),
                (Method::Ibl, 3, true),
                (Method::Rt2ar, 3, false),
                (Method::Rt2ar, 6, true),
                (Method::Dpt, 3, true)
            ]
        );
        let coarse = [("field_resolution", "128")];
        assert_eq!([0, 3, 4].map(|i| cheaper(&choice, true, true)[i].settings.clone()), [coarse; 3]);
        assert!(cheaper(&Choice { bounces: 2, ..choice }, false, true).is_empty());
    }

    #[test]
    fn a_law_through_two_errors_tells_the_samples() {
        let point = |samples, error| Point { samples, error, ms: 1.0 };
        let law = Law::through(point(4, 0.08), point(16, 0.04));
        assert!((law.power - 0.5).abs() < 1e-12 && law.samples_for(0.01) == 256.0 && law.samples_for(0.08) == 4.0);
        assert!((law.error_at(64.0) - 0.02).abs() < 1e-12);
        // Errors that do not fall, that grow, and none at all.
        for (few, more) in [(0.04, 0.04), (0.04, 0.05)] {
            let law = Law::through(point(4, few), point(16, more));
            assert!(law.samples_for(0.01) > 1e20 && law.samples_for(1.0) == 1.0);
        }
        assert_eq!(Law::through(point(4, 0.0), point(16, 0.0)).samples_for(0.01), 1.0);
    }
}
