//! Reflection and refraction against the laws they follow.

use super::super::lights::Pattern;
use super::super::media::{Media, refracted};
use super::super::shade::{Change, Shader};
use super::super::trail::{Path, Trail};
use super::*;
use crate::bsdf::dielectric;
use crate::bvh::Ray;
use crate::objects::{Absorption, Body};
use crate::test_scenes::{SKY, ball, lamp, under};
use crate::tracer::{TraceParams, Tracer};
use crate::world::{Environment, LightSample, ProxyWorld, RealHit};
use glam::{DVec3, Quat, Vec2};
use pano_core::builtin::primitives;
use proptest::prelude::*;

/// A picture of directions: every colour is one.
fn directions() -> ProxyWorld {
    let (w, h) = (512, 256);
    let picture = RadianceImage::from_fn(w, h, |x, y| {
        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
        pano_core::sphere::direction_from_uv(uv) + 2.0
    });
    ProxyWorld::new(Arc::new(picture), Quat::IDENTITY, Vec3::ZERO, &[])
}

fn color_of(direction: DVec3) -> DVec3 {
    direction + 2.0
}

/// Radiance along one ray that meets an object, without lights.
fn along<W: RealWorld>(objects: &Objects, world: &W, ray: Ray, depth: u32) -> Vec3 {
    let (photo, lighting) = (RadianceImage::filled(1, 1, Vec3::ZERO), under(vec![]));
    let params = Params { depth, ..Params::new(&photo) };
    let trace = TraceParams::default();
    let tracer = Tracer { objects, world, params: &trace };
    let (patterns, response) = (Pattern::ladder(20, 5), Pattern::new(12, 5));
    let shader = Shader { tracer, lighting: &lighting, lights: &[], patterns, response, brightest: f32::MAX, params: &params };
    let mut trail = Trail::new(false);
    let met = shader.meet(&ray, Media::default(), true, RealWorld::hit, &mut 0);
    let crate::tracer::First::Object(hit) = met.first else { panic!("{ray:?} misses") };
    shader.object(&ray, &hit, Path { media: met.media, ..Path::primary() }, &mut trail)
}

/// Rays along −Z at these distances from the axis of a unit sphere.
const OFFSETS: [(f64, f64); 6] = [(0.0, 0.0), (0.2, 0.1), (-0.5, 0.3), (0.1, -0.7), (0.6, 0.6), (0.85, -0.2)];

fn unit_sphere(material: Material) -> Objects {
    objects([(primitives::icosphere(1.0, 6), Vec3::ZERO, material)])
}

fn toward_sphere((x, y): (f64, f64)) -> (Ray, DVec3) {
    let at = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
    (Ray::new(Vec3::new(x as f32, y as f32, 5.0), Vec3::NEG_Z), at)
}

#[test]
fn a_mirror_sphere_shows_the_reflected_direction() {
    let sphere = unit_sphere(Material::metal(Vec3::ONE, 0.0));
    for offset in OFFSETS {
        let (ray, normal) = toward_sphere(offset);
        let d = DVec3::NEG_Z;
        let expected = color_of(d - normal * (2.0 * d.dot(normal)));
        let found = along(&sphere, &directions(), ray, 6).as_dvec3();
        // The picture's grid is 0.7° wide, the sphere's 1°; its normals are interpolated.
        assert!((found - expected).abs().max_element() < 3e-3, "{offset:?}: {found} {expected}");
    }
}

