//! Light from a video: a sun that moves and flickers, from pixels to shadows.

use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::DirectionalLight;
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_light::track::{Params as TrackParams, Tracker};
use pano_light::{WorkingMap, detect, ibl};
use pano_tests::random::Random;
use pano_tests::scenes::{Lamp, placed, prepared, sky};
use pano_trace::mr360::{Lighting, Params, render};
use pano_trace::objects::Objects;
use pano_trace::tracer::Frame;
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use std::sync::Arc;

const FRAMES: u32 = 120;
const SIZE: usize = 32;
/// The largest mean change of the shadowed ground's brightness between two frames, as a share of it, with tracked lights. The
/// smoothing lets a light change by 15 % of what it flickers by; the rest is the shadow's own motion. Measured: 0.025 tracked,
/// 0.21 as detected.
const BOUND: f32 = 0.035;

/// Where the sun of a frame is: it crosses the seam of the panorama on its way.
fn sun(frame: u32) -> Vec3 {
    let yaw = (100.0 + 1.2 * frame as f32).to_radians();
    Vec3::new(yaw.sin() * 0.77, 0.64, -yaw.cos() * 0.77).normalize()
}

/// A frame of the video: the sun at a third to all of its strength, and every now and then behind a cloud.
fn frame(number: u32, random: &mut Random) -> RadianceImage {
    let strength = if random.unit() < 0.08 { 0.0 } else { random.between(0.33, 1.0) };
    let lamp =
        Lamp { direction: sun(number), cos_radius: 5f32.to_radians().cos(), radiance: Vec3::new(60.0, 55.0, 45.0) * strength };
    sky(256, Vec3::splat(0.15), Vec3::new(0.4, 0.5, 0.7), &[lamp])
}

/// The ground with a ball on it from above, as a share of its brightness without.
fn shadow(rest: &RadianceImage, lights: Vec<DirectionalLight>) -> Image<f32> {
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(40.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    let world = ProxyWorld::new(Arc::new(RadianceImage::filled(2, 1, Vec3::ONE)), Quat::IDENTITY, Vec3::Y, &[plane]);
    let mesh = prepared(primitives::icosphere(0.3, 3));
    let objects = Objects::new(&[placed(&mesh, Affine3A::from_translation(Vec3::Y * 0.6), Material::diffuse(Vec3::splat(0.5)))]);
    let camera = Camera {
        position: Vec3::Y * 100.0,
        world_from_camera: rotation_from_yaw_pitch(0.0, -90.0),
        projection: Projection::Perspective { vfov: 2.0 * 0.02f32.atan() },
        width: SIZE,
        height: SIZE,
    };
    let photo = RadianceImage::filled(SIZE, SIZE, Vec3::ONE);
    let lighting = Lighting { maps: ibl::radiance_maps(rest), lights, pano_from_world: Quat::IDENTITY, capture: Vec3::Y };
    let params = Params { samples: 8, shadows: true, ambient_occlusion: false, gloss: 0.0, gloss_roughness: 0.0, photo: &photo };
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let lit = render(&frame, &world, &lighting, &params, &Silent).expect("nobody cancels");
    lit.traced.layers.delta.map(|d| d.y)
}

/// Mean absolute difference over the pixels that either picture changes.
fn change(a: &Image<f32>, b: &Image<f32>) -> f32 {
    let pairs = a.data().iter().zip(b.data()).filter(|(a, b)| **a != 0.0 || **b != 0.0);
    let (sum, count) = pairs.fold((0.0, 0), |(sum, count), (a, b)| (sum + (a - b).abs(), count + 1));
    if count > 0 { sum / count as f32 } else { 0.0 }
}

/// Direction from the ball to its shadow.
fn cast_towards(shadow: &Image<f32>) -> Vec2 {
    let offset = |i: usize| Vec2::new((i % SIZE) as f32 + 0.5, (i / SIZE) as f32 + 0.5) - 0.5 * SIZE as f32;
    shadow.data().iter().enumerate().map(|(i, d)| offset(i) * -d).sum::<Vec2>().normalize_or_zero()
}

#[test]
fn the_shadow_of_a_flickering_sun_follows_it_and_does_not_pop() {
    let mut random = Random::new(5);
    let mut tracker = Tracker::new(TrackParams::default());
    let (mut last, mut worst): (Option<[Image<f32>; 2]>, [f32; 2]) = (None, [0.0; 2]);
    for number in 0..FRAMES {
        let map = WorkingMap::from_hdr(&frame(number, &mut random));
        let found = detect::detect(&map, &detect::Params::default());
        let rest = found.clamped(&map);
        let tracked: Vec<DirectionalLight> = tracker.update(&map, &found.lights).iter().map(|t| t.light).collect();
        assert!(tracked.len() <= 1, "frame {number}: one sun, not {}", tracked.len());
        let shadows = [shadow(&rest, tracked), shadow(&rest, found.lights)];
        let towards = cast_towards(&shadows[0]);
        let away = -Vec2::new(sun(number).x, sun(number).z).normalize();
        let lag = towards.dot(away).clamp(-1.0, 1.0).acos().to_degrees();
        assert!(lag < 8.0, "frame {number}: the shadow points {lag}° off");
        if let Some(last) = &last {
            for i in 0..2 {
                worst[i] = worst[i].max(change(&shadows[i], &last[i]));
            }
        }
        last = Some(shadows);
    }
    assert!(worst[0] < BOUND, "tracked: {}", worst[0]);
    assert!(worst[1] > 5.0 * BOUND, "as detected: {}; without tracking the shadow pops", worst[1]);
}
