use super::*;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};

/// A frame of one wall.
struct Scene {
    depth: Image<f32>,
    normal: Image<Vec3>,
    thing: Image<u32>,
    previous: Image<Vec2>,
}

impl Scene {
    fn still(w: usize, h: usize) -> Self {
        Self {
            depth: Image::filled(w, h, 2.0),
            normal: Image::filled(w, h, Vec3::Z),
            thing: Image::filled(w, h, 0),
            previous: Image::from_fn(w, h, |x, y| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)),
        }
    }

    fn guides(&self) -> Guides<'_> {
        Guides {
            depth: &self.depth,
            normal: &self.normal,
            thing: &self.thing,
            previous: &self.previous,
            previous_depth: &self.depth,
            sharp: None,
            level: None,
        }
    }
}

fn noisy(w: usize, h: usize, seed: u64) -> Image<Vec3> {
    let mut random = StdRng::seed_from_u64(seed);
    Image::from_fn(w, h, |_, _| Vec3::splat(random.random_range(0.0..2.0)))
}

fn deviation(image: &Image<Vec3>) -> f32 {
    (image.data().iter().map(|v| (v.x - 1.0).powi(2)).sum::<f32>() / image.data().len() as f32).sqrt()
}

/// Frames count equally at first. What moves then blends by a tenth: noise falls to √(0.1 / 1.9) = 1/4.4; what stays by 1/32,
/// to √(1 / 63) = 1/7.9. The frames told are the ones that noise is worth.
#[test]
fn noise_falls_with_the_frames() {
    let (w, h) = (48, 40);
    for (motion, limit) in [(1.0, 4.36), (0.0, 7.94)] {
        let mut scene = Scene::still(w, h);
        scene.previous = Image::from_fn(w, h, |x, y| Vec2::new((x as f32 + motion) % w as f32 + 0.5, y as f32 + 0.5));
        let params = Params { clamp: f32::INFINITY, ..Params::default() };
        let (mut history, mut first, mut last, mut squares) = (None, 0.0, 0.0, 0.0);
        for frame in 0..200 {
            let mut signal = noisy(w, h, frame);
            accumulate(&params, &scene.guides(), None, &mut signal, &mut history).unwrap();
            match frame {
                0 => first = deviation(&signal),
                8 => assert!((first / deviation(&signal) - 3.0).abs() < 0.2, "nine frames"),
                192.. => {
                    last = deviation(&signal);
                    squares += last * last / 8.0;
                }
                _ => {}
            }
        }
        assert!((first / squares.sqrt() / limit - 1.0).abs() < 0.05, "{first} {last} {limit}");
        let frames = history.unwrap().frames().get(20, 20);
        assert!((frames / limit.powi(2) - 1.0).abs() < 0.02, "{frames} {limit}");
    }
}

/// A scene that moves by two and a half pixels a frame keeps its history.
#[test]
fn history_follows_motion() {
    let (w, h) = (64, 16);
    let picture = |x: f32| Vec3::splat((0.2 * x).sin() + 2.0);
    let mut scene = Scene::still(w, h);
    scene.previous = Image::from_fn(w, h, |x, y| Vec2::new(x as f32 + 3.0, y as f32 + 0.5));
    let params = Params { clamp: f32::INFINITY, ..Params::default() };
    let mut history = None;
    for frame in 0..10 {
        let mut signal = Image::from_fn(w, h, |x, _| picture(x as f32 + 2.5 * frame as f32));
        accumulate(&params, &scene.guides(), None, &mut signal, &mut history).unwrap();
        for x in 0..w / 2 {
            let exact = picture(x as f32 + 2.5 * frame as f32);
            // Each frame interpolates between texels once more.
            assert!((signal.get(x, 5).x - exact.x).abs() < 0.05, "frame {frame}, column {x}");
        }
    }
    let history = history.unwrap();
    assert_eq!(history.frames().get(0, 5).round(), 10.0);
    assert_eq!(history.frames().get(w - 1, 5), 1.0, "what comes into view is new");
}

