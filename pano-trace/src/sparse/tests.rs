use super::*;
use proptest::prelude::*;

/// A floor 2 mm a pixel wide, facing the viewer.
fn floor(w: usize, h: usize) -> (Image<Vec3>, Image<Vec3>) {
    (Image::from_fn(w, h, |x, y| Vec3::new(0.002 * x as f32, 0.002 * y as f32, 0.0)), Image::filled(w, h, Vec3::Z))
}

#[test]
fn a_floor_is_traced_at_one_pixel_in_sixteen() {
    let (position, normal) = floor(32, 24);
    let levels = levels(&Params::default(), &position, &normal, &Image::filled(32, 24, 0));
    assert!(levels.data().iter().all(|&l| l == 2));
    let traced = (0..32 * 24).filter(|i| is_traced(levels.get(i % 32, i / 32), i % 32, i / 32)).count();
    assert_eq!(traced, 32 * 24 / 16);
}

/// Two pixels from a step of 10 cm, or from a fold, everything is traced; touched pixels are; steps between δ₁/σ and δ₂/σ
/// take the middle level.
#[test]
fn edges_and_active_pixels_are_dense() {
    let params = Params::default();
    let (position, normal) = floor(32, 16);
    let at = |depth: f32, turned: bool, active: u32| {
        let position = Image::from_fn(32, 16, |x, y| position.get(x, y) + if x >= 16 { Vec3::Z * depth } else { Vec3::ZERO });
        let normal = Image::from_fn(32, 16, |x, y| if x >= 16 && turned { Vec3::X } else { normal.get(x, y) });
        levels(&params, &position, &normal, &Image::from_fn(32, 16, |x, _| if x == 3 { active } else { 0 }))
    };
    let step = at(0.1, false, 0);
    for (x, level) in [(13, 2), (14, 0), (17, 0), (18, 2)] {
        assert_eq!(step.get(x, 8), level, "column {x}");
    }
    assert_eq!(at(0.04, false, 0).get(15, 8), 1, "10·4 cm = .4");
    assert_eq!(at(0.0, true, 0).get(15, 8), 0);
    let active = at(0.0, false, 1);
    assert_eq!((active.get(3, 8), active.get(4, 8)), (0, 2));
}

#[test]
fn pixels_stay_active_for_ten_frames() {
    let params = Params::default();
    let levels = Image::filled(8, 8, 2);
    let mut active = Image::filled(8, 8, 0);
    let touched = Image::from_fn(8, 8, |x, y| (x, y) == (4, 0));
    update_activity(&params, &levels, &touched, &mut active);
    assert_eq!((active.get(4, 0), active.get(7, 3), active.get(3, 0)), (10, 10, 0), "the ray stood for its block");
    for _ in 0..9 {
        update_activity(&params, &levels, &Image::filled(8, 8, false), &mut active);
    }
    assert_eq!(active.get(7, 3), 1);
    update_activity(&params, &levels, &Image::filled(8, 8, false), &mut active);
    assert_eq!(active.get(7, 3), 0);
}

/// The nearest sample counts most.
#[test]
fn nearer_samples_weigh_more() {
    let levels = Image::filled(5, 5, 2);
    let mut share = Image::from_fn(5, 5, |x, y| f32::from(u8::from(x % 4 == 0 && y % 4 == 0)));
    let mut signal = Image::from_fn(5, 5, |x, y| Vec3::splat(if (x, y) == (0, 0) { 1.0 } else { 0.0 }));
    interpolate(&levels, |_, _| true, &mut share, &mut [&mut signal]);
    let at = |x, y| signal.get(x, y).x;
    assert!(at(1, 0) > at(2, 0) && at(2, 0) > at(3, 0) && at(1, 1) > at(3, 3));
    // Distances 1, 3, √17, 5.
    let exact = 1.0 / (1.0 + 1.0 / 3.0 + 1.0 / 17f32.sqrt() + 0.2);
    assert!((at(1, 0) - exact).abs() < 1e-6);
    assert!(share.data().iter().all(|&s| s == 1.0));
}

proptest! {
    /// Constants stay, whatever the levels and shares; traced pixels are never changed; unknown stays unknown.
    #[test]
    fn interpolation_keeps_constants(
        levels in prop::collection::vec(0u8..3, 17 * 9),
        shares in prop::collection::vec(prop_oneof![Just(0.0f32), 0.1f32..1.0], 17 * 9),
        value in -10.0f32..10.0,
    ) {
        let levels = Image::from_vec(17, 9, levels).unwrap();
        let shares = Image::from_vec(17, 9, shares).unwrap();
        let traced = |x: usize, y: usize| is_traced(levels.get(x, y), x, y);
        let mut share = Image::from_fn(17, 9, |x, y| if traced(x, y) { shares.get(x, y) } else { 0.0 });
        let mut signal = share.map(|s| Vec3::splat(value * s));
        let before = signal.clone();
        interpolate(&levels, |_, _| true, &mut share, &mut [&mut signal]);
        for (i, (v, s)) in signal.data().iter().zip(share.data()).enumerate() {
            prop_assert!((v.x - value * s).abs() <= 1e-4 * value.abs(), "{v} {s}");
            let (x, y) = (i % 17, i / 17);
            prop_assert!(!traced(x, y) || *v == before.get(x, y));
        }
    }
}
