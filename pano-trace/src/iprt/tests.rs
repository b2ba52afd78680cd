use super::*;
use crate::bvh::Ray;
use crate::objects::{Placement, PreparedMesh};
use crate::world::{CapturedOptions, CapturedWorld, RealWorld};
use glam::{Affine3A, Quat, Vec2};
use pano_core::builtin::primitives;
use pano_core::camera::{Projection, rotation_from_yaw_pitch};
use pano_core::image::{Image, RadianceImage};
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::sphere;
use std::f32::consts::PI;
use std::sync::Arc;

/// The world of a panorama of `width` columns, from functions of the direction.
fn world(width: usize, distance: impl Fn(Vec3) -> f32, radiance: impl Fn(Vec3) -> Vec3) -> CapturedWorld {
    let (w, h) = (width, width / 2);
    let direction =
        |x: usize, y: usize| sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
    let picture = RadianceImage::from_fn(w, h, |x, y| radiance(direction(x, y)));
    let depth = Image::from_fn(w, h, |x, y| distance(direction(x, y)));
    let options = CapturedOptions { irradiance_width: 8, irradiance_samples: 1, ..CapturedOptions::default() };
    CapturedWorld::new(Arc::new(picture), &depth, Quat::IDENTITY, Vec3::ZERO, &[], &options, &Silent).unwrap()
}

/// A ball of radius `radius` at `center`.
fn ball(center: Vec3, radius: f32, material: Material) -> Objects {
    let mesh = Arc::new(PreparedMesh::new(primitives::uv_sphere(radius, 32, 16)).unwrap());
    Objects::new(&[Placement { mesh, world_from_mesh: Affine3A::from_translation(center), material: Some(material) }])
}

fn camera(size: usize, pitch: f32) -> Camera {
    Camera {
        position: Vec3::ZERO,
        world_from_camera: rotation_from_yaw_pitch(0.0, pitch),
        projection: Projection::Perspective { vfov: 1.0 },
        width: size,
        height: size,
    }
}

fn frame<'a>(camera: &'a Camera, objects: &'a Objects) -> Frame<'a> {
    Frame { camera, objects, capture: Vec3::ZERO, stream: Stream::default() }
}

/// A floor 1.5 m below a bright dome.
fn floor(d: Vec3) -> f32 {
    if d.y < -0.02 { -1.5 / d.y } else { 75.0 }
}

fn floor_radiance(d: Vec3) -> Vec3 {
    Vec3::splat(if d.y < -0.02 { 0.25 } else { 1.0 })
}

fn all(_: usize, _: usize) -> bool {
    true
}

/// Inside a sphere of radiance L every point receives π·L, and an object far from a pixel changes nothing there.
#[test]
fn irradiance_in_a_shining_sphere_is_pi_times_its_radiance() {
    let world = world(256, |_| 2.0, |_| Vec3::new(0.5, 1.0, 2.0));
    let (camera, objects) = (camera(12, 0.0), ball(Vec3::new(0.0, 0.0, 1.2), 0.05, Material::diffuse(Vec3::ZERO)));
    let params = Params { samples: 256, ..Params::default() };
    let nothing = Update::default();
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &nothing);
    let real = trace_real(&frame(&camera, &objects), &updated, &params, None, all, &Silent).unwrap();
    assert!(real.share.data().iter().all(|&s| s == 1.0));
    let n = real.irradiance.data().len() as f32;
    let mean: Vec3 = real.irradiance.data().iter().sum::<Vec3>() / n;
    let relative = mean / (PI * Vec3::new(0.5, 1.0, 2.0));
    assert!((relative - 1.0).abs().max_element() < 0.01, "{relative}");
}

