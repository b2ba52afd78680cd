//! The device: memory, limits, loss.

use crate::Test;
use glam::Vec3;
use pano_core::gpu::{Band, Gpu, GpuError, GpuOptions};
use pano_core::image::Image;
use pano_light::expand::gpu::{expand, expand_picture};

pub(crate) const TESTS: &[Test] = &[
    ("context::pictures_come_back", pictures_come_back),
    ("context::bands_cover_every_row_once", bands_cover_every_row_once),
    ("context::what_is_too_large_is_refused", what_is_too_large_is_refused),
    ("context::kernels_are_compiled_once", kernels_are_compiled_once),
    ("context::a_lost_device_is_an_error", a_lost_device_is_an_error),
    ("context::a_device_is_lost_after_so_many_submissions", a_device_is_lost_after_so_many_submissions),
    ("context::dispatches_are_timed", dispatches_are_timed),
];

fn pictures_come_back(gpu: &Gpu) {
    for (w, h) in [(1, 1), (3, 7), (64, 5)] {
        let image = Image::from_fn(w, h, |x, y| Vec3::new(x as f32, f32::NAN, y as f32));
        let before = gpu.traffic();
        let held = gpu.upload(&image).unwrap();
        let back = gpu.read(&held).unwrap();
        let bits = |i: &Image<Vec3>| i.data().iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&image));
        let after = gpu.traffic();
        // Tests share the device, so that others' bytes may count as well.
        assert!(after.uploaded - before.uploaded >= 12 * (w * h) as u64 && after.read - before.read >= 12 * (w * h) as u64);
        let mut part = Image::filled(w, h, Vec3::ZERO);
        let rows = h / 2..h;
        gpu.read_rows(&gpu.upload_rows(&image, &(0..h)).unwrap(), &rows, &mut part).unwrap();
        assert!(part.data()[..rows.start * w].iter().all(|p| *p == Vec3::ZERO));
        assert!(part.data()[rows.start * w..].iter().all(|p| p.y.is_nan()));
    }
}

fn bands_cover_every_row_once(_: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(1200), ..GpuOptions::default() }).unwrap();
    assert_eq!(small.max_binding(), 1200);
    // A hundred rows of ten bytes; two of them are a halo, on each side.
    let bands = small.bands((10, 300), 1, 2).unwrap();
    assert_eq!(bands[0], Band { keep: 0..116, hold: 0..118 });
    assert_eq!(bands.iter().map(|b| b.keep.len()).sum::<usize>(), 300);
    for (i, band) in bands.iter().enumerate() {
        assert!(band.hold.len() * 10 <= 1200, "{band:?}");
        assert!(i == 0 || (bands[i - 1].keep.end == band.keep.start && band.hold.start + 2 == band.keep.start), "{band:?}");
    }
    assert_eq!(small.bands((10, 120), 1, 50).unwrap(), [Band { keep: 0..120, hold: 0..120 }]);
    assert!(matches!(small.bands((10, 121), 1, 60), Err(GpuError::TooLarge { .. })));
}

fn what_is_too_large_is_refused(gpu: &Gpu) {
    let error = gpu.buffer::<u32>((gpu.max_binding() / 4 + 1) as usize).unwrap_err();
    assert!(matches!(error, GpuError::TooLarge { .. }), "{error}");
    assert!(gpu.max_binding() <= 128 << 20, "no GPU promises more");
}

fn kernels_are_compiled_once(_: &Gpu) {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let held = gpu.upload(&Image::filled(4, 2, Vec3::ONE)).unwrap();
    for _ in 0..3 {
        expand(&gpu, &held).unwrap();
    }
    assert_eq!(gpu.compiled(), 1);
}

fn a_lost_device_is_an_error(_: &Gpu) {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let image = Image::filled(4, 2, Vec3::ONE);
    let held = gpu.upload(&image).unwrap();
    gpu.lose();
    for error in [
        gpu.check().unwrap_err(),
        gpu.upload(&image).unwrap_err(),
        gpu.read(&held).unwrap_err(),
        expand(&gpu, &held).unwrap_err(),
        gpu.buffer::<u32>(1).unwrap_err(),
    ] {
        assert!(matches!(error, GpuError::Lost { .. }), "{error}");
    }
    // Another one can be had.
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    assert_eq!(gpu.read(&gpu.upload(&image).unwrap()).unwrap(), image);
    // It is lost while it works, and says so only when that has ended.
    let picture = Image::filled(2048, 1024, Vec3::ONE);
    let held = gpu.upload(&picture).unwrap();
    expand(&gpu, &held).unwrap();
    gpu.lose();
    let error = expand_picture(&gpu, &picture, &mut picture.clone()).unwrap_err();
    assert!(matches!(error, GpuError::Lost { .. }), "{error}");
}

fn a_device_is_lost_after_so_many_submissions(_: &Gpu) {
    let image = Image::filled(4, 2, Vec3::ONE);
    for lose_after in 0..4 {
        let gpu = Gpu::new(&GpuOptions { lose_after: Some(lose_after), ..GpuOptions::default() }).unwrap();
        let mut out = image.clone();
        // A dispatch and a copy.
        let result = expand_picture(&gpu, &image, &mut out);
        assert_eq!(result.is_ok(), lose_after >= 2, "{lose_after}: {result:?}");
        if let Err(error) = result {
            assert!(matches!(error, GpuError::Lost { .. }), "{error}");
            assert_eq!(out, image, "nothing is half done");
        }
    }
}

fn dispatches_are_timed(_: &Gpu) {
    let gpu = Gpu::new(&GpuOptions { timestamps: true, ..GpuOptions::default() }).unwrap();
    let held = gpu.upload(&Image::filled(64, 64, Vec3::ONE)).unwrap();
    expand(&gpu, &held).unwrap();
    expand(&gpu, &held).unwrap();
    // A GPU without timestamps gives none; one with them gives all, once.
    let timings = gpu.take_timings().unwrap();
    assert!(timings.is_empty() || timings.len() == 2, "{timings:?}");
    assert!(timings.iter().all(|t| t.entry == "expand" && t.ms >= 0.0), "{timings:?}");
    assert!(gpu.take_timings().unwrap().is_empty());
}
