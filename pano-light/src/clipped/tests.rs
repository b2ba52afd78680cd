use super::*;
use crate::test_maps::{Lamp, degrees, sky};
use glam::Vec3;
use proptest::prelude::*;

/// A picture clipped at 1, as a camera would.
fn photo(lamps: &[Lamp]) -> RadianceImage {
    sky(512, lamps).map(|p| p.min(Vec3::ONE))
}

fn both(ldr: &RadianceImage) -> (Detection, Detection) {
    let map = WorkingMap::from_ldr(ldr);
    (crate::detect::detect(&map, &Default::default()), detect(ldr, &map, &Params::default()))
}

#[test]
fn a_small_lamp_with_a_halo_beats_a_large_white_screen() {
    // As in the studio picture of the paper's kind: a spot overhead and a paper screen at eye level, both clipped.
    let spot = Lamp::white(-80.0, 48.0, 4.0, 800.0);
    let glow = Lamp { radius: 7.0, radiance: Vec3::splat(0.6), ..spot };
    let screen = Lamp::white(60.0, 12.0, 12.0, 2.0);
    let (paper, clipped) = both(&photo(&[spot, glow, screen]));
    assert!(degrees(paper.lights[0].direction, screen.direction()) < 3.0, "MR360 takes the larger one");
    assert!(degrees(clipped.lights[0].direction, spot.direction()) < 1.0, "{:?}", clipped.lights);
}

#[test]
fn parts_of_one_light_count_together() {
    let lamps = [-4.0, 0.0, 4.0].map(|yaw| Lamp::white(yaw, 40.0, 1.5, 100.0));
    let (_, d) = both(&photo(&lamps));
    assert_eq!(d.found, 1, "{:?}", d.lights);
    assert!(degrees(d.lights[0].direction, lamps[1].direction()) < 0.5, "{:?}", d.lights);
    let apart = [-40.0, 40.0].map(|yaw| Lamp::white(yaw, 40.0, 1.5, 100.0));
    assert_eq!(both(&photo(&apart)).1.found, 2);
}

#[test]
fn what_is_not_clipped_is_no_light() {
    let (_, d) = both(&photo(&[Lamp::white(0.0, 40.0, 5.0, 0.9)]));
    assert_eq!(d.lights, []);
    let (_, d) = both(&RadianceImage::filled(64, 32, Vec3::ZERO));
    assert_eq!(d.lights, []);
}

#[test]
fn an_all_white_picture_is_one_light_from_above() {
    // The whole half sphere is clipped: wherever the light is, it is up.
    let (_, d) = both(&RadianceImage::filled(64, 32, Vec3::ONE));
    assert_eq!(d.lights.len(), 1);
    assert!(degrees(d.lights[0].direction, Vec3::Y) < 0.1, "{:?}", d.lights);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Lamps that the horizon does not cut: of those only a part is a light, whose middle is another.
    #[test]
    fn lights_turn_with_the_picture(yaw in -180.0f32..180.0, height in 17.0f32..70.0, radius in 2.0f32..15.0, turn in -180.0f32..180.0) {
        let lamp = Lamp::white(yaw, height, radius, 50.0);
        let (_, a) = both(&photo(&[lamp]));
        let (_, b) = both(&photo(&[Lamp { yaw: yaw + turn, ..lamp }]));
        prop_assert_eq!((a.lights.len(), b.lights.len()), (1, 1));
        prop_assert!(degrees(a.lights[0].direction, lamp.direction()) < 0.5);
        let turned = glam::Quat::from_rotation_y(-turn.to_radians()) * a.lights[0].direction;
        prop_assert!(degrees(b.lights[0].direction, turned) < 0.5);
        prop_assert!((a.lights[0].intensity.x / b.lights[0].intensity.x - 1.0).abs() < 0.1);
    }

    #[test]
    fn any_picture_gives_finite_lights(values in prop::collection::vec(prop::array::uniform3(prop::num::f32::ANY), 32)) {
        let ldr = RadianceImage::from_fn(8, 4, |x, y| Vec3::from_array(values[y * 8 + x]));
        let (_, d) = both(&ldr);
        for l in &d.lights {
            prop_assert!(l.direction.is_normalized() && l.intensity.is_finite() && l.irradiance.is_finite(), "{l:?}");
        }
    }
}
