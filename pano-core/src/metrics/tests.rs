use super::*;
use proptest::prelude::*;

/// A picture that is no constant, with values in [0, 1].
fn pattern(w: usize, h: usize, seed: usize) -> Image<Vec3> {
    let value = |i: usize| ((i * 2_654_435_761 + seed * 40_503) >> 7) as u8 as f32 / 255.0;
    Image::from_fn(w, h, |x, y| Vec3::new(value(y * w + x), value(y * w + x + 7), x as f32 / w as f32))
}

fn constant(w: usize, h: usize, value: f32) -> Image<Vec3> {
    Image::filled(w, h, Vec3::splat(value))
}

#[test]
fn a_picture_is_no_way_from_itself() {
    for (w, h) in [(1, 1), (2, 1), (10, 40), (11, 11), (33, 17)] {
        let a = pattern(w, h, 1);
        assert_eq!(mse(&a, &a, None).unwrap(), 0.0);
        assert_eq!(psnr(&a, &a, None).unwrap(), f64::INFINITY);
        assert_eq!(ws_psnr(&a, &a, None).unwrap(), f64::INFINITY);
        assert_eq!(rel_rmse(&a, &a, None).unwrap(), 0.0);
        assert_eq!(flip(&a, &a, None).unwrap(), 0.0);
        let similarity = ssim(&a, &a, None).unwrap();
        assert_eq!(similarity.is_some(), w >= 11 && h >= 11);
        assert!(similarity.is_none_or(|s| (s - 1.0).abs() < 1e-12), "{similarity:?}");
    }
}

#[test]
fn constants_have_closed_forms() {
    let (a, b) = (constant(24, 12, 0.25), constant(24, 12, 0.75));
    assert_eq!(mse(&a, &b, None).unwrap(), 0.25);
    let decibels = -10.0 * 0.25f64.log10();
    assert!((psnr(&a, &b, None).unwrap() - decibels).abs() < 1e-12);
    // The weights do not matter to a constant difference.
    assert!((ws_psnr(&a, &b, None).unwrap() - decibels).abs() < 1e-12);
    assert!((rel_rmse(&a, &b, None).unwrap() - (0.25f64 / (0.5625 + 0.01)).sqrt()).abs() < 1e-12);
    // No variance: only the luminance term is left.
    let luminance = (2.0 * 0.25 * 0.75 + 1e-4) / (0.0625 + 0.5625 + 1e-4);
    assert!((ssim(&a, &b, None).unwrap().unwrap() - luminance).abs() < 1e-12);
    // Black and white are as far apart as FLIP goes, but for the error's final exponent and the feature term.
    let far = flip(&constant(24, 12, 0.0), &constant(24, 12, 1.0), None).unwrap();
    assert!((0.9..=1.0).contains(&far), "{far}");
}

#[test]
fn latitude_weighs() {
    let black = constant(8, 4, 0.0);
    let lit = |row: usize| Image::from_fn(8, 4, |_, y| Vec3::splat(if y == row { 1.0 } else { 0.0 }));
    let (pole, equator) = (ws_psnr(&black, &lit(0), None).unwrap(), ws_psnr(&black, &lit(1), None).unwrap());
    let (s, c) = (std::f64::consts::FRAC_PI_8.sin(), std::f64::consts::FRAC_PI_8.cos());
    assert!((pole - -10.0 * (s / (2.0 * s + 2.0 * c)).log10()).abs() < 1e-9, "{pole}");
    assert!((equator - -10.0 * (c / (2.0 * s + 2.0 * c)).log10()).abs() < 1e-9, "{equator}");
}

