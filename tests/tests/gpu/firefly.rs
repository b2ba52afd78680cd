//! The clamp of fireflies.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::Image;
use pano_denoise::firefly::{self, Params, gpu::clamp_picture};
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("firefly::equals_the_cpu", equals_the_cpu),
    ("firefly::huge_values_stay_finite", huge_values_stay_finite),
    ("firefly::bands_make_no_difference", bands_make_no_difference),
];

fn equals_the_cpu(gpu: &Gpu) {
    property(48, (sizes(), any::<u32>(), any::<bool>(), any::<bool>()), |(size, seed, wrap, odd)| {
        let layers = layers(size, seed);
        let params = Params { wrap, ..Params::default() };
        let source = if odd { wild(size, 5.0, seed) } else { layers.object };
        let share = if odd { layers.coverage.map(|c| if c > 0.5 { f32::NAN } else { 1.0 - c }) } else { layers.coverage };
        let (mut got, mut want) = (source.clone(), source);
        let on_gpu = clamp_picture(gpu, &params, &share, &mut got).unwrap();
        let on_cpu = firefly::clamp(&params, &share, &mut want).unwrap();
        // A ratio of two luminances in f32; what is not normal may count as 0.
        assert_close("signal", &got, &want, 1e-37, 2e-6)?;
        // Luminances that are almost at the limit may fall on either side.
        prop_assert!(on_gpu.pixels.abs_diff(on_cpu.pixels) <= 1, "{on_gpu:?} {on_cpu:?}");
        prop_assert!((on_gpu.energy - on_cpu.energy).abs() <= 1e-5 * (on_cpu.before + 1e-6), "{on_gpu:?} {on_cpu:?}");
        prop_assert!((on_gpu.before - on_cpu.before).abs() <= 1e-5 * (on_cpu.before + 1e-6), "{on_gpu:?} {on_cpu:?}");
        Ok(())
    });
}

fn huge_values_stay_finite(gpu: &Gpu) {
    let mut layers = layers((21, 17), 9);
    layers.object = layers.object.map(|v| v * -1e37);
    clamp_picture(gpu, &Params::default(), &layers.coverage.map(|c| c * 1e-30), &mut layers.object).unwrap();
    assert!(layers.object.data().iter().all(|v: &Vec3| v.is_finite()));
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(19 * 12 * 9), ..GpuOptions::default() }).unwrap();
    for wrap in [false, true] {
        let (share, params) = (Image::filled(19, 50, 1.0), Params { wrap, ..Params::default() });
        let source = wild((19, 50), 1.0, 5).map(|v| if v.is_finite() { v * v * v * v } else { Vec3::splat(20.0) });
        let (mut banded, mut whole) = (source.clone(), source);
        clamp_picture(&small, &params, &share, &mut banded).unwrap();
        let clamped = clamp_picture(gpu, &params, &share, &mut whole).unwrap();
        assert!(same_bits(&banded, &whole) && clamped.pixels > 0, "wrap {wrap}: {clamped:?}");
    }
    assert!(small.submissions() > 2 * 3 * 7, "{} submissions", small.submissions());
}
