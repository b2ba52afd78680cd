use super::*;
use pano_core::image::Image;
use proptest::prelude::*;

/// A dark photo, and the same with a bright spot of an object in the middle.
fn spot(size: usize, brightness: f32) -> (RadianceImage, RadianceImage) {
    let photo = Image::from_fn(size, size, |x, y| Vec3::splat(0.1 + 0.01 * ((x * 3 + y) % 7) as f32));
    let mut picture = photo.clone();
    picture.set(size / 2, size / 2, Vec3::splat(brightness));
    (photo, picture)
}

fn bloom_of(bloom: f32) -> Params {
    Params { bloom, ..Params::default() }
}

#[test]
fn off_is_off_to_the_bit() {
    let (photo, picture) = spot(32, 50.0);
    let mut out = picture.clone();
    let report = apply(&Params::default(), &photo, &mut out).unwrap();
    assert_eq!(out, picture);
    assert_eq!((report.spread, report.change), (0.0, 0.0));
}

#[test]
fn bloom_spreads_a_gaussian_and_keeps_the_light() {
    let (photo, picture) = spot(129, 101.0);
    for radius in [0.02, 0.06] {
        let mut out = picture.clone();
        let report = apply(&Params { radius, ..bloom_of(0.2) }, &photo, &mut out).unwrap();
        assert!((report.spread - 20.0).abs() < 1e-3 && report.change.abs() < 0.02, "{report:?}");
        let added = |x: usize, y: usize| f64::from(out.get(x, y).x - picture.get(x, y).x);
        assert!((out.get(64, 64).x - 81.0) < 3.0, "a fifth is taken away: {}", out.get(64, 64));
        let sigma = f64::from(radius) * 129.0;
        let variance = (0..129 * 129)
            .filter(|i| *i != 64 * 129 + 64)
            .map(|i| added(i % 129, i / 129) * ((i % 129) as f64 - 64.0).powi(2))
            .sum::<f64>()
            / 20.0;
        // The reduced map's pixels and its bilinear lookup widen it a little.
        assert!((variance.sqrt() / sigma - 1.0).abs() < 0.12, "{} {sigma}", variance.sqrt());
    }
}

#[test]
fn glare_follows_the_equations() {
    let (photo, picture) = spot(65, 1001.5);
    let params = Params { glare: 0.4, passes: 2, attenuation: 0.9, ..Params::default() };
    let mut out = picture.clone();
    let report = apply(&params, &photo, &mut out).unwrap();
    assert!((report.spread - 400.0).abs() < 0.1 && report.change.abs() < 0.05, "{report:?}");
    // Pass 1 steps by one pixel, pass 2 by four: at distance i = s₁ + 4·s₂ there is a^i of the ray's sum.
    let total: f32 = (0..16).map(|i| 0.9f32.powi(i)).sum();
    for i in 1..16usize {
        let expected = 0.25 * 400.0 * 0.9f32.powi(i as i32) / total;
        for (x, y) in [(32 + i, 32 + i), (32 - i, 32 + i), (32 + i, 32 - i), (32 - i, 32 - i)] {
            let found = out.get(x, y).x - picture.get(x, y).x;
            assert!((found / expected - 1.0).abs() < 1e-3, "({x}, {y}): {found} {expected}");
        }
    }
    assert_eq!(out.get(32, 40), picture.get(32, 40), "rays are diagonal");
    assert_eq!(out.get(49, 49), picture.get(49, 49), "and end");
}

#[test]
fn the_photo_s_own_lights_are_left_alone_unless_asked_for() {
    let mut photo = RadianceImage::filled(40, 20, Vec3::splat(0.2));
    photo.set(10, 10, Vec3::splat(80.0));
    let params = Params { glare: 0.2, ..bloom_of(0.2) };
    let mut out = photo.clone();
    assert_eq!(apply(&params, &photo, &mut out).unwrap().spread, 0.0);
    assert_eq!(out, photo);
    let report = apply(&Params { everything: true, ..params }, &photo, &mut out).unwrap();
    assert!(report.spread > 10.0 && out.get(12, 12).x > photo.get(12, 12).x && out.get(10, 10).x < 80.0);
}

#[test]
fn what_lies_beyond_the_reach_keeps_its_bits() {
    let (photo, picture) = spot(128, 60.0);
    let mut out = picture.clone();
    apply(&Params { glare: 0.2, passes: 2, ..bloom_of(0.2) }, &photo, &mut out).unwrap();
    for (x, y) in [(0, 0), (64, 5), (120, 60), (127, 127)] {
        assert_eq!(out.get(x, y), picture.get(x, y), "({x}, {y})");
    }
}

#[test]
fn a_panorama_wraps() {
    let photo = RadianceImage::filled(64, 32, Vec3::ZERO);
    let mut picture = photo.clone();
    picture.set(63, 16, Vec3::splat(50.0));
    let params = Params { wrap: true, glare: 0.2, radius: 0.1, ..bloom_of(0.3) };
    let report = apply(&params, &photo, &mut picture).unwrap();
    assert!(picture.get(0, 16).x > 0.0 && (picture.get(0, 16).x / picture.get(62, 16).x - 1.0).abs() < 1e-4);
    assert!(report.change.abs() < 2.0, "only over the poles light is lost: {report:?}");
    let mut flat = photo.clone();
    flat.set(63, 16, Vec3::splat(50.0));
    let lost = apply(&Params { wrap: false, ..params }, &photo, &mut flat).unwrap();
    assert!(lost.change < -5.0 && flat.get(0, 16) == Vec3::ZERO, "{lost:?}");
}

#[test]
fn faulty_arguments_are_named() {
    let (photo, mut picture) = spot(8, 2.0);
    let d = Params::default();
    for (params, word) in [
        (bloom_of(1.5), "bloom"),
        (Params { glare: f32::NAN, ..d }, "glare"),
        (Params { threshold: -1.0, ..d }, "threshold"),
        (Params { radius: 0.0, ..d }, "radius"),
        (Params { attenuation: 1.0, ..d }, "attenuation"),
        (Params { passes: 0, ..d }, "passes"),
        (Params { glare: 0.7, ..bloom_of(0.7) }, "together"),
    ] {
        assert!(apply(&params, &photo, &mut picture).unwrap_err().to_string().contains(word), "{word}");
    }
    assert!(apply(&d, &RadianceImage::filled(2, 2, Vec3::ZERO), &mut picture).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn output_is_finite_and_no_light_is_made(
        w in 1usize..12, h in 1usize..12, values in prop::collection::vec(0.0f32..1e30, 60), bloom in 0.0f32..0.5, glare in 0.0f32..0.5,
        threshold in 0.0f32..10.0, radius in 0.001f32..0.25, attenuation in 0.5f32..0.99, passes in 1u32..=4, everything: bool, wrap: bool,
    ) {
        let photo = Image::from_fn(w, h, |x, y| Vec3::splat(values[(x * 5 + y) % 60]));
        let mut picture = Image::from_fn(w, h, |x, y| Vec3::new(values[(x + y * 7) % 60], values[(x * 3 + y) % 60], 0.5));
        let params = Params { bloom, glare, threshold, radius, attenuation, passes, everything, wrap };
        let report = apply(&params, &photo, &mut picture).unwrap();
        prop_assert!(picture.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
        prop_assert!(report.change <= 1e-3 * report.before + 1e-3, "{report:?}");
    }
}
