use super::*;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};

/// A wall straight ahead.
fn wall(w: usize, h: usize) -> (Image<f32>, Image<Vec3>) {
    (Image::filled(w, h, 2.0), Image::filled(w, h, Vec3::Z))
}

fn ones(w: usize, h: usize) -> Image<f32> {
    Image::filled(w, h, 1.0)
}

fn noise(w: usize, h: usize, mean: f32, deviation: f32, seed: u64) -> Image<Vec3> {
    let mut random = StdRng::seed_from_u64(seed);
    // Twelve uniform numbers make a normal one.
    Image::from_fn(w, h, |_, _| {
        let normal: f32 = (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
        Vec3::splat(mean + deviation * normal)
    })
}

fn run(params: &Params, (depth, normal): &(Image<f32>, Image<Vec3>), variance: f32, signal: &mut Image<Vec3>) -> Energy {
    let (w, h) = signal.size();
    filter(params, &Guides { depth, normal }, &ones(w, h), &mut Image::filled(w, h, variance), signal).unwrap()
}

fn deviation(image: &Image<Vec3>) -> f32 {
    let n = image.data().len() as f32;
    let mean = image.data().iter().map(|v| v.y).sum::<f32>() / n;
    (image.data().iter().map(|v| (v.y - mean).powi(2)).sum::<f32>() / n).sqrt()
}

/// Five passes average about a thousand pixels: noise falls by far more than ten.
#[test]
fn noise_on_a_wall_is_averaged_away() {
    let mut signal = noise(160, 128, 1.0, 0.2, 1);
    let energy = run(&Params::default(), &wall(160, 128), 0.04, &mut signal);
    assert!(deviation(&signal) < 0.2 / 12.0, "{}", deviation(&signal));
    assert!(energy.relative_change().abs() < 0.01, "{energy:?}");
}

/// One light pixel spreads over 65 pixels, the last pass's window, and no farther than all windows together.
#[test]
fn the_window_is_that_of_the_paper() {
    let mut signal = Image::filled(161, 161, Vec3::ZERO);
    signal.set(80, 80, Vec3::ONE);
    let params = Params { sigma_luminance: f32::INFINITY, ..Params::default() };
    run(&params, &wall(161, 161), 1.0, &mut signal);
    let lit = |x: usize| signal.get(x, 80).x > 0.0;
    assert!(lit(80 - 32) && lit(80 + 32), "the window of the last pass");
    assert!(lit(80 - 62) && lit(80 + 62) && !lit(80 - 63) && !lit(80 + 63), "2·(1 + 2 + 4 + 8 + 16)");
    let sum: f32 = signal.data().iter().map(|v| v.x).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
}

/// A shadow edge of ten standard deviations stays where it is.
#[test]
fn edges_above_the_noise_stay() {
    let (w, h) = (96, 64);
    let mut signal = noise(w, h, 0.0, 0.02, 2);
    for y in 0..h {
        for x in w / 2..w {
            signal.set(x, y, signal.get(x, y) + 0.5);
        }
    }
    run(&Params::default(), &wall(w, h), 0.0004, &mut signal);
    for y in 0..h {
        assert!(signal.get(w / 2 - 1, y).x < 0.05 && signal.get(w / 2, y).x > 0.45, "row {y}");
    }
}

/// Nothing crosses a step in depth, a fold, or the border of another thing's share.
#[test]
fn guides_stop_the_filter() {
    let (w, h) = (64, 32);
    let half = |x: usize| x >= w / 2;
    let (depth, normal) = wall(w, h);
    let step = (Image::from_fn(w, h, |x, _| if half(x) { 3.0 } else { 2.0 }), normal.clone());
    let fold = (depth.clone(), Image::from_fn(w, h, |x, _| if half(x) { Vec3::X } else { Vec3::Z }));
    let params = Params { sigma_luminance: f32::INFINITY, ..Params::default() };
    for (what, surfaces) in [("step", &step), ("fold", &fold)] {
        let mut signal = Image::from_fn(w, h, |x, _| Vec3::splat(if half(x) { 1.0 } else { 0.0 }));
        run(&params, surfaces, 1.0, &mut signal);
        assert!(signal.get(w / 2 - 1, 7).x < 1e-3 && signal.get(w / 2, 7).x > 0.999, "{what}");
    }
    let share = Image::from_fn(w, h, |x, _| if half(x) { 0.0 } else { 1.0 });
    let mut signal = Image::from_fn(w, h, |x, _| Vec3::splat(if half(x) { 7.0 } else { 1.0 }));
    filter(&params, &Guides { depth: &depth, normal: &normal }, &share, &mut Image::filled(w, h, 1.0), &mut signal).unwrap();
    assert!(signal.data().iter().enumerate().all(|(i, v)| (v.x - if half(i % w) { 7.0 } else { 1.0 }).abs() < 1e-6));
}

#[test]
fn bad_arguments_are_named() {
    let (depth, normal) = wall(4, 4);
    let guides = Guides { depth: &depth, normal: &normal };
    let call = |params: &Params, share: &Image<f32>| {
        filter(params, &guides, share, &mut ones(4, 4), &mut Image::filled(4, 4, Vec3::ONE)).unwrap_err().to_string()
    };
    assert!(call(&Params { sigma_depth: 0.0, ..Params::default() }, &ones(4, 4)).contains("sigma_depth"));
    assert!(call(&Params { levels: 9, ..Params::default() }, &ones(4, 4)).contains("levels"));
    assert!(call(&Params::default(), &ones(5, 4)).contains("share"));
}

fn value() -> impl Strategy<Value = f32> {
    prop_oneof![6 => -2.0f32..10.0, 1 => Just(0.0), 1 => prop_oneof![Just(f32::MAX), Just(f32::MIN), Just(1e-38f32), Just(1e30f32)]]
}

fn depth_value() -> impl Strategy<Value = f32> {
    prop_oneof![5 => 0.5f32..5.0, 1 => prop_oneof![Just(0.0), Just(f32::NAN), Just(f32::INFINITY), Just(1e-38f32), Just(1e9f32)]]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn finite_input_gives_finite_output(
        (w, h, signal, depth, share, variance) in (1usize..14, 1usize..10).prop_flat_map(|(w, h)| {
            let n = w * h;
            (
                Just(w), Just(h),
                prop::collection::vec((value(), value(), value()), n),
                prop::collection::vec(depth_value(), n),
                prop::collection::vec(prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..1.0, Just(1e-30)], n),
                prop::collection::vec(prop_oneof![Just(0.0f32), 0.0f32..1.0, Just(f32::MAX)], n),
            )
        }),
        wrap: bool,
    ) {
        let depth = Image::from_vec(w, h, depth).unwrap();
        let normal = Image::from_fn(w, h, |x, y| [Vec3::Z, Vec3::X, Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8)][(x * 7 + y * 3) % 4]);
        let mut signal = Image::from_vec(w, h, signal.into_iter().map(Vec3::from).collect()).unwrap();
        let mut variance = Image::from_vec(w, h, variance).unwrap();
        let share = Image::from_vec(w, h, share).unwrap();
        let params = Params { wrap, ..Params::default() };
        filter(&params, &Guides { depth: &depth, normal: &normal }, &share, &mut variance, &mut signal).unwrap();
        prop_assert!(signal.data().iter().all(|v| v.is_finite()));
        prop_assert!(variance.data().iter().all(|v| v.is_finite() && *v >= 0.0));
    }

    #[test]
    fn a_constant_picture_stays(value in 0.0f32..100.0, variance in 0.0f32..10.0, w in 1usize..40, h in 1usize..20, wrap: bool) {
        let mut signal = Image::filled(w, h, Vec3::splat(value));
        run(&Params { wrap, ..Params::default() }, &wall(w, h), variance, &mut signal);
        prop_assert!(signal.data().iter().all(|v| (v.x - value).abs() <= 1e-5 * value), "{value}");
    }

    /// In a panorama there is no first column.
    #[test]
    fn rolling_the_input_rolls_the_output(seed: u64, by in 1usize..32) {
        let (w, h) = (32, 16);
        let mut random = StdRng::seed_from_u64(seed);
        let depth = Image::from_fn(w, h, |x, _| if x % 11 < 4 { 1.5f32 } else { 3.0 });
        let normal = Image::from_fn(w, h, |_, y| if y < 9 { Vec3::Z } else { Vec3::Y });
        let signal = Image::from_fn(w, h, |_, _| Vec3::new(random.random(), random.random(), random.random()));
        let roll = |x: usize| (x + by) % w;
        let params = Params { wrap: true, ..Params::default() };
        let mut plain = signal.clone();
        run(&params, &(depth.clone(), normal.clone()), 0.05, &mut plain);
        let mut rolled = Image::from_fn(w, h, |x, y| signal.get(roll(x), y));
        let surfaces = (Image::from_fn(w, h, |x, y| depth.get(roll(x), y)), Image::from_fn(w, h, |x, y| normal.get(roll(x), y)));
        run(&params, &surfaces, 0.05, &mut rolled);
        for y in 0..h {
            for x in 0..w {
                prop_assert!(rolled.get(x, y).distance(plain.get(roll(x), y)) < 1e-6, "({x}, {y})");
            }
        }
    }
}
