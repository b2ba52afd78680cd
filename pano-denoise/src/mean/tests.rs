use super::*;
use proptest::prelude::*;

/// A frame of one flat real surface seen head on, whose change is a noisy step.
fn flat(w: usize, h: usize) -> (TracedLayers, RadianceImage) {
    let mut layers = TracedLayers::empty(w, h);
    layers.depth = Image::filled(w, h, 2.0);
    layers.normal = Image::filled(w, h, Vec3::Z);
    layers.albedo = Image::filled(w, h, Vec3::splat(0.5));
    let photo = Image::from_fn(w, h, |x, y| Vec3::splat(0.2 + 0.7 * ((x * 7 + y * 13) % 5) as f32));
    layers.delta = Image::from_fn(w, h, |x, y| photo.get(x, y) * if (x + y) % 2 == 0 { -0.4 } else { -0.6 });
    (layers, photo)
}

#[test]
fn penumbrae_become_smooth_and_the_photo_stays_sharp() {
    let (mut layers, photo) = flat(9, 9);
    let before = layers.delta.clone();
    let penumbra = Image::from_fn(9, 9, |x, _| x < 5);
    let report = filter(&Params::default(), &penumbra, &photo, &mut layers).unwrap();
    for y in 1..8 {
        for x in 1..8 {
            let ratio = layers.delta.get(x, y) / photo.get(x, y);
            if x < 5 {
                // Of nine taps five or four are the darker ones.
                assert!((ratio + 0.5).abs().max_element() < 0.0112, "({x}, {y}): {ratio}");
            } else {
                assert_eq!(layers.delta.get(x, y), before.get(x, y), "outside of the penumbra");
            }
        }
    }
    assert!(report.delta.relative_change().abs() < 0.05 && report.object.magnitude == 0.0, "{report:?}");
}

#[test]
fn surfaces_and_shares_are_kept_apart() {
    let (mut layers, photo) = flat(8, 6);
    // A step in depth after the fourth column; an object's share in the first.
    layers.depth = Image::from_fn(8, 6, |x, _| if x < 4 { 2.0 } else { 5.0 });
    layers.delta = Image::from_fn(8, 6, |x, y| photo.get(x, y) * if x < 4 { -0.5 } else { 0.0 });
    layers.coverage = Image::from_fn(8, 6, |x, _| if x == 0 { 1.0 } else { 0.0 });
    layers.object = Image::from_fn(8, 6, |x, _| if x == 0 { Vec3::splat(9.0) } else { Vec3::ZERO });
    let expected = layers.clone();
    filter(&Params::default(), &Image::filled(8, 6, true), &photo, &mut layers).unwrap();
    for y in 0..6 {
        for x in 1..8 {
            assert!((layers.delta.get(x, y) - expected.delta.get(x, y)).abs().max_element() < 1e-5, "({x}, {y})");
            assert_eq!(layers.object.get(x, y), Vec3::ZERO, "({x}, {y})");
        }
        assert!((layers.object.get(0, y) - 9.0).abs().max_element() < 1e-5);
    }
}

#[test]
fn radius_0_and_no_penumbra_change_nothing() {
    let (layers, photo) = flat(5, 4);
    for (radius, penumbra) in [(0, true), (2, false)] {
        let mut out = layers.clone();
        filter(&Params { radius, ..Params::default() }, &Image::filled(5, 4, penumbra), &photo, &mut out).unwrap();
        for (a, b) in out.delta.data().iter().zip(layers.delta.data()) {
            assert!((*a - *b).abs().max_element() < 1e-6, "radius {radius}");
        }
    }
}

#[test]
fn faulty_arguments_are_named() {
    let (mut layers, photo) = flat(3, 3);
    let penumbra = Image::filled(3, 3, true);
    for (params, word) in [
        (Params { radius: 17, ..Params::default() }, "radius"),
        (Params { sigma_depth: 0.0, ..Params::default() }, "sigma_depth"),
        (Params { sigma_normal: f32::NAN, ..Params::default() }, "sigma_normal"),
        (Params { sigma_albedo: -1.0, ..Params::default() }, "sigma_albedo"),
    ] {
        assert!(filter(&params, &penumbra, &photo, &mut layers).unwrap_err().to_string().contains(word));
    }
    let small = Image::filled(2, 3, true);
    assert!(filter(&Params::default(), &small, &photo, &mut layers).unwrap_err().to_string().contains("penumbra"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn finite_layers_stay_finite(
        w in 1usize..6, h in 1usize..5, values in prop::collection::vec(-1e30f32..1e30, 90), wrap: bool, radius in 0usize..4,
    ) {
        let at = |x: usize, y: usize, k: usize| values[(3 * (y * w + x) + k) % values.len()];
        let mut layers = TracedLayers::empty(w, h);
        layers.coverage = Image::from_fn(w, h, |x, y| at(x, y, 0).abs() % 1.0);
        layers.delta = Image::from_fn(w, h, |x, y| Vec3::new(at(x, y, 0), at(x, y, 1), at(x, y, 2)));
        layers.object = layers.delta.map(|d| d.abs());
        layers.depth = Image::from_fn(w, h, |x, y| at(x, y, 1));
        let photo = layers.object.map(|o| o * 1e-30);
        let params = Params { wrap, radius, ..Params::default() };
        filter(&params, &Image::filled(w, h, true), &photo, &mut layers).unwrap();
        prop_assert!(layers.delta.data().iter().chain(layers.object.data()).all(|v| v.is_finite()));
    }
}
