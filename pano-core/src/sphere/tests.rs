use super::*;
use crate::image::Image;
use proptest::prelude::*;

/// The table of the design: u of +X, −Z, −X, +Z.
#[test]
fn conventions_put_the_axes_where_the_table_says() {
    let axes = [Vec3::X, Vec3::NEG_Z, Vec3::NEG_X, Vec3::Z];
    let table = [
        (Convention::Forward, [0.75, 0.5, 0.25, 0.0]),
        (Convention::Three, [0.5, 0.25, 0.0, 0.75]),
        (Convention::Blender, [0.5, 0.25, 0.0, 0.75]),
        (Convention::Mitsuba, [0.25, 0.0, 0.75, 0.5]),
        (Convention::Usd, [0.25, 0.0, 0.75, 0.5]),
    ];
    for (convention, us) in table {
        for (axis, u) in axes.into_iter().zip(us) {
            let got = convention.uv_from_direction(axis);
            let gap = (got.x - u).abs();
            assert!(gap.min(1.0 - gap) < 1e-6, "{convention:?}: {axis} at u {} instead of {u}", got.x);
            assert!((got.y - 0.5).abs() < 1e-6);
            assert!(convention.direction_from_uv(Vec2::new(u, 0.5)).distance(axis) < 1e-6);
        }
    }
}

#[test]
fn solid_angles_sum_to_the_sphere() {
    for (w, h) in [(1, 1), (2, 1), (7, 3), (512, 256), (4096, 2048)] {
        let sum: f64 = (0..h).map(|j| w as f64 * pixel_solid_angle(w, h, j)).sum();
        assert!((sum / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12, "{w}×{h}: {sum}");
    }
}

#[test]
fn poles_have_a_direction_and_lookups_step_over_them() {
    assert_eq!(uv_from_direction(Vec3::Y), Vec2::new(0.5, 0.0));
    assert_eq!(uv_from_direction(Vec3::NEG_Y), Vec2::new(0.5, 1.0));
    // Just above the first row's centre a lookup mixes the texel with the one half a turn away.
    let image = Image::from_fn(8, 4, |x, y| if y == 0 { x as f32 } else { 100.0 });
    let top = bilinear(&image, Vec2::new(1.5 / 8.0, 0.0));
    assert!((top - 0.5 * (1.0 + 5.0)).abs() < 1e-5, "{top}");
}

proptest! {
    #[test]
    fn direction_and_uv_are_inverse(u in 0.0f32..1.0, v in 0.001f32..0.999) {
        let back = uv_from_direction(direction_from_uv(Vec2::new(u, v)));
        let gap = (back.x - u).abs();
        prop_assert!(gap.min(1.0 - gap) < 2e-5 / (v * PI).sin(), "{u} {v} -> {back}");
        prop_assert!((back.y - v).abs() < 1e-6);
        prop_assert!(back.x < 1.0);
    }

    #[test]
    fn lookups_interpolate_between_neighbours_everywhere(
        w in 1usize..9, h in 1usize..9, u in -1.0f32..2.0, v in 0.0f32..=1.0, seed in 0usize..1000,
    ) {
        let image = Image::from_fn(w, h, |x, y| ((x * 31 + y * 17 + seed) % 23) as f32);
        let taps = bilinear_taps(w, h, Vec2::new(u, v));
        prop_assert!((taps.iter().map(|t| t.weight).sum::<f32>() - 1.0).abs() < 1e-5);
        let values: Vec<f32> = taps.iter().map(|t| image.get(t.x, t.y)).collect();
        let got = bilinear(&image, Vec2::new(u, v));
        prop_assert!(got >= values.iter().copied().fold(f32::MAX, f32::min) - 1e-4);
        prop_assert!(got <= values.iter().copied().fold(f32::MIN, f32::max) + 1e-4);
    }

    #[test]
    fn lookups_are_continuous_over_the_seam(v in 0.0f32..=1.0) {
        let image = Image::from_fn(16, 8, |x, y| (x as f32 * 0.7).sin() + y as f32);
        let (left, right) = (bilinear(&image, Vec2::new(1e-6, v)), bilinear(&image, Vec2::new(1.0 - 1e-6, v)));
        prop_assert!((left - right).abs() < 1e-3);
    }
}
