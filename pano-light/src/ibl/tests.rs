use super::median_cut::median_cut;
use super::sh9::Sh9;
use super::*;
use crate::test_maps::{Lamp, sky};
use crate::{WorkingMap, detect};
use glam::{Vec2, Vec3};
use pano_core::sphere::{direction_from_uv, pixel_solid_angle};
use proptest::prelude::*;
use std::f32::consts::PI;

fn center(x: usize, y: usize, (w, h): (usize, usize)) -> Vec3 {
    direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32))
}

/// Root mean square difference over the sphere, relative to the mean.
fn relative_error(a: &RadianceImage, b: &RadianceImage) -> f32 {
    let (w, h) = a.size();
    let (mut error, mut mean) = (0.0, 0.0);
    for y in 0..h {
        let area = pixel_solid_angle(w, h, y) as f32 / (4.0 * PI);
        for x in 0..w {
            error += (a.get(x, y) - b.get(x, y)).length_squared() / 3.0 * area;
            mean += b.get(x, y).element_sum() / 3.0 * area;
        }
    }
    error.sqrt() / mean
}

/// What lights the scene once its lights are taken out, as in a frame.
fn typical(lamps: &[Lamp]) -> RadianceImage {
    let map = WorkingMap::from_ldr(&sky(512, lamps).map(|p| p.min(Vec3::ONE)));
    detect::detect(&map, &detect::Params::default()).clamped(&map)
}

fn kernels() -> [(Kernel, (usize, usize)); 5] {
    std::array::from_fn(|i| match i {
        0 => (Kernel::Diffuse, DIFFUSE_SIZE),
        _ => (Kernel::Glossy(GLOSSY_ROUGHNESS[i - 1]), GLOSSY_SIZES[i - 1]),
    })
}

fn map_of(maps: &RadianceMaps, i: usize) -> &RadianceImage {
    if i == 0 { &maps.diffuse } else { &maps.glossy[i - 1] }
}

#[test]
fn constant_light_stays_constant() {
    let maps = radiance_maps(&RadianceImage::filled(600, 300, Vec3::new(0.5, 1.0, 2.0)));
    for (i, (kernel, size)) in kernels().into_iter().enumerate() {
        let map = map_of(&maps, i);
        assert_eq!(map.size(), size);
        assert!(map.data().iter().all(|p| p.abs_diff_eq(Vec3::new(0.5, 1.0, 2.0), 1e-4)), "{kernel:?}");
    }
}

#[test]
fn thirty_six_samples_come_near_the_exact_convolution() {
    // Two windows and a lamp, as clamped maps have them: 5 % in diffuse light and 7 % in the narrowest lobe.
    let panorama =
        typical(&[Lamp::white(70.0, 20.0, 15.0, 3.0), Lamp::white(-120.0, 35.0, 10.0, 2.0), Lamp::white(10.0, 80.0, 4.0, 9.0)]);
    let maps = radiance_maps(&panorama);
    for (i, bound) in [0.06, 0.08, 0.08, 0.08, 0.06].into_iter().enumerate() {
        let (kernel, size) = kernels()[i];
        let error = relative_error(map_of(&maps, i), &exact::convolved(&panorama, kernel, size));
        assert!(error < bound, "{kernel:?}: {error}");
    }
}

#[test]
fn exact_diffuse_light_of_a_lamp_falls_with_the_cosine() {
    let lamp = Lamp::white(20.0, 30.0, 3.0, 1.0);
    let lit = sky(600, &[lamp]);
    let dark = sky(600, &[]);
    let size = (16, 8);
    let (lit, dark) = (exact::convolved(&lit, Kernel::Diffuse, size), exact::convolved(&dark, Kernel::Diffuse, size));
    let area = 2.0 * PI * (1.0 - lamp.radius.to_radians().cos());
    for y in 0..8 {
        for x in 0..16 {
            let cos = center(x, y, size).dot(lamp.direction()).max(0.0);
            let more = (lit.get(x, y) - dark.get(x, y)).x;
            // The lamp hides the sky behind it, a fifth of its radiance.
            let expected = area * cos / PI * 0.88;
            assert!((more - expected).abs() < 0.06 * area / PI, "{more} {expected}");
        }
    }
}

