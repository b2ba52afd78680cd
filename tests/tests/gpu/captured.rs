//! The path tracers over captured radiance: a room with a table, whose rims are gaps, a window into the open, and a lamp.

use crate::Test;
use crate::frames::{Apart, assert_alike, assert_sampled_alike, both_of, of_all_kinds, plain, rmse, view};
use glam::{Quat, Vec2, Vec3};
use pano_core::camera::{Camera, Projection};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::Image;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_tests::rooms::{Cuboid, Room};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;
use pano_trace::tracer::gpu::{captured_hits, render_captured};
use pano_trace::tracer::{Frame, Method, Mis, TraceParams, Traced};
use pano_trace::world::{CapturedOptions, CapturedWorld, RealHit, RealWorld};
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("captured::hits_equal_the_cpu", hits_equal_the_cpu),
    ("captured::frames_equal_the_cpu", frames_equal_the_cpu),
    ("captured::strategies_equal_the_cpu", strategies_equal_the_cpu),
    ("captured::adaptive_frames_equal_the_cpu", adaptive_frames_equal_the_cpu),
    ("captured::bands_make_no_difference", bands_make_no_difference),
    ("captured::the_sky_fits_beside_the_panorama", the_sky_fits_beside_the_panorama),
    ("captured::what_does_not_fit_is_refused", what_does_not_fit_is_refused),
];

pub(crate) const CAPTURE: Vec3 = Vec3::new(0.1, 1.5, 1.0);
/// The lamp is at 12. Of a surface at a gap, rounding may choose the other side: it is another one.
pub(crate) const APART: Apart = Apart { rest: 1e-4, guides: 500 };

pub(crate) fn room() -> Room {
    Room {
        walls: Cuboid { lo: Vec3::new(-2.0, -1.5, -3.0), hi: Vec3::new(2.5, 1.2, 2.0) },
        table: Some(Cuboid { lo: Vec3::new(-1.3, -1.5, -1.9), hi: Vec3::new(-0.2, -0.7, -1.1) }),
        window: Some((Vec2::new(-0.5, -0.3), Vec2::new(0.8, 0.6))),
        colors: [Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.7, 0.8, 0.9)],
        lights: [Vec3::splat(3.0), Vec3::splat(12.0)],
    }
}

pub(crate) fn world(objects: &Objects, change: impl Fn(&mut CapturedOptions)) -> CapturedWorld {
    let mut options = CapturedOptions { irradiance_width: 64, ..CapturedOptions::default() };
    change(&mut options);
    world_of(&room().depth(128), objects, &options)
}

pub(crate) fn world_of(depth: &Image<f32>, objects: &Objects, options: &CapturedOptions) -> CapturedWorld {
    let radiance = Arc::new(room().radiance(128));
    CapturedWorld::new(radiance, depth, Quat::from_rotation_y(0.3), CAPTURE, objects.balls(), options, &Silent)
        .expect("nobody cancels")
}

/// From the capture point and from all over the room, most of them towards the table.
fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let ray = |i: usize| {
        let origin = CAPTURE + if i.is_multiple_of(10) { Vec3::ZERO } else { random.direction() * random.between(0.0, 1.1) };
        let table = Vec3::new(random.between(-1.5, 0.0), random.between(-1.5, -0.5), random.between(-2.0, -1.0));
        let toward = CAPTURE + Quat::from_rotation_y(0.3) * table;
        let direction = if i.is_multiple_of(4) { random.direction() } else { (toward - origin).normalize() };
        Ray::new(origin, direction).up_to(if i.is_multiple_of(5) { random.between(0.5, 6.0) } else { f32::INFINITY })
    };
    (0..count).map(ray).collect()
}

/// Back faces have surface 1.
fn is_hidden(hit: &RealHit) -> bool {
    hit.surface == 1
}

