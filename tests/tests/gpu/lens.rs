//! Bloom and glare, and frames of rt2ar with them.

use crate::{Test, support::*};
use glam::Vec3;
use pano_compose::lens::{self, Params, gpu::apply_picture};
use pano_compose::pipeline::{Backend, RenderOptions, render};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::progress::Silent;
use pano_core::scene::Method;
use pano_tests::nasty;
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("lens::equals_the_cpu", equals_the_cpu),
    ("lens::what_is_no_number_is_no_light", what_is_no_number_is_no_light),
    ("lens::what_lies_beyond_the_reach_keeps_its_bits", what_lies_beyond_the_reach_keeps_its_bits),
    ("lens::huge_values_stay_finite", huge_values_stay_finite),
    ("lens::bands_make_no_difference", bands_make_no_difference),
    ("lens::sizes_that_differ_are_named", sizes_that_differ_are_named),
    ("lens::frames_of_rt2ar_equal_the_cpu", frames_of_rt2ar_equal_the_cpu),
];

/// Sums of f32 on both sides, of weights that add up to 1, of light up to 50: each term rounds once, and multiply-adds may round
/// once less.
const ABSOLUTE: f32 = 5e-5;
const RELATIVE: f32 = 1e-5;

/// A dim photo with a bright pixel here and there, and a picture with more of them.
fn scene((w, h): (usize, usize), seed: u32) -> (RadianceImage, RadianceImage) {
    let mut random = Random::new(seed);
    let mut shine = |dim: Vec3| if random.below(15) == 0 { random.color(0.0, 50.0) } else { dim };
    let photo = Image::from_fn(w, h, |x, y| shine(Vec3::splat(0.1 + 0.01 * ((x * 3 + y) % 7) as f32)));
    let picture = photo.map(shine);
    (photo, picture)
}

fn compare(gpu: &Gpu, params: &Params, photo: &RadianceImage, picture: &RadianceImage) -> Result<(), TestCaseError> {
    let (mut got, mut want) = (picture.clone(), picture.clone());
    let on_gpu = apply_picture(gpu, params, photo, &mut got).unwrap();
    let on_cpu = lens::apply(params, photo, &mut want).unwrap();
    assert_close("picture", &got, &want, ABSOLUTE, RELATIVE)?;
    prop_assert!((on_gpu.spread - on_cpu.spread).abs() <= 1e-5 * (1.0 + on_cpu.spread), "{on_gpu:?} {on_cpu:?}");
    if on_cpu.before.is_finite() {
        prop_assert_eq!(on_gpu.before, on_cpu.before);
        let pixels = picture.data().len() as f64;
        prop_assert!((on_gpu.change - on_cpu.change).abs() <= f64::from(ABSOLUTE) * pixels, "{on_gpu:?} {on_cpu:?}");
    }
    Ok(())
}

/// Parameters of all kinds, at least one effect on.
fn params() -> impl Strategy<Value = Params> {
    let shares = prop_oneof![Just((0.3f32, 0.0f32)), Just((0.0, 0.4)), Just((0.5, 0.5))];
    // From half a pixel to a quarter of the picture.
    let shape = (0.001f32..0.25, 0.5f32..0.99, 1u32..=4);
    (shares, shape, 0.0f32..3.0, any::<bool>(), any::<bool>()).prop_map(
        |((bloom, glare), (radius, attenuation, passes), threshold, everything, wrap)| Params {
            bloom,
            glare,
            threshold,
            radius,
            attenuation,
            passes,
            everything,
            wrap,
        },
    )
}

fn equals_the_cpu(gpu: &Gpu) {
    // Above sixteen times four rows blooms come from reduced maps.
    let sizes = prop_oneof![sizes(), (40usize..90, 60usize..120)];
    property(64, (sizes, any::<u32>(), params()), |(size, seed, params)| {
        let (photo, picture) = scene(size, seed);
        compare(gpu, &params, &photo, &picture)
    });
}

fn what_is_no_number_is_no_light(gpu: &Gpu) {
    property(32, (sizes(), any::<u32>(), params()), |(size, seed, params)| {
        compare(gpu, &params, &wild(size, 2.0, seed), &wild(size, 5.0, seed ^ 1))
    });
}

fn what_lies_beyond_the_reach_keeps_its_bits(gpu: &Gpu) {
    let photo = wild((128, 128), 0.9, 7);
    let mut picture = photo.clone();
    picture.set(64, 64, Vec3::splat(60.0));
    let before = picture.clone();
    let params = Params { bloom: 0.2, glare: 0.2, passes: 2, ..Params::default() };
    apply_picture(gpu, &params, &photo, &mut picture).unwrap();
    let far = |x: usize, y: usize| x.abs_diff(64).max(y.abs_diff(64)) > 40;
    let far_only = |image: &RadianceImage| Image::from_fn(128, 128, |x, y| if far(x, y) { image.get(x, y) } else { Vec3::ZERO });
    assert!(same_bits(&far_only(&picture), &far_only(&before)));
    assert!(picture.get(66, 66).x > before.get(66, 66).x && picture.get(64, 64).x < 60.0);
}

