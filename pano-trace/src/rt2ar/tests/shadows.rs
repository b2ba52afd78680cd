//! Shadows against closed forms, and the adaptive ones against all samples.

use super::*;
use crate::test_scenes::{SKY, ball, black, lamp, pixel, under};
use crate::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use glam::{Quat, Vec2};
use pano_core::builtin::primitives;
use proptest::prelude::*;

#[test]
fn the_umbra_keeps_the_light_of_the_map() {
    for shadow in [Shadow::Hard, Shadow::Soft, Shadow::Adaptive] {
        let light = lamp(Vec3::new(1.0, 1.0, 0.0), 0.3, 2.0);
        let out = lit(&ball(Vec3::new(0.0, 1.0, 0.0), 0.4, black()), &under(vec![light]), |p| p.shadow = shadow);
        let (x, y) = pixel(-1.0, 0.0);
        // E without is π·SKY + 2π·cos 45°, with the ball π·SKY.
        let expected = PHOTO * (SKY / (SKY + 2.0 * 0.5f32.sqrt()) - 1.0);
        let found = out.traced.layers.delta.get(x, y);
        assert!(found.abs_diff_eq(expected, 1e-4), "{shadow:?}: {found} {expected}");
        assert_eq!(out.shadows[0].get(x, y), 0.0);
        let (x, y) = pixel(1.5, 1.5);
        assert_eq!((out.traced.layers.delta.get(x, y), out.shadows[0].get(x, y)), (Vec3::ZERO, 1.0), "{shadow:?}");
    }
}

#[test]
fn penumbrae_are_as_wide_as_the_light() {
    for degrees in [1.0f32, 5.0, 10.0, 15.0] {
        let lighting = under(vec![lamp(Vec3::Y, degrees, 1.0)]);
        let out = lit(&ball(Vec3::new(0.0, 1.5, 0.0), 0.6, black()), &lighting, |p| (p.samples, p.shadow_samples) = (8, 64));
        let row = (SIZE / 2..SIZE).map(|x| out.shadows[0].get(x, SIZE / 2));
        let width = row.filter(|v| (0.01..0.99).contains(v)).count() as f32 * 4.0 / SIZE as f32;
        // Over the ball's rim, 1.5 m up, half of the light is seen; the penumbra's inner half lies under the ball.
        let expected = 1.5 * degrees.to_radians().tan();
        assert!((width - expected).abs() < 0.1, "{degrees}°: {width} {expected}");
    }
}

/// Inside the penumbra of a straight edge the share of a disc-shaped light that is seen is the segment of a circle.
#[test]
fn a_straight_edge_shows_segments_of_the_light() {
    let degrees = 10f32;
    // A half plane over x < 0, 1 m up.
    let edge = objects([(primitives::quad(Vec3::new(-9.0, 1.0, 9.0), Vec3::X * 9.0, Vec3::NEG_Z * 18.0), Vec3::ZERO, black())]);
    let out = lit(&edge, &under(vec![lamp(Vec3::Y, degrees, 1.0)]), |p| (p.samples, p.shadow_samples) = (16, 128));
    let radius = degrees.to_radians().tan();
    for x in [0.05f32, 0.1, 0.15] {
        let (px, py) = pixel(x, 0.3);
        // The pixel's middle; the plate hides what lies in front of it from above.
        let at = ((px as f32 + 0.5) / SIZE as f32 - 0.5) * 4.0;
        let h = at / radius;
        let hidden = if h >= 1.0 { 0.0 } else { (h.acos() - h * (1.0 - h * h).sqrt()) / std::f32::consts::PI };
        let found = out.shadows[0].get(px, py);
        assert!((found - (1.0 - hidden)).abs() < 0.04, "{x}: {found} {}", 1.0 - hidden);
    }
}

