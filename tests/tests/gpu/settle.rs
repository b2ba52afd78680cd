//! Single pixels that stick out, before and after the filter.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuError, GpuImage, GpuLayers, GpuOptions, GpuResult};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_denoise::cross_bilateral::{self, Params};
use pano_denoise::settle;
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("settle::before_equals_the_cpu", before_equals_the_cpu),
    ("settle::after_equals_the_cpu", after_equals_the_cpu),
    ("settle::pixels_give_in_the_same_order", pixels_give_in_the_same_order),
    ("settle::what_is_no_number_is_treated_alike", what_is_no_number_is_treated_alike),
    ("settle::with_the_filter_it_is_three_steps", with_the_filter_it_is_three_steps),
    ("settle::bands_make_no_difference", bands_make_no_difference),
    ("settle::huge_values_stay_finite", huge_values_stay_finite),
    ("settle::sizes_that_differ_are_named", sizes_that_differ_are_named),
];

/// What sticks out is a difference of values up to 30 (rounding: 2·10⁻⁶), of which a pixel gets up to 225 shares; fused products round
/// once where the CPU does twice.
const ABSOLUTE: f32 = 1e-5;
const RELATIVE: f32 = 1e-5;

/// Odd sizes, and whether columns wrap: those of panoramas, which have a few.
fn odd_sizes() -> impl Strategy<Value = ((usize, usize), bool)> {
    (sizes(), any::<bool>()).prop_map(|((w, h), wrap)| ((w.max(if wrap { 3 } else { 1 }), h), wrap))
}

/// Layers with lone bright and dark pixels over a photo that is black in places. No quotient of two depths is as near to what still
/// counts as one surface as rounding goes.
fn scene(size: (usize, usize), seed: u32) -> (TracedLayers, RadianceImage) {
    let mut random = Random::new(seed ^ 0x5e77);
    let mut layers = layers(size, seed);
    layers.depth = layers.depth.map(|depth| depth * random.between(0.9999, 1.0001));
    layers.delta = layers.delta.map(|delta| match random.below(25) {
        0 => delta - Vec3::splat(random.between(0.0, 2.0)),
        1 => delta + random.color(0.0, 30.0),
        _ => delta,
    });
    // Rims that are less than black.
    layers.object = layers.object.map(|object| object * if random.below(15) == 0 { -1.0 } else { 1.0 });
    let photo = Image::from_fn(size.0, size.1, |_, _| random.color(0.0, 1.0) * if random.below(9) == 0 { 0.0 } else { 1.0 });
    (layers, photo)
}

/// The same with much that is no number.
fn odd_scene(size: (usize, usize), seed: u32) -> (TracedLayers, RadianceImage) {
    let (mut odd, _) = scene(size, seed);
    odd.object = wild(size, 1.0, seed);
    odd.delta = wild(size, 1.0, seed ^ 1).map(|v| v - Vec3::splat(0.4));
    for (i, hole) in wild(size, 1.0, seed ^ 2).data().iter().enumerate().filter(|(_, hole)| hole.is_nan()) {
        odd.normal.data_mut()[i] = if hole.x.is_nan() { Vec3::NAN } else { Vec3::ZERO };
        odd.depth.data_mut()[i] = [f32::NAN, -1.0, 0.0, 1e-20, f32::INFINITY, 1e30][i % 6];
        odd.coverage.data_mut()[i] = [f32::NAN, 0.0, 1.0][i % 3];
    }
    (odd, wild(size, 1.0, seed ^ 3))
}

type Step = fn(&Gpu, bool, &GpuImage<Vec3>, &mut GpuLayers) -> GpuResult<()>;
/// A step on the GPU and on the CPU.
type Twins = (Step, fn(&mut TracedLayers, &RadianceImage, bool));

/// Object and delta after a step on the GPU.
fn stepped(gpu: &Gpu, step: Step, (layers, photo): &(TracedLayers, RadianceImage), wrap: bool) -> [Image<Vec3>; 2] {
    let mut held = GpuLayers::upload(gpu, layers, &(0..photo.height())).unwrap();
    step(gpu, wrap, &gpu.upload(photo).unwrap(), &mut held).unwrap();
    [gpu.read(&held.object).unwrap(), gpu.read(&held.delta).unwrap()]
}

fn compare(
    gpu: &Gpu,
    (step, twin): Twins,
    scene: &(TracedLayers, RadianceImage),
    absolute: f32,
    wrap: bool,
) -> Result<TracedLayers, TestCaseError> {
    let mut want = scene.0.clone();
    twin(&mut want, &scene.1, wrap);
    let [object, delta] = stepped(gpu, step, scene, wrap);
    assert_close("object", &object, &want.object, absolute, RELATIVE)?;
    assert_close("delta", &delta, &want.delta, absolute, RELATIVE)?;
    Ok(want)
}

const BEFORE: Twins = (settle::gpu::before, settle::before);
const AFTER: Twins = (settle::gpu::after, settle::after);

fn before_equals_the_cpu(gpu: &Gpu) {
    property(64, (odd_sizes(), any::<u32>()), |((size, wrap), seed)| {
        compare(gpu, BEFORE, &scene(size, seed), ABSOLUTE, wrap).map(|_| ())
    });
    let scene = scene((61, 47), 3);
    let settled = compare(gpu, BEFORE, &scene, ABSOLUTE, true).unwrap();
    let changed = |a: &Image<Vec3>, b: &Image<Vec3>| a.data().iter().zip(b.data()).filter(|(a, b)| a != b).count();
    let counts = (changed(&settled.object, &scene.0.object), changed(&settled.delta, &scene.0.delta));
    assert!(counts.0 > 2 && counts.1 > 500, "{counts:?} pixels of object and delta have changed");
}

