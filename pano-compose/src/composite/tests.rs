use super::*;
use glam::Vec2;
use pano_core::color::{LUMINANCE_WEIGHTS, luminance, srgb_to_linear};
use proptest::prelude::*;
use std::f32::consts::PI;

/// A photo with a gradient in it.
fn photo(width: usize, height: usize) -> RadianceImage {
    Image::from_fn(width, height, |x, y| Vec3::new(0.1 + x as f32, 0.2 + y as f32, 0.7))
}

fn run(photo: &RadianceImage, layers: &TracedLayers) -> (Composite, Clamped) {
    let mut out = Composite::new(photo.width(), photo.height());
    let clamped = composite(photo, layers, &mut out).unwrap();
    (out, clamped)
}

fn bits(image: &Image<Vec3>) -> Vec<[u32; 3]> {
    image.data().iter().map(|v| v.to_array().map(f32::to_bits)).collect()
}

#[test]
fn without_objects_the_photo_comes_back_bit_for_bit() {
    let mut photo = photo(7, 5);
    photo.set(0, 0, Vec3::new(1e-40, 3.3e38, 0.0));
    let mut layers = TracedLayers::empty(7, 5);
    layers.delta.set(1, 1, Vec3::splat(-0.0));
    let (out, clamped) = run(&photo, &layers);
    assert_eq!(bits(&out.color), bits(&photo));
    assert!(out.multiplier.data().iter().all(|&m| m == Vec3::ONE));
    assert_eq!(clamped, Clamped::default());
}

#[test]
fn the_formula_holds_where_something_changed() {
    let photo = photo(2, 1);
    let mut layers = TracedLayers::empty(2, 1);
    layers.coverage.set(1, 0, 0.25);
    layers.object.set(1, 0, Vec3::new(0.1, 0.2, 0.3));
    layers.delta.set(1, 0, Vec3::new(-0.3, 0.0, 0.15));
    let (out, clamped) = run(&photo, &layers);
    let p = photo.get(1, 0);
    let expected = p * 0.75 + Vec3::new(-0.2, 0.2, 0.45);
    assert!(out.color.get(1, 0).abs_diff_eq(expected, 1e-6), "{}", out.color.get(1, 0));
    let ratio = (p * 0.75 + layers.delta.get(1, 0)) / (p * 0.75);
    assert!(out.multiplier.get(1, 0).abs_diff_eq(ratio, 1e-6), "{}", out.multiplier.get(1, 0));
    assert_eq!(bits(&out.color)[0], bits(&photo)[0], "the neighbour is untouched");
    assert_eq!(clamped.pixels, 0);
}

#[test]
fn a_covered_pixel_shows_the_object_alone() {
    let photo = photo(1, 1);
    let mut layers = TracedLayers::empty(1, 1);
    layers.coverage.set(0, 0, 1.0);
    layers.object.set(0, 0, Vec3::new(0.5, 0.25, 4.0));
    let (out, _) = run(&photo, &layers);
    assert_eq!(out.color.get(0, 0), Vec3::new(0.5, 0.25, 4.0));
    assert_eq!(out.multiplier.get(0, 0), Vec3::ONE);
}

#[test]
fn clamping_counts_pixels_and_energy() {
    let photo = Image::filled(3, 1, Vec3::ONE);
    let mut layers = TracedLayers::empty(3, 1);
    layers.delta.set(0, 0, Vec3::new(-3.0, 0.0, -1.5));
    layers.delta.set(1, 0, Vec3::splat(-2.0));
    layers.delta.set(2, 0, Vec3::splat(-1.0));
    let (out, clamped) = run(&photo, &layers);
    assert_eq!(out.color.data(), [Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, Vec3::ZERO]);
    assert_eq!(out.multiplier.data(), out.color.data());
    assert_eq!(clamped.pixels, 2);
    let expected = f64::from(Vec3::new(2.0, 0.0, 0.5).dot(LUMINANCE_WEIGHTS) + luminance(Vec3::ONE));
    assert!((clamped.energy - expected).abs() < 1e-6, "{} for {expected}", clamped.energy);
}