fn soft_and_adaptive(objects: &Objects, lighting: &Lighting, change: impl Fn(&mut Params<'_>)) -> [Rendered; 3] {
    [(Shadow::Soft, false), (Shadow::Adaptive, false), (Shadow::Adaptive, true)].map(|(shadow, spread)| {
        lit(objects, lighting, |p| {
            (p.shadow, p.spread) = (shadow, spread);
            change(p);
        })
    })
}

/// Pixels that `all` knows to be in a penumbra, and the share of them that `some` does not.
fn missed(all: &Rendered, some: &Rendered) -> (usize, f64) {
    let penumbra = all.penumbra.data().iter().filter(|p| **p).count();
    let lost = all.penumbra.data().iter().zip(some.penumbra.data()).filter(|(a, s)| **a && !**s).count();
    (penumbra, lost as f64 / penumbra.max(1) as f64)
}

#[test]
fn adaptive_shadows_are_the_soft_ones_where_the_probes_tell() {
    let lighting = under(vec![lamp(Vec3::new(0.5, 1.0, 0.2), 8.0, 2.0)]);
    let objects = ball(Vec3::new(0.0, 1.2, 0.0), 0.5, Material::default());
    let [soft, probes, spread] = soft_and_adaptive(&objects, &lighting, |p| p.samples = 1);
    let [soft_layers, probed, spread_out] = [&soft, &probes, &spread].map(|r| &r.traced.layers);
    let (count, share) = missed(&soft, &probes);
    assert!(count > 100 && share < 0.06, "{count} pixels of penumbra, {share} missed");
    assert!(missed(&soft, &spread).1 == 0.0, "{:?}", missed(&soft, &spread));
    // A missed sample or two of twenty.
    let most = PHOTO.max_element();
    assert!(largest_difference(&soft_layers.delta, &probed.delta) < 0.25 * most);
    assert_eq!(soft_layers.delta.data(), spread_out.delta.data(), "with the pixels beside penumbrae all of it");
    // What the ball's coat shows is sampled by its share of the pixel: no step is larger than one of twenty samples.
    assert!(largest_difference(&soft_layers.object, &spread_out.object) < most / 20.0);
}

/// Rods much thinner than the light: what five probes miss there, and what is left of it with the further means.
#[test]
fn what_five_probes_miss_is_bounded() {
    let rod = |i: i32| (primitives::cylinder(0.015, 3.0, 12), Vec3::new(i as f32 * 0.55, 0.05, 0.2 * i as f32), black());
    let objects = objects((-2..=2).map(rod));
    let lighting = under(vec![lamp(Vec3::new(0.9, 1.0, 0.3), 6.0, 2.0)]);
    let [soft, probes, spread] = soft_and_adaptive(&objects, &lighting, |p| (p.samples, p.shadow_samples) = (1, 50));
    let [plain, spread] = [&probes, &spread].map(|r| missed(&soft, r).1);
    // The pattern depends on the number of probes: each has all samples of its own to compare with.
    let [soft, more, _] = soft_and_adaptive(&objects, &lighting, |p| (p.samples, p.shadow_samples, p.probes) = (1, 50, 13));
    let more = missed(&soft, &more).1;
    println!("missed: five probes {plain:.3}, also beside penumbrae {spread:.3}, thirteen probes {more:.3}");
    assert!(plain > 0.1, "the case is hard: {plain}");
    assert!(spread < 0.01 && more < 0.5 * plain, "{plain} {spread} {more}");
}

#[test]
fn a_lamp_with_a_place_casts_a_shadow_that_grows() {
    // A lamp on a known ceiling 4 m over the plane: a ball half way up casts a shadow of twice its radius.
    let ceiling = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(40.0)),
        world_from_local: Affine3A::from_translation(Vec3::Y * 4.0),
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    let floor = Proxy { world_from_local: Affine3A::IDENTITY, ..ceiling.clone() };
    let world = ProxyWorld::new(Arc::new(RadianceImage::filled(8, 4, SKY)), Quat::IDENTITY, Vec3::Y, &[floor, ceiling]);
    let lighting = under(vec![lamp(Vec3::Y, 0.5, 1.0)]);
    let lights = place_lights(&world, &lighting);
    assert!((lights[0].distance - 3.0).abs() < 1e-4 && lights[0].center.abs_diff_eq(Vec3::Y * 4.0, 1e-4), "{lights:?}");
    let camera = Camera {
        position: Vec3::new(0.0, 3.9, 0.0),
        projection: pano_core::camera::Projection::Perspective { vfov: 2.0 * (2.0f32 / 3.9).atan() },
        ..from_above()
    };
    let objects = ball(Vec3::new(0.0, 2.0, 0.0), 0.3, black());
    let out = seen(&camera, &objects, &world, &lighting, |p| p.samples = 8);
    let dark = out.shadows[0].data().iter().filter(|v| **v < 0.5).count() as f32 * (4.0 / SIZE as f32).powi(2);
    let radius = (dark / std::f32::consts::PI).sqrt();
    // The tangent cone is a little wider than the ball's middle: 4·tan(asin(0.3/2)).
    let expected = 4.0 * (0.15f32).asin().tan();
    assert!((radius - expected).abs() < 0.04, "{radius} {expected}");
}

