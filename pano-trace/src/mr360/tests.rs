//! Closed forms: a ball over a plane under uniform light and one lamp.

use super::*;
use crate::objects::Objects;
use crate::test_scenes::{PHOTO, SIZE, SKY, ball, black, from_above, lamp, pixel, plane, under};
use crate::tracer::Frame;
use glam::{Quat, Vec2};
use pano_core::image::Image;
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use std::f32::consts::TAU;

fn lit(objects: &Objects, lighting: &Lighting, change: impl Fn(&mut Params<'_>)) -> Lit {
    let photo = Image::filled(SIZE, SIZE, PHOTO);
    let mut params =
        Params { samples: 32, shadows: true, ambient_occlusion: false, gloss: 0.0, gloss_roughness: 0.0, photo: &photo };
    change(&mut params);
    let camera = from_above();
    let frame = Frame { camera: &camera, objects, stream: Stream::default() };
    let lit = render(&frame, &plane(), lighting, &params, &Silent).unwrap();
    assert_eq!(lit.traced.discarded, 0);
    lit
}

#[test]
fn the_umbra_keeps_the_light_of_the_map() {
    // From 45° the shadow of a ball at height 1 lies 1 m off.
    let light = lamp(Vec3::new(1.0, 1.0, 0.0), 0.3, 2.0);
    let out = lit(&ball(Vec3::new(0.0, 1.0, 0.0), 0.4, black()), &under(vec![light]), |_| {});
    let (x, y) = pixel(-1.0, 0.0);
    // E without is π·SKY + 2π·cos 45°, with the ball π·SKY.
    let expected = PHOTO * (SKY / (SKY + 2.0 * 0.5f32.sqrt()) - 1.0);
    assert!(out.traced.layers.delta.get(x, y).abs_diff_eq(expected, 1e-4), "{} {expected}", out.traced.layers.delta.get(x, y));
    assert_eq!(out.shadows[0].get(x, y), 0.0);
    let (x, y) = pixel(1.5, 1.5);
    assert_eq!((out.traced.layers.delta.get(x, y), out.shadows[0].get(x, y)), (Vec3::ZERO, 1.0), "elsewhere nothing changes");
}

#[test]
fn penumbrae_are_as_wide_as_the_light() {
    for degrees in [1.0f32, 5.0, 10.0, 15.0] {
        let out =
            lit(&ball(Vec3::new(0.0, 1.5, 0.0), 0.6, black()), &under(vec![lamp(Vec3::Y, degrees, 1.0)]), |p| p.samples = 64);
        let row = (SIZE / 2..SIZE).map(|x| out.shadows[0].get(x, SIZE / 2));
        let width = row.filter(|v| (0.01..0.99).contains(v)).count() as f32 * 4.0 / SIZE as f32;
        // Over the ball's rim, 1.5 m up, half of the light is seen; the penumbra's inner half lies under the ball.
        let expected = 1.5 * degrees.to_radians().tan();
        assert!((width - expected).abs() < 0.1, "{degrees}°: {width} {expected}");
    }
}

#[test]
fn shadows_fall_away_from_their_lights() {
    for turn in 0..8 {
        let direction = Quat::from_rotation_y(turn as f32 * TAU / 8.0) * Vec3::new(1.0, 1.2, 0.0);
        let out = lit(&ball(Vec3::new(0.0, 0.7, 0.0), 0.3, black()), &under(vec![lamp(direction, 2.0, 1.0)]), |p| p.samples = 8);
        let mut sum = Vec2::ZERO;
        for (i, d) in out.traced.layers.delta.data().iter().enumerate() {
            sum += Vec2::new((i % SIZE) as f32 + 0.5, (i / SIZE) as f32 + 0.5) * -d.x - Vec2::splat(0.5 * SIZE as f32) * -d.x;
        }
        let away = -Vec2::new(direction.x, direction.z).normalize();
        assert!(sum.normalize().dot(away) > 0.999, "turn {turn}: {sum} {away}");
    }
}

#[test]
fn two_lights_cast_two_shadows_that_add() {
    let lights = [Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 0.0)].map(|d| lamp(d, 1.0, 1.0));
    let objects = ball(Vec3::new(0.0, 0.8, 0.0), 0.3, black());
    let both = lit(&objects, &under(lights.to_vec()), |_| {});
    assert_eq!(both.shadows.len(), 2);
    let (left, right) = (pixel(-0.8, 0.0), pixel(0.8, 0.0));
    let at = |shadow: &Image<f32>, (x, y): (usize, usize)| shadow.get(x, y);
    assert_eq!((at(&both.shadows[0], left), at(&both.shadows[0], right)), (0.0, 1.0));
    assert_eq!((at(&both.shadows[1], left), at(&both.shadows[1], right)), (1.0, 0.0));
    let off = lit(&objects, &under(lights.to_vec()), |p| p.shadows = false);
    assert!(off.traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
}

#[test]
fn a_white_ball_vanishes_in_uniform_light() {
    let objects = ball(Vec3::new(0.0, 0.5, 0.0), 0.5, Material::diffuse(Vec3::ONE));
    let out = lit(&objects, &under(vec![]), |p| p.ambient_occlusion = true);
    let layers = &out.traced.layers;
    for (i, (object, coverage)) in layers.object.data().iter().zip(layers.coverage.data()).enumerate() {
        assert!(object.abs_diff_eq(SKY * *coverage, 1e-3), "pixel {i}: {object} at {coverage}");
    }
    assert!(layers.delta.data().iter().all(|d| d.abs().max_element() < 1e-3), "what it blocks it sends back");
}

#[test]
fn a_black_ball_darkens_the_ground_by_its_form_factor() {
    let objects = ball(Vec3::new(0.0, 1.0, 0.0), 0.5, black());
    let out = lit(&objects, &under(vec![]), |p| (p.ambient_occlusion, p.samples) = (true, 256));
    for (x, z) in [(1.2, 0.0), (0.0, -0.9), (-1.0, 1.0)] {
        let to = Vec3::new(0.0, 1.0, 0.0) - Vec3::new(x, 0.0, z);
        let form_factor = to.y / to.length() * 0.25 / to.length_squared();
        let (px, py) = pixel(x, z);
        let mean = (0..25).map(|i| out.traced.layers.delta.get(px + i % 5 - 2, py + i / 5 - 2)).sum::<Vec3>() / 25.0;
        let error = (mean / PHOTO + form_factor).abs().max_element();
        // 6400 samples; a pixel is 8 cm wide.
        assert!(error < 0.015, "({x}, {z}): {} {form_factor}", mean / PHOTO);
    }
    let off = lit(&objects, &under(vec![]), |_| {});
    assert!(off.traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
}

#[test]
fn only_glossy_floors_mirror_objects() {
    let shining = Material { emissive: Vec3::splat(10.0), ..black() };
    let objects = ball(Vec3::new(0.0, 1.0, 0.0), 0.5, shining);
    let matt = lit(&objects, &under(vec![]), |_| {});
    assert!(matt.traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
    // From above the mirror image is under the ball, which hides it; a rough floor spreads it.
    let glossy = lit(&objects, &under(vec![]), |p| (p.gloss, p.gloss_roughness, p.samples) = (1.0, 0.7, 64));
    let sum: Vec3 = glossy.traced.layers.delta.data().iter().sum();
    assert!(sum.min_element() > 0.0);
    let half = lit(&objects, &under(vec![]), |p| (p.gloss, p.gloss_roughness, p.samples) = (0.5, 0.7, 64));
    let ratio = half.traced.layers.delta.data().iter().sum::<Vec3>() / sum;
    assert!(ratio.abs_diff_eq(Vec3::splat(0.5), 1e-3), "{ratio}");
}

#[test]
fn mirrors_and_glass_show_the_sky() {
    for material in [Material::metal(Vec3::ONE, 0.0), Material::glass(1.0001, 0.0)] {
        let objects = ball(Vec3::new(0.0, 3.0, 0.0), 0.5, material);
        let layers = lit(&objects, &under(vec![]), |_| {}).traced.layers;
        let center = SIZE / 2;
        assert!(layers.object.get(center, center).abs_diff_eq(SKY, 0.02), "{}", layers.object.get(center, center));
    }
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let objects = ball(Vec3::new(0.0, 0.8, 0.0), 0.4, Material::default());
    let lighting = under(vec![lamp(Vec3::new(1.0, 1.0, 0.3), 8.0, 2.0)]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lit(&objects, &lighting, |p| (p.ambient_occlusion, p.gloss) = (true, 0.5)))
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one.traced.layers.delta.data(), two.traced.layers.delta.data());
    assert_eq!(one.traced.layers.object.data(), two.traced.layers.object.data());
    assert_eq!(one.shadows, two.shadows);
}

#[test]
fn black_light_and_no_light_change_nothing() {
    let mut dark = under(vec![]);
    let black_map = RadianceImage::filled(2, 1, Vec3::ZERO);
    dark.maps =
        RadianceMaps { diffuse: black_map.clone(), glossy: std::array::from_fn(|_| black_map.clone()), mirror: black_map };
    let out = lit(&ball(Vec3::Y, 0.5, Material::diffuse(Vec3::ONE)), &dark, |p| p.ambient_occlusion = true);
    assert!(out.traced.layers.delta.data().iter().chain(out.traced.layers.object.data()).all(|d| *d == Vec3::ZERO));
}