/// As in the tests of marching: a crossing that grazes a surface or a rim may be missed by one of them, and the ray goes on. Back faces
/// are lit by the same random numbers, unless rounding moves their place into another cell.
fn hits_equal_the_cpu(gpu: &Gpu) {
    for (hidden_samples, seed) in [(0, 0), (1, 0), (3, 7)] {
        let world = world(&plain(), |o| (o.hidden_samples, o.seed) = (hidden_samples, seed));
        let rays = rays(&mut Random::new(31), 20_000);
        let (mut apart, mut hits, mut assumed) = (Vec::new(), 0, 0);
        for (ray, got) in rays.iter().zip(captured_hits(gpu, &world, &rays).unwrap()) {
            let hit = world.hit(ray);
            let radiance = world.arriving(ray.direction, hit.as_ref());
            let light_pdf = world.light_pdf(ray.origin, ray.direction, hit.as_ref());
            let same = hit.map_or(got.t == f32::INFINITY, |hit| {
                (got.t - hit.t).abs() <= 1e-3 * (1.0 + hit.t)
                    && got.position.distance(hit.position) <= 1e-3 * (1.0 + hit.t)
                    && got.normal.dot(hit.normal) > 0.99
                    && got.hidden == is_hidden(&hit)
            });
            // Densities per area grow without bound at grazing angles.
            let close = got.radiance.distance(radiance) <= 2e-3 * radiance.length()
                && (got.light_pdf - light_pdf).abs() <= 1e-2 * (1.0 + light_pdf);
            if !(same && close) {
                apart.push((*ray, got, hit, radiance, light_pdf));
            }
            hits += usize::from(hit.is_some());
            assumed += usize::from(hit.is_some_and(|hit| is_hidden(&hit)));
        }
        println!("{hidden_samples} pairs: {} rays, {hits} hits, {assumed} assumed, {} apart", rays.len(), apart.len());
        assert!(hits > rays.len() / 2 && assumed > rays.len() / 100);
        assert!(apart.len() * 500 <= rays.len(), "{} apart, such as {:?}", apart.len(), &apart[..3]);
    }
}

fn both(gpu: &Gpu, camera: &Camera, objects: &Objects, world: &CapturedWorld, params: &TraceParams) -> [Traced; 2] {
    both_of(camera, objects, world, params, |frame| render_captured(gpu, frame, world, params, &Silent))
}

/// From where the panorama was taken, and from another place, with glossy, glass and shining objects.
fn frames_equal_the_cpu(gpu: &Gpu) {
    let seen = Camera { position: CAPTURE, ..view(64, 48) };
    let objects = of_all_kinds();
    let world = world(&objects, |_| ());
    let round = world_of(&Image::filled(128, 64, 2.5), &objects, &CapturedOptions::default());
    for method in [Method::Ibl, Method::Dpt, Method::OnePass, Method::TwoPass] {
        let params = TraceParams { method, samples: 4, bounces: 3, ..TraceParams::default() };
        for (what, camera) in [("seen", &seen), ("moved", &view(64, 48))] {
            let [got, want] = both(gpu, camera, &objects, &world, &params);
            let lit = want.layers.object.data().iter().chain(want.layers.delta.data()).filter(|p| p.length() > 0.01).count();
            assert!(lit > 300, "{method:?}: {lit} pixels are lit");
            assert_alike(&format!("{method:?}, {what}"), &got, &want, APART);
        }
        // Without rims and corners every path ends where the CPU's does.
        let [got, want] = both(gpu, &view(64, 48), &objects, &round, &params);
        assert_alike(&format!("{method:?}, round"), &got, &want, APART);
        assert!(rmse(&got, &want) < 1e-3, "{method:?}: {}", rmse(&got, &want));
    }
}

/// Paths long enough for Russian roulette and for several points that wait for one another; every surface a mirror; no second order.
fn strategies_equal_the_cpu(gpu: &Gpu) {
    let objects = of_all_kinds();
    let around = Camera { position: CAPTURE, projection: Projection::Panorama, ..view(64, 32) };
    let mirrors = world(&objects, |o| o.reflectance_cap = 0.2);
    for (method, mis) in [(Method::Dpt, Mis::LightOnly), (Method::OnePass, Mis::BsdfOnly)] {
        let params = TraceParams { method, mis, samples: 3, bounces: 8, ..TraceParams::default() };
        let [got, want] = both(gpu, &around, &objects, &mirrors, &params);
        assert_alike(&format!("{method:?}, {mis:?}"), &got, &want, APART);
    }
    let plain_ones = plain();
    let world = world(&plain_ones, |o| o.irradiance_samples = 4);
    let params = TraceParams { second_order: false, everywhere: true, samples: 4, bounces: 2, ..TraceParams::default() };
    let [got, want] = both(gpu, &around, &plain_ones, &world, &params);
    assert_alike("everywhere", &got, &want, APART);
    let params = TraceParams { samples: 1, bounces: 1, ..TraceParams::default() };
    let [got, want] = both(gpu, &around, &plain_ones, &world, &params);
    assert_alike("one bounce", &got, &want, APART);
}

