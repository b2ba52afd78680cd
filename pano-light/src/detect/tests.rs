use super::*;
use crate::expand::LUMA_WEIGHTS;
use crate::grid::grid;
use crate::test_maps::{Lamp, degrees, sky};
use glam::DVec3;
use pano_core::sphere::{direction_from_uv, pixel_solid_angle};
use proptest::prelude::*;

fn found(panorama: &RadianceImage) -> Detection {
    detect(&WorkingMap::from_hdr(panorama), &Params::default())
}

/// ∫ L dω of the upper half of the working map.
fn upper_light(map: &RadianceImage) -> DVec3 {
    let half = map.data().len() / 2;
    map.data()[..half].iter().enumerate().map(|(i, p)| p.as_dvec3() * grid().solid_angle(i)).sum()
}

#[test]
fn a_lamp_is_where_it_is_and_as_strong_and_large_as_it_is() {
    let lamp = Lamp::white(40.0, 35.0, 6.0, 50.0);
    let d = found(&sky(1024, &[lamp]));
    let solid_angle = std::f32::consts::TAU * (1.0 - lamp.radius.to_radians().cos());
    assert_eq!(d.lights.len(), 1, "{:?}", d.lights);
    let light = &d.lights[0];
    assert!(degrees(light.direction, lamp.direction()) < 0.1, "{light:?}");
    // Only what exceeds the threshold is the light's; the blur's rim belongs to it.
    let expected = solid_angle * (50.0 - d.threshold as f32);
    assert!((light.irradiance.x / expected - 1.0).abs() < 0.02, "{light:?} {expected}");
    assert!(light.solid_angle > solid_angle * 0.9 && light.solid_angle < solid_angle * 1.6, "{light:?} {solid_angle}");
    assert_eq!(light.intensity, light.irradiance, "HDR lights are as bright as they are");
}

#[test]
fn statistics_are_those_of_the_blurred_upper_half() {
    // Columns in stripes of five: every 5×5 box holds a fifth of white, so that the blur is constant.
    let stripes = RadianceImage::from_fn(600, 300, |x, _| Vec3::splat(if x % 5 == 0 { 5.0 } else { 0.0 }));
    let d = found(&stripes);
    assert!((d.mean - 1.0).abs() < 1e-5 && d.sigma < 1e-5, "{} {}", d.mean, d.sigma);
    // Black but for a fifth of the columns. The blur makes 0.8, 0.6, 0.4 and 0.2 of two white and two black columns at each
    // edge, whose squares sum to 1.2 in place of 2.
    let variance = 0.2 - 2.0 * 0.8 / 600.0 - 0.2f64.powi(2);
    let half = RadianceImage::from_fn(600, 300, |x, y| Vec3::splat(if x < 120 && y < 150 { 1.0 } else { 0.0 }));
    let d = found(&half);
    assert!((d.mean - 0.2).abs() < 1e-6 && (d.sigma - variance.sqrt()).abs() < 1e-5, "{} {}", d.mean, d.sigma);
    assert!((d.threshold - (d.mean + 2.0 * d.sigma)).abs() < 1e-12);
}