#[test]
fn spherical_harmonics_are_diffuse_light_to_a_few_percent() {
    let panorama = typical(&[Lamp::white(70.0, 20.0, 15.0, 3.0), Lamp::white(-120.0, 35.0, 10.0, 2.0)]);
    let sh = Sh9::project(&panorama);
    let map = RadianceImage::from_fn(32, 16, |x, y| sh.irradiance(center(x, y, (32, 16))) / PI);
    let error = relative_error(&map, &exact::convolved(&panorama, Kernel::Diffuse, (32, 16)));
    assert!(error < 0.05, "{error}");
}

#[test]
fn spherical_harmonics_hold_their_own_bands_exactly() {
    // L = 1 + d·a: irradiance is π + 2π/3 n·a.
    let a = Vec3::new(0.2, -0.4, 0.5);
    let panorama = RadianceImage::from_fn(256, 128, |x, y| Vec3::splat(1.0 + center(x, y, (256, 128)).dot(a)));
    let sh = Sh9::project(&panorama);
    for n in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(1.0, -2.0, 0.5).normalize()] {
        let expected = PI + 2.0 * PI / 3.0 * n.dot(a);
        assert!((sh.irradiance(n).x - expected).abs() < 1e-3, "{n}: {} {expected}", sh.irradiance(n).x);
    }
}

#[test]
fn median_cut_keeps_all_light_and_shares_it() {
    let panorama = sky(512, &[Lamp::white(70.0, 20.0, 5.0, 30.0)]);
    let total: Vec3 = (0..256).map(|y| panorama.row(y).iter().sum::<Vec3>() * pixel_solid_angle(512, 256, y) as f32).sum();
    let lights = median_cut(&panorama, 5);
    assert_eq!(lights.len(), 32);
    let sum: Vec3 = lights.iter().map(|l| l.irradiance).sum();
    assert!((sum / total - 1.0).abs().max_element() < 1e-4);
    let mean = total.x / 32.0;
    assert!(lights.iter().all(|l| l.irradiance.x < 2.0 * mean), "no light has much more than its share");
    assert!((lights.iter().map(|l| l.solid_angle).sum::<f32>() / (4.0 * PI) - 1.0).abs() < 1e-4);
    assert_eq!(median_cut(&RadianceImage::filled(8, 4, Vec3::ZERO), 3), []);
    assert_eq!(median_cut(&RadianceImage::filled(1, 1, Vec3::ONE), 3).len(), 1);
}

#[test]
fn roughness_between_two_maps_is_mixed() {
    let maps = radiance_maps(&typical(&[Lamp::white(0.0, 30.0, 10.0, 3.0)]));
    let d = Lamp::white(0.0, 30.0, 10.0, 3.0).direction();
    let at = |r: f32| maps.specular(d, r).x;
    assert!((at(0.375) - 0.5 * (at(0.25) + at(0.5))).abs() < 1e-5);
    assert!((at(0.125) - 0.5 * (at(0.0) + at(0.25))).abs() < 1e-5);
    assert_eq!(at(0.0), pano_core::sphere::bilinear(&maps.mirror, pano_core::sphere::uv_from_direction(d)).x);
    assert!(at(0.0) > at(0.5) && at(0.5) > at(1.0), "rougher mirrors dim the lamp");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn maps_turn_with_the_panorama(columns in 0usize..32, yaw in -180.0f32..180.0) {
        let panorama = typical(&[Lamp::white(yaw, 30.0, 12.0, 3.0)]);
        // Whole pixels of every map.
        let shift = columns * 600 / 32;
        prop_assume!(shift * 32 == columns * 600);
        let rolled = RadianceImage::from_fn(600, 300, |x, y| panorama.get((x + shift) % 600, y));
        let (a, b) = (radiance_maps(&panorama), radiance_maps(&rolled));
        for i in 0..5 {
            let (a, b) = (map_of(&a, i), map_of(&b, i));
            let turned = RadianceImage::from_fn(a.width(), a.height(), |x, y| a.get((x + columns * a.width() / 32) % a.width(), y));
            prop_assert!(relative_error(&turned, b) < 0.01, "map {i}");
        }
    }
}