/// Everything a ray sees in a glass sphere: at each meeting with its surface the same share is reflected.
fn glass_sphere(normal: DVec3, ior: f64) -> DVec3 {
    let d = DVec3::NEG_Z;
    let cos = -d.dot(normal);
    let share = f64::from(dielectric(cos as f32, ior as f32));
    let bend = |d: DVec3, n: DVec3, eta: f64| {
        let cos = -d.dot(n);
        d / eta + n * (cos / eta - (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt())
    };
    let mut sum = color_of(d - normal * (2.0 * d.dot(normal))) * share;
    let (mut inside, mut at, mut left) = (bend(d, normal, ior), normal, 1.0 - share);
    for _ in 0..40 {
        at -= inside * (2.0 * at.dot(inside));
        sum += color_of(bend(inside, -at, 1.0 / ior)) * (left * (1.0 - share));
        // Rounding would grow from chord to chord.
        (at, inside) = (at.normalize(), (inside - at * (2.0 * inside.dot(at))).normalize());
        left *= share;
    }
    sum
}

#[test]
fn a_glass_sphere_shows_the_refracted_directions() {
    for ior in [1.1f32, 1.33, 1.5, 2.4] {
        let sphere = unit_sphere(Material::glass(ior, 0.0));
        for offset in OFFSETS {
            let (ray, normal) = toward_sphere(offset);
            let expected = glass_sphere(normal, f64::from(ior));
            let found = along(&sphere, &directions(), ray, 16).as_dvec3();
            // The same grids; two refractions at up to 2.4 bend three times as much.
            assert!((found - expected).abs().max_element() < 1e-2, "ior {ior}, {offset:?}: {found} {expected}");
        }
    }
}

#[test]
fn beyond_the_depth_the_environment_is_seen() {
    let sphere = unit_sphere(Material::glass(1.5, 0.0));
    let (ray, _) = toward_sphere((0.0, 0.0));
    // Straight on, all directions are ±Z, and what is not followed keeps the last direction.
    let found = along(&sphere, &directions(), ray, 0);
    let expected = Vec3::new(2.0, 2.0, 0.04 * 3.0 + 0.96);
    assert!(found.abs_diff_eq(expected, 5e-3), "{found} {expected}");
}

/// A wall behind everything whose colour is its place, under a black sky.
#[derive(Debug)]
struct Wall {
    z: f32,
    black: RadianceImage,
}

fn wall(z: f32) -> Wall {
    Wall { z, black: RadianceImage::filled(2, 1, Vec3::ZERO) }
}

impl Wall {
    fn color(at: Vec3) -> Vec3 {
        Vec3::new(3.0 + at.x, 3.0 + at.y, 1.0)
    }
}

impl RealWorld for Wall {
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        let t = (self.z - ray.origin.z) / ray.direction.z;
        let position = ray.at(t);
        (t > 0.0 && t < ray.t_max).then(|| RealHit {
            t,
            position,
            normal: Vec3::Z,
            facet: Vec3::Z,
            surface: 0,
            radiance: Some(Self::color(position)),
        })
    }

    fn infinity(&self, _direction: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn reflectance(&self, _hit: &RealHit) -> Vec3 {
        Vec3::ZERO
    }

    fn sample_light(&self, _from: Vec3, _u: Vec2) -> Option<LightSample> {
        None
    }

    fn light_pdf(&self, _from: Vec3, _direction: Vec3, _behind: Option<&RealHit>) -> f32 {
        0.0
    }

    fn reach(&self, _ray: &Ray, _sample: &LightSample) -> Option<Option<RealHit>> {
        None
    }

    fn environment(&self) -> Environment<'_> {
        Environment { radiance: &self.black, light: None, pano_from_world: Quat::IDENTITY }
    }

    fn sees_itself(&self) -> bool {
        false
    }

    fn leave(&self, hit: &RealHit) -> Vec3 {
        hit.position + hit.normal * 1e-4
    }
}

#[test]
fn a_glass_slab_shifts_a_ray_by_the_closed_form() {
    let (thickness, ior) = (0.5f64, 1.5f64);
    let slab = objects([(primitives::cuboid(Vec3::new(20.0, 20.0, thickness as f32)), Vec3::ZERO, Material::glass(1.5, 0.0))]);
    for degrees in [0.0f64, 10.0, 30.0, 50.0, 70.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let direction = Vec3::new(sin as f32, 0.0, -cos as f32);
        let start = Vec3::new(-1.0, 0.5, 2.0);
        let found = along(&slab, &wall(-3.0), Ray::new(start, direction), 40).as_dvec3();
        let sin_inside = sin / ior;
        let cos_inside = (1.0 - sin_inside * sin_inside).sqrt();
        // Sideways at the same z: in air the slab's thickness takes it t·tan θ to the side, in glass t·tan θ′.
        let shift = thickness * (sin_inside / cos_inside - sin / cos);
        let straight = f64::from(start.x) + 5.0 * sin / cos;
        let face = f64::from(dielectric(cos as f32, 1.5));
        // Twice more through the slab for each pair of reflections inside.
        let (mut expected, mut weight) = (DVec3::ZERO, (1.0 - face) * (1.0 - face));
        for pair in 0..30 {
            let x = straight + shift + f64::from(pair) * 2.0 * thickness * sin_inside / cos_inside;
            expected += DVec3::new(3.0 + x, 3.5, 1.0) * weight;
            weight *= face * face;
        }
        assert!((found - expected).abs().max_element() < 1e-3, "{degrees}°: {found} {expected}");
    }
}