#[test]
fn nothing_shines_in_a_pure_sky() {
    type Sky = (&'static str, fn(f32) -> f32);
    let skies: [Sky; 4] = [
        ("overcast (CIE)", |y| (1.0 + 2.0 * y) / 3.0),
        ("clear, bright near the horizon", |y| 1.5 - y),
        ("dusk", |y| 0.1 + (1.0 - y)),
        ("uniform", |_| 0.7),
    ];
    for (name, luminance) in skies {
        let panorama = RadianceImage::from_fn(512, 256, |x, y| {
            let d = direction_from_uv(glam::Vec2::new((x as f32 + 0.5) / 512.0, (y as f32 + 0.5) / 256.0));
            Vec3::new(0.6, 0.8, 1.0) * if d.y > 0.0 { luminance(d.y) } else { 0.2 }
        });
        assert_eq!(found(&panorama).lights, [], "{name}");
    }
}

#[test]
fn black_and_constant_maps_have_no_lights() {
    for value in [0.0, 1e-30, 0.1, 1.0, 1e5, 1e30, f32::MAX] {
        for (w, h) in [(1, 1), (2, 1), (3, 5), (512, 256), (1200, 600)] {
            let panorama = RadianceImage::filled(w, h, Vec3::splat(value));
            for map in [WorkingMap::from_hdr(&panorama), WorkingMap::from_ldr(&panorama)] {
                let d = detect(&map, &Params::default());
                assert_eq!(d.lights, [], "{value} {w}×{h}");
                assert_eq!(&d.clamped(&map), map.radiance());
            }
        }
    }
}

#[test]
fn a_sun_of_one_pixel_is_found_in_a_picture_of_any_size() {
    for (w, h, x, y) in [(4096, 2048, 1234, 500), (600, 300, 0, 60), (1200, 600, 1199, 31), (2048, 1024, 7, 0)] {
        let mut panorama = RadianceImage::filled(w, h, Vec3::splat(0.5));
        panorama.set(x, y, Vec3::new(1e5, 9e4, 7e4));
        let d = found(&panorama);
        assert_eq!(d.lights.len(), 1, "{w}×{h}: {:?}", d.lights);
        let light = &d.lights[0];
        let at = direction_from_uv(glam::Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
        // Half a pixel of the working map, or a row of it at the pole.
        assert!(degrees(light.direction, at) < 0.5, "{w}×{h}: {light:?} {at}");
        let sun = Vec3::new(1e5, 9e4, 7e4) * pixel_solid_angle(w, h, y) as f32;
        let share = light.irradiance / sun;
        assert!(share.min_element() > 0.97 && share.max_element() < 1.01, "{w}×{h}: {} of {sun}", light.irradiance);
    }
}

#[test]
fn weak_lights_beyond_nine_tenths_are_left_out() {
    let lamps = [Lamp::white(-90.0, 30.0, 4.0, 100.0), Lamp::white(0.0, 30.0, 4.0, 60.0), Lamp::white(90.0, 30.0, 4.0, 14.0)];
    let d = found(&sky(600, &lamps));
    assert_eq!((d.found, d.lights.len()), (3, 2), "{:?}", d.lights);
    assert!(degrees(d.lights[0].direction, lamps[0].direction()) < 0.2, "the strongest comes first");
    let all = detect(&WorkingMap::from_hdr(&sky(600, &lamps)), &Params { keep: 1.0, ..Params::default() });
    assert_eq!(all.lights.len(), 3);
}

#[test]
fn reflections_below_the_horizon_do_not_count() {
    let d = found(&sky(600, &[Lamp::white(0.0, -40.0, 5.0, 100.0), Lamp::white(120.0, 20.0, 5.0, 10.0)]));
    assert_eq!(d.lights.len(), 1);
    assert!(d.lights[0].direction.y > 0.0);
}

#[test]
fn ldr_lights_are_remapped_by_their_size() {
    let white = Vec3::ONE;
    let small = Lamp { radiance: white, ..Lamp::white(30.0, 40.0, 2.0, 1.0) };
    let large = Lamp { radiance: white, ..Lamp::white(30.0, 40.0, 20.0, 1.0) };
    for (lamp, brighter) in [(small, true), (large, false)] {
        let d = detect(&WorkingMap::from_ldr(&sky(512, &[lamp])), &Params::default());
        let light = d.lights[0];
        assert_eq!(light.intensity.x > light.irradiance.x, brighter, "{light:?}");
    }
}

fn any_lamps() -> impl Strategy<Value = Vec<Lamp>> {
    let lamp = (-180.0f32..180.0, 5.0f32..85.0, 1.0f32..12.0, 0.0f32..4.0);
    let lamp = lamp.prop_map(|(yaw, height, radius, power)| Lamp {
        radiance: Vec3::new(1.0, 0.8, 0.5) * 10.0f32.powf(power),
        ..Lamp::white(yaw, height, radius, 1.0)
    });
    prop::collection::vec(lamp, 1..5)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Lights and clamped map are the map, in sum and pixel by pixel.
    #[test]
    fn no_light_is_lost(lamps in any_lamps(), ldr: bool) {
        let panorama = sky(512, &lamps);
        let map = if ldr { WorkingMap::from_ldr(&panorama) } else { WorkingMap::from_hdr(&panorama) };
        let d = detect(&map, &Params::default());
        let clamped = d.clamped(&map);
        let lights: DVec3 = d.lights.iter().map(|l| l.irradiance.as_dvec3()).sum();
        let (whole, rest) = (upper_light(map.radiance()), upper_light(&clamped));
        let error = ((lights + rest) / whole - DVec3::ONE).abs().max_element();
        prop_assert!(error < 1e-5, "{error}");
        for (i, (&before, &after)) in map.radiance().data().iter().zip(clamped.data()).enumerate() {
            let lit = d.lit().data().get(i).is_some_and(|lit| *lit);
            prop_assert!(lit || before == after, "pixel {i} of no light has changed");
            prop_assert!(after.min_element() >= 0.0 && after.cmple(before + 1e-6 * before).all());
            prop_assert!(!lit || after.dot(LUMA_WEIGHTS) <= d.threshold as f32 * 1.0001);
        }
    }

    /// Whatever the yaw, lights turn with the panorama.
    #[test]
    fn lights_turn_with_the_panorama(lamps in any_lamps(), yaw in -180.0f32..180.0) {
        let turned: Vec<Lamp> = lamps.iter().map(|l| Lamp { yaw: l.yaw + yaw, ..*l }).collect();
        let (a, b) = (found(&sky(600, &lamps)), found(&sky(600, &turned)));
        // Where pixels cut the rim of a lamp changes the deviation of all of them: the more, the fewer pixels it has (in 3000
        // random cases by 0.047 over its radius in pixels).
        let smallest = lamps.iter().map(|l| f64::from(l.radius) * 600.0 / 360.0).fold(f64::INFINITY, f64::min);
        let off = (a.threshold / b.threshold - 1.0).abs();
        prop_assert!(off < 0.01f64.max(0.06 / smallest), "{} {}, {smallest} pixels", a.threshold, b.threshold);
        let rotation = glam::Quat::from_rotation_y(-yaw.to_radians());
        let strongest = a.lights[0];
        let nearest = b.lights.iter().min_by(|p, q| {
            degrees(p.direction, rotation * strongest.direction).total_cmp(&degrees(q.direction, rotation * strongest.direction))
        });
        let nearest = nearest.copied();
        prop_assert!(nearest.is_some());
        let nearest = nearest.unwrap_or(strongest);
        prop_assert!(degrees(nearest.direction, rotation * strongest.direction) < 0.5, "{strongest:?} {nearest:?}");
        prop_assert!((nearest.irradiance.x / strongest.irradiance.x - 1.0).abs() < 0.03, "{strongest:?} {nearest:?}");
    }

    /// By whole columns the result is the same but for rounding, seam or not.
    #[test]
    fn rolling_by_columns_changes_nothing(lamps in any_lamps(), columns in 0usize..600) {
        let panorama = sky(600, &lamps);
        let rolled = RadianceImage::from_fn(600, 300, |x, y| panorama.get((x + columns) % 600, y));
        let (a, b) = (found(&panorama), found(&rolled));
        prop_assert_eq!(a.lights.len(), b.lights.len());
        let rotation = glam::Quat::from_rotation_y(columns as f32 / 600.0 * std::f32::consts::TAU);
        for (p, q) in a.lights.iter().zip(&b.lights) {
            prop_assert!(degrees(rotation * p.direction, q.direction) < 0.01, "{p:?} {q:?}");
            prop_assert!((p.irradiance / q.irradiance - 1.0).abs().max_element() < 1e-4);
        }
    }

    #[test]
    fn any_pixels_give_finite_lights(values in prop::collection::vec(prop::array::uniform3(prop::num::f32::ANY), 32)) {
        let panorama = RadianceImage::from_fn(8, 4, |x, y| Vec3::from_array(values[y * 8 + x]));
        for map in [WorkingMap::from_hdr(&panorama), WorkingMap::from_ldr(&panorama)] {
            let d = detect(&map, &Params::default());
            prop_assert!(d.threshold.is_finite() && d.sigma.is_finite());
            for l in &d.lights {
                prop_assert!(l.direction.is_normalized() && l.direction.y > 0.0, "{l:?}");
                prop_assert!(l.irradiance.is_finite() && l.intensity.is_finite() && l.solid_angle > 0.0, "{l:?}");
            }
            prop_assert!(d.clamped(&map).data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
        }
    }
}
