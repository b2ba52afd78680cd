//! The à-trous filter.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::Image;
use pano_core::layers::TracedLayers;
use pano_denoise::atrous::{self, Guides, Params, gpu::filter_pictures};
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("atrous::equals_the_cpu", equals_the_cpu),
    ("atrous::what_takes_no_part_keeps_its_bits", what_takes_no_part_keeps_its_bits),
    ("atrous::huge_values_stay_finite", huge_values_stay_finite),
    ("atrous::bands_make_no_difference", bands_make_no_difference),
];

/// Averages of values up to 30 by weights whose exponents are good to 1e-5; each level's variance steers the next one.
const ABSOLUTE: f32 = 2e-3;
const RELATIVE: f32 = 1e-3;

fn guides(layers: &TracedLayers) -> Guides<'_> {
    Guides { depth: &layers.depth, normal: &layers.normal }
}

fn variances((w, h): (usize, usize), seed: u32) -> Image<f32> {
    let mut random = Random::new(seed);
    Image::from_fn(w, h, |_, _| [0.0, 0.01, 0.3, 4.0, f32::NAN, -1.0][random.below(6) as usize])
}

fn equals_the_cpu(gpu: &Gpu) {
    property(40, (sizes(), any::<u32>(), any::<bool>(), 0u32..6), |(size, seed, wrap, levels)| {
        let (layers, params) = (layers(size, seed), Params { wrap, levels, ..Params::default() });
        let (mut got, mut want) = (layers.object.clone(), layers.object.clone());
        let (mut got_variance, mut want_variance) = (variances(size, seed), variances(size, seed));
        filter_pictures(gpu, &params, &guides(&layers), &layers.coverage, &mut got_variance, &mut got).unwrap();
        atrous::filter(&params, &guides(&layers), &layers.coverage, &mut want_variance, &mut want).unwrap();
        assert_close("signal", &got, &want, ABSOLUTE, RELATIVE)?;
        assert_close_values("variance", &got_variance, &want_variance, ABSOLUTE, 1e-2)
    });
}

fn what_takes_no_part_keeps_its_bits(gpu: &Gpu) {
    property(16, (sizes(), any::<u32>()), |(size, seed)| {
        let (layers, params) = (layers(size, seed), Params::default());
        let source = wild(size, 1.0, seed);
        let share = layers.coverage.map(|c| if c == 1.0 { f32::NAN } else { c });
        let (mut got, mut want) = (source.clone(), source.clone());
        let (mut got_variance, mut want_variance) = (variances(size, seed), variances(size, seed));
        filter_pictures(gpu, &params, &guides(&layers), &share, &mut got_variance, &mut got).unwrap();
        atrous::filter(&params, &guides(&layers), &share, &mut want_variance, &mut want).unwrap();
        for (i, (value, share)) in source.data().iter().zip(share.data()).enumerate() {
            if !(*share > 0.0 && value.is_finite()) {
                prop_assert_eq!(got.data()[i].to_array().map(f32::to_bits), value.to_array().map(f32::to_bits));
                prop_assert_eq!(got_variance.data()[i].to_bits(), want_variance.data()[i].to_bits());
            }
        }
        assert_close("signal", &got, &want, ABSOLUTE, RELATIVE)
    });
}

fn huge_values_stay_finite(gpu: &Gpu) {
    let layers = layers((21, 17), 9);
    let mut signal = layers.object.map(|v| v * 1e37);
    let share = layers.coverage.map(|c| c * 1e-30);
    let mut variance = Image::filled(21, 17, f32::MAX);
    filter_pictures(gpu, &Params::default(), &guides(&layers), &share, &mut variance.clone(), &mut signal).unwrap();
    assert!(signal.data().iter().all(|v| v.is_finite()));
    let mut signal = layers.object.map(|v| v * 1e37);
    filter_pictures(gpu, &Params::default(), &guides(&layers), &layers.coverage, &mut variance, &mut signal).unwrap();
    assert!(signal.data().iter().all(|v: &Vec3| v.is_finite()) && variance.data().iter().all(|v| v.is_finite()));
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(19 * 16 * 40), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        let (layers, params) = (layers((19, 90), 5), Params { wrap, levels: 3, ..Params::default() });
        let (mut banded, mut whole) = (layers.object.clone(), layers.object.clone());
        let (mut a, mut b) = (variances((19, 90), 2), variances((19, 90), 2));
        filter_pictures(&small, &params, &guides(&layers), &layers.coverage, &mut a, &mut banded).unwrap();
        filter_pictures(gpu, &params, &guides(&layers), &layers.coverage, &mut b, &mut whole).unwrap();
        assert!(same_bits(&banded, &whole) && same_bits(&a.map(Vec3::splat), &b.map(Vec3::splat)), "wrap {wrap}");
    }
    assert!(small.submissions() > 40, "{} submissions", small.submissions());
}