#[test]
fn real_surfaces_shade_objects_and_objects_one_another() {
    // A wall east of the ball keeps the low light from it; a plate above keeps the high one.
    let wall = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(6.0)),
        world_from_local: Affine3A::from_rotation_translation(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2), Vec3::X * 1.5),
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    let sky = Arc::new(RadianceImage::filled(8, 4, SKY));
    let world = ProxyWorld::new(sky, Quat::IDENTITY, Vec3::Y, &[wall]);
    let low = DirectionalLightFrom(Vec3::new(1.0, 0.3, 0.0)).light();
    let lighting = Lighting { capture: Vec3::new(5.0, 1.0, 0.0), ..under(vec![low]) };
    let one = ball(Vec3::new(0.0, 0.5, 0.0), 0.3, Material::diffuse(Vec3::ONE));
    let behind = seen(&from_above(), &one, &world, &lighting, |_| {});
    let open = lit(&one, &lighting, |_| {});
    let east = pixel(0.15, 0.0);
    let (dark, bright) = (behind.traced.layers.object.get(east.0, east.1), open.traced.layers.object.get(east.0, east.1));
    assert!(dark.abs_diff_eq(SKY, 0.01) && bright.min_element() > 1.3 * dark.max_element(), "{dark} {bright}");

    let high = under(vec![lamp(Vec3::Y, 1.0, 1.0)]);
    let white = Material::diffuse(Vec3::ONE);
    let lower = (primitives::cuboid(Vec3::new(2.0, 0.1, 2.0)), Vec3::Y * 0.2, white.clone());
    let upper = (primitives::cuboid(Vec3::new(0.5, 0.1, 0.5)), Vec3::new(0.3, 1.0, 0.0), white);
    let out = lit(&objects([lower, upper]), &under(vec![lamp(Vec3::new(-1.0, 1.0, 0.0), 1.0, 1.0)]), |_| {});
    // From 45° the shadow falls 0.8 m to the east of the upper plate.
    let (shadow, free) = (pixel(0.9, 0.0), pixel(-0.6, 0.0));
    assert_eq!((out.shadows[0].get(shadow.0, shadow.1), out.shadows[0].get(free.0, free.1)), (0.0, 1.0));
    assert!(high.lights.len() == 1);
}

/// A lamp of one degree.
struct DirectionalLightFrom(Vec3);

impl DirectionalLightFrom {
    fn light(self) -> pano_core::light::DirectionalLight {
        lamp(self.0, 1.0, 2.0)
    }
}

#[test]
fn coloured_glass_casts_a_coloured_shadow() {
    let tint = Vec3::new(0.9, 0.3, 0.1);
    let glass = Material { base_color: tint, thin: true, ..Material::glass(1.5, 0.0) };
    let pane = objects([(primitives::quad(Vec3::new(-0.5, 1.0, 0.5), Vec3::X, Vec3::NEG_Z), Vec3::ZERO, glass)]);
    let out = lit(&pane, &under(vec![lamp(Vec3::new(1.0, 1.0, 0.0), 0.5, 2.0)]), |_| {});
    let (x, y) = pixel(-1.0, 0.0);
    let face = crate::bsdf::dielectric(0.5f32.sqrt(), 1.5);
    let passes = tint * (1.0 - 2.0 * face / (1.0 + face));
    let lamp = 2.0 * 0.5f32.sqrt();
    let expected = PHOTO * lamp * (passes - 1.0) / (SKY + lamp);
    let found = out.traced.layers.delta.get(x, y);
    assert!(found.abs_diff_eq(expected, 2e-3), "{found} {expected}");
}