/// Samples go where the CPU's go. At rims rounding may give a pilot another sample, upon which the whole frame's noise is another one: there
/// the numbers are nearly the same, and only the pilots' frame is.
fn adaptive_frames_equal_the_cpu(gpu: &Gpu) {
    let objects = of_all_kinds();
    let room = world(&objects, |_| ());
    let round = world_of(&Image::filled(128, 64, 2.5), &objects, &CapturedOptions::default());
    for (what, world, samples, target) in [("round", &round, 48, 0.02), ("pilots", &room, 16, 0.05), ("room", &room, 48, 0.05)] {
        let params = TraceParams { samples, bounces: 2, error_target: Some(target), ..TraceParams::default() };
        let [got, want] = both(gpu, &view(40, 30), &objects, world, &params);
        if what != "room" {
            assert_alike(what, &got, &want, APART);
        }
        assert_sampled_alike(what, &got, &want);
    }
}

/// Rows of a frame that do not fit one binding.
fn bands_make_no_difference(_: &Gpu) {
    let objects = plain();
    let world = world(&objects, |_| ());
    let camera = view(90, 60);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let params = TraceParams { method: Method::Ibl, samples: 2, ..TraceParams::default() };
    let [whole, banded] = [None, Some(1 << 19)].map(|max_binding| {
        let gpu = Gpu::new(&GpuOptions { max_binding, ..GpuOptions::default() }).unwrap();
        (render_captured(&gpu, &frame, &world, &params, &Silent).unwrap().unwrap(), gpu.submissions())
    });
    assert!(banded.1 > 2 * whole.1, "{} {}", banded.1, whole.1);
    assert!(banded.0.layers.object == whole.0.layers.object && banded.0.layers.albedo == whole.0.layers.albedo);
}

/// A panorama that takes three quarters of a binding, as one of 4096 × 2048 does, with a window into the open. No two of its texels are
/// alike, so that rays behind all surfaces tell which texel infinity shows; rays that end too soon look there as well.
fn the_sky_fits_beside_the_panorama(gpu: &Gpu) {
    let mut random = Random::new(32);
    let radiance = Arc::new(Image::from_fn(512, 256, |_, _| random.color(0.1, 1.0)));
    let options = CapturedOptions { irradiance_width: 0, ..CapturedOptions::default() };
    let place = Quat::from_rotation_y(0.3);
    let world = CapturedWorld::new(radiance, &room().depth(128), place, CAPTURE, &[], &options, &Silent).expect("nobody cancels");
    let rays = rays(&mut random, 4000);
    let small = Gpu::new(&GpuOptions { max_binding: Some(1 << 21), ..GpuOptions::default() }).unwrap();
    let [whole, tight] = [gpu, &small].map(|gpu| captured_hits(gpu, &world, &rays).unwrap());
    assert!(tight == whole);
    let (mut sky, mut walls) = (0, 0);
    for (ray, got) in rays.iter().zip(&tight).filter(|(ray, got)| got.t == f32::INFINITY && world.hit(ray).is_none()) {
        let want = world.infinity(ray.direction);
        // A direction is good to 3·10⁻⁷, and texels are a 512th of the turn.
        assert!(got.radiance.distance(want) < 1e-3, "{ray:?}: {} {want}", got.radiance);
        let depth = room().distance(Vec3::ZERO, place.inverse() * ray.direction);
        *if depth.is_finite() { &mut walls } else { &mut sky } += 1;
    }
    assert!(sky > 0 && walls > 100, "{sky} rays into the open, {walls} where the panorama shows a wall");
}

fn what_does_not_fit_is_refused(_: &Gpu) {
    let objects = plain();
    let world = world(&objects, |_| ());
    let camera = view(4, 4);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    for most in [10_000, 90_000] {
        let small = Gpu::new(&GpuOptions { max_binding: Some(most), ..GpuOptions::default() }).unwrap();
        let refused = render_captured(&small, &frame, &world, &TraceParams::default(), &Silent);
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{most}: {refused:?}");
    }
}