#[test]
fn the_multiplier_has_a_finite_limit_where_the_photo_is_black() {
    // Photo → 0 in one pixel of a frame of mean about 1: 1 + delta / floor, approached continuously.
    let delta = 0.002;
    let at = |value: f32, exposure: f32| {
        let mut photo = Image::filled(100, 10, Vec3::splat(exposure));
        photo.set(3, 3, Vec3::splat(value * exposure));
        let mut layers = TracedLayers::empty(100, 10);
        layers.delta.set(3, 3, Vec3::splat(delta * exposure));
        run(&photo, &layers).0.multiplier.get(3, 3).x
    };
    let limit = 1.0 + delta / (MULTIPLIER_FLOOR * 0.999);
    assert!((at(0.0, 1.0) - limit).abs() < 1e-3, "{} for {limit}", at(0.0, 1.0));
    assert!((at(1e-6, 1.0) - limit).abs() < 1e-3);
    // Well above the floor the ratio is exact.
    assert!((at(0.1, 1.0) - 1.02).abs() < 1e-6);
    // Exposure cancels.
    for exposure in [1e-6, 1e6] {
        assert!((at(0.0, exposure) - limit).abs() < 1e-3, "{exposure}: {}", at(0.0, exposure));
    }
    // A black frame has no scale at all.
    let mut layers = TracedLayers::empty(2, 1);
    layers.delta.set(0, 0, Vec3::ONE);
    let (out, _) = run(&Image::filled(2, 1, Vec3::ZERO), &layers);
    assert_eq!((out.color.get(0, 0), out.multiplier.get(0, 0)), (Vec3::ONE, Vec3::ONE));
}

#[test]
fn the_channels_are_named_and_filled() {
    let photo = photo(3, 2);
    let mut layers = TracedLayers::empty(3, 2);
    layers.coverage.set(1, 1, 0.5);
    layers.object.set(1, 1, Vec3::new(1.0, 2.0, 3.0));
    layers.depth.set(1, 1, 4.0);
    layers.normal.set(1, 1, Vec3::Y);
    layers.albedo.set(1, 1, Vec3::new(0.1, 0.2, 0.3));
    let (out, _) = run(&photo, &layers);
    let channels = exr_channels(&out, &layers, &photo).unwrap();
    let names: Vec<&str> = channels.iter().map(|c| c.0.as_str()).collect();
    let expected = "R G B A object.R object.G object.B object.A delta.R delta.G delta.B multiplier.R multiplier.G \
        multiplier.B photo.R photo.G photo.B Z normal.X normal.Y normal.Z albedo.R albedo.G albedo.B";
    assert_eq!(names.join(" "), expected);
    let channel = |name: &str| channels.iter().find(|c| c.0 == name).unwrap().1.get(1, 1);
    assert_eq!(channel("A"), 1.0);
    assert_eq!(channel("object.B"), 3.0);
    assert_eq!(channel("object.A"), 0.5);
    assert_eq!(channel("Z"), 4.0);
    assert_eq!(channel("normal.Y"), 1.0);
    assert_eq!(channel("albedo.G"), 0.2);
    assert_eq!(channel("G"), out.color.get(1, 1).y);
    // What the file promises: the composite can be put together from its layers.
    for c in ["R", "G", "B"] {
        let layer = |name: &str| channel(&format!("{name}.{c}"));
        let sum = layer("photo") * (1.0 - channel("object.A")) + layer("delta") + layer("object");
        assert!((sum - channel(c)).abs() < 1e-6);
    }
}