/// What was hidden, is another thing, is turned, or lies at another depth starts anew.
#[test]
fn what_was_not_seen_has_no_history() {
    let (w, h) = (8, 8);
    let change = |what: usize, scene: &mut Scene| match what {
        0 => scene.thing.set(3, 3, 1),
        1 => scene.normal.set(3, 3, Vec3::X),
        2 => scene.depth.set(3, 3, 2.5),
        3 => scene.previous.set(3, 3, Vec2::NAN),
        4 => scene.previous.set(3, 3, Vec2::new(-4.0, 3.0)),
        _ => scene.depth.set(3, 3, f32::INFINITY),
    };
    for what in 0..6 {
        let mut history = None;
        let scene = Scene::still(w, h);
        accumulate(&Params::default(), &scene.guides(), None, &mut Image::filled(w, h, Vec3::ZERO), &mut history).unwrap();
        let mut next = Scene::still(w, h);
        change(what, &mut next);
        let mut signal = Image::filled(w, h, Vec3::ONE);
        let params = Params { clamp: f32::INFINITY, ..Params::default() };
        accumulate(&params, &next.guides(), None, &mut signal, &mut history).unwrap();
        assert_eq!(signal.get(3, 3), Vec3::ONE, "case {what}");
        assert_eq!(signal.get(5, 5), Vec3::splat(0.5), "case {what}");
    }
}

