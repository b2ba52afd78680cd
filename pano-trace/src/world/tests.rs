//! A depth camera by itself, and layers together.

use super::*;
use glam::{Affine3A, Quat};
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::Image;
use std::sync::Arc;

const EYE: Vec3 = Vec3::new(0.5, 1.4, 2.0);

fn camera() -> Camera {
    Camera {
        position: EYE,
        world_from_camera: rotation_from_yaw_pitch(20.0, -30.0),
        projection: Projection::Pinhole { focal: Vec2::new(90.0, 95.0), center: Vec2::new(61.0, 44.0) },
        width: 120,
        height: 90,
    }
}

/// The floor y = 0, coloured by its place.
fn floor_color(at: Vec3) -> Vec3 {
    Vec3::new(2.0 + 0.3 * at.x, 1.0, 3.0 + 0.3 * at.z)
}

fn floor_camera() -> CameraWorld {
    let camera = camera();
    let center = |x: usize, y: usize| camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
    let distance = |d: Vec3| if d.y < -0.05 { -EYE.y / d.y } else { f32::INFINITY };
    let depth = Image::from_fn(camera.width, camera.height, |x, y| distance(center(x, y)));
    let picture = RadianceImage::from_fn(camera.width, camera.height, |x, y| {
        let t = depth.get(x, y);
        if t.is_finite() { floor_color(EYE + center(x, y) * t) } else { Vec3::ZERO }
    });
    CameraWorld::new(Arc::new(picture), &depth, camera, &crate::prt::FieldOptions::default()).unwrap()
}

#[test]
fn a_depth_camera_shows_its_surface_from_elsewhere() {
    let world = floor_camera();
    for (from, to) in [
        (EYE, Vec3::new(0.9, 0.0, 0.3)),
        (Vec3::new(2.0, 2.0, -1.0), Vec3::new(1.2, 0.0, 0.0)),
        (Vec3::new(-1.0, 0.3, 0.5), Vec3::new(0.9, 0.0, 0.2)),
    ] {
        let hit = world.hit(&Ray::new(from, (to - from).normalize())).unwrap_or_else(|| panic!("{from} {to}"));
        assert!(hit.position.distance(to) < 2e-3, "{from}: {} {to}", hit.position);
        assert!(hit.normal.dot(Vec3::Y) > 0.999, "{}", hit.normal);
        let radiance = hit.radiance.unwrap();
        assert!(radiance.abs_diff_eq(floor_color(to), 0.01), "{radiance} {}", floor_color(to));
        assert!(world.leave(&hit).y > 1e-5);
    }
    // Behind the camera and beside its picture there is nothing.
    for d in [Vec3::Y, Vec3::Z, Vec3::new(-1.0, -0.4, 0.0)] {
        assert!(world.hit(&Ray::new(EYE, d.normalize())).is_none(), "{d}");
    }
}

#[test]
fn a_depth_camera_needs_pictures_of_its_size() {
    let options = crate::prt::FieldOptions::default();
    let small = Image::filled(3, 2, 1.0);
    let picture = Arc::new(RadianceImage::filled(120, 90, Vec3::ONE));
    assert!(CameraWorld::new(picture.clone(), &small, camera(), &options).unwrap_err().to_string().contains("depth"));
    let panorama = Camera { projection: Projection::Panorama, ..camera() };
    let depth = Image::filled(120, 90, 1.0);
    assert!(CameraWorld::new(picture, &depth, panorama, &options).unwrap_err().to_string().contains("panorama"));
}

