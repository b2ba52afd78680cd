use super::*;
use pano_core::color::luminance;
use proptest::prelude::*;

/// A frame that shows a wall head-on: the same normal, albedo and depth everywhere.
fn flat(width: usize, height: usize) -> TracedLayers {
    let mut layers = TracedLayers::empty(width, height);
    layers.depth.data_mut().fill(2.0);
    layers.normal.data_mut().fill(Vec3::Z);
    layers.albedo.data_mut().fill(Vec3::splat(0.5));
    layers
}

/// Uniform in [0, 1), by integer hash.
fn random(x: usize, y: usize, seed: u32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
    for _ in 0..2 {
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 13)).wrapping_mul(0x297A_2D39);
    }
    (h >> 8) as f32 / 16_777_216.0
}

/// Noise of zero mean and standard deviation `sigma` in each channel.
fn noise(x: usize, y: usize, sigma: f32) -> Vec3 {
    Vec3::from_array([1, 2, 3].map(|seed| (random(x, y, seed) - 0.5) * 12f32.sqrt() * sigma))
}

fn variance(values: impl Iterator<Item = f32> + Clone) -> f64 {
    let n = values.clone().count() as f64;
    let mean = values.clone().map(f64::from).sum::<f64>() / n;
    values.map(|v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n
}

#[test]
fn a_constant_stays_constant() {
    for wrap in [false, true] {
        let mut layers = flat(17, 9);
        layers.coverage = Image::from_fn(17, 9, |x, y| random(x, y, 7));
        let (object, real) = (Vec3::new(0.3, 5.0, 1e-3), Vec3::new(-0.2, 0.1, 0.0));
        layers.object = layers.coverage.map(|c| object * c);
        layers.delta = layers.coverage.map(|c| real * (1.0 - c));
        let before = layers.clone();
        let report = filter(&Params { wrap, ..Params::default() }, &mut layers).unwrap();
        for i in 0..17 * 9 {
            assert!(layers.object.data()[i].abs_diff_eq(before.object.data()[i], 1e-6), "object {i}");
            assert!(layers.delta.data()[i].abs_diff_eq(before.delta.data()[i], 1e-6), "delta {i}");
        }
        assert!(report.object.relative_change().abs() < 1e-6 && report.delta.relative_change().abs() < 1e-6);
    }
}

#[test]
fn noise_on_a_flat_region_falls_at_least_fourfold() {
    // From a nearly converged picture to one whose noise exceeds its mean.
    for sigma in [1e-3, 0.1, 1.5] {
        let mut layers = flat(64, 64);
        layers.delta = Image::from_fn(64, 64, |x, y| Vec3::splat(-1.0) + noise(x, y, sigma));
        let before = variance(layers.delta.data().iter().map(|&v| luminance(v)));
        let report = filter(&Params::default(), &mut layers).unwrap();
        let after = variance(layers.delta.data().iter().map(|&v| luminance(v)));
        assert!(after * 4.0 < before, "σ {sigma}: variance {before} became {after}");
        assert!(report.delta.relative_change().abs() < 0.02, "σ {sigma}: {:?}", report.delta);
    }
}

#[test]
fn rare_bright_samples_are_spread_too() {
    // One pixel in ten is lit, tenfold: what a path tracer makes of a small lamp with few samples.
    let mut layers = flat(64, 64);
    layers.delta = Image::from_fn(64, 64, |x, y| Vec3::splat(if random(x, y, 4) < 0.1 { 10.0 } else { 0.0 }));
    let before = variance(layers.delta.data().iter().map(|v| v.y));
    let report = filter(&Params::default(), &mut layers).unwrap();
    let after = variance(layers.delta.data().iter().map(|v| v.y));
    assert!(after * 4.0 < before, "variance {before} became {after}");
    assert!(report.delta.relative_change().abs() < 0.1, "{:?}", report.delta);
}

/// Filters a noisy step at column 16 of a frame whose guides `prepare` sets, and returns the worst deviation, in column
/// 15 and 16, of the column's mean from the truth (0.2 on the left, 1.0 on the right).
fn step_error(prepare: impl Fn(&mut TracedLayers)) -> f32 {
    let mut layers = flat(32, 64);
    prepare(&mut layers);
    let truth = |x: usize| if x < 16 { 0.2 } else { 1.0 };
    // Noise above the step: only the guide can keep the sides apart.
    layers.delta = Image::from_fn(32, 64, |x, y| (Vec3::splat(truth(x)) + noise(x, y, 1.0)) * (1.0 - layers.coverage.get(x, y)));
    let column = |image: &Image<Vec3>, x: usize| (0..64).map(|y| luminance(image.get(x, y))).sum::<f32>() / 64.0;
    let before = layers.delta.clone();
    filter(&Params::default(), &mut layers).unwrap();
    // Against the noisy side's own mean: five columns are averaged, three of which are on this side.
    let side = |from: usize| (from..from + 3).map(|x| column(&before, x)).sum::<f32>() / 3.0;
    (column(&layers.delta, 15) - side(13)).abs().max((column(&layers.delta, 16) - side(16)).abs())
}

#[test]
fn an_edge_in_each_guide_is_kept() {
    let right = |image: &mut Image<Vec3>, value: Vec3| {
        for y in 0..64 {
            (16..32).for_each(|x| image.set(x, y, value));
        }
    };
    assert!(step_error(|_| ()) > 0.2, "without a guide a step below the noise is blurred: the test means something");
    type Prepare = Box<dyn Fn(&mut TracedLayers)>;
    let cases: [(&str, Prepare); 5] = [
        ("depth", Box::new(|l| l.depth = Image::from_fn(32, 64, |x, _| if x < 16 { 2.0 } else { 2.4 }))),
        ("sky", Box::new(|l| l.depth = Image::from_fn(32, 64, |x, _| if x < 16 { 2.0 } else { f32::INFINITY }))),
        ("normal", Box::new(move |l| right(&mut l.normal, Vec3::Y))),
        ("no normal", Box::new(move |l| right(&mut l.normal, Vec3::ZERO))),
        ("albedo", Box::new(move |l| right(&mut l.albedo, Vec3::new(0.9, 0.5, 0.1)))),
    ];
    for (name, prepare) in cases {
        let error = step_error(prepare);
        assert!(error < 0.06, "{name}: {error}");
    }
}

#[test]
fn coverage_separates_object_and_real_surface() {
    let mut layers = flat(32, 16);
    layers.coverage = Image::from_fn(32, 16, |x, _| if x < 16 { 0.0 } else { 1.0 });
    layers.object = Image::from_fn(32, 16, |x, y| if x < 16 { Vec3::ZERO } else { Vec3::ONE + noise(x, y, 0.3) });
    layers.delta = Image::from_fn(32, 16, |x, y| if x < 16 { noise(x, y, 0.3) - Vec3::ONE } else { Vec3::ZERO });
    filter(&Params::default(), &mut layers).unwrap();
    for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
        if x < 16 {
            assert_eq!(layers.object.get(x, y), Vec3::ZERO);
            assert!(layers.delta.get(x, y).max_element() < -0.3, "{x} {y}: {}", layers.delta.get(x, y));
        } else {
            assert_eq!(layers.delta.get(x, y), Vec3::ZERO);
            assert!(layers.object.get(x, y).min_element() > 0.3, "{x} {y}: {}", layers.object.get(x, y));
        }
    }
}

