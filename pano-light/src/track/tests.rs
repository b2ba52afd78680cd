use super::*;
use crate::test_maps::{Lamp, degrees, sky};
use glam::Vec3;
use pano_core::image::RadianceImage;
use proptest::prelude::*;
use std::sync::LazyLock;

fn light(lamp: &Lamp) -> DirectionalLight {
    let solid_angle = std::f32::consts::TAU * (1.0 - lamp.radius.to_radians().cos());
    let irradiance = lamp.radiance * solid_angle;
    DirectionalLight { direction: lamp.direction(), irradiance, solid_angle, intensity: irradiance }
}

static MAP: LazyLock<WorkingMap> = LazyLock::new(|| WorkingMap::from_hdr(&sky(64, &[])));

/// Updates a tracker that sees the same place.
fn feed(tracker: &mut Tracker, lamps: &[Lamp]) -> Vec<TrackedLight> {
    let lights: Vec<_> = lamps.iter().map(light).collect();
    tracker.update(&MAP, &lights)
}

#[test]
fn the_first_frame_is_lit_at_once() {
    let lamps = [Lamp::white(0.0, 40.0, 3.0, 10.0), Lamp::white(90.0, 40.0, 3.0, 30.0)];
    let lights = feed(&mut Tracker::new(Params::default()), &lamps);
    assert_eq!(lights.iter().map(|l| l.id).collect::<Vec<_>>(), [1, 0], "the strongest first");
    assert_eq!(lights[0].light, light(&lamps[1]));
}

#[test]
fn lights_are_born_and_die_slowly() {
    let mut tracker = Tracker::new(Params::default());
    feed(&mut tracker, &[]);
    let lamp = Lamp::white(0.0, 40.0, 3.0, 10.0);
    let full = light(&lamp).irradiance.x;
    let born: Vec<f32> = (0..12).map(|_| feed(&mut tracker, &[lamp])[0].light.irradiance.x / full).collect();
    assert!((born[0] - 0.1).abs() < 1e-4 && (born[9] - 1.0).abs() < 1e-4 && born.windows(2).all(|w| w[0] <= w[1]), "{born:?}");
    let dying: Vec<Vec<TrackedLight>> = (0..12).map(|_| feed(&mut tracker, &[])).collect();
    assert!((dying[0][0].light.irradiance.x / full - 0.9).abs() < 1e-4);
    assert!(dying[8].len() == 1 && dying[9].is_empty() && dying[11].is_empty());
    assert_eq!(feed(&mut tracker, &[lamp])[0].id, 1, "it is another light now");
}

#[test]
fn a_light_that_is_missed_for_a_few_frames_stays_the_same() {
    let mut tracker = Tracker::new(Params::default());
    let lamp = Lamp::white(0.0, 40.0, 3.0, 10.0);
    feed(&mut tracker, &[lamp]);
    for _ in 0..5 {
        feed(&mut tracker, &[]);
    }
    assert_eq!(feed(&mut tracker, &[lamp])[0].id, 0);
}

#[test]
fn identities_survive_the_seam_and_the_zenith() {
    let mut tracker = Tracker::new(Params::default());
    for frame in 0..60 {
        // One goes once around behind the viewer's back, the other over the top.
        let around = Lamp::white(150.0 + frame as f32, 30.0, 2.0, 10.0);
        let up = 60.0 + frame as f32;
        let over = if up <= 90.0 { Lamp::white(0.0, up, 2.0, 20.0) } else { Lamp::white(180.0, 180.0 - up, 2.0, 20.0) };
        let lights = feed(&mut tracker, &[around, over]);
        assert_eq!(lights.iter().map(|l| l.id).collect::<Vec<_>>(), [1, 0], "frame {frame}");
        assert!(degrees(lights[1].light.direction, around.direction()) < 4.0, "frame {frame}: {lights:?}");
        assert!(degrees(lights[0].light.direction, over.direction()) < 4.0, "frame {frame}: {lights:?}");
    }
}

#[test]
fn two_lights_side_by_side_keep_their_names() {
    let mut tracker = Tracker::new(Params::default());
    let (weak, strong) = (Lamp::white(0.0, 30.0, 1.0, 10.0), Lamp::white(8.0, 30.0, 1.0, 100.0));
    feed(&mut tracker, &[strong, weak]);
    // They move by more than half their distance, and the order of detection changes.
    let (weak, strong) = (Lamp { yaw: 5.0, ..weak }, Lamp { yaw: 13.0, ..strong });
    let lights = feed(&mut tracker, &[weak, strong]);
    assert_eq!(lights.iter().map(|l| l.id).collect::<Vec<_>>(), [0, 1]);
    assert!(lights[0].light.irradiance.x > 5.0 * lights[1].light.irradiance.x);
}

#[test]
fn a_cut_forgets_and_a_flicker_does_not() {
    let place = |yaw: f32, exposure: f32, sun: f32| {
        let lamps = [-170.0, -120.0, -60.0, 0.0, 75.0].map(|y: f32| Lamp::white(y + yaw, 10.0 + 0.2 * y.abs(), 25.0, 0.9));
        let lamps: Vec<Lamp> = [Lamp::white(30.0, 50.0, 4.0, sun)].into_iter().chain(lamps).collect();
        WorkingMap::from_hdr(&sky(128, &lamps).map(|p| p * exposure))
    };
    let lights = [light(&Lamp::white(30.0, 50.0, 4.0, 50.0))];
    let mut tracker = Tracker::new(Params::default());
    let id = |tracker: &mut Tracker, map: &WorkingMap| tracker.update(map, &lights)[0];
    assert_eq!(id(&mut tracker, &place(0.0, 1.0, 50.0)).id, 0);
    for (exposure, sun) in [(1.0, 5.0), (0.3, 50.0), (2.0, 0.2), (1.0, 500.0)] {
        assert_eq!(id(&mut tracker, &place(0.0, exposure, sun)).id, 0, "exposure {exposure}, sun {sun}");
    }
    let after = id(&mut tracker, &place(97.0, 1.0, 50.0));
    assert_eq!(after.id, 1, "another place");
    assert_eq!(after.light, lights[0], "and lit at once");
    let black = WorkingMap::from_hdr(&RadianceImage::filled(2, 1, Vec3::ZERO));
    tracker.update(&black, &[]);
    assert_eq!(tracker.update(&black, &[]), []);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// However a light flickers, what is shown changes by no more than the smoothing allows.
    #[test]
    fn shown_light_changes_slowly(values in prop::collection::vec(prop::option::of(0.1f32..10.0), 2..60)) {
        let params = Params::default();
        let mut tracker = Tracker::new(params);
        let full = light(&Lamp::white(0.0, 40.0, 3.0, 10.0)).irradiance.x;
        feed(&mut tracker, &[]);
        let mut last = 0.0;
        for value in values {
            let lamps: Vec<Lamp> = value.into_iter().map(|v| Lamp::white(0.0, 40.0, 3.0, v)).collect();
            let shown: f32 = feed(&mut tracker, &lamps).iter().map(|l| l.light.irradiance.x).sum();
            prop_assert!((shown - last).abs() <= full * (params.smoothing + 1.0 / params.fade_frames as f32), "{last} {shown}");
            last = shown;
        }
    }
}
