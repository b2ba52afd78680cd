//! Compositing.

use crate::{Test, support::*};
use glam::Vec3;
use pano_compose::composite::{Composite, composite, gpu::composite_pictures};
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::Image;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("composite::equals_the_cpu", equals_the_cpu),
    ("composite::untouched_pixels_keep_their_bits", untouched_pixels_keep_their_bits),
    ("composite::extremes_stay_finite", extremes_stay_finite),
    ("composite::bands_make_no_difference", bands_make_no_difference),
];

/// The sum of three terms of up to 30, each rounded in f32, of which little may be left; ratios to a floor of a thousandth of
/// the mean are up to a thousand.
const ABSOLUTE: f32 = 3e-5;
const RELATIVE: f32 = 1e-5;

/// A photo as loading leaves it.
fn finite(size: (usize, usize), seed: u32) -> Image<Vec3> {
    wild(size, 1.0, seed).map(|p| if p.is_finite() { p.max(Vec3::ZERO) } else { Vec3::ZERO })
}

fn equals_the_cpu(gpu: &Gpu) {
    property(48, (sizes(), any::<u32>()), |(size, seed)| {
        let layers = layers(size, seed);
        let photo = finite(size, seed);
        let (mut got, mut want) = (Composite::new(size.0, size.1), Composite::new(size.0, size.1));
        let on_gpu = composite_pictures(gpu, &photo, &layers, &mut got).unwrap();
        let on_cpu = composite(&photo, &layers, &mut want).unwrap();
        assert_close("color", &got.color, &want.color, ABSOLUTE, RELATIVE)?;
        assert_close("multiplier", &got.multiplier, &want.multiplier, ABSOLUTE, RELATIVE)?;
        // A sum of about 0 may fall on either side of it.
        prop_assert!(on_gpu.pixels.abs_diff(on_cpu.pixels) <= 1 + on_cpu.pixels / 100, "{on_gpu:?} {on_cpu:?}");
        prop_assert!((on_gpu.energy - on_cpu.energy).abs() <= 1e-4 * (1.0 + on_cpu.energy), "{on_gpu:?} {on_cpu:?}");
        Ok(())
    });
}

fn untouched_pixels_keep_their_bits(gpu: &Gpu) {
    let photo = wild((37, 19), 1e4, 3);
    let mut layers = layers((37, 19), 3);
    layers.delta = layers.delta.map(|_| Vec3::ZERO);
    let mut out = Composite::new(37, 19);
    composite_pictures(gpu, &photo, &layers, &mut out).unwrap();
    let mut untouched = 0;
    for (i, &coverage) in layers.coverage.data().iter().enumerate() {
        if coverage == 0.0 {
            let bits = |v: Vec3| v.to_array().map(f32::to_bits);
            assert_eq!(bits(out.color.data()[i]), bits(photo.data()[i]));
            assert_eq!(out.multiplier.data()[i], Vec3::ONE);
            untouched += 1;
        }
    }
    assert!(untouched > 100, "{untouched}");
}

fn extremes_stay_finite(gpu: &Gpu) {
    let values = [0.0, 1e-40, 1.0, f32::MAX];
    let n = values.len();
    let mut layers = layers((n * n * n, 3), 1);
    let pick = |i: usize| values[i % n];
    let photo = Image::from_fn(n * n * n, 3, |x, _| Vec3::splat(pick(x)));
    layers.delta = Image::from_fn(n * n * n, 3, |x, y| Vec3::splat(if y == 0 { -pick(x / n) } else { pick(x / n) }));
    layers.object = Image::from_fn(n * n * n, 3, |x, _| Vec3::splat(pick(x / n / n)));
    layers.coverage = Image::from_fn(n * n * n, 3, |_, y| [0.0, 1.0, 1.0 - 6e-8][y]);
    let mut out = Composite::new(n * n * n, 3);
    composite_pictures(gpu, &photo, &layers, &mut out).unwrap();
    for image in [&out.color, &out.multiplier] {
        assert!(image.data().iter().all(|v| v.is_finite() && v.min_element() >= 0.0), "{image:?}");
    }
}

fn bands_make_no_difference(gpu: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(37 * 16 * 8), ..GpuOptions::default() }).unwrap();
    let (photo, layers) = (finite((37, 43), 8), layers((37, 43), 8));
    let (mut banded, mut whole) = (Composite::new(37, 43), Composite::new(37, 43));
    let a = composite_pictures(&small, &photo, &layers, &mut banded).unwrap();
    let b = composite_pictures(gpu, &photo, &layers, &mut whole).unwrap();
    assert_close("color", &banded.color, &whole.color, 0.0, 0.0).unwrap();
    assert_eq!(a.pixels, b.pixels);
    // Workgroups hold other pixels, and each adds up its own in f32.
    assert!((a.energy - b.energy).abs() <= 1e-5 * b.energy && small.submissions() > 12, "{a:?} {b:?}");
}
