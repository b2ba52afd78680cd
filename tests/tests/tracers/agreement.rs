//! Three estimators of the same change must agree: `dpt`, `onepass` and `twopass`, block by block, on random scenes.

use pano_core::image::Image;
use pano_tests::scenes::{TestScene, random_proxies, random_room};
use pano_tests::statistics::{Estimate, binomial_bound, sidak_bound, two_sided_tail};
use pano_trace::tracer::{Method, TraceParams};
use pano_trace::world::RealWorld;

/// Side of a block in pixels.
const BLOCK: usize = 8;
/// Independent renderings whose block means give the mean and its standard error.
const REPETITIONS: u32 = 48;
/// With 48 renderings a side the deviation is a Student t of 47 (one side much noisier) to 94 degrees of freedom, up to this
/// much wider than a normal number at 3 to 5 standard errors…
const STUDENT: f64 = 1.1;
/// …and with a variance of 47/45 to 94/92.
const STUDENT_VARIANCE: f64 = 1.033;

/// Per block and channel (object and delta, three colours each) the means over the repetitions.
fn block_estimates<W: RealWorld>(scene: &TestScene<W>, params: &TraceParams, first_seed: u32) -> Vec<[Estimate; 6]> {
    let (columns, rows) = (scene.camera.width / BLOCK, scene.camera.height / BLOCK);
    let mut values = vec![[const { Vec::new() }; 6]; columns * rows];
    for repetition in 0..REPETITIONS {
        let layers = scene.trace(params, first_seed + repetition).layers;
        for (b, block) in values.iter_mut().enumerate() {
            let (x0, y0) = (b % columns * BLOCK, b / columns * BLOCK);
            let mean = |image: &Image<glam::Vec3>, channel: usize| {
                let pixels = (0..BLOCK * BLOCK).map(|i| image.get(x0 + i % BLOCK, y0 + i / BLOCK));
                pixels.map(|p| f64::from(p[channel])).sum::<f64>() / (BLOCK * BLOCK) as f64
            };
            for channel in 0..3 {
                block[channel].push(mean(&layers.object, channel));
                block[3 + channel].push(mean(&layers.delta, channel));
            }
        }
    }
    values.into_iter().map(|block| block.map(|v| Estimate::of(&v))).collect()
}

/// Compares every block with the reference's and collects what the deviations look like.
#[derive(Default)]
struct Verdict {
    /// Blocks compared (object and delta count as two), in the green channel.
    tests: usize,
    /// …those more than 3 standard errors apart,
    beyond: usize,
    /// …and the sum of the squares of their deviations.
    squares: f64,
    /// The largest deviation of any channel.
    worst: f64,
    worst_is: String,
}

impl Verdict {
    fn compare(&mut self, what: &str, estimates: &[[Estimate; 6]], reference: &[[Estimate; 6]]) {
        for (block, (estimate, reference)) in estimates.iter().zip(reference).enumerate() {
            for channel in 0..6 {
                let raw = estimate[channel].deviation(&reference[channel]);
                let deviation = raw / STUDENT;
                if deviation.abs() > self.worst {
                    let (e, r) = (&estimate[channel], &reference[channel]);
                    self.worst = deviation.abs();
                    self.worst_is = format!("{what}, block {block}, channel {channel}: {e:?}, reference {r:?}");
                }
                // The channels of a block are correlated: green stands for them where outliers are counted.
                if channel % 3 == 1 && reference[channel].error > 0.0 {
                    self.tests += 1;
                    self.beyond += usize::from(deviation.abs() > 3.0);
                    self.squares += raw * raw / STUDENT_VARIANCE;
                }
            }
        }
    }

    fn check(&self, name: &str) {
        let Self { tests, beyond, squares, worst, worst_is } = self;
        let allowed = binomial_bound(*tests, two_sided_tail(3.0), 1e-3);
        let bound = sidak_bound(3 * tests, 1e-3);
        let mean_square = squares / *tests as f64;
        // The mean of n squares of standard normal numbers has mean 1 and variance 2/n. Too small a one would mean that the
        // standard errors are too large to tell anything.
        let spread = 3.3 * (2.0 / *tests as f64).sqrt();
        let numbers = format!(
            "{name}: {beyond} of {tests} blocks beyond 3 SE ({allowed} allowed), mean square {mean_square:.3} (1 ± {spread:.3}), \
             largest {worst:.2} SE ({bound:.2} allowed): {worst_is}"
        );
        println!("{numbers}");
        assert!(beyond <= &allowed && *worst <= bound && (mean_square - 1.0).abs() <= spread, "{numbers}");
    }
}

/// Methods with the samples they get: more for the noisier.
const METHODS: [(&str, Method, u32); 3] =
    [("dpt", Method::Dpt, 4), ("onepass", Method::OnePass, 8), ("twopass", Method::TwoPass, 12)];
/// Which are compared. One-pass is much less noisy than two-pass and tells more about dpt.
const PAIRS: [(usize, usize); 3] = [(0, 2), (1, 2), (0, 1)];

/// Renders every scene by every method and compares.
fn agree<W: RealWorld>(scenes: u32, least_tests: usize, make: impl Fn(u32) -> TestScene<W>) {
    let mut verdicts = PAIRS.map(|_| Verdict::default());
    for seed in 0..scenes {
        let scene = make(seed);
        let bounces = 1 + seed % 4;
        // Other random numbers for each method: equal errors must not cancel.
        let estimates = METHODS.map(|(_, method, samples)| {
            let params = TraceParams { method, samples, bounces, ..TraceParams::default() };
            block_estimates(&scene, &params, 1000 * (method as u32 + 1))
        });
        for (verdict, (a, b)) in verdicts.iter_mut().zip(PAIRS) {
            verdict.compare(&format!("scene {seed}, {bounces} bounces"), &estimates[a], &estimates[b]);
        }
    }
    for (verdict, (a, b)) in verdicts.iter().zip(PAIRS) {
        assert!(verdict.tests >= least_tests, "{} blocks tell too little", verdict.tests);
        verdict.check(&format!("{} against {}", METHODS[a].0, METHODS[b].0));
    }
}

#[test]
fn dpt_and_onepass_equal_twopass_block_by_block_on_random_proxies() {
    agree(10, 150, random_proxies);
}

#[test]
fn dpt_and_onepass_equal_twopass_block_by_block_in_captured_rooms() {
    agree(4, 40, random_room);
}
