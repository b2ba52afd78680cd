use super::*;
use proptest::prelude::*;

fn ones(w: usize, h: usize) -> Image<f32> {
    Image::filled(w, h, 1.0)
}

#[test]
fn a_lone_bright_pixel_is_clamped_and_its_energy_told() {
    let mut signal = Image::filled(5, 4, Vec3::splat(0.5));
    signal.set(2, 1, Vec3::splat(100.0));
    let clamped = clamp(&Params::default(), &ones(5, 4), &mut signal).unwrap();
    assert!((signal.get(2, 1).x - 1.0).abs() < 1e-6);
    assert_eq!(clamped.pixels, 1);
    assert!((clamped.energy - 99.0).abs() < 1e-4 && (clamped.before - 109.5).abs() < 1e-4, "{clamped:?}");
}

#[test]
fn highlights_of_two_pixels_and_colours_stay() {
    let mut signal = Image::filled(6, 6, Vec3::splat(0.1));
    signal.set(2, 2, Vec3::new(9.0, 1.0, 0.0));
    signal.set(3, 2, Vec3::new(8.0, 1.0, 0.0));
    let before = signal.clone();
    assert_eq!(clamp(&Params::default(), &ones(6, 6), &mut signal).unwrap().pixels, 0);
    assert_eq!(signal, before);
    signal.set(3, 2, Vec3::splat(0.1));
    clamp(&Params::default(), &ones(6, 6), &mut signal).unwrap();
    let left = signal.get(2, 2);
    assert!((left.x / left.y - 9.0).abs() < 1e-4, "the colour is kept: {left}");
}

/// Neighbours of another layer do not count, premultiplied values are compared without the premultiplication, and what is
/// alone is left alone.
#[test]
fn shares_are_respected() {
    let mut signal = Image::filled(3, 1, Vec3::splat(0.1));
    signal.set(1, 0, Vec3::ONE);
    let share = Image::from_vec(3, 1, vec![0.0, 1.0, 0.0]).unwrap();
    assert_eq!(clamp(&Params::default(), &share, &mut signal).unwrap().pixels, 0);
    let share = Image::from_vec(3, 1, vec![0.1, 1.0, 0.1]).unwrap();
    assert_eq!(clamp(&Params::default(), &share, &mut signal).unwrap().pixels, 0, "1 beside 0.1 / 0.1");
}

#[test]
fn a_panorama_has_neighbours_over_the_seam() {
    let mut signal = Image::filled(6, 3, Vec3::ZERO);
    signal.set(0, 1, Vec3::ONE);
    signal.set(5, 1, Vec3::ONE);
    let mut flat = signal.clone();
    assert_eq!(clamp(&Params { wrap: true, ..Params::default() }, &ones(6, 3), &mut signal).unwrap().pixels, 0);
    assert_eq!(clamp(&Params::default(), &ones(6, 3), &mut flat).unwrap().pixels, 2);
    assert!(clamp(&Params { factor: 0.5, ..Params::default() }, &ones(6, 3), &mut flat).is_err());
}

proptest! {
    /// Finite, never brighter, the energy told is the energy lost, and rolling commutes.
    #[test]
    fn clamping_only_takes_away(
        values in prop::collection::vec((-10.0f32..10.0, -10.0f32..10.0, prop_oneof![4 => -10.0f32..10.0, 1 => Just(f32::MAX)]), 48),
        by in 0usize..8,
    ) {
        let before = Image::from_vec(8, 6, values.into_iter().map(Vec3::from).collect()).unwrap();
        let params = Params { wrap: true, ..Params::default() };
        let bright = |i: &Image<Vec3>| -> f64 {
            i.data().iter().map(|v| v.as_dvec3().dot(pano_core::color::LUMINANCE_WEIGHTS.as_dvec3()).abs()).sum()
        };
        let mut after = before.clone();
        let clamped = clamp(&params, &ones(8, 6), &mut after).unwrap();
        prop_assert!(after.data().iter().all(|v| v.is_finite()));
        prop_assert!((bright(&before) - clamped.before).abs() <= 1e-6 * clamped.before);
        prop_assert!((bright(&before) - bright(&after) - clamped.energy).abs() <= 1e-5 * clamped.before);
        let mut rolled = Image::from_fn(8, 6, |x, y| before.get((x + by) % 8, y));
        clamp(&params, &ones(8, 6), &mut rolled).unwrap();
        prop_assert_eq!(rolled, Image::from_fn(8, 6, |x, y| after.get((x + by) % 8, y)));
    }

    #[test]
    fn a_constant_picture_stays(value in 0.0f32..1e6, w in 1usize..9, h in 1usize..9, wrap: bool) {
        let mut signal = Image::filled(w, h, Vec3::splat(value));
        prop_assert_eq!(clamp(&Params { wrap, ..Params::default() }, &ones(w, h), &mut signal).unwrap().pixels, 0);
    }
}
