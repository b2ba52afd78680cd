//! Inverse tone mapping.

use crate::{Test, support::*};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::Image;
use pano_light::expand::{self, gpu::expand_picture};
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("expand::equals_the_cpu", equals_the_cpu),
    ("expand::bands_make_no_difference", bands_make_no_difference),
    ("expand::sizes_that_differ_are_named", sizes_that_differ_are_named),
];

fn equals_the_cpu(gpu: &Gpu) {
    property(64, (sizes(), any::<u32>()), |(size, seed)| {
        let ldr = wild(size, 1.3, seed);
        let (mut got, mut want) = (ldr.clone(), ldr.clone());
        expand_picture(gpu, &ldr, &mut got).unwrap();
        expand::expand(&ldr, &mut want).unwrap();
        // The tenth power by four products, of which each may round once, and multiply-adds that may round once less: 10 ulp.
        // What is not normal may count as 0.
        assert_close("expand", &got, &want, 1.2e-38, 10.0 * f32::EPSILON)
    });
}

fn bands_make_no_difference(_: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(1024), ..GpuOptions::default() }).unwrap();
    let ldr = Image::from_fn(17, 41, |x, y| Vec3::new(x as f32, y as f32, 7.0) / 41.0);
    let (mut got, mut want) = (ldr.clone(), ldr.clone());
    expand_picture(&small, &ldr, &mut got).unwrap();
    expand::expand(&ldr, &mut want).unwrap();
    assert!(small.submissions() >= 2 * 9, "{} submissions", small.submissions());
    assert_close("bands", &got, &want, 0.0, 10.0 * f32::EPSILON).unwrap();
    // Not even one row.
    let wide = Image::filled(1000, 2, Vec3::ONE);
    let error = expand_picture(&small, &wide, &mut wide.clone()).unwrap_err();
    assert!(matches!(error, GpuError::TooLarge { bytes: 12000, limit: 1024 }), "{error}");
}

fn sizes_that_differ_are_named(gpu: &Gpu) {
    let (a, mut b) = (Image::filled(4, 2, Vec3::ZERO), Image::filled(2, 4, Vec3::ZERO));
    let error = expand_picture(gpu, &a, &mut b).unwrap_err();
    assert!(matches!(&error, GpuError::Input(e) if e.to_string().contains("4×2")), "{error}");
}