#[test]
fn untouched_pixels_keep_their_8_bit_codes() {
    let codes = Image::from_fn(16, 16, |x, y| [(x + 16 * y) as u8, (255 - x - 16 * y) as u8, (7 * x) as u8]);
    let photo = codes.map(|p| Vec3::from_array(p.map(|c| srgb_to_linear(f32::from(c) / 255.0))));
    let mut layers = TracedLayers::empty(16, 16);
    layers.delta.set(4, 4, Vec3::splat(-1.0));
    let (out, _) = run(&photo, &layers);
    let encoded = encode_ldr(&out.color);
    for i in (0..256).filter(|&i| i != 4 + 16 * 4) {
        assert_eq!(encoded.data()[i], codes.data()[i]);
    }
    assert_eq!(encoded.get(4, 4), [0; 3]);
}

#[test]
fn encoding_clips_and_survives_anything() {
    let image = Image::from_vec(3, 1, vec![Vec3::splat(9.0), Vec3::splat(f32::NAN), Vec3::new(-1.0, f32::INFINITY, 0.5)]);
    let encoded = encode_ldr(&image.unwrap());
    assert_eq!(encoded.data(), [[255; 3], [0; 3], [0, 255, 188]]);
}

#[test]
fn sizes_that_differ_are_named() {
    let mut layers = TracedLayers::empty(4, 2);
    let error = composite(&photo(4, 2), &layers, &mut Composite::new(2, 4)).unwrap_err().to_string();
    assert!(error.contains("the output has 2×4 pixels, the photo 4×2"), "{error}");
    layers.normal = Image::filled(1, 1, Vec3::ZERO);
    let error = composite(&photo(4, 2), &layers, &mut Composite::new(4, 2)).unwrap_err().to_string();
    assert!(error.contains("normal"), "{error}");
    assert!(exr_channels(&Composite::new(4, 2), &layers, &photo(4, 2)).is_err());
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let photo = photo(31, 17);
    let mut layers = TracedLayers::empty(31, 17);
    layers.delta = Image::from_fn(31, 17, |x, y| Vec3::new(-0.7 * x as f32, 0.013 * y as f32, -0.9));
    let go = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&photo, &layers))
    };
    let (one, two) = (go(1), go(2));
    assert!(one.0 == two.0 && one.1.energy.to_bits() == two.1.energy.to_bits() && one.1.pixels > 0);
}

proptest! {
    #[test]
    fn finite_input_gives_finite_output_from_0(
        values in proptest::collection::vec(
            (prop_oneof![Just(0.0f32), 0.0f32..10.0, Just(f32::MAX), Just(1e-40)],
             prop_oneof![Just(0.0f32), -10.0f32..10.0, Just(f32::MAX), Just(f32::MIN)],
             prop_oneof![Just(0.0f32), 0.0f32..10.0, Just(f32::MAX)],
             prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..1.0, Just(1.0 - 6e-8)]), 1..20),
    ) {
        let n = values.len();
        let photo = Image::from_fn(n, 1, |x, _| Vec3::splat(values[x].0));
        let mut layers = TracedLayers::empty(n, 1);
        for (x, v) in values.iter().enumerate() {
            layers.delta.set(x, 0, Vec3::new(v.1, 0.0, -v.1));
            layers.object.set(x, 0, Vec3::splat(v.2));
            layers.coverage.set(x, 0, v.3);
        }
        let (out, clamped) = run(&photo, &layers);
        for image in [&out.color, &out.multiplier] {
            prop_assert!(image.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{:?}", image);
        }
        prop_assert!(clamped.energy.is_finite() && clamped.energy >= 0.0);
    }
}

/// One pixel of irradiance.
fn irradiance(share: f32, real: f32, change: f32) -> Irradiance {
    let one = |v: f32| Image::filled(2, 1, Vec3::splat(v));
    // The second pixel gives the frame its scale.
    let mut irradiance = Irradiance { share: Image::filled(2, 1, share), real: one(PI), change: one(0.0) };
    irradiance.real.set(0, 0, Vec3::splat(real * share));
    irradiance.change.set(0, 0, Vec3::splat(change * share));
    irradiance
}

fn grey(value: f32) -> RadianceImage {
    Image::filled(2, 1, Vec3::splat(value))
}