fn huge_values_stay_finite(gpu: &Gpu) {
    for scale in [1e20, 1e36, f32::MAX / 50.0] {
        let (photo, picture) = scene((90, 70), 9);
        let params = Params { bloom: 0.5, glare: 0.5, radius: 0.2, passes: 4, ..Params::default() };
        for wrap in [false, true] {
            let mut got = picture.map(|v| v * scale);
            apply_picture(gpu, &Params { wrap, ..params }, &photo, &mut got).unwrap();
            assert!(got.data().iter().all(|v: &Vec3| v.is_finite() && v.min_element() >= 0.0), "{scale}");
            let mut want = picture.map(|v| v * scale);
            lens::apply(&Params { wrap, ..params }, &photo, &mut want).unwrap();
            assert_close("picture", &got, &want, ABSOLUTE * scale, RELATIVE).unwrap();
        }
    }
}

fn bands_make_no_difference(gpu: &Gpu) {
    // Forty rows a binding: of the picture's 150, and of its glare with fifteen on both sides.
    let small = Gpu::new(&GpuOptions { max_binding: Some(60 * 12 * 40), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        // A standard deviation of 15 pixels: a map of a third of the size.
        let params = Params { bloom: 0.3, glare: 0.3, passes: 2, radius: 0.1, threshold: 0.5, wrap, ..Params::default() };
        let (photo, picture) = scene((60, 150), 5);
        let (mut banded, mut whole) = (picture.clone(), picture.clone());
        let a = apply_picture(&small, &params, &photo, &mut banded).unwrap();
        let b = apply_picture(gpu, &params, &photo, &mut whole).unwrap();
        assert!(same_bits(&banded, &whole) && !same_bits(&whole, &picture), "wrap {wrap}");
        // Workgroups hold other pixels, and each adds up its own in f32.
        assert!((a.spread - b.spread).abs() <= 1e-5 * b.spread && b.spread > 1.0, "{a:?} {b:?}");
    }
    // Fifteen bands of ten rows, each with nine kernels of the glare.
    assert!(small.submissions() > 2 * 15 * 9, "{} submissions", small.submissions());
    // Not even one row with its halo.
    let (photo, mut picture) = scene((60, 150), 5);
    let before = picture.clone();
    let error = apply_picture(&small, &Params { glare: 0.3, passes: 4, ..Params::default() }, &photo, &mut picture).unwrap_err();
    assert!(matches!(error, GpuError::TooLarge { .. }) && same_bits(&picture, &before), "{error}");
}

fn sizes_that_differ_are_named(gpu: &Gpu) {
    let (photo, mut picture) = (Image::filled(4, 2, Vec3::ZERO), Image::filled(2, 4, Vec3::ZERO));
    let error = apply_picture(gpu, &Params { bloom: 0.1, ..Params::default() }, &photo, &mut picture).unwrap_err();
    assert!(matches!(&error, GpuError::Input(e) if e.to_string().contains("(4, 2)")), "{error}");
}

/// Whole frames: the mean filter after rt2ar's rays, and the lens at the end.
fn frames_of_rt2ar_equal_the_cpu(_: &Gpu) {
    let folder = tempfile::tempdir().unwrap();
    let mut room = nasty::scenes().remove(0);
    // A lamp as wide as 20 degrees, and a view large enough for its penumbrae.
    room.picture =
        Image::from_fn(32, 16, |x, y| Vec3::splat(if (5..7).contains(&x) && (3..5).contains(&y) { 40.0 } else { 0.4 }));
    room.text = room.text.replace("size = [14, 10]", "size = [84, 60]");
    let scene = room.write(folder.path(), Method::Rt2ar).unwrap();
    let frame = |backend, until: Option<&str>| {
        let mut options = RenderOptions { backend, ..RenderOptions::default() };
        for (key, value) in [("bloom", "0.3"), ("glare", "0.3"), ("lens_threshold", "0.2"), ("lens_light", "all")] {
            options.settings.set(key, value).unwrap();
        }
        if let Some(until) = until {
            options.settings.set("gpu_until", until).unwrap();
        }
        render(&scene, &options, &Silent).unwrap()
    };
    let (want, got) = (frame(Backend::Cpu, None), frame(Backend::Gpu, None));
    let stage = |name| got.stats.stages.iter().find(|s| s.name == name).map(|s| (s.backend, s.pixels));
    assert!(stage("mean").is_some_and(|(backend, pixels)| backend == "gpu" && pixels > 0), "{:?}", got.stats.stages);
    assert_eq!(stage("lens").map(|s| s.0), Some("gpu"));
    assert_close("frame", &got.composite.color, &want.composite.color, 1e-3, 1e-3).unwrap();
    let part = frame(Backend::Gpu, Some("composite"));
    assert_eq!(part.stats.stages.last().map(|s| (s.name, s.backend)), Some(("lens", "cpu")));
}