#[test]
fn a_thin_pane_does_not_shift_a_ray_and_tints_by_channel() {
    let tint = Vec3::new(0.9, 0.5, 0.2);
    let material = Material { thin: true, base_color: tint, transmission: 0.5, specular: 0.0, ..Material::glass(1.5, 0.0) };
    let pane = objects([(primitives::quad(Vec3::new(-9.0, -9.0, 0.0), Vec3::X * 18.0, Vec3::Y * 18.0), Vec3::ZERO, material)]);
    let direction = Vec3::new(0.3, 0.1, -1.0).normalize();
    let found = along(&pane, &wall(-3.0), Ray::new(Vec3::new(-1.0, 0.5, 2.0), direction), 4);
    let face = dielectric(-direction.z, 1.5);
    let expected = Wall::color(Vec3::new(0.5, 1.0, -3.0)) * tint * 0.5 * (1.0 - 2.0 * face / (1.0 + face));
    // Half of the pane is opaque, with the same base colour under the sky of `under`.
    let opaque = tint * 0.5 * SKY;
    assert!(found.abs_diff_eq(expected + opaque, 1e-4), "{found} {expected} {opaque}");
}

#[test]
fn light_beyond_the_critical_angle_stays_inside() {
    // Inside a block, a ray meets faces at 50° and 40°: beyond and within the critical angle of 41.8°.
    let material = Material { base_color: Vec3::new(1.0, 0.5, 0.25), ..Material::glass(1.5, 0.0) };
    let block = objects([(primitives::cuboid(Vec3::splat(2.0)), Vec3::ZERO, material)]);
    let ray = Ray::new(Vec3::new(0.0, 0.0, 0.0), Vec3::new(50f32.to_radians().sin(), 0.0, -50f32.to_radians().cos()));
    let inside = along(&block, &directions(), ray, 0);
    // The first face is that at +x, met at 40°; at depth 0 what it sends on is seen in the directions it goes.
    let face = dielectric(40f32.to_radians().cos(), 1.0 / 1.5);
    assert!(face > 0.0 && face < 1.0 && dielectric(50f32.to_radians().cos(), 1.0 / 1.5) == 1.0);
    let out = refracted(ray.direction, Vec3::NEG_X, 1.0 / 1.5).unwrap();
    let back = Vec3::new(-ray.direction.x, 0.0, ray.direction.z);
    let expected = (back + 2.0) * face + (out + 2.0) * (1.0 - face) * material_tint();
    assert!(inside.abs_diff_eq(expected, 6e-3), "{inside} {expected}");
    let steep = Ray::new(Vec3::ZERO, Vec3::new(40f32.to_radians().sin(), 0.0, -40f32.to_radians().cos()));
    // Now the face at −z comes first, at 40° again; turned by a little over 8° more it reflects everything.
    let total = Ray::new(Vec3::new(0.0, 0.0, -0.9), Vec3::new(50f32.to_radians().sin(), 0.0, -50f32.to_radians().cos()));
    assert!(along(&block, &directions(), steep, 0).is_finite());
    let mirrored = Vec3::new(total.direction.x, 0.0, -total.direction.z);
    let found = along(&block, &directions(), total, 0);
    assert!(found.abs_diff_eq(mirrored + 2.0, 5e-3), "all of it, without colour: {found}");
}

fn material_tint() -> Vec3 {
    Vec3::new(1.0, 0.5, 0.25)
}

#[test]
fn a_body_with_the_index_of_air_is_invisible_to_the_bit() {
    let lighting = under(vec![lamp(Vec3::new(1.0, 1.0, 0.2), 6.0, 2.0), lamp(Vec3::new(-1.0, 2.0, 0.0), 1.0, 1.0)]);
    let things = || {
        vec![
            (primitives::icosphere(0.3, 3), Vec3::new(-0.3, 0.6, 0.1), Material::default()),
            (primitives::icosphere(0.2, 3), Vec3::new(0.9, 0.9, 0.9), Material::glass(1.5, 0.0)),
        ]
    };
    let invisible = Material { ior: 1.0, ..Material::glass(1.5, 0.0) };
    let mut more = things();
    more.push((primitives::icosphere(0.5, 3), Vec3::new(0.1, 1.2, 0.2), invisible.clone()));
    more.push((primitives::cuboid(Vec3::splat(3.0)), Vec3::new(0.0, 1.7, 0.0), invisible));
    for shadow in [Shadow::Hard, Shadow::Soft, Shadow::Adaptive] {
        let render = |things| lit(&objects(things), &lighting, |p| (p.shadow, p.gloss) = (shadow, 0.6));
        let (without, with) = (render(things()), render(more.clone()));
        let (a, b) = (&without.traced.layers, &with.traced.layers);
        assert!(a.object == b.object && a.coverage == b.coverage, "{shadow:?}");
        assert!(a.delta == b.delta && a.depth == b.depth, "{shadow:?}");
        assert!(without.shadows == with.shadows, "{shadow:?}");
        assert!(a.coverage.data().iter().any(|c| *c > 0.0) && a.delta.data().iter().any(|d| *d != Vec3::ZERO));
    }
}