/// A shadow that jumps leaves no ghost, and another size or no history leaves the signal alone.
#[test]
fn ghosts_are_clamped_away() {
    let scene = Scene::still(32, 32);
    let mut history = None;
    let dark = |x: usize, from: usize| Vec3::splat(if (from..from + 8).contains(&x) { 0.0 } else { 1.0 });
    for _ in 0..20 {
        accumulate(&Params::default(), &scene.guides(), None, &mut Image::from_fn(32, 32, |x, _| dark(x, 2)), &mut history)
            .unwrap();
    }
    let mut moved = Image::from_fn(32, 32, |x, _| dark(x, 20));
    accumulate(&Params::default(), &scene.guides(), None, &mut moved, &mut history).unwrap();
    // In the middle of both stripes the neighbourhood is flat and the old value is worth nothing.
    assert!(moved.get(5, 16).x > 0.999 && moved.get(23, 16).x < 1e-3, "{} {}", moved.get(5, 16), moved.get(23, 16));
    let small = Scene::still(16, 16);
    let mut signal = noisy(16, 16, 1);
    let before = signal.clone();
    accumulate(&Params::default(), &small.guides(), None, &mut signal, &mut history).unwrap();
    assert_eq!(signal, before);
    let bad = Params { blend: 0.0, ..Params::default() };
    assert!(accumulate(&bad, &small.guides(), None, &mut signal, &mut history).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn finite_frames_stay_finite_and_constant_ones_constant(
        motion in prop::collection::vec((-20.0f32..20.0, -20.0f32..20.0), 48),
        extreme in prop_oneof![Just(f32::MAX), Just(f32::MIN), Just(0.0f32), -5.0f32..5.0],
        wrap: bool, clamp in prop_oneof![Just(0.0f32), Just(1.5), Just(f32::INFINITY)],
    ) {
        let mut scene = Scene::still(8, 6);
        scene.previous = Image::from_vec(8, 6, motion.into_iter().map(Vec2::from).collect()).unwrap();
        let params = Params { wrap, clamp, ..Params::default() };
        let (mut history, mut constant) = (None, None);
        for frame in 0..4 {
            let mut signal = noisy(8, 6, frame);
            signal.set(2, 2, Vec3::splat(extreme));
            accumulate(&params, &scene.guides(), None, &mut signal, &mut history).unwrap();
            prop_assert!(signal.data().iter().all(|v| v.is_finite()));
            let mut flat = Image::filled(8, 6, Vec3::splat(0.7));
            accumulate(&params, &scene.guides(), None, &mut flat, &mut constant).unwrap();
            prop_assert!(flat.data().iter().all(|v| (v.x - 0.7).abs() < 1e-6));
        }
    }

    /// A panorama that turns by whole columns: history comes over the seam.
    #[test]
    fn rolling_the_input_rolls_the_output(by in 0usize..16, seed in 0u64..1000) {
        let (w, h) = (16, 8);
        let mut scene = Scene::still(w, h);
        scene.previous = Image::from_fn(w, h, |x, y| Vec2::new(x as f32 + 3.25, y as f32 + 0.5));
        let params = Params { wrap: true, ..Params::default() };
        let (mut a, mut b) = (None, None);
        for frame in 0..3 {
            let mut plain = noisy(w, h, seed + frame);
            let mut rolled = Image::from_fn(w, h, |x, y| plain.get((x + by) % w, y));
            accumulate(&params, &scene.guides(), None, &mut plain, &mut a).unwrap();
            accumulate(&params, &scene.guides(), None, &mut rolled, &mut b).unwrap();
            for y in 0..h {
                for x in 0..w {
                    prop_assert!(rolled.get(x, y).distance(plain.get((x + by) % w, y)) < 1e-6, "({x}, {y})");
                }
            }
        }
    }
}

/// Rare events are neither forgotten nor counted twice, although most frames show none in most neighbourhoods; and the variance
/// that is told is the one there is.
#[test]
fn rare_events_keep_their_mean() {
    let (w, h) = (64, 48);
    let scene = Scene::still(w, h);
    let rare = |seed: u64| {
        let mut random = StdRng::seed_from_u64(seed);
        Image::from_fn(w, h, |_, _| Vec3::splat(if random.random_range(0.0..1.0) < 0.02f32 { 50.0 } else { 0.0 }))
    };
    let (mut history, mut sum, mut told, mut squares) = (None, 0.0f64, 0.0f64, 0.0f64);
    let frames = 40..200;
    for frame in 0..frames.end {
        let mut signal = rare(frame);
        let variance = accumulate(&Params::default(), &scene.guides(), None, &mut signal, &mut history).unwrap();
        if frames.contains(&frame) {
            sum += signal.data().iter().map(|v| f64::from(v.x)).sum::<f64>();
            squares += signal.data().iter().map(|v| f64::from(v.x - 1.0).powi(2)).sum::<f64>();
            told += variance.data().iter().map(|&v| f64::from(v)).sum::<f64>();
        }
    }
    let n = (w * h) as f64 * frames.count() as f64;
    assert!((sum / n - 1.0).abs() < 0.03, "mean {}", sum / n);
    assert!((0.8..1.25).contains(&(told / squares)), "{} of {}", told / n, squares / n);
}

/// The shadow of something that walks off, in noise as large as the light: after as many frames as the 7×7 pixels need to know
/// it for certain, what is left of it is small.
#[test]
fn ghosts_leave_noise() {
    let scene = Scene::still(64, 32);
    let mut ghosts = [0.0f32; 2];
    for (ghost, clamp) in ghosts.iter_mut().zip([2.0, f32::INFINITY]) {
        let params = Params { clamp, ..Params::default() };
        let mut history = None;
        for frame in 0..34 {
            let light = noisy(64, 32, frame);
            let shadow = |x: usize| if frame < 30 && (20..40).contains(&x) { 0.2 } else { 1.0 };
            let mut signal = Image::from_fn(64, 32, |x, y| light.get(x, y) * shadow(x));
            accumulate(&params, &scene.guides(), None, &mut signal, &mut history).unwrap();
            if frame == 33 {
                let inside = |x: usize| (24..36).contains(&x);
                let missing = signal.data().iter().enumerate().filter(|(i, _)| inside(i % 64)).map(|(_, v)| 1.0 - v.x);
                *ghost = missing.sum::<f32>() / (12.0 * 32.0);
            }
        }
    }
    let [corrected, plain] = ghosts;
    assert!(corrected < 0.2 && plain > 0.45, "{corrected} {plain}");
}

/// Where lamps go out, their neighbourhood has lost more than the dark pixels beside them ever had.
#[test]
fn a_lamp_that_goes_out_makes_no_dark_pixel_negative() {
    let scene = Scene::still(16, 16);
    let mut history = None;
    for frame in 0..24 {
        let lit = if frame < 20 { 100.0 } else { 0.1 };
        let mut signal = Image::from_fn(16, 16, |x, _| Vec3::splat(if x < 8 { lit } else { 0.1 }));
        accumulate(&Params::default(), &scene.guides(), None, &mut signal, &mut history).unwrap();
        assert!(signal.data().iter().all(|v| v.x > 0.099), "frame {frame}");
    }
}

/// What moves in a mirror has no motion vector, and no noise either: history stays within the range of the neighbours.
#[test]
fn mirrors_are_clamped_to_their_neighbours() {
    let mut scene = Scene::still(32, 32);
    let sharp = Image::filled(32, 32, true);
    let mut history = None;
    let stripe = |frame: usize| Image::from_fn(32, 32, move |x, _| Vec3::splat(if x == frame { 1.0 } else { 0.0 }));
    scene.normal = Image::filled(32, 32, Vec3::Z);
    for frame in 0..20 {
        let mut signal = stripe(frame);
        let guides = Guides { sharp: Some(&sharp), ..scene.guides() };
        accumulate(&Params::default(), &guides, None, &mut signal, &mut history).unwrap();
    }
    let history = history.unwrap();
    let trail: f32 = (0..17).map(|x| history.signal().get(x, 16).x).sum();
    assert!(trail < 1e-3, "{trail}");
}

/// A pixel unlike all others, as at the edge of an object, has no neighbours to tell noise from change: its history is kept.
#[test]
fn a_lone_pixel_keeps_its_history() {
    let mut scene = Scene::still(8, 8);
    scene.thing.set(4, 4, 1);
    let (mut history, mut sum, mut squares) = (None, 0.0f32, 0.0f32);
    for frame in 0..400 {
        let mut signal = noisy(8, 8, frame);
        accumulate(&Params::default(), &scene.guides(), None, &mut signal, &mut history).unwrap();
        if frame >= 40 {
            sum += signal.get(4, 4).x / 360.0;
            squares += (signal.get(4, 4).x - 1.0).powi(2) / 360.0;
        }
    }
    // A tenth of each new frame; one has a deviation of 1/√3.
    assert!((sum - 1.0).abs() < 0.05 && squares.sqrt() < 0.2, "{sum} {}", squares.sqrt());
}

/// Where neither the frame nor history knows anything the value is 0, and the first that is known counts whole.
#[test]
fn nothing_known_is_no_frame() {
    let scene = Scene::still(8, 8);
    let mut history = None;
    for (value, frames, want) in
        [(f32::NAN, 0.0, 0.0), (f32::NAN, 0.0, 0.0), (3.0, 1.0, 3.0), (f32::NAN, 1.0, 3.0), (1.0, 2.0, 2.0)]
    {
        let mut signal = Image::filled(8, 8, Vec3::splat(value));
        let params = Params { clamp: f32::INFINITY, ..Params::default() };
        accumulate(&params, &scene.guides(), None, &mut signal, &mut history).unwrap();
        assert_eq!((signal.get(4, 4).x, history.as_ref().unwrap().frames().get(4, 4)), (want, frames));
    }
}

/// One pixel in four is sampled and the others are copied from it: the mean of rare events is kept, and they leave no blobs brighter
/// than with samples everywhere.
#[test]
fn interpolated_values_count_less() {
    let (w, h) = (64, 48);
    let scene = Scene::still(w, h);
    let level = Image::from_fn(w, h, |x, y| if x % 2 == 0 && y % 2 == 0 { 0 } else { 1 });
    let (mut sparse, mut dense) = (None, None);
    let (mut sum, mut brightest) = (0.0f64, [0.0f32; 2]);
    for frame in 0..200u64 {
        let mut random = StdRng::seed_from_u64(frame);
        let every = Image::from_fn(w, h, |_, _| Vec3::splat(if random.random_range(0.0..1.0) < 0.02f32 { 50.0 } else { 0.0 }));
        let mut some = Image::from_fn(w, h, |x, y| every.get(x & !1, y & !1));
        let guides = Guides { level: Some(&level), ..scene.guides() };
        accumulate(&Params::default(), &guides, None, &mut some, &mut sparse).unwrap();
        let mut every = every;
        accumulate(&Params::default(), &scene.guides(), None, &mut every, &mut dense).unwrap();
        // Interpolated pixels begin with a frame of their own.
        if frame >= 100 {
            let block = |image: &Image<Vec3>, x, y| (0..4).map(|i| image.get(2 * x + i % 2, 2 * y + i / 2).x).sum::<f32>();
            for (brightest, image) in brightest.iter_mut().zip([&some, &every]) {
                for (x, y) in (0..h / 2).flat_map(|y| (0..w / 2).map(move |x| (x, y))) {
                    *brightest = brightest.max(block(image, x, y));
                }
            }
            sum += some.data().iter().map(|v| f64::from(v.x)).sum::<f64>() / (w * h * 100) as f64;
        }
    }
    assert!((sum - 1.0).abs() < 0.05, "mean {sum}");
    assert!(brightest[0] < 1.5 * brightest[1], "{brightest:?}");
}