#[test]
fn of_layers_the_nearest_counts_and_the_first_tells_infinity() {
    let sky = Arc::new(RadianceImage::filled(8, 4, Vec3::splat(7.0)));
    let shelf = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(1.0)),
        world_from_local: Affine3A::from_translation(Vec3::new(0.9, 0.5, 0.2)),
        reflectance: Reflectance::Known(Vec3::splat(0.4)),
    };
    let base: Arc<dyn RealWorld + Send> = Arc::new(ProxyWorld::new(sky, Quat::IDENTITY, EYE, &[]));
    let black = Arc::new(RadianceImage::filled(2, 1, Vec3::ZERO));
    let ghosts = Arc::new(ProxyWorld::new(black, Quat::IDENTITY, EYE, &[shelf.clone(), shelf]));
    let world = LayeredWorld::new(base, [ghosts as Arc<dyn RealWorld + Send>, Arc::new(floor_camera())], EYE);
    let down = |x: f32, z: f32| world.hit(&Ray::new(Vec3::new(x, 2.0, z), Vec3::NEG_Y)).unwrap();
    let (on_shelf, on_floor) = (down(0.9, 0.2), down(1.6, 0.0));
    assert!((on_shelf.t - 1.5).abs() < 1e-4 && (on_floor.t - 2.0).abs() < 1e-3);
    assert_eq!((world.pictured(&on_shelf), world.reflectance(&on_shelf)), (None, Vec3::splat(0.4)));
    assert!(world.pictured(&on_floor).unwrap().abs_diff_eq(floor_color(on_floor.position), 0.02));
    assert_eq!(world.infinity(Vec3::Y), Vec3::splat(7.0));
    // Light from the sky reaches the floor, except below the shelf.
    let sample = LightSample { direction: Vec3::Y, target: LightTarget::Infinity };
    for (x, reached) in [(1.6, true), (0.9, false)] {
        let ray = Ray::new(Vec3::new(x, 0.1, 0.2), Vec3::Y);
        assert_eq!(world.reach(&ray, &sample).is_some(), reached, "{x}");
    }
    assert!(world.sample_light(EYE, Vec2::splat(0.5)).is_some());
    assert_eq!(world.light_pdf(EYE, Vec3::NEG_Y, Some(&on_floor)), 0.0);
    assert!(world.leave(&on_floor).y > 5e-3, "layers that show the same do not shade one another");
}

/// What blocks a ray is what it hits, in every kind of world.
#[test]
fn what_is_hit_blocks() {
    let sky = Arc::new(RadianceImage::filled(64, 32, Vec3::ONE));
    let shelf = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(6.0)),
        world_from_local: Affine3A::from_translation(Vec3::new(0.9, 0.5, 0.2)),
        reflectance: Reflectance::Known(Vec3::splat(0.4)),
    };
    let ghosts = ProxyWorld::new(sky.clone(), Quat::IDENTITY, EYE, &[shelf]);
    let depth = Image::from_fn(64, 32, |x, y| if (x / 8 + y / 8) % 3 == 0 { f32::INFINITY } else { 1.0 + (x % 7) as f32 * 0.2 });
    let options = CapturedOptions { irradiance_width: 0, ..CapturedOptions::default() };
    let silent = pano_core::progress::Silent;
    let captured = CapturedWorld::new(sky, &depth, Quat::from_rotation_y(0.5), EYE, &[], &options, &silent).unwrap();
    let seen = floor_camera();
    let layers: [Arc<dyn RealWorld + Send>; 2] = [Arc::new(ghosts.clone()), Arc::new(seen.clone())];
    let layered = LayeredWorld::new(Arc::new(captured.clone()), layers, EYE);
    let worlds: [&dyn RealWorld; 4] = [&ghosts, &captured, &seen, &layered];
    let (mut hits, mut misses) = ([0; 4], [0; 4]);
    for i in 0..2000u32 {
        let u = |k: u32| (pano_core::random::hash(i * 8 + k) >> 8) as f32 / 8_388_608.0 - 1.0;
        let Some(direction) = Vec3::new(u(0), u(1), u(2)).try_normalize() else { continue };
        let origin = if i % 5 == 0 { EYE } else { EYE + Vec3::new(u(3), u(4), u(5)) };
        let ray = Ray::new(origin, direction).up_to(if i % 3 == 0 { f32::INFINITY } else { 2.0 + u(6) });
        for (k, world) in worlds.iter().enumerate() {
            let (hit, surface) = (world.hit(&ray), world.surface(&ray));
            assert_eq!(world.blocks(&ray), hit.is_some(), "world {k}, {ray:?}");
            assert_eq!(surface.map(|s| (s.t, s.normal)), hit.map(|h| (h.t, h.normal)), "world {k}, {ray:?}");
            *(if hit.is_some() { &mut hits[k] } else { &mut misses[k] }) += 1;
        }
    }
    assert!(hits.iter().chain(&misses).all(|n| *n > 20), "{hits:?} {misses:?}");
}