#[test]
fn glass_in_the_same_glass_does_not_show() {
    let glass = Material::glass(1.5, 0.0);
    let one = unit_sphere(glass.clone());
    let nested = objects([
        (primitives::icosphere(1.0, 6), Vec3::ZERO, glass.clone()),
        (primitives::icosphere(0.5, 4), Vec3::new(0.1, 0.0, 0.2), glass),
    ]);
    for offset in OFFSETS {
        let (ray, _) = toward_sphere(offset);
        let (a, b) = (along(&one, &directions(), ray, 8), along(&nested, &directions(), ray, 8));
        // The way goes on from the inner surface, some units in the last place off.
        assert!(a.abs_diff_eq(b, 1e-4), "{offset:?}: {a} {b}");
    }
}

#[test]
fn a_hollow_sphere_bends_light_as_two_shells_do() {
    // A bubble of index 1 in glass. On the axis all is straight: four faces of the same reflectance r, a stack of plates.
    let bubble = Material { ior: 1.0, ..Material::glass(1.5, 0.0) };
    let hollow = objects([
        (primitives::icosphere(1.0, 5), Vec3::ZERO, Material::glass(1.5, 0.0)),
        (primitives::icosphere(0.8, 5), Vec3::ZERO, bubble),
    ]);
    let found = along(&hollow, &directions(), toward_sphere((0.0, 0.0)).0, 40);
    let r = dielectric(1.0, 1.5);
    // Four plane faces in a row let 1/(1 + 4·2r/(1−r)/2) … of the light through: T = (1−r)/(1+(2m−1)r), m = 2 plates.
    let through = (1.0 - r) / (1.0 + 3.0 * r);
    let expected = through + 3.0 * (1.0 - through);
    assert!((found.z - expected).abs() < 5e-3, "{found} {expected}");
    assert!((found.x - 2.0).abs() < 5e-3 && (found.y - 2.0).abs() < 5e-3, "{found}");
}

fn body(ior: f32) -> Body {
    Body { ior, factors: Vec3::ONE, clear: 1.0, thin: false, alpha: 0.0, absorption: Absorption::NONE }
}

#[test]
fn media_remember_where_the_ray_is() {
    let air = Media::default();
    let (glass, eta) = air.beyond(7, &body(1.5), true);
    assert_eq!((glass.ior(), eta), (1.5, 1.5));
    let (water, eta) = glass.beyond(8, &body(1.33), true);
    assert_eq!((water.ior(), eta), (1.33, 1.33 / 1.5));
    // Overlapping: the glass is left first, and nothing changes until the water is.
    let (still, eta) = water.beyond(7, &body(1.5), false);
    assert_eq!((still.ior(), eta), (1.33, 1.0));
    let (out, eta) = still.beyond(8, &body(1.33), false);
    assert_eq!((out.ior(), eta), (1.0, 1.0 / 1.33));
    // A ray that begins inside comes out.
    let (out, eta) = air.beyond(3, &body(2.0), false);
    assert_eq!((out.ior(), eta), (1.0, 0.5));
    // Beyond what is told apart a body is passed.
    let mut deep = air;
    for i in 0..20 {
        deep = deep.beyond(i, &body(1.5), true).0;
    }
    assert_eq!(deep.beyond(30, &body(1.2), true).1, 1.0);
}

#[test]
fn absorption_counts_by_the_way_inside() {
    let color = Vec3::new(0.8, 0.4, 0.1);
    // Index 1.0001 reflects nothing to speak of, and is no case of its own.
    let material = Material { ior: 1.0001, attenuation_color: color, attenuation_distance: 1.0, ..Material::glass(1.5, 0.0) };
    let inner = Material { attenuation_color: Vec3::ONE, attenuation_distance: f32::INFINITY, ..material.clone() };
    let sphere =
        objects([(primitives::icosphere(1.0, 5), Vec3::ZERO, material), (primitives::icosphere(0.5, 5), Vec3::ZERO, inner)]);
    let found = along(&sphere, &directions(), toward_sphere((0.0, 0.0)).0, 12);
    // Two metres of way, one of them through the clear core.
    let expected = color * Vec3::new(2.0, 2.0, 1.0);
    assert!(found.abs_diff_eq(expected, 5e-3), "{found} {expected}");
}

