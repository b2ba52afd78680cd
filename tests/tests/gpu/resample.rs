//! Resampling.

use crate::{Test, support::*};
use glam::{Quat, Vec2, Vec3};
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::sphere::resample::{self, gpu};
use pano_tests::random::Random;
use proptest::prelude::*;

pub(crate) const TESTS: &[Test] = &[
    ("resample::views_equal_the_cpu", views_equal_the_cpu),
    ("resample::copies_stay_copies", copies_stay_copies),
    ("resample::sizes_equal_the_cpu", sizes_equal_the_cpu),
    ("resample::bands_make_no_difference", bands_make_no_difference),
];

fn noise((w, h): (usize, usize), seed: u32) -> RadianceImage {
    let mut random = Random::new(seed);
    Image::from_fn(w, h, |_, _| random.color(0.0, 1.0))
}

fn camera(projection: Projection, (width, height): (usize, usize), yaw: f32, pitch: f32) -> Camera {
    Camera { position: Vec3::ZERO, world_from_camera: rotation_from_yaw_pitch(yaw, pitch), projection, width, height }
}

/// A direction is good to 5e-7, on both sides, and a texel of noise has a slope of 1 a texel: at a width of W columns 1e-6·W
/// texels, divided by sin θ at the poles. Within 1e-3 of a pole the longitude is a matter of rounding.
fn check_view(got: &RadianceImage, want: &RadianceImage, camera: &Camera, turn: Quat, width: usize) -> Result<(), TestCaseError> {
    for y in 0..want.height() {
        for x in 0..want.width() {
            let d = turn.inverse() * camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            let sin = d.x.hypot(d.z);
            let apart = (got.get(x, y) - want.get(x, y)).abs().max_element();
            let allowed = 2e-6 + 1e-6 * width as f32 / sin.max(1e-6);
            prop_assert!(sin < 1e-3 || apart <= allowed, "({x}, {y}), sin θ {sin}: {} {}", got.get(x, y), want.get(x, y));
        }
    }
    Ok(())
}

fn views_equal_the_cpu(device: &Gpu) {
    let angles = (-400.0f32..400.0, prop_oneof![Just(90.0f32), Just(-90.0), -90.0f32..90.0], -180.0f32..180.0);
    property(60, (sizes(), sizes(), any::<u32>(), 0..3, angles), |(size, view, seed, kind, (yaw, pitch, heading))| {
        let panorama = noise(size, seed);
        let projection = match kind {
            0 => Projection::Perspective { vfov: 1.7 },
            1 => Projection::Pinhole { focal: Vec2::new(9.0, 7.0), center: Vec2::new(3.2, 8.9) },
            _ => Projection::Panorama,
        };
        let (camera, turn) = (camera(projection, view, yaw, pitch), rotation_from_yaw_pitch(heading, 11.0));
        let (mut got, mut want) = (Image::filled(view.0, view.1, Vec3::ZERO), Image::filled(view.0, view.1, Vec3::ZERO));
        gpu::view_from_panorama(device, &panorama, turn, &camera, &mut got).unwrap();
        resample::view_from_panorama(&panorama, turn, &camera, &mut want).unwrap();
        check_view(&got, &want, &camera, turn, size.0)
    });
}

fn copies_stay_copies(device: &Gpu) {
    let panorama = wild((16, 8), 1.0, 3);
    let mut view = Image::filled(16, 8, Vec3::ZERO);
    let same = camera(Projection::Panorama, (16, 8), 0.0, 0.0);
    gpu::view_from_panorama(device, &panorama, Quat::IDENTITY, &same, &mut view).unwrap();
    assert!(same_bits(&view, &panorama));
    let mut small = Image::filled(3, 3, Vec3::ZERO);
    assert!(gpu::view_from_panorama(device, &panorama, Quat::IDENTITY, &same, &mut small).is_err());
}

fn sizes_equal_the_cpu(device: &Gpu) {
    property(60, (sizes(), sizes(), any::<u32>()), |(size, to, seed)| {
        let mut panorama = noise(size, seed);
        // A sun.
        panorama.set(seed as usize % size.0, seed as usize % size.1, Vec3::splat(1e4));
        let mut want = Image::filled(to.0, to.1, Vec3::ZERO);
        resample::resize_panorama(&panorama, &mut want);
        let got = device.read(&gpu::resize(device, &panorama, Ok, to).unwrap()).unwrap();
        // Sums of up to 1200 products in f32, relative to the sun where it takes part.
        assert_close("resized", &got, &want, 2e-6, 1e-5)
    });
}

fn bands_make_no_difference(device: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(40 * 12 * 8), ..GpuOptions::default() }).unwrap();
    let panorama = noise((40, 31), 5);
    let view = camera(Projection::Perspective { vfov: 2.0 }, (17, 13), 170.0, 80.0);
    let [a, b] = [&small, device].map(|g| g.read(&gpu::look_up(g, &panorama, Quat::IDENTITY, &view).unwrap()).unwrap());
    // The order of at most four terms.
    assert_close("view", &a, &b, 0.0, 1e-6).unwrap();
    let [a, b] = [&small, device].map(|g| g.read(&gpu::resize(g, &panorama, Ok, (7, 9)).unwrap()).unwrap());
    assert_close("resized", &a, &b, 0.0, 1e-5).unwrap();
    assert!(small.submissions() >= 10, "{}", small.submissions());
}