/// A black ball that hides a share of a dome takes that share of the light: by the form factor of a sphere over a plane,
/// r²/d² straight above.
#[test]
fn a_black_ball_takes_its_form_factor_of_the_light() {
    let world = world(512, floor, floor_radiance);
    // Straight below the camera the floor sees the ball at a distance of 1 m.
    let (camera, objects) = (camera(9, -80.0), ball(Vec3::new(0.0, -0.7, -0.26), 0.2, Material::diffuse(Vec3::ZERO)));
    let params = Params { samples: 4096, ..Params::default() };
    let nothing = Update::default();
    let frame = frame(&camera, &objects);
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &nothing);
    let buffer = GBuffer::new(&frame, &world);
    let real = trace_real(&frame, &updated, &params, None, all, &Silent).unwrap();
    let (mut tested, mut found, mut predicted) = (0, 0.0, 0.0);
    for y in 0..9 {
        for x in 0..9 {
            if !(buffer.shows_real(x, y) && real.share.get(x, y) == 1.0) {
                continue;
            }
            let to = Vec3::new(0.0, -0.7, -0.26) - buffer.position.get(x, y);
            let expected = -(0.2f32 / to.length()).powi(2) * to.y / to.length();
            let ratio = real.change.get(x, y).x / real.irradiance.get(x, y).x;
            // A thousand samples of which a hundredth is blocked know the share to a third.
            assert!((ratio - expected).abs() < 0.2 * expected.abs() + 8e-3, "({x}, {y}): {ratio}, expected {expected}");
            (tested, found, predicted) = (tested + 1, found + ratio, predicted + expected);
        }
    }
    assert!(tested > 20 && (found / predicted - 1.0).abs() < 0.04, "{tested} pixels: {found}, expected {predicted}");
}

/// A white ball in a white furnace is as bright as its surroundings, and changes nothing.
#[test]
fn a_white_ball_in_a_furnace_is_invisible() {
    let world = world(256, |_| 3.0, |_| Vec3::ONE);
    let (camera, objects) = (camera(16, 0.0), ball(Vec3::new(0.0, 0.0, -1.0), 0.3, Material::diffuse(Vec3::ONE)));
    let params = Params { samples: 64, bounces: 16, ..Params::default() };
    let nothing = Update::default();
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &nothing);
    let frame = frame(&camera, &objects);
    let seen = trace_virtual(&frame, &updated, &params, &Silent).unwrap();
    let real = trace_real(&frame, &updated, &params, None, all, &Silent).unwrap();
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..16 {
        for x in 0..16 {
            let whole = seen.coverage.get(x, y) + real.share.get(x, y);
            assert!((whole - 1.0).abs() < 0.3, "thinned pixels know their share less well: ({x}, {y}) {whole}");
            if seen.coverage.get(x, y) == 1.0 {
                assert!((seen.radiance.get(x, y).x - 1.0).abs() < 0.1, "({x}, {y}): {}", seen.radiance.get(x, y));
                (sum, count) = (sum + seen.radiance.get(x, y).x, count + 1.0);
            }
        }
    }
    let change: f32 =
        real.change.data().iter().map(|c| c.x).sum::<f32>() / real.irradiance.data().iter().map(|c| c.x).sum::<f32>();
    assert!(change.abs() < 0.005, "{change}");
}

/// The panorama takes the view's ratio where the view sees its surface, and nowhere else; rays from elsewhere see it.
#[test]
fn the_panorama_is_updated_where_the_view_sees_it() {
    let world = world(256, |_| 2.0, |_| Vec3::ONE);
    let (camera, objects) = (camera(32, 0.0), ball(Vec3::new(0.0, 0.0, 1.2), 0.05, Material::diffuse(Vec3::ZERO)));
    let frame = frame(&camera, &objects);
    let buffer = GBuffer::new(&frame, &world);
    let (ratio, gloss) = (Image::filled(32, 32, Vec3::splat(0.5)), Image::filled(32, 32, Vec2::new(0.8, 0.1)));
    let update = panorama_update(&frame, &world, &buffer, &ratio, &gloss, (64, 32));
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &update);
    let from = Vec3::new(0.3, 0.2, 0.1);
    let ahead = updated.hit(&Ray::new(from, (Vec3::NEG_Z * 2.0 - from).normalize())).unwrap();
    let behind = updated.hit(&Ray::new(from, Vec3::Z)).unwrap();
    // Half of the .8 that leave in all directions, and a tenth of what lies in the mirror direction.
    assert!((ahead.radiance.unwrap().x - 0.5).abs() < 1e-3 && (behind.radiance.unwrap().x - 1.0).abs() < 1e-3);
    let direction = (Vec3::NEG_Z * 2.0 - from).normalize();
    let (before, after) = updated.radiance(&world.hit(&Ray::new(from, direction)).unwrap(), direction);
    assert!((before.x - 0.9).abs() < 1e-3 && (after.x - 0.5).abs() < 1e-3, "{before} {after}");
}

