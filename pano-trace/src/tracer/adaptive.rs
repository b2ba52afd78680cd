//! Adaptive sampling: samples go where the noise is.
//!
//! Every pixel takes a pilot of [`PILOT`] samples, whose batch means tell how noisy it is. Then each pixel's number of samples is
//! settled once, from the *other* pixels of its neighbourhood: enough for the asked root mean square error of the frame's noisy
//! pixels, for the least samples in all. With σ the standard deviation of a sample, that is n ∝ σ (Lagrange: minimise Σ n under
//! Σ σ²/n fixed), between the pilot and the maximum. Giving each pixel the same error (n ∝ σ²) spends more for the same root mean
//! square.
//!
//! **Bias.** Stopping on an estimate made of a pixel's own samples prefers pixels that were lucky: those that have not found the
//! light yet look quiet. Here a pixel's own samples have no say in their number, but for its share in the frame's one multiplier
//! (one part in the number of pixels), so its mean stays unbiased: `what_is_rarely_found_is_not_lost` measures it. The price: a
//! noisy pixel among quiet ones gets too few.
//!
//! The variance of Owen-scrambled samples is less than that of independent ones, and the more so the more there are: batches of
//! [`BATCH`] see some of it, so that the error told is an upper bound.

use super::around;
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::Image;
use rayon::prelude::*;

/// Samples of which every pixel has at least so many (or the maximum, if that is less), a power of two so that they are
/// stratified. Four batches and 24 neighbours estimate a variance to 17 %.
pub(super) const PILOT: u32 = 16;

/// Samples whose mean counts as one measurement; also the step in which numbers of samples grow.
pub(super) const BATCH: u32 = 4;

/// Pixels to each side that a pixel's noise is estimated from.
const RADIUS: usize = 2;

/// Halvings of the interval in which the frame's multiplier lies: its span of 10¹² is settled to a thousandth.
const STEPS: u32 = 50;

/// How noisy a pixel is: running moments of batch means of its luminance.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    sum: f32,
    in_batch: u32,
    batches: u32,
    mean: f64,
    /// Sum of squared differences from the mean (Welford's recurrence).
    squares: f64,
}

impl Noise {
    /// Takes the next sample.
    pub(super) fn add(&mut self, radiance: Vec3) {
        self.sum += luminance(radiance);
        self.in_batch += 1;
        if self.in_batch == BATCH {
            let batch = f64::from(self.sum) / f64::from(BATCH);
            (self.sum, self.in_batch) = (0.0, 0);
            self.batches += 1;
            let before = batch - self.mean;
            self.mean += before / f64::from(self.batches);
            self.squares += before * (batch - self.mean);
        }
    }

    /// After `samples` samples, whose batch means have that mean and sum of squared differences from it.
    #[cfg(feature = "gpu")]
    pub(super) fn measured(samples: u32, mean: f32, squares: f32) -> Self {
        let batches = samples / BATCH;
        Self { batches, mean: mean.into(), squares: squares.into(), ..Self::default() }
    }

    /// Variance of one sample; 0 of fewer than two batches.
    fn variance(&self) -> f64 {
        if self.batches < 2 { 0.0 } else { f64::from(BATCH) * self.squares / f64::from(self.batches - 1) }
    }
}

/// Samples of every pixel, from the noise of the pilots, `width` in a row: at most `most`, for the root mean square error `target`
/// of the noisy pixels. Columns wrap if `wrap`.
pub(super) fn settle(noise: &[Noise], most: &[u32], target: f32, width: usize, wrap: bool) -> Vec<u32> {
    let variances: Vec<f64> = noise.iter().map(Noise::variance).collect();
    allocate(&neighbourhood(&variances, width, wrap, false), most, target.into())
}

/// The mean of `values` (`width` in a row) over the neighbourhood of each; of itself only if `with_self`. Columns wrap if `wrap`.
fn neighbourhood(values: &[f64], width: usize, wrap: bool, with_self: bool) -> Vec<f64> {
    let size = (width, values.len() / width);
    let mean = |i: usize| {
        let (mut sum, mut count) = (0.0, 0);
        for n in around(i, size, RADIUS, wrap).filter(|&n| with_self || n != i) {
            sum += values[n];
            count += 1;
        }
        if count == 0 { values[i] } else { sum / f64::from(count) }
    };
    (0..values.len()).into_par_iter().map(mean).collect()
}

/// Samples of every pixel: for variances `variances` of a sample and `most` samples, the fewest in all that bring the root mean
/// square error of the noisy pixels to `target`; the most if that is not enough.
fn allocate(variances: &[f64], most: &[u32], target: f64) -> Vec<u32> {
    let noisy: Vec<(f64, u32)> = variances.iter().copied().zip(most.iter().copied()).filter(|(v, _)| *v > 0.0).collect();
    let count = |variance: f64, most: u32, multiplier: f64| {
        let wanted = (multiplier * variance.sqrt()).clamp(f64::from(PILOT), 4e9) as u32;
        wanted.next_multiple_of(BATCH).min(most)
    };
    let error = |multiplier: f64| {
        let sum: f64 = noisy.iter().map(|&(v, most)| v / f64::from(count(v, most, multiplier))).sum();
        (sum / noisy.len().max(1) as f64).sqrt()
    };
    // Samples per unit of standard deviation, as a power of two around that of the brightest noise.
    let brightest = noisy.iter().map(|(v, _)| v.sqrt()).fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (-20.0, 40.0);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if error(f64::exp2(middle) / brightest) > target { low = middle } else { high = middle }
    }
    let multiplier = f64::exp2(high) / brightest;
    variances.iter().zip(most).map(|(&v, &most)| count(v, most, multiplier)).collect()
}