#[test]
fn mirrors_see_one_another_again_and_again() {
    // Between two parallel mirrors of reflectance ½ each further reflection is half as bright.
    let half = Material::metal(Vec3::splat(0.5), 0.0);
    let mirror = |z: f32| (primitives::quad(Vec3::new(-5.0, -5.0, z), Vec3::X * 10.0, Vec3::Y * 10.0), Vec3::ZERO, half.clone());
    let mirrors = objects([mirror(-1.0), mirror(1.0)]);
    let ray = Ray::new(Vec3::ZERO, Vec3::NEG_Z);
    for depth in 0..6 {
        let found = along(&mirrors, &directions(), ray, depth);
        // What is not followed sees the environment in the last direction, ±Z.
        let last = if depth % 2 == 0 { 3.0 } else { 1.0 };
        let expected = 0.5f32.powi(depth as i32 + 1) * last;
        assert!((found.z - expected).abs() < 4e-3 * expected, "depth {depth}: {} {expected}", found.z);
    }
}

#[test]
fn objects_show_in_glossy_real_surfaces_and_those_in_objects() {
    // A mirror ball above a glossy floor: the floor shows the ball, and the ball shows a floor that shows the ball.
    let lighting = under(vec![]);
    let black = ball(Vec3::new(0.0, 1.0, 0.0), 0.5, Material::diffuse(Vec3::ZERO));
    let matt = lit(&black, &lighting, |_| {});
    let glossy = lit(&black, &lighting, |p| (p.gloss, p.gloss_roughness) = (1.0, 0.5));
    assert!(matt.traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
    let sum: Vec3 = glossy.traced.layers.delta.data().iter().sum();
    assert!(sum.max_element() < 0.0, "a black ball takes light out of the floor's mirror image: {sum}");
    let mirror = ball(Vec3::new(0.0, 1.0, 0.0), 0.5, Material::metal(Vec3::ONE, 0.0));
    let seen = |gloss: f32, depth: u32| {
        lit(&mirror, &lighting, |p| (p.gloss, p.gloss_roughness, p.depth) = (gloss, 0.0, depth)).traced.layers.object
    };
    assert!(largest_difference(&seen(0.0, 4), &seen(1.0, 4)) < 0.2, "a mirror image in a mirror image");
    assert_eq!(largest_difference(&seen(0.0, 1), &seen(1.0, 1)), 0.0, "not followed so far");
}

/// A shadow takes a highlight that the picture has; of one brighter than the picture, which is not in it, less the brighter it is.
#[test]
fn a_highlight_that_is_not_in_the_picture_is_not_taken_from_it() {
    let lost = |picture: f32, highlight: f32| {
        let highlight = Vec3::splat(highlight);
        let change = Change { without: Vec3::ONE, highlight, dimmed: -highlight, ..Change::default() };
        -change.of(Vec3::splat(picture), 0.9).y
    };
    for (picture, highlight, expected) in [(1.0, 0.3, 0.3), (1.0, 1.0, 1.0), (1.0, 2.0, 0.5), (1.0, 10.0, 0.1), (0.0, 1.0, 0.0)] {
        assert!((lost(picture, highlight) - expected).abs() < 1e-6, "{highlight} on {picture}: {}", lost(picture, highlight));
    }
    // White light is not in a picture that has less blue: taking it would leave a saturated patch.
    let white = Change { without: Vec3::ONE, highlight: Vec3::splat(0.5), dimmed: Vec3::splat(-0.5), ..Change::default() };
    let left = white.of(Vec3::new(1.0, 0.8, 0.25), 0.9);
    assert!(left.abs_diff_eq(Vec3::splat(-0.125), 1e-6), "{left}");
}

proptest! {
    #[test]
    fn refraction_follows_snell(cos in 0.01f32..1.0, turn in 0.0f32..6.2, eta in 0.3f32..3.0) {
        let sin = (1.0 - cos * cos).sqrt();
        let d = Vec3::new(sin * turn.cos(), -cos, sin * turn.sin());
        match refracted(d, Vec3::Y, eta) {
            None => prop_assert!(sin / eta >= 0.9999, "{sin} / {eta}"),
            Some(out) => {
                prop_assert!((out.length() - 1.0).abs() < 1e-5 && out.y < 0.0);
                let sideways = Vec3::new(out.x, 0.0, out.z);
                prop_assert!((sideways * eta).abs_diff_eq(Vec3::new(d.x, 0.0, d.z), 1e-4), "{d} {out}");
            }
        }
    }
}