#[test]
fn ssim_of_one_window_is_the_formula() {
    let (a, b) = (pattern(11, 11, 1), pattern(11, 11, 2));
    let g = |d: f64| (-0.5 * (d / 1.5).powi(2)).exp();
    let weight = |i: usize| g((i % 11) as f64 - 5.0) * g((i / 11) as f64 - 5.0);
    let total: f64 = (0..121).map(weight).sum();
    let mean_of = |f: &dyn Fn(DVec3, DVec3) -> DVec3| {
        let at = |i: usize| f(a.data()[i].as_dvec3(), b.data()[i].as_dvec3()) * weight(i) / total;
        (0..121).map(at).sum::<DVec3>()
    };
    let (ma, mb) = (mean_of(&|a, _| a), mean_of(&|_, b| b));
    let (va, vb) = (mean_of(&|a, _| (a - ma) * (a - ma)), mean_of(&|_, b| (b - mb) * (b - mb)));
    let cov = mean_of(&|a, b| (a - ma) * (b - mb));
    let s = (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
    let got = ssim(&a, &b, None).unwrap().unwrap();
    assert!((got - s.element_sum() / 3.0).abs() < 1e-12, "{got} {s}");
}

#[test]
fn pieces_do_not_change_flip() {
    let (a, b) = (pattern(20, 70, 1), pattern(20, 70, 2));
    let whole = super::flip::mean(&a, &b, None, 70);
    for band in [1, 16, 33] {
        assert_eq!(super::flip::mean(&a, &b, None, band), whole, "{band} rows a piece");
    }
    assert_eq!(flip(&a, &b, None).unwrap(), whole);
}

#[test]
fn a_mask_leaves_out_the_rest() {
    let a = constant(30, 20, 0.5);
    let mut b = a.clone();
    b.set(0, 0, Vec3::ONE);
    let all = Mask::filled(30, 20, true);
    let rest = Mask::from_fn(30, 20, |x, y| (x, y) != (0, 0));
    let only = Mask::from_fn(30, 20, |x, y| (x, y) == (0, 0));
    assert_eq!(mse(&a, &b, Some(&rest)).unwrap(), 0.0);
    assert_eq!(mse(&a, &b, Some(&only)).unwrap(), 0.25);
    assert_eq!(mse(&a, &b, Some(&all)).unwrap(), mse(&a, &b, None).unwrap());
    assert_eq!(ssim(&a, &b, Some(&only)).unwrap(), None, "the pixel lies in the border");
    let far = Mask::from_fn(30, 20, |x, _| x > 5);
    assert_eq!(ssim(&a, &b, Some(&far)).unwrap(), Some(1.0), "no counted window sees the pixel");
    assert_eq!(ssim(&a, &b, Some(&all)).unwrap(), ssim(&a, &b, None).unwrap());
    let (one, mean) = (flip(&a, &b, Some(&only)).unwrap(), flip(&a, &b, None).unwrap());
    assert!(one > mean && flip(&a, &b, Some(&all)).unwrap() == mean);
}

#[test]
fn what_does_not_fit_is_an_error() {
    let (a, b) = (constant(12, 12, 0.0), constant(12, 13, 0.0));
    let (wrong_mask, empty_mask) = (Mask::filled(3, 3, true), Mask::filled(12, 12, false));
    for metric in [mse, psnr, ws_psnr, rel_rmse, flip] {
        assert!(metric(&a, &b, None).unwrap_err().to_string().contains("12×13"));
        assert!(metric(&a, &a, Some(&wrong_mask)).unwrap_err().to_string().contains("3×3"));
        assert!(metric(&a, &a, Some(&empty_mask)).unwrap_err().to_string().contains("no pixel"));
    }
    assert!(ssim(&a, &b, None).is_err() && ssim(&a, &a, Some(&wrong_mask)).is_err());
}

#[test]
fn nan_gives_nan_and_no_panic() {
    let (a, b) = (constant(12, 12, f32::NAN), constant(12, 12, 0.5));
    assert!(mse(&a, &b, None).unwrap().is_nan() && ssim(&a, &b, None).unwrap().unwrap().is_nan());
    assert_eq!(flip(&a, &b, None).unwrap(), flip(&constant(12, 12, 0.0), &b, None).unwrap());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn order_does_not_matter(w in 1usize..40, h in 1usize..40, seed in 0usize..1000) {
        let (a, b) = (pattern(w, h, seed), pattern(w, h, seed + 1));
        for metric in [mse, psnr, ws_psnr] {
            prop_assert_eq!(metric(&a, &b, None).unwrap(), metric(&b, &a, None).unwrap());
        }
        let (ab, ba) = (ssim(&a, &b, None).unwrap(), ssim(&b, &a, None).unwrap());
        prop_assert!(ab.zip(ba).is_none_or(|(ab, ba)| (ab - ba).abs() < 1e-12 && ab <= 1.0));
        let (ab, ba) = (flip(&a, &b, None).unwrap(), flip(&b, &a, None).unwrap());
        prop_assert!((ab - ba).abs() < 1e-5 && (0.0..=1.0).contains(&ab), "{} {}", ab, ba);
    }
}