/// Standard error of every pixel's luminance, from its own variance and its neighbours'.
pub(super) fn error_map(noise: &[Noise], samples: &[u32], width: usize, wrap: bool) -> Image<f32> {
    let variances: Vec<f64> = noise.iter().map(Noise::variance).collect();
    let smooth = neighbourhood(&variances, width, wrap, true);
    let errors = smooth.iter().zip(samples).map(|(v, n)| (v / f64::from(*n)).sqrt() as f32);
    Image::from_vec(width, variances.len() / width, errors.collect()).expect("one value a pixel")
}

#[cfg(test)]
mod tests {
    use super::*;
    use pano_core::random::combine;
    use proptest::prelude::*;

    #[test]
    fn variances_of_known_sequences() {
        let noise = |values: &[f32]| {
            let mut noise = Noise::default();
            values.iter().for_each(|v| noise.add(Vec3::splat(*v)));
            noise.variance()
        };
        assert_eq!(noise(&[1.0; 16]), 0.0);
        assert_eq!(noise(&[5.0; 4]), 0.0, "one batch has no variance");
        // Batch means of 0 and 1: a variance of ½ of four samples' mean.
        assert!((noise(&[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_pixel_has_no_say_in_its_own_neighbourhood() {
        let mut values = vec![0.0; 12 * 6];
        values[2 * 12] = 24.0;
        let others = neighbourhood(&values, 12, true, false);
        assert_eq!(others[2 * 12], 0.0);
        assert!((others[2 * 12 + 1] - 1.0).abs() < 1e-12);
        assert!((others[2 * 12 + 11] - 1.0).abs() < 1e-12, "over the seam");
        assert_eq!(neighbourhood(&values, 12, false, false)[2 * 12 + 11], 0.0);
        assert_eq!(neighbourhood(&[3.0], 1, true, false), [3.0], "a single pixel has no other");
    }

    /// Half the pixels are ten times as noisy: the same error for fewer samples than equal numbers, and than equal errors.
    #[test]
    fn the_target_is_met_with_the_fewest_samples() {
        let variances: Vec<f64> = (0..1000).map(|i| if i % 2 == 0 { 1.0 } else { 100.0 }).collect();
        let target = 0.25;
        let counts = allocate(&variances, &[1 << 20; 1000], target);
        let mean = |f: &dyn Fn(usize) -> f64| (0..1000).map(f).sum::<f64>() / 1000.0;
        let error = mean(&|i| variances[i] / f64::from(counts[i])).sqrt();
        assert!((error - target).abs() < 0.01 * target, "{error}");
        let spent = mean(&|i| f64::from(counts[i]));
        // Uniform, and equal errors: mean σ² / target² = 808. Best: (mean σ)² / target² = 484.
        assert!((spent - 484.0).abs() < 5.0, "{spent}");
        assert!(allocate(&variances, &[40; 1000], target).iter().all(|n| *n <= 40));
    }

    /// Light that one sample in a hundred finds, a hundred times as bright. Most pilots have not met it: a pixel that decides for
    /// itself stops there and stays black, while those that have met it go on, and their mean falls to what it should be.
    #[test]
    fn what_is_rarely_found_is_not_lost() {
        const SIDE: usize = 32;
        const MOST: u32 = 256;
        let mean = |decide: &dyn Fn(&[Noise]) -> Vec<u32>, run: u32| {
            let sample = |pixel: u32, index: u32| {
                let found = combine(combine(run, pixel), index) < u32::MAX / 100;
                if found { 100.0 } else { 0.0 }
            };
            let mut noise = vec![Noise::default(); SIDE * SIDE];
            for (i, noise) in noise.iter_mut().enumerate() {
                (0..PILOT).for_each(|index| noise.add(Vec3::splat(sample(i as u32, index))));
            }
            let counts = decide(&noise);
            let means = counts
                .iter()
                .enumerate()
                .map(|(i, &n)| (0..n).map(|index| f64::from(sample(i as u32, index))).sum::<f64>() / f64::from(n));
            (means.sum::<f64>() / counts.len() as f64, counts.iter().map(|n| f64::from(*n)).sum::<f64>() / counts.len() as f64)
        };
        let over_runs = |decide: &dyn Fn(&[Noise]) -> Vec<u32>| {
            let runs: Vec<(f64, f64)> = (0..100).map(|run| mean(decide, run)).collect();
            let average = |of: fn(&(f64, f64)) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
            (average(|r| r.0), average(|r| r.1))
        };
        let most = vec![MOST; SIDE * SIDE];
        let (ours, spent) = over_runs(&|noise| settle(noise, &most, 1.0, SIDE, false));
        let (naive, _) = over_runs(&|noise| allocate(&noise.iter().map(Noise::variance).collect::<Vec<_>>(), &most, 1.0));
        assert!((50.0..200.0).contains(&spent), "{spent} samples are no test");
        // The standard error of 100 runs of 1024 pixels with about 100 samples each is 0.003.
        assert!((ours - 1.0).abs() < 0.01, "{ours}");
        assert!(naive < 0.8, "deciding for oneself no longer goes wrong: {naive}");
    }

    proptest! {
        #[test]
        fn any_variances_give_counts_in_range(
            variances in prop::collection::vec(prop_oneof![Just(0.0), 0.0f64..1e3, Just(1e-40), Just(1e30)], 1..40),
            most in 1u32..100_000,
            target in prop_oneof![Just(0.0), 0.0f64..10.0],
        ) {
            let counts = allocate(&variances, &vec![most; variances.len()], target);
            for (n, v) in counts.iter().zip(&variances) {
                prop_assert!((PILOT.min(most)..=most).contains(n), "{n} of {most}");
                if *v == 0.0 {
                    prop_assert_eq!(*n, PILOT.min(most));
                }
            }
        }
    }
}