fn after_equals_the_cpu(gpu: &Gpu) {
    property(64, (odd_sizes(), any::<u32>()), |((size, wrap), seed)| {
        let mut scene = scene(size, seed);
        settle::before(&mut scene.0, &scene.1, wrap);
        compare(gpu, AFTER, &scene, ABSOLUTE, wrap).map(|_| ())
    });
}

/// Of neighbours that all go beyond their bounds, a pixel takes from one after the other, and is never less than black in between.
fn pixels_give_in_the_same_order(gpu: &Gpu) {
    property(32, (odd_sizes(), any::<u32>()), |((size, wrap), seed)| {
        let mut random = Random::new(seed);
        let (mut layers, _) = scene(size, seed);
        layers.depth = layers.depth.map(|_| 2.0);
        layers.normal = layers.normal.map(|_| Vec3::Y);
        layers.coverage = layers.coverage.map(|_| [0.0, 0.0, 0.3, 1.0][random.below(4) as usize]);
        let mut lone = |most: f32| random.color(-most, most) * if random.below(3) == 0 { 20.0 } else { 0.1 };
        layers.delta = layers.delta.map(|_| lone(1.0));
        layers.object = layers.object.map(|_| lone(1.0).abs());
        let photo = Image::filled(size.0, size.1, Vec3::new(0.5, 1.0, 0.25));
        compare(gpu, BEFORE, &(layers.clone(), photo.clone()), ABSOLUTE, wrap)?;
        compare(gpu, AFTER, &(layers, photo), ABSOLUTE, wrap).map(|_| ())
    });
}

fn what_is_no_number_is_treated_alike(gpu: &Gpu) {
    property(48, (odd_sizes(), any::<u32>()), |((size, wrap), seed)| {
        compare(gpu, BEFORE, &odd_scene(size, seed), ABSOLUTE, wrap)?;
        compare(gpu, AFTER, &odd_scene(size, seed), ABSOLUTE, wrap).map(|_| ())
    });
}

/// The three steps in a row do what they do one by one. The filter between them is the GPU's own here: a change that it leaves at exactly 0
/// is left alone afterwards, and one of a rounding is not.
fn with_the_filter_it_is_three_steps(gpu: &Gpu) {
    property(24, (odd_sizes(), any::<u32>(), 1u32..4), |((size, wrap), seed, delta_passes)| {
        let params = Params { wrap, delta_passes, ..Params::default() };
        let (layers, photo) = scene(size, seed);
        let (mut got, mut want) = (layers.clone(), layers);
        let at_once = settle::gpu::filter_layers(gpu, &params, &photo, &mut got).unwrap();
        settle::before(&mut want, &photo, wrap);
        let of_filter = cross_bilateral::gpu::filter_layers(gpu, &params, &mut want).unwrap();
        settle::after(&mut want, &photo, wrap);
        assert_close("object", &got.object, &want.object, ABSOLUTE, RELATIVE)?;
        assert_close("delta", &got.delta, &want.delta, ABSOLUTE, RELATIVE)?;
        for (a, b) in [(at_once.object, of_filter.object), (at_once.delta, of_filter.delta)] {
            let same = |a: f64, b: f64| (a - b).abs() <= 1e-5 * (1.0 + b.abs());
            prop_assert!(same(a.before, b.before) && same(a.after, b.after) && same(a.magnitude, b.magnitude), "{a:?} {b:?}");
        }
        Ok(())
    });
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(33 * 16 * 70), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        let params = Params { wrap, ..Params::default() };
        let (layers, photo) = scene((33, 150), 5);
        let (mut banded, mut whole) = (layers.clone(), layers);
        settle::gpu::filter_layers(&small, &params, &photo, &mut banded).unwrap();
        settle::gpu::filter_layers(gpu, &params, &photo, &mut whole).unwrap();
        assert!(same_bits(&banded.object, &whole.object) && same_bits(&banded.delta, &whole.delta), "wrap {wrap}");
    }
    assert!(small.submissions() > 2 * 10 * 20, "{} submissions", small.submissions());
}

fn huge_values_stay_finite(gpu: &Gpu) {
    for (scale, photo_scale) in [(1e30, 1.0), (1.0, 1e30), (1e-20, 1e20)] {
        let (mut layers, photo) = scene((21, 17), 9);
        layers.object = layers.object.map(|v| v * scale);
        layers.delta = layers.delta.map(|v| v * scale);
        let scene = (layers, photo.map(|v| v * photo_scale));
        for twins in [BEFORE, AFTER] {
            let settled =
                compare(gpu, twins, &scene, ABSOLUTE * scale, false).unwrap_or_else(|e| panic!("{scale}, {photo_scale}: {e}"));
            assert!(settled.object.data().iter().chain(settled.delta.data()).all(|v| v.is_finite()));
        }
    }
}

fn sizes_that_differ_are_named(gpu: &Gpu) {
    let (mut layers, _) = scene((4, 2), 1);
    let photo = Image::filled(2, 4, Vec3::ONE);
    let named = |error: String| assert!(error.contains("photo"), "{error}");
    match settle::gpu::filter_layers(gpu, &Params::default(), &photo, &mut layers) {
        Err(GpuError::Input(error)) => named(error.to_string()),
        other => panic!("{other:?}"),
    }
    named(settle::filter(&Params::default(), &photo, &mut layers).unwrap_err().to_string());
}
