use super::*;
use crate::camera::rotation_from_yaw_pitch;
use crate::sphere::{direction_from_uv, pixel_solid_angle};
use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;
use std::f32::consts::TAU;

fn black(width: usize, height: usize) -> RadianceImage {
    Image::filled(width, height, Vec3::ZERO)
}

/// Noise with a sun in it.
fn noise(width: usize, height: usize, seed: usize) -> RadianceImage {
    Image::from_fn(width, height, |x, y| {
        let i = (x * 7919 + y * 104_729 + seed * 31).wrapping_mul(2_654_435_761) >> 7;
        let sun = if (x + y * width) == seed % (width * height) { 1e5 } else { 0.0 };
        Vec3::new((i % 97) as f32, (i % 89) as f32 * 0.1, (i % 83) as f32 * 0.01) + sun
    })
}

/// A function of direction that a coarse grid can follow.
fn smooth(d: Vec3) -> Vec3 {
    Vec3::new(1.0 + d.x, 1.0 + d.y * d.z, 1.0 + 0.5 * (d.z + d.x * d.y))
}

fn smooth_panorama(width: usize, height: usize) -> RadianceImage {
    let size = Vec2::new(width as f32, height as f32);
    Image::from_fn(width, height, |x, y| smooth(direction_from_uv(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / size)))
}

/// Radiance over the whole sphere.
fn integral(image: &RadianceImage) -> DVec3 {
    let row = |y: usize| image.row(y).iter().map(|p| p.as_dvec3()).sum::<DVec3>();
    (0..image.height()).map(|y| pixel_solid_angle(image.width(), image.height(), y) * row(y)).sum()
}

fn largest_difference(a: &RadianceImage, b: &RadianceImage) -> f32 {
    assert_eq!(a.size(), b.size());
    a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max)
}

fn camera(projection: Projection, width: usize, height: usize, yaw: f32, pitch: f32) -> Camera {
    Camera { position: Vec3::ZERO, world_from_camera: rotation_from_yaw_pitch(yaw, pitch), projection, width, height }
}

fn view(panorama: &RadianceImage, world_from_pano: Quat, camera: &Camera) -> RadianceImage {
    let mut view = black(camera.width, camera.height);
    view_from_panorama(panorama, world_from_pano, camera, &mut view).unwrap();
    view
}

/// What a whole turn, and a half, and a quarter of the panorama are: copies, bit for bit.
#[test]
fn the_whole_panorama_is_a_copy() {
    for (w, h) in [(1, 1), (2, 1), (8, 4), (4096, 2)] {
        let panorama = noise(w, h, 3);
        for turn in [Quat::IDENTITY, Quat::from_euler(glam::EulerRot::XYZ, 1.0, 2.0, 3.0)] {
            let mut whole = camera(Projection::Panorama, w, h, 0.0, 0.0);
            whole.world_from_camera = turn;
            assert_eq!(view(&panorama, turn, &whole), panorama);
            assert_eq!(view(&panorama, -turn, &whole), panorama);
        }
        // The scene's heading and the view's yaw cancel.
        let turned = camera(Projection::Panorama, w, h, 33.0, 0.0);
        assert_eq!(view(&panorama, rotation_from_yaw_pitch(33.0, 0.0), &turned), panorama);
    }
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let perspective = camera(Projection::Perspective { vfov: 1.0 }, 4, 4, 0.0, 0.0);
    let (panorama, mut small) = (black(4, 2), black(3, 4));
    assert!(view_from_panorama(&panorama, Quat::IDENTITY, &perspective, &mut small).is_err());
    let mut back = black(4, 2);
    let mut mask = Image::filled(4, 2, 0.0);
    assert!(panorama_from_view(&small, &perspective, Quat::IDENTITY, &mut back, &mut mask).is_err());
    let mut mask = Image::filled(2, 2, 0.0);
    assert!(panorama_from_view(&black(4, 4), &perspective, Quat::IDENTITY, &mut back, &mut mask).is_err());
}