#[test]
fn a_lamp_is_not_white_paint() {
    // The photo is brighter than any paint under this light: it loses what white paint would, not in proportion.
    let bright = RadianceImage::filled(SIZE, SIZE, Vec3::splat(100.0));
    let (camera, objects) = (from_above(), ball(Vec3::new(0.0, 1.0, 0.0), 0.4, black()));
    let (world, lighting) = (plane(), under(vec![lamp(Vec3::new(1.0, 1.0, 0.0), 0.3, 1.0)]));
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let params = Params { reflectance_cap: 0.9, ..Params::new(&bright) };
    let out = render(&frame, &world, &lighting, &place_lights(&world, &lighting), &params, &Silent).unwrap();
    let least = out.traced.layers.delta.data().iter().map(|d| d.min_element()).fold(0.0, f32::min);
    let expected = -0.9 * 0.5f32.sqrt();
    assert!((least - expected).abs() < 1e-3, "{least} {expected}");
}

#[test]
fn ghosts_show_the_photo_and_are_shaded_in_mirrors() {
    // A mirror plate high over the plane faces down; a camera between sees the plane in it: albedo ½ under SKY and a lamp.
    let (half, strength) = (0.5, 1.0);
    let mirror = Material::metal(Vec3::ONE, 0.0);
    let plate = (primitives::cuboid(Vec3::new(4.0, 0.1, 4.0)), Vec3::Y * 3.0, mirror);
    let post = (primitives::icosphere(0.3, 3), Vec3::new(1.5, 0.5, 1.5), black());
    let camera =
        Camera { position: Vec3::Y, world_from_camera: pano_core::camera::rotation_from_yaw_pitch(0.0, 90.0), ..from_above() };
    let lighting = under(vec![lamp(Vec3::new(4.0, 1.0, 0.0), 0.3, strength)]);
    let out = seen(&camera, &objects([plate, post]), &plane(), &lighting, |p| p.shadows = false);
    let found = out.traced.layers.object.get(SIZE / 2, SIZE / 2);
    let expected = (SKY + strength / 17f32.sqrt()) * half;
    assert!(found.abs_diff_eq(expected, 1e-3), "{found} {expected}");
    assert_eq!(out.traced.layers.coverage.get(SIZE / 2, SIZE / 2), 1.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the material, the light and the place, the layers are finite.
    #[test]
    fn output_is_finite(
        base in prop::array::uniform3(0.0f32..=1.0), metallic in 0.0f32..=1.0, roughness in 0.0f32..=1.0,
        transmission in 0.0f32..=1.0, ior in 1.0f32..4.0, thin: bool, radius in 1e-4f32..3.0, height in -1.0f32..3.0,
        direction in prop::array::uniform3(-1.0f32..1.0), degrees in 0.01f32..170.0, strength in 0.0f32..1e6,
        gloss in 0.0f32..=1.0, probes in 5u32..64, samples in 1u32..64,
    ) {
        let direction = Vec3::from_array(direction).try_normalize().unwrap_or(Vec3::Y);
        let lighting = under(vec![lamp(direction, degrees, strength), lamp(-direction, 1.0, 1.0)]);
        let material = Material {
            base_color: Vec3::from_array(base), metallic, roughness, transmission, ior, thin,
            attenuation_color: Vec3::new(0.0, 0.5, 1.0), attenuation_distance: 0.1, ..Material::default()
        };
        let mesh = primitives::icosphere(radius, 2);
        let things = objects([(mesh.clone(), Vec3::Y * height, material.clone()), (mesh, Vec3::new(0.1, height, 0.1), material)]);
        let camera = Camera { width: 7, height: 7, ..from_above() };
        let out = seen(&camera, &things, &plane(), &lighting, |p| {
            (p.samples, p.shadow_samples, p.probes, p.gloss) = (2, samples, probes, gloss);
        });
        let layers = &out.traced.layers;
        prop_assert!(layers.object.data().iter().chain(layers.delta.data()).all(|v| v.is_finite()));
        prop_assert!(layers.object.data().iter().all(|v| v.min_element() >= 0.0));
        prop_assert!(out.shadows.iter().flat_map(|s| s.data()).all(|v| (-1e-5..=1.00001).contains(v)));
    }
}

#[test]
fn light_beyond_all_numbers_is_at_most_taken_away() {
    let change = |irradiance: f32| shade::Change {
        without: Vec3::INFINITY,
        irradiance: Vec3::splat(irradiance),
        ..shade::Change::default()
    };
    assert_eq!(change(f32::NAN).of(Vec3::ONE, 0.9), Vec3::ZERO);
    assert_eq!(change(f32::NEG_INFINITY).of(Vec3::ONE, 0.9), -Vec3::ONE);
}
