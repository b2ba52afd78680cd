use super::*;
use pano_core::color::srgb_to_linear;
use pano_core::image::Image;
use proptest::prelude::*;

fn expanded(rgb: Vec3) -> Vec3 {
    let mut out = Image::filled(1, 1, Vec3::splat(-1.0));
    expand(&Image::filled(1, 1, rgb), &mut out).unwrap();
    out.get(0, 0)
}

#[test]
fn closed_forms() {
    // k of the primaries is 10·weight¹⁰ + 1.8.
    let cases = [
        (Vec3::ZERO, Vec3::ZERO),
        (Vec3::ONE, Vec3::splat(11.8)),
        (Vec3::splat(0.5), Vec3::splat(0.5 * (10.0 / 1024.0 + 1.8))),
        (Vec3::X, Vec3::X * (10.0 * 0.3f32.powi(10) + 1.8)),
        (Vec3::Y, Vec3::Y * (10.0 * 0.59f32.powi(10) + 1.8)),
        (Vec3::Z, Vec3::Z * 1.8),
        (Vec3::new(1.0, 0.5, 0.0), Vec3::new(1.0, 0.5, 0.0) * (10.0 * 0.595f32.powi(10) + 1.8)),
    ];
    for (ldr, hdr) in cases {
        assert!(expanded(ldr).abs_diff_eq(hdr, 2e-6 * (1.0 + hdr.max_element())), "{ldr} became {}, not {hdr}", expanded(ldr));
    }
}

#[test]
fn black_stays_exactly_black() {
    assert_eq!(expanded(Vec3::ZERO).to_array().map(f32::to_bits), [0; 3]);
    assert_eq!(expanded(Vec3::splat(-0.0)).to_array().map(f32::to_bits), [0; 3]);
}

#[test]
fn every_8_bit_grey_is_brighter_than_the_one_before() {
    let greys: Vec<f32> = (0..=255).map(|code| expanded(Vec3::splat(srgb_to_linear(code as f32 / 255.0))).x).collect();
    assert!(greys.windows(2).all(|w| w[0] < w[1]));
}

#[test]
fn every_pixel_is_written_whatever_the_size() {
    for (w, h) in [(1, 1), (2, 1), (1, 3), (7, 5)] {
        let ldr = Image::from_fn(w, h, |x, y| Vec3::new(x as f32, y as f32, 3.0) / 8.0);
        let mut hdr = Image::filled(w, h, Vec3::splat(-1.0));
        expand(&ldr, &mut hdr).unwrap();
        assert_eq!(hdr, ldr.map(|p| p * factor(p)));
    }
}

#[test]
fn sizes_that_differ_are_named() {
    let error = expand(&Image::filled(4, 2, Vec3::ZERO), &mut Image::filled(2, 4, Vec3::ZERO)).unwrap_err();
    assert!(error.to_string().contains("4×2") && error.to_string().contains("2×4"), "{error}");
}

proptest! {
    #[test]
    fn any_input_gives_finite_output_in_range(r: f32, g: f32, b: f32) {
        let out = expanded(Vec3::new(r, g, b));
        prop_assert!(out.is_finite() && out.min_element() >= 0.0 && out.max_element() <= 11.8 + 1e-5, "{}", out);
    }

    #[test]
    fn hue_is_kept(r in 0.0f32..1.0, g in 0.0f32..1.0, b in 0.0f32..1.0) {
        let ldr = Vec3::new(r, g, b);
        let cross = expanded(ldr).cross(ldr).length();
        prop_assert!(cross <= 1e-5, "{}", cross);
    }
}