#[test]
fn a_converged_shadow_edge_and_a_mirror_image_stay() {
    // A shadow's edge, horizontal, vertical and diagonal.
    for edge in [|x: usize, _: usize| x < 16, |_, y| y < 16, |x, y| x + y < 32] {
        let mut layers = flat(32, 32);
        layers.delta = Image::from_fn(32, 32, |x, y| if edge(x, y) { Vec3::splat(-1.0) } else { Vec3::ZERO });
        let before = layers.delta.clone();
        filter(&Params::default(), &mut layers).unwrap();
        assert_eq!(layers.delta, before);
    }
    // A mirror shows thin stripes and a gradient, with little noise: the detail stays, most of the noise goes.
    let truth = |x: usize, y: usize| Vec3::splat(if x.is_multiple_of(4) { 3.0 } else { 1.0 } + 0.01 * y as f32);
    let mut layers = flat(64, 64);
    layers.coverage.data_mut().fill(1.0);
    layers.object = Image::from_fn(64, 64, |x, y| truth(x, y) + noise(x, y, 0.02));
    let rms = |image: &Image<Vec3>| {
        let sum: f32 = (0..64 * 64).map(|i| (image.data()[i] - truth(i % 64, i / 64)).length_squared()).sum();
        (sum / (64.0 * 64.0)).sqrt()
    };
    let before = rms(&layers.object);
    filter(&Params::default(), &mut layers).unwrap();
    let after = rms(&layers.object);
    assert!(after < 0.7 * before, "{before} became {after}");
}