/// Each target is of twice the size: the same function, with the error of linear interpolation.
#[test]
fn enlarging_follows_a_smooth_function_over_seam_and_poles() {
    let mut previous = f32::INFINITY;
    for height in [16, 32, 64] {
        let mut large = black(4 * height + 2, 2 * height + 1);
        resize_panorama(&smooth_panorama(2 * height, height), &mut large);
        let error = largest_difference(&large, &smooth_panorama(4 * height + 2, 2 * height + 1));
        assert!(error < 0.35 * previous, "{height}: {error} after {previous}");
        previous = error;
    }
    assert!(previous < 2e-3, "{previous}");
}

#[test]
fn an_axis_may_shrink_while_the_other_grows() {
    for (w, h) in [(32, 64), (128, 16), (64, 16), (32, 32), (64, 32)] {
        let mut resized = black(w, h);
        resize_panorama(&smooth_panorama(64, 32), &mut resized);
        let error = largest_difference(&resized, &smooth_panorama(w, h));
        // A row of π/16 at a pole has its mean at ⅔ of its height, not at its centre: π/96 off, at a slope of 1.
        assert!(error < 0.033, "{w}×{h}: {error}");
    }
}

#[test]
fn views_see_a_smooth_function_everywhere() {
    let panorama = smooth_panorama(256, 128);
    let world_from_pano = rotation_from_yaw_pitch(70.0, 20.0);
    for (yaw, pitch) in [(0.0, 0.0), (180.0, 0.0), (0.0, 90.0), (0.0, -90.0), (135.0, 45.0)] {
        for projection in [Projection::Perspective { vfov: 1.5 }, Projection::Panorama] {
            let camera = camera(projection, 33, 17, yaw, pitch);
            let got = view(&panorama, world_from_pano, &camera);
            let want = Image::from_fn(33, 17, |x, y| {
                let d = camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                smooth(world_from_pano.inverse() * d)
            });
            assert!(largest_difference(&got, &want) < 2e-3, "{projection:?} yaw {yaw} pitch {pitch}");
        }
    }
}

#[test]
fn a_view_goes_back_to_where_it_was_seen() {
    let world_from_pano = rotation_from_yaw_pitch(-40.0, 10.0);
    let panorama = smooth_panorama(128, 64);
    for projection in [Projection::Perspective { vfov: 1.2 }, Projection::Panorama] {
        let camera = camera(projection, 160, 120, 25.0, -60.0);
        let view = view(&panorama, world_from_pano, &camera);
        let (mut back, mut coverage) = (black(128, 64), Image::filled(128, 64, -1.0));
        panorama_from_view(&view, &camera, world_from_pano, &mut back, &mut coverage).unwrap();
        let mut seen = 0.0;
        for y in 0..64 {
            for x in 0..128 {
                if coverage.get(x, y) == 1.0 {
                    seen += pixel_solid_angle(128, 64, y);
                    let error = (back.get(x, y) - panorama.get(x, y)).abs().max_element();
                    assert!(error < 5e-3, "{projection:?} ({x}, {y}): {error}");
                } else {
                    assert_eq!((coverage.get(x, y), back.get(x, y)), (0.0, Vec3::ZERO));
                }
            }
        }
        // Solid angle of a rectangular pyramid: 4·asin(sin(h/2)·sin(v/2)) for its half angles' sines.
        let want = match projection {
            Projection::Panorama => 4.0 * std::f64::consts::PI,
            Projection::Perspective { vfov } => {
                let b = f64::from(0.5 * vfov).tan();
                let a = b * 160.0 / 120.0;
                4.0 * (a * b / ((1.0 + a * a) * (1.0 + b * b)).sqrt()).asin()
            }
            Projection::Pinhole { .. } => unreachable!("none is in the list"),
        };
        assert!((seen / want - 1.0).abs() < 0.02, "{projection:?}: {seen} of {want} sr");
    }
}

