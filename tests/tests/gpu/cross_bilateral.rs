//! The cross-bilateral filter.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::layers::TracedLayers;
use pano_denoise::cross_bilateral::{self, Params, gpu::filter_layers};
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("cross_bilateral::equals_the_cpu", equals_the_cpu),
    ("cross_bilateral::terms_that_are_off_are_off", terms_that_are_off_are_off),
    ("cross_bilateral::what_is_no_number_is_left_alone", what_is_no_number_is_left_alone),
    ("cross_bilateral::huge_values_stay_finite", huge_values_stay_finite),
    ("cross_bilateral::bands_make_no_difference", bands_make_no_difference),
];

/// Weights are exponentials of sums of squares whose f32 error is about 1e-6 of exponents up to some tens; averages of values up
/// to 30 over up to 25 taps, three times over.
const ABSOLUTE: f32 = 2e-3;
const RELATIVE: f32 = 2e-4;
/// Where no tap of the pixel's own surface lies on a straight line of three, noise is measured on other surfaces, whose weights
/// are e^−500 or so: there an error of 1e-6 of the exponent is one of 1e-3 of the noise, which passes amplify. Holes everywhere
/// make many such pixels.
const ABSOLUTE_WITH_HOLES: f32 = 5e-2;

fn compare(gpu: &Gpu, params: &Params, layers: &TracedLayers, absolute: f32) -> Result<(), TestCaseError> {
    let (mut got, mut want) = (layers.clone(), layers.clone());
    let on_gpu = filter_layers(gpu, params, &mut got).unwrap();
    let on_cpu = cross_bilateral::filter(params, &mut want).unwrap();
    assert_close("object", &got.object, &want.object, absolute, RELATIVE)?;
    assert_close("delta", &got.delta, &want.delta, absolute, RELATIVE)?;
    prop_assert_eq!(on_gpu.object.before, on_cpu.object.before);
    prop_assert!((on_gpu.object.after - on_cpu.object.after).abs() <= f64::from(absolute) * (1.0 + on_cpu.object.magnitude));
    Ok(())
}

fn equals_the_cpu(gpu: &Gpu) {
    property(48, (sizes(), any::<u32>(), any::<bool>(), 1u32..4), |(size, seed, wrap, delta_passes)| {
        compare(gpu, &Params { wrap, delta_passes, ..Params::default() }, &layers(size, seed), ABSOLUTE)
    });
}

fn terms_that_are_off_are_off(gpu: &Gpu) {
    let off = f32::INFINITY;
    let only = Params { sigma_depth: off, sigma_normal: off, sigma_albedo: off, sigma_radiance: off, ..Params::default() };
    for params in [
        only,
        Params { sigma_space: off, ..only },
        Params { sigma_depth: 0.01, ..only },
        Params { sigma_normal: 0.1, ..only },
        Params { sigma_albedo: 0.05, ..only },
        Params { sigma_radiance: 2.0, ..only },
    ] {
        compare(gpu, &params, &layers((33, 21), 4), ABSOLUTE).unwrap_or_else(|e| panic!("{params:?}: {e}"));
    }
}

fn what_is_no_number_is_left_alone(gpu: &Gpu) {
    property(24, (sizes(), any::<u32>(), any::<bool>()), |(size, seed, wrap)| {
        let mut odd = layers(size, seed);
        odd.object = wild(size, 1.0, seed);
        odd.delta = wild(size, 1.0, seed ^ 1).map(|v| v - Vec3::splat(0.4));
        let normals = wild(size, 1.0, seed ^ 2);
        for (i, n) in normals.data().iter().enumerate() {
            if n.is_nan() {
                odd.normal.data_mut()[i] = Vec3::NAN;
                odd.depth.data_mut()[i] = [f32::NAN, -1.0, 0.0, 1e-20, 1e9, 1e30][i % 6];
                odd.coverage.data_mut()[i] = [f32::NAN, 0.0, 1.0][i % 3];
            }
        }
        compare(gpu, &Params { wrap, ..Params::default() }, &odd, ABSOLUTE_WITH_HOLES)
    });
}

fn huge_values_stay_finite(gpu: &Gpu) {
    let mut huge = layers((21, 17), 9);
    huge.object = huge.object.map(|v| v * 1e37);
    huge.delta = huge.delta.map(|v| v * -f32::MAX);
    filter_layers(gpu, &Params::default(), &mut huge).unwrap();
    assert!(huge.object.data().iter().chain(huge.delta.data()).all(|v| v.is_finite()));
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(33 * 16 * 40), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        let params = Params { wrap, ..Params::default() };
        let layers = layers((33, 70), 5);
        let (mut banded, mut whole) = (layers.clone(), layers);
        filter_layers(&small, &params, &mut banded).unwrap();
        filter_layers(gpu, &params, &mut whole).unwrap();
        assert!(same_bits(&banded.object, &whole.object) && same_bits(&banded.delta, &whole.delta), "wrap {wrap}");
    }
    assert!(small.submissions() > 2 * 3 * 10, "{} submissions", small.submissions());
}