/// Eq. 2 on a diffuse surface: half the light, half the radiance, whatever the share; and no change is none, bit for bit.
#[test]
fn the_picture_changes_as_the_irradiance() {
    for share in [1.0, 0.25] {
        let irradiance = irradiance(share, 2.0, -1.0);
        let ratio = irradiance.ratio(&grey(0.3), 0.9).unwrap();
        assert!((ratio.get(0, 0).x - 0.5).abs() < 1e-6 && ratio.get(1, 0) == Vec3::ONE);
        let delta = delta_from_ratio(&grey(0.3), &irradiance.share, &ratio);
        assert!((delta.get(0, 0).x + 0.15 * share).abs() < 1e-6 && delta.get(1, 0) == Vec3::ZERO);
        assert!((irradiance.mixed().get(0, 0).x - share).abs() < 1e-6);
    }
}

/// E_R → 0: the change is that of a surface of reflectance `cap` at most, and a black frame has no ratio.
#[test]
fn no_irradiance_does_not_divide_by_nothing() {
    for real in [1.0, 1e-3, 1e-6, 1e-30, 0.0] {
        let ratio = irradiance(1.0, real, 0.5).ratio(&grey(0.2), 0.9).unwrap().get(0, 0).x;
        let change = (ratio - 1.0) * 0.2;
        assert!(ratio.is_finite() && change <= 0.5 * 0.9 / PI + 1e-6, "{real}: {ratio}");
        // Without radiance the floor of the frame's mean is left.
        let dark = irradiance(1.0, real, 0.5).ratio(&grey(0.0), 0.9).unwrap().get(0, 0).x;
        assert!(dark.is_finite() && dark <= 1.0 + 0.5 / (IRRADIANCE_FLOOR * 0.4 * PI), "{real}: {dark}");
    }
    let black = Irradiance { real: grey(0.0), ..irradiance(1.0, 0.0, 0.0) };
    assert_eq!(black.ratio(&grey(0.0), 0.9).unwrap().get(0, 0), Vec3::ONE);
}

/// Light that only a mirror image explains is lost where an object comes before it; a lamp, brighter than what it could
/// mirror, keeps its own.
#[test]
fn mirror_images_are_blocked_and_lamps_are_not() {
    let irradiance = irradiance(1.0, PI, 0.0);
    // Radiance 2 where .9 could be diffuse: 1.1 beyond, of a window of 4.
    let gloss = irradiance.gloss(&grey(2.0), &grey(4.0), 0.9).unwrap();
    assert!(gloss.get(0, 0).abs_diff_eq(Vec2::new(0.45, 0.275), 1e-6), "{gloss:?}");
    let change =
        |before: f32, after: f32| irradiance.mirror_delta(&grey(2.0), &gloss, &grey(before), &grey(after)).unwrap().get(0, 0).x;
    assert!((change(4.0, 1.0) - (1.0 - 4.0) * 1.1 / 4.0).abs() < 1e-5, "{}", change(4.0, 1.0));
    // An object before a quarter of the pixel takes a quarter of that; none takes nothing.
    assert!((change(1.0, 0.25) - 0.25 * change(4.0, 1.0)).abs() < 1e-6);
    assert_eq!(change(0.0, 0.0), 0.0);
    // More than the image there was cannot be taken, whatever is found to lie in the mirror direction.
    assert!((change(400.0, 0.0) + 1.1).abs() < 1e-5);
    // Before a wall of 0.5 it shines by itself, and nothing is beyond diffuse where little is sent out.
    assert_eq!(irradiance.gloss(&grey(2.0), &grey(0.5), 0.9).unwrap().get(0, 0), Vec2::X);
    assert_eq!(irradiance.gloss(&grey(0.5), &grey(4.0), 0.9).unwrap().get(0, 0), Vec2::X);
    assert!(irradiance.gloss(&grey(2.0), &Image::filled(3, 1, Vec3::ONE), 0.9).is_err());
    assert!(irradiance.ratio(&Image::filled(3, 1, Vec3::ONE), 0.9).is_err());
}