#[test]
fn a_noisy_shadow_edge_keeps_its_contrast() {
    let mut layers = flat(32, 64);
    layers.delta = Image::from_fn(32, 64, |x, y| Vec3::splat(if x < 16 { -1.0 } else { -0.1 }) + noise(x, y, 0.15));
    filter(&Params::default(), &mut layers).unwrap();
    let column = |x: usize| (0..64).map(|y| layers.delta.get(x, y).y).sum::<f32>() / 64.0;
    let contrast = column(16) - column(15);
    assert!(contrast > 0.9 * 0.9, "contrast across the edge: {contrast} of 0.9");
}

#[test]
fn a_grazing_plane_is_filtered_and_the_unit_of_depth_is_irrelevant() {
    // A floor 1.5 below the eye, seen down to 3° below the horizon: depth doubles within a few rows.
    let depth = |scale: f32| Image::from_fn(32, 32, |_, y| scale * 1.5 / ((3.0 + 0.5 * y as f32).to_radians()).sin());
    let mut results = vec![];
    for scale in [1.0, 1024.0, 1.0 / 1024.0] {
        let mut layers = flat(32, 32);
        layers.depth = depth(scale);
        layers.normal.data_mut().fill(Vec3::Y);
        layers.delta = Image::from_fn(32, 32, |x, y| noise(x, y, 0.2) - Vec3::ONE);
        let before = variance(layers.delta.data().iter().map(|&v| v.y));
        filter(&Params::default(), &mut layers).unwrap();
        let after = variance(layers.delta.data().iter().map(|&v| v.y));
        assert!(after * 4.0 < before, "scale {scale}: variance {before} became {after}");
        results.push(layers.delta);
    }
    // Powers of two scale depths exactly.
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

#[test]
fn zeros_far_from_anything_stay_exactly_zero() {
    let mut layers = flat(16, 16);
    layers.delta.set(8, 8, Vec3::splat(-1.0));
    layers.delta.set(0, 0, Vec3::splat(-0.0));
    layers.delta.set(15, 0, Vec3::splat(-0.0));
    let before = layers.delta.clone();
    filter(&Params { wrap: true, delta_passes: 1, ..Params::default() }, &mut layers).unwrap();
    for (x, y) in (0usize..16).flat_map(|y| (0usize..16).map(move |x| (x, y))) {
        if x.abs_diff(8) > 2 || y.abs_diff(8) > 2 {
            assert_eq!(layers.delta.get(x, y).to_array().map(f32::to_bits), before.get(x, y).to_array().map(f32::to_bits));
        }
    }
}

#[test]
fn a_pixel_that_is_not_finite_stays_alone() {
    let mut layers = flat(9, 9);
    layers.delta = Image::from_fn(9, 9, |x, y| Vec3::ONE + noise(x, y, 0.1));
    layers.delta.set(4, 4, Vec3::new(f32::NAN, 0.0, f32::INFINITY));
    filter(&Params::default(), &mut layers).unwrap();
    assert_eq!(layers.delta.data().iter().filter(|v| !v.is_finite()).count(), 1);
}

#[test]
fn infinite_sigmas_average_the_window() {
    let off = f32::INFINITY;
    let params = Params {
        wrap: true,
        sigma_space: off,
        sigma_depth: off,
        sigma_normal: off,
        sigma_albedo: off,
        sigma_radiance: off,
        delta_passes: 1,
    };
    let mut layer = Image::filled(5, 5, Vec3::ZERO);
    layer.set(2, 2, Vec3::splat(25.0));
    let guides = flat(5, 5);
    let guides = Guides { depth: &guides.depth, normal: &guides.normal, albedo: &guides.albedo };
    filter_layer(&params, &guides, &Image::filled(5, 5, 1.0), &mut layer).unwrap();
    assert!(layer.get(2, 2).abs_diff_eq(Vec3::ONE, 1e-6), "{}", layer.get(2, 2));
}

#[test]
fn bad_arguments_are_named() {
    let mut layers = flat(4, 4);
    for sigma in [0.0, -1.0, f32::NAN] {
        let error = filter(&Params { sigma_depth: sigma, ..Params::default() }, &mut layers).unwrap_err();
        assert!(error.to_string().contains("sigma_depth"), "{error}");
    }
    layers.albedo = Image::filled(4, 3, Vec3::ZERO);
    let error = filter(&Params::default(), &mut layers).unwrap_err().to_string();
    assert!(error.contains("albedo has 4×3 pixels, the layer 4×4"), "{error}");
}

/// Layers with every kind of finite value, depth also infinite or NaN.
fn any_layers() -> impl Strategy<Value = TracedLayers> {
    (1usize..8, 1usize..8).prop_flat_map(|(w, h)| {
        let real = prop_oneof![Just(0.0f32), -1.0f32..1.0, Just(1e-40), Just(f32::MAX), Just(f32::MIN), Just(-1e5)];
        let vec = (real.clone(), real.clone(), real.clone()).prop_map(|(x, y, z)| Vec3::new(x, y, z));
        let share = prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..1.0, Just(1e-40), Just(1.0 - 1e-7)];
        let depth = prop_oneof![
            Just(0.0f32),
            Just(f32::NAN),
            Just(f32::INFINITY),
            Just(1e-40),
            Just(1e-6),
            Just(1e9),
            0.1f32..10.0,
            Just(f32::MAX)
        ];
        let n = w * h;
        let vecs = move |s: &BoxedStrategy<Vec3>| proptest::collection::vec(s.clone(), n);
        let vec = vec.boxed();
        (vecs(&vec), vecs(&vec), vecs(&vec), vecs(&vec), proptest::collection::vec(share, n), proptest::collection::vec(depth, n))
            .prop_map(move |(object, delta, normal, albedo, coverage, depth)| {
                fn image<T: Copy>(w: usize, h: usize, data: Vec<T>) -> Image<T> {
                    Image::from_vec(w, h, data).unwrap()
                }
                TracedLayers {
                    object: image(w, h, object),
                    coverage: image(w, h, coverage),
                    delta: image(w, h, delta),
                    depth: image(w, h, depth),
                    normal: image(w, h, normal),
                    albedo: image(w, h, albedo),
                }
            })
    })
}

