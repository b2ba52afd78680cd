//! The mean filter of penumbrae.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_denoise::mean::{self, Params, gpu::filter_layers};
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("mean::equals_the_cpu", equals_the_cpu),
    ("mean::terms_that_are_off_are_off", terms_that_are_off_are_off),
    ("mean::what_is_no_number_is_left_alone", what_is_no_number_is_left_alone),
    ("mean::huge_values_stay_finite", huge_values_stay_finite),
    ("mean::bands_make_no_difference", bands_make_no_difference),
    ("mean::sizes_that_differ_are_named", sizes_that_differ_are_named),
];

/// Averages of values up to 30, and of ratios up to a hundred, whose weights are exponentials of exponents that matter up to ten
/// or so: a residual of inverse depths, good to 1e-7, over a sigma of 0.02 makes an error of 2e-5 of such a weight.
const ABSOLUTE: f32 = 3e-4;
const RELATIVE: f32 = 3e-5;

/// A photo that is nowhere nearly black, but for some channels that are black, and a penumbra over two thirds of it.
fn scene(size: (usize, usize), seed: u32) -> (TracedLayers, RadianceImage, Image<bool>) {
    let mut random = Random::new(seed ^ 0x3ea);
    let photo = Image::from_fn(size.0, size.1, |_, _| {
        let black = random.below(12) as usize;
        let color = random.color(0.01, 1.0);
        Vec3::from_array(std::array::from_fn(|c| if c == black { 0.0 } else { color[c] }))
    });
    let penumbra = Image::from_fn(size.0, size.1, |_, _| random.below(3) > 0);
    (layers(size, seed), photo, penumbra)
}

fn compare(
    gpu: &Gpu,
    params: &Params,
    (layers, photo, penumbra): &(TracedLayers, RadianceImage, Image<bool>),
) -> Result<TracedLayers, TestCaseError> {
    let (mut got, mut want) = (layers.clone(), layers.clone());
    let on_gpu = filter_layers(gpu, params, penumbra, photo, &mut got).unwrap();
    let on_cpu = mean::filter(params, penumbra, photo, &mut want).unwrap();
    assert_close("object", &got.object, &want.object, ABSOLUTE, RELATIVE)?;
    assert_close("delta", &got.delta, &want.delta, ABSOLUTE, RELATIVE)?;
    for (a, b) in [(on_gpu.object, on_cpu.object), (on_gpu.delta, on_cpu.delta)] {
        prop_assert_eq!((a.before, a.magnitude), (b.before, b.magnitude));
        prop_assert!((a.after - b.after).abs() <= f64::from(ABSOLUTE) * (1.0 + b.magnitude), "{:?} {:?}", a, b);
    }
    // Pixels outside of penumbrae keep their bits, whatever they hold.
    for (i, _) in penumbra.data().iter().enumerate().filter(|(_, p)| !**p) {
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        prop_assert_eq!(bits(got.delta.data()[i]), bits(layers.delta.data()[i]));
        prop_assert_eq!(bits(got.object.data()[i]), bits(layers.object.data()[i]));
    }
    Ok(got)
}

fn equals_the_cpu(gpu: &Gpu) {
    property(48, (sizes(), any::<u32>(), any::<bool>(), 0usize..4), |(size, seed, wrap, radius)| {
        compare(gpu, &Params { wrap, radius, ..Params::default() }, &scene(size, seed)).map(|_| ())
    });
}

fn terms_that_are_off_are_off(gpu: &Gpu) {
    let off = f32::INFINITY;
    let only = Params { sigma_depth: off, sigma_normal: off, sigma_albedo: off, radius: 2, ..Params::default() };
    let scene = scene((33, 21), 4);
    let made =
        [only, Params { sigma_depth: 0.01, ..only }, Params { sigma_normal: 0.1, ..only }, Params { sigma_albedo: 0.05, ..only }]
            .map(|params| compare(gpu, &params, &scene).unwrap_or_else(|e| panic!("{params:?}: {e}")));
    for (i, picture) in made.iter().enumerate() {
        assert!(made[..i].iter().all(|other| !same_bits(&other.delta, &picture.delta)), "term {i} does nothing");
    }
}

fn what_is_no_number_is_left_alone(gpu: &Gpu) {
    property(32, (sizes(), any::<u32>(), any::<bool>()), |(size, seed, wrap)| {
        let (mut odd, mut photo, penumbra) = scene(size, seed);
        odd.object = wild(size, 1.0, seed);
        odd.delta = wild(size, 1.0, seed ^ 1).map(|v| v - Vec3::splat(0.4));
        let holes = wild(size, 1.0, seed ^ 2);
        for (i, hole) in holes.data().iter().enumerate() {
            if hole.is_nan() {
                odd.normal.data_mut()[i] = Vec3::NAN;
                odd.albedo.data_mut()[i] = [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO][i % 3];
                odd.depth.data_mut()[i] = [f32::NAN, -1.0, 0.0, 1e-20, 1e9, 1e30][i % 6];
                odd.coverage.data_mut()[i] = [f32::NAN, 0.0, 1.0][i % 3];
            }
            let channel = i % 3;
            // What is no ratio to divide by; what is one stays as it was.
            if !hole[channel].is_finite() || hole[channel] < 1e-38 {
                photo.data_mut()[i][channel] = hole[channel];
            }
        }
        compare(gpu, &Params { wrap, ..Params::default() }, &(odd, photo, penumbra)).map(|_| ())
    });
}

fn huge_values_stay_finite(gpu: &Gpu) {
    for (scale, photo_scale) in [(1e37, 1.0), (1e37, 1e-37), (1.0, 1e-37), (-f32::MAX / 50.0, f32::MAX), (1e-38, 1e38)] {
        let (mut layers, photo, penumbra) = scene((21, 17), 9);
        layers.object = layers.object.map(|v| v * scale);
        layers.delta = layers.delta.map(|v| v * scale);
        filter_layers(gpu, &Params::default(), &penumbra, &photo.map(|v| v * photo_scale), &mut layers).unwrap();
        assert!(layers.object.data().iter().chain(layers.delta.data()).all(|v| v.is_finite()), "{scale} over {photo_scale}");
    }
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(33 * 16 * 12), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        let params = Params { wrap, radius: 3, ..Params::default() };
        let (layers, photo, _) = scene((33, 70), 5);
        let penumbra = Image::filled(33, 70, true);
        let (mut banded, mut whole) = (layers.clone(), layers.clone());
        filter_layers(&small, &params, &penumbra, &photo, &mut banded).unwrap();
        filter_layers(gpu, &params, &penumbra, &photo, &mut whole).unwrap();
        assert!(same_bits(&banded.object, &whole.object) && same_bits(&banded.delta, &whole.delta), "wrap {wrap}");
        assert!(!same_bits(&whole.delta, &layers.delta));
    }
    // Bands of four rows: slopes and two layers, and two pictures that are read, for each of them.
    assert!(small.submissions() > 2 * 17 * 5, "{} submissions", small.submissions());
}

fn sizes_that_differ_are_named(gpu: &Gpu) {
    let (mut layers, photo, _) = scene((4, 2), 1);
    let error = filter_layers(gpu, &Params::default(), &Image::filled(2, 4, true), &photo, &mut layers).unwrap_err();
    assert!(matches!(&error, GpuError::Input(e) if e.to_string().contains("penumbra")), "{error}");
}
