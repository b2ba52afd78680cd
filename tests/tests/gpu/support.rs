//! What the tests of several stages need.

use glam::Vec3;
use pano_core::image::Image;
use pano_core::layers::TracedLayers;
use pano_tests::random::Random;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

/// Runs a property on `cases` random inputs, always the same ones.
pub(crate) fn property<S: Strategy>(cases: u32, strategy: S, test: impl Fn(S::Value) -> Result<(), TestCaseError>) {
    let mut runner = TestRunner::new_with_rng(
        Config { cases, failure_persistence: None, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    if let Err(failure) = runner.run(&strategy, test) {
        panic!("{failure}");
    }
}

/// Odd sizes: from one pixel, over workgroups that are not full, to several of them.
pub(crate) fn sizes() -> impl Strategy<Value = (usize, usize)> {
    prop_oneof![Just((1, 1)), Just((2, 1)), Just((1, 5)), (1usize..40, 1usize..30)]
}

/// Colours between 0 and `most`, and every tenth channel something that is no colour: NaN, infinite, negative, denormal.
pub(crate) fn wild((width, height): (usize, usize), most: f32, seed: u32) -> Image<Vec3> {
    let mut random = Random::new(seed);
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 1e-40];
    let mut channel = move || match random.below(10) {
        0 => odd[random.below(odd.len() as u32) as usize],
        _ => random.between(0.0, most),
    };
    Image::from_fn(width, height, |_, _| Vec3::new(channel(), channel(), channel()))
}

/// Fails with place and values unless all channels agree within `absolute + relative·|want|`; NaN agrees with NaN.
pub(crate) fn assert_close(
    what: &str,
    got: &Image<Vec3>,
    want: &Image<Vec3>,
    absolute: f32,
    relative: f32,
) -> Result<(), TestCaseError> {
    prop_assert_eq!(got.size(), want.size());
    for (i, (g, w)) in got.data().iter().zip(want.data()).enumerate() {
        for c in 0..3 {
            let same =
                g[c] == w[c] || (g[c].is_nan() && w[c].is_nan()) || (g[c] - w[c]).abs() <= absolute + relative * w[c].abs();
            let (x, y) = (i % got.width(), i / got.width());
            prop_assert!(same, "{what}, pixel ({x}, {y}) channel {c}: GPU {}, CPU {}", g[c], w[c]);
        }
    }
    Ok(())
}

/// Layers as tracers make them: an object over a slanted floor before a wall, with noise, shadows, sky and lone bright pixels.
pub(crate) fn layers((width, height): (usize, usize), seed: u32) -> TracedLayers {
    let mut random = Random::new(seed);
    let mut layers = TracedLayers::empty(width, height);
    let (cx, cy, radius) = (random.between(0.0, width as f32), random.between(0.0, height as f32), random.between(1.0, 12.0));
    for y in 0..height {
        for x in 0..width {
            let (dx, dy) = (x as f32 - cx, y as f32 - cy);
            let coverage = (radius - dx.hypot(dy)).clamp(0.0, 1.0);
            let sky = y * 5 < height;
            let floor = y * 2 > height;
            layers.coverage.set(x, y, coverage);
            let noise = |random: &mut Random| random.color(0.0, 1.0) * if random.below(40) == 0 { 30.0 } else { 1.0 };
            layers.object.set(x, y, noise(&mut random) * coverage);
            if floor && random.below(3) > 0 {
                layers.delta.set(x, y, (random.color(-0.5, 0.2)) * (1.0 - coverage));
            }
            let (depth, normal) = match (coverage > 0.0, sky, floor) {
                (true, ..) => (2.0 - 0.05 * coverage, Vec3::new(dx, -dy, 8.0).normalize()),
                (_, true, _) => (f32::INFINITY, Vec3::ZERO),
                (_, _, true) => (40.0 / (y as f32 - 0.4 * height as f32), Vec3::Y),
                _ => (6.0 + 0.02 * x as f32, Vec3::Z),
            };
            layers.depth.set(x, y, depth);
            layers.normal.set(x, y, normal);
            layers.albedo.set(x, y, if sky { Vec3::ZERO } else { Vec3::splat(if (x / 4) % 2 == 0 { 0.5 } else { 0.7 }) });
        }
    }
    layers
}

/// Whether two pictures have the same bits.
pub(crate) fn same_bits(a: &Image<Vec3>, b: &Image<Vec3>) -> bool {
    let bits = |i: &Image<Vec3>| i.data().iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    a.size() == b.size() && bits(a) == bits(b)
}

/// As [`assert_close`], of pictures of one channel.
pub(crate) fn assert_close_values(
    what: &str,
    got: &Image<f32>,
    want: &Image<f32>,
    absolute: f32,
    relative: f32,
) -> Result<(), TestCaseError> {
    assert_close(what, &got.map(Vec3::splat), &want.map(Vec3::splat), absolute, relative)
}