/// Screen space knows what the extended view shows: a ball just outside the frame counts, one behind the camera does not.
#[test]
fn screen_space_ends_a_tenth_beyond_the_frame() {
    let world = world(256, |_| 3.0, |_| Vec3::ONE);
    let camera = camera(64, 0.0);
    let edge = (0.5f32).tan();
    let params = Params { samples: 256, reach: Reach::Screen, ..Params::default() };
    let nothing = Update::default();
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &nothing);
    let changed = |center: Vec3| {
        let objects = ball(center, 0.05, Material::diffuse(Vec3::ZERO));
        let frame = frame(&camera, &objects);
        let screen = ScreenObjects::new(&frame, &world);
        let ray = Ray::new(center + Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z);
        let hit = objects.intersect(&ray).unwrap();
        let real = trace_real(&frame, &updated, &params, Some(&screen), |x, y| x % 8 == 0 && y % 8 == 0, &Silent).unwrap();
        (screen.shows(&ray, &hit), real.touched.data().iter().any(|&t| t))
    };
    assert!(changed(Vec3::new(0.5, 0.0, -2.0)).0, "inside");
    assert!(changed(Vec3::new(2.0 * edge * 1.05, 0.0, -2.0)).0, "between the frame and its extension");
    assert!(!changed(Vec3::new(2.0 * edge * 1.2, 0.0, -2.0)).0, "outside");
    assert_eq!(changed(Vec3::new(0.0, 0.0, 1.0)), (false, false), "behind the camera");
}

/// Points of a moved object and of still surfaces are found where they were.
#[test]
fn motion_vectors_lead_back() {
    let world = world(128, |_| 3.0, |_| Vec3::ONE);
    let now_camera = camera(48, 0.0);
    let then_camera = Camera { world_from_camera: rotation_from_yaw_pitch(5.0, 2.0), position: Vec3::X * 0.1, ..now_camera };
    let mesh = Arc::new(PreparedMesh::new(primitives::uv_sphere(0.4, 32, 16)).unwrap());
    let at = |p: Vec3| {
        let world_from_mesh = Affine3A::from_translation(p);
        Objects::new(&[Placement { mesh: mesh.clone(), world_from_mesh, material: Some(Material::default()) }])
    };
    let step = Vec3::new(0.15, 0.0, 0.2);
    let (now, then) = (at(Vec3::new(0.0, 0.0, -1.5)), at(Vec3::new(0.0, 0.0, -1.5) - step));
    let buffer = GBuffer::new(&frame(&now_camera, &now), &world);
    let earlier = Earlier { camera: then_camera, objects: then };
    let (previous, depth) = motion(&buffer, &now_camera, &now, &earlier);
    for (x, y) in [(24, 24), (20, 27), (3, 5), (45, 40)] {
        let moved = if buffer.thing.get(x, y) == 1 { step } else { Vec3::ZERO };
        let seen = buffer.position.get(x, y) - moved - then_camera.position;
        assert!(previous.get(x, y).distance(then_camera.pixel(seen).unwrap()) < 1e-2, "({x}, {y})");
        assert!((depth.get(x, y) - seen.length()).abs() < 1e-4);
    }
    assert_eq!((buffer.thing.get(24, 24), buffer.thing.get(3, 5)), (1, 0));
    let other = Earlier { objects: ball(Vec3::ZERO, 0.4, Material::default()), ..earlier };
    assert!(motion(&buffer, &now_camera, &now, &other).0.get(24, 24).is_nan(), "another mesh has no past");
}

/// With attempts every pixel at the silhouette has a value of both kinds, and the coverage is that of many samples.
#[test]
fn few_samples_know_the_silhouette() {
    let world = world(128, |_| 3.0, |_| Vec3::ONE);
    let (camera, objects) = (camera(24, 0.0), ball(Vec3::new(0.03, 0.02, -1.5), 0.3, Material::diffuse(Vec3::ONE)));
    let nothing = Update::default();
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &nothing);
    let frame = frame(&camera, &objects);
    let coverage = GBuffer::new(&frame, &world).coverage(&frame, &world);
    let many = trace_virtual(&frame, &updated, &Params { samples: 1024, bounces: 1, ..Params::default() }, &Silent).unwrap();
    let one = Params { attempts: 64, ..Params::default() };
    let (seen, real) = (
        trace_virtual(&frame, &updated, &one, &Silent).unwrap(),
        trace_real(&frame, &updated, &one, None, all, &Silent).unwrap(),
    );
    for (i, (&a, &b)) in coverage.data().iter().zip(many.coverage.data()).enumerate() {
        assert!((a - b).abs() < 0.15, "{a} {b}");
        let (x, y) = (i % 24, i / 24);
        assert!(b < 0.1 || seen.coverage.get(x, y) == 1.0, "({x}, {y}): {b}");
        assert!(b > 0.9 || real.share.get(x, y) == 1.0, "({x}, {y}): {b}");
    }
}
