use super::*;
use proptest::prelude::*;

fn checkerboard(size: usize, square: usize) -> Texture {
    let image = Image::from_fn(size, size, |x, y| Vec4::splat(((x / square + y / square) % 2) as f32));
    Texture::new(Arc::new(image))
}

fn over(x: Vec2, y: Vec2) -> Footprint {
    Footprint { axes: [x, y], max_anisotropy: 16 }
}

#[test]
fn axes_are_those_of_the_ellipse() {
    let turn = Mat2::from_angle(0.6);
    for other in [Mat2::IDENTITY, Mat2::from_angle(1.9)] {
        let (long, short) = axes_of_ellipse(turn * Mat2::from_diagonal(Vec2::new(5.0, 0.5)) * other);
        assert!((long.length() - 5.0).abs() < 1e-4 && (short - 0.5).abs() < 1e-4, "{long} {short}");
        assert!((long.normalize().dot(Vec2::from_angle(0.6)).abs() - 1.0).abs() < 1e-5, "{long}");
    }
    assert_eq!(axes_of_ellipse(Mat2::ZERO), (Vec2::ZERO, 0.0));
}

#[test]
fn a_wide_footprint_sees_the_mean_and_a_narrow_one_the_texel() {
    let texture = checkerboard(64, 4);
    for uv in [Vec2::splat(0.3), Vec2::new(0.9, 0.1), Vec2::new(-3.2, 7.7)] {
        let wide = texture.sample_over(uv, &over(Vec2::X * 0.5, Vec2::Y * 0.5));
        assert!(wide.abs_diff_eq(Vec4::splat(0.5), 0.02), "{uv}: {wide}");
        let narrow = texture.sample_over(uv, &over(Vec2::X * 1e-3, Vec2::Y * 1e-3));
        assert_eq!(narrow, texture.sample(uv));
    }
}

/// Stripes along u, seen over a footprint that is long along u: isotropic filtering loses them, anisotropic keeps them.
#[test]
fn a_long_footprint_blurs_along_itself_only() {
    let stripes = Image::from_fn(64, 64, |_, y| Vec4::splat((y / 4 % 2) as f32));
    let texture = Texture::new(Arc::new(stripes));
    let middle_of_a_stripe = Vec2::new(0.5, 6.0 / 64.0);
    let long = over(Vec2::X * 0.5, Vec2::Y / 64.0);
    let sharp = texture.sample_over(middle_of_a_stripe, &Footprint { max_anisotropy: 32, ..long });
    let blurred = texture.sample_over(middle_of_a_stripe, &Footprint { max_anisotropy: 1, ..long });
    assert!(sharp.x > 0.99 && (blurred.x - 0.5).abs() < 0.1, "{sharp} {blurred}");
}

/// Across the seam of a tiled picture the mean goes on into the next tile; at a clamped border it does not.
#[test]
fn footprints_cross_the_seam_as_the_picture_does() {
    let halves = Image::from_fn(64, 64, |x, _| Vec4::splat(if x < 32 { 0.0 } else { 1.0 }));
    let mut texture = Texture::new(Arc::new(halves));
    let at = |texture: &Texture, u: f32| texture.sample_over(Vec2::new(u, 0.5), &over(Vec2::X * 0.25, Vec2::Y * 0.25)).x;
    assert!((at(&texture, 0.0) - 0.5).abs() < 0.05 && (at(&texture, 1.0) - at(&texture, 0.0)).abs() < 1e-5);
    texture.wrap_u = Wrap::Clamp;
    assert!(at(&texture, 0.0) < 0.01 && at(&texture, 1.0) > 0.99, "{} {}", at(&texture, 0.0), at(&texture, 1.0));
    texture.wrap_u = Wrap::Mirror;
    assert!(at(&texture, 0.0) < 0.01 && at(&texture, 1.0) > 0.99, "{} {}", at(&texture, 0.0), at(&texture, 1.0));
}

#[test]
fn each_smaller_picture_has_the_mean_of_the_first() {
    for (w, h) in [(64, 64), (7, 5), (1, 9), (13, 1)] {
        let image = Image::from_fn(w, h, |x, y| Vec4::new((x * 31 % 7) as f32, (y * 17 % 5) as f32, (x + y) as f32, 1.0));
        let mean = |image: &Image<Vec4>| image.data().iter().sum::<Vec4>() / image.data().len() as f32;
        let levels = pyramid(&image);
        assert_eq!(levels.last().unwrap().size(), (1, 1));
        for level in &levels {
            assert!(mean(level).abs_diff_eq(mean(&image), 1e-4), "{w}×{h}: {} {}", mean(level), mean(&image));
        }
    }
    assert!(pyramid(&Image::filled(1, 1, Vec4::ONE)).is_empty());
}

proptest! {
    /// A constant picture stays constant to the bit, whatever the size, the place and the footprint.
    #[test]
    fn constant_pictures_stay_constant(
        value in prop::array::uniform4(0.0f32..10.0), w in 1usize..40, h in 1usize..40, uv in prop::array::uniform2(-5.0f32..5.0),
        axes in prop::array::uniform4(-3.0f32..3.0), most in 0u32..100,
    ) {
        let value = Vec4::from_array(value);
        let texture = Texture::new(Arc::new(Image::filled(w, h, value)));
        let axes = [Vec2::new(axes[0], axes[1]), Vec2::new(axes[2], axes[3])];
        let found = texture.sample_over(Vec2::from_array(uv), &Footprint { axes, max_anisotropy: most });
        prop_assert_eq!(found, value);
        prop_assert_eq!(texture.sample(Vec2::from_array(uv)), value);
    }

    /// No footprint, however degenerate, leaves the range of the picture.
    #[test]
    fn lookups_stay_within_the_picture(bits in prop::array::uniform6(any::<u32>()), most in 0u32..100) {
        let [a, b, c, d, u, v] = bits.map(f32::from_bits);
        let footprint = Footprint { axes: [Vec2::new(a, b), Vec2::new(c, d)], max_anisotropy: most };
        let found = checkerboard(16, 2).sample_over(Vec2::new(u, v), &footprint);
        prop_assert!(found.cmpge(Vec4::splat(-1e-6)).all() && found.cmple(Vec4::splat(1.0 + 1e-6)).all(), "{}", found);
    }
}