/// `image`, `by` columns to the right.
fn rolled<T: Copy>(image: &Image<T>, by: usize) -> Image<T> {
    let (w, h) = image.size();
    Image::from_fn(w, h, |x, y| image.get((x + w - by % w) % w, y))
}

fn bits(image: &Image<Vec3>) -> Vec<[u32; 3]> {
    image.data().iter().map(|v| v.to_array().map(f32::to_bits)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn finite_input_gives_finite_output(mut layers in any_layers(), wrap: bool) {
        let before = layers.clone();
        let report = filter(&Params { wrap, ..Params::default() }, &mut layers).unwrap();
        prop_assert!(layers.object.data().iter().chain(layers.delta.data()).all(|v| v.is_finite()));
        prop_assert!(report.object.relative_change().is_finite() && report.delta.relative_change().is_finite());
        for i in 0..layers.coverage.data().len() {
            let coverage = layers.coverage.data()[i];
            prop_assert!(coverage > 0.0 || layers.object.data()[i] == before.object.data()[i]);
            prop_assert!(coverage < 1.0 || layers.delta.data()[i] == before.delta.data()[i]);
        }
    }

    #[test]
    fn a_rolled_panorama_gives_the_rolled_result(layers in any_layers(), by in 0usize..8) {
        let params = Params { wrap: true, ..Params::default() };
        let mut turned = TracedLayers {
            object: rolled(&layers.object, by),
            coverage: rolled(&layers.coverage, by),
            delta: rolled(&layers.delta, by),
            depth: rolled(&layers.depth, by),
            normal: rolled(&layers.normal, by),
            albedo: rolled(&layers.albedo, by),
        };
        let mut plain = layers;
        filter(&params, &mut plain).unwrap();
        filter(&params, &mut turned).unwrap();
        prop_assert_eq!(bits(&rolled(&plain.object, by)), bits(&turned.object));
        prop_assert_eq!(bits(&rolled(&plain.delta, by)), bits(&turned.delta));
    }
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let run = |threads: usize| {
        let mut layers = flat(33, 17);
        layers.coverage = Image::from_fn(33, 17, |x, y| random(x, y, 9));
        layers.object = Image::from_fn(33, 17, |x, y| noise(x, y, 1.0));
        layers.delta = Image::from_fn(33, 17, |x, y| noise(y, x, 1.0));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let report = pool.install(|| filter(&Params::default(), &mut layers)).unwrap();
        (bits(&layers.object), bits(&layers.delta), report)
    };
    assert!(run(1) == run(2));
}