proptest! {
    #[test]
    fn shrinking_preserves_energy(
        (w, h, to_w, to_h) in (1usize..40, 1usize..30).prop_flat_map(|(w, h)| (Just(w), Just(h), 1..=w, 1..=h)),
        seed in 0usize..1000,
    ) {
        let panorama = noise(w, h, seed);
        let mut small = black(to_w, to_h);
        resize_panorama(&panorama, &mut small);
        let (before, after) = (integral(&panorama), integral(&small));
        for c in 0..3 {
            prop_assert!((after[c] / before[c] - 1.0).abs() < 1e-4 || before[c] == 0.0, "{before} became {after}");
        }
        let most = panorama.data().iter().copied().fold(Vec3::ZERO, Vec3::max);
        prop_assert!(small.data().iter().all(|p| p.cmple(most * 1.000_01).all()));
    }

    #[test]
    fn a_constant_stays_constant(w in 1usize..20, h in 1usize..20, to_w in 1usize..40, to_h in 1usize..40) {
        let mut resized = black(to_w, to_h);
        resize_panorama(&Image::filled(w, h, Vec3::new(0.1, 2.0, 3e4)), &mut resized);
        for p in resized.data() {
            prop_assert!((*p / Vec3::new(0.1, 2.0, 3e4) - 1.0).abs().max_element() < 1e-5);
        }
    }

    /// A panorama turned by k columns is its pixels rolled by k columns, bit for bit.
    #[test]
    fn yaw_by_columns_rolls(w in 1usize..64, h in 1usize..5, k in 0usize..64, pitch in -90.0f32..90.0) {
        let panorama = noise(w, h, 1);
        let turn = -(k as f32) / w as f32 * TAU;
        let world_from_pano = rotation_from_yaw_pitch(0.0, pitch);
        let mut camera = camera(Projection::Panorama, w, h, 0.0, 0.0);
        camera.world_from_camera = world_from_pano * Quat::from_rotation_y(turn);
        let rolled = Image::from_fn(w, h, |x, y| panorama.get((x + k) % w, y));
        prop_assert_eq!(view(&panorama, world_from_pano, &camera), rolled);
    }

    /// A yaw close to k columns, which is interpolated, is close to the roll: the copy turns the right way.
    #[test]
    fn the_copy_is_the_limit_of_interpolation(k in 0usize..64) {
        let panorama = smooth_panorama(64, 32);
        let turned = |columns: f32| {
            let yaw = columns / 64.0 * 360.0;
            view(&panorama, Quat::IDENTITY, &camera(Projection::Panorama, 64, 32, yaw, 0.0))
        };
        prop_assert!(largest_difference(&turned(k as f32), &turned(k as f32 + 0.01)) < 2e-3);
    }

    #[test]
    fn views_are_continuous_over_the_seam_and_the_poles(yaw in -180.0f32..180.0, pitch in -90.0f32..90.0) {
        let panorama = smooth_panorama(64, 32);
        let narrow = camera(Projection::Perspective { vfov: 0.2 }, 24, 24, yaw, pitch);
        let view = view(&panorama, Quat::IDENTITY, &narrow);
        for y in 0..24 {
            for pair in view.row(y).windows(2) {
                // A pixel is 1/120 rad, and no channel changes faster than by 1.5 a radian.
                prop_assert!((pair[0] - pair[1]).abs().max_element() < 0.03);
            }
        }
    }

    #[test]
    fn any_size_gives_finite_values(w in 1usize..6, h in 1usize..6, to_w in 1usize..9, to_h in 1usize..9, yaw in -400.0f32..400.0) {
        let panorama = noise(w, h, 5);
        for projection in [Projection::Perspective { vfov: 2.0 }, Projection::Panorama] {
            let camera = camera(projection, to_w, to_h, yaw, yaw * 0.3);
            let view = view(&panorama, Quat::IDENTITY, &camera);
            let (mut back, mut coverage) = (black(w, h), Image::filled(w, h, 0.0));
            panorama_from_view(&view, &camera, Quat::IDENTITY, &mut back, &mut coverage).unwrap();
            prop_assert!(view.data().iter().chain(back.data()).all(|p| p.is_finite() && p.min_element() >= 0.0));
        }
    }
}
