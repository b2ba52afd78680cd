//! A shining globe that the panorama has seen from one side.

use super::irradiance::estimate;
use super::lamps::Lamps;
use super::tests::{LO, box_room, coarse, density_and_reached, here, lamp_room, world};
use super::*;
use crate::objects::{Objects, Placement, PreparedMesh};
use crate::tracer::{Frame, Mis, TraceParams, render};
use glam::Affine3A;
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::{Sampler, Stream};
use std::f32::consts::PI;

const GLOBE: Ball = Ball { center: Vec3::new(1.0, 0.7, -1.2), radius: 0.15 };
const SHINES: f32 = 60.0;
const WALLS: f32 = 0.2;

fn meets_globe(d: Vec3) -> Option<f32> {
    let along = GLOBE.center.dot(d);
    let discriminant = along * along - GLOBE.center.length_squared() + GLOBE.radius * GLOBE.radius;
    (along > 0.0 && discriminant > 0.0).then(|| along - discriminant.sqrt())
}

fn globe_room() -> CapturedWorld {
    let distance = |d: Vec3| meets_globe(d).unwrap_or_else(|| box_room(d));
    let radiance = |d: Vec3| Vec3::splat(if meets_globe(d).is_some() { SHINES } else { WALLS });
    world(512, distance, radiance, here(), &coarse())
}

/// The surface of the room at `at` (panorama frame), with the normal that a wall has there.
fn surface(at: Vec3, normal: Vec3) -> RealHit {
    let (turn, capture) = here();
    let (position, normal) = (capture + turn * at, turn * normal);
    RealHit { t: at.length(), position, normal, facet: normal, surface: SEEN, radiance: None }
}

/// Mean of `n` estimates of the irradiance, and the standard deviation of one.
fn irradiance(world: &CapturedWorld, hit: &RealHit, n: u32) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let at = glam::UVec2::new(i, 0);
        let e = f64::from(estimate(world, hit, Back::Lit, &mut Sampler::new(at, 0, Stream::default())).x);
        (sum, squares) = (sum + e, squares + e * e);
    }
    let mean = sum / f64::from(n);
    (mean, (squares / f64::from(n) - mean * mean).max(0.0).sqrt())
}

#[test]
fn a_globe_is_a_lamp_and_a_bright_patch_of_the_ceiling_is_none() {
    let lamps = |world: &CapturedWorld| Lamps::find(&reduced_luminance(&world.radiance), &world.field);
    let found = lamps(&globe_room());
    let ball = found.balls().next().expect("a lamp");
    assert_eq!(found.balls().count(), 1);
    assert!(ball.center.distance(GLOBE.center) + GLOBE.radius < ball.radius, "{ball:?} holds the globe");
    assert!(ball.radius < 2.0 * GLOBE.radius, "{ball:?}");
    assert_eq!(lamps(&world(256, box_room, lamp_room, here(), &coarse())).balls().count(), 0);
    // The globe across the seam and over a pole.
    for turn in
        [Quat::from_rotation_arc(GLOBE.center.normalize(), Vec3::Z), Quat::from_rotation_arc(GLOBE.center.normalize(), Vec3::Y)]
    {
        let back = turn.inverse();
        let distance = |d: Vec3| meets_globe(back * d).unwrap_or(5.0);
        let radiance = |d: Vec3| Vec3::splat(if meets_globe(back * d).is_some() { SHINES } else { WALLS });
        let found = lamps(&world(512, distance, radiance, here(), &coarse()));
        assert_eq!(found.balls().count(), 1, "{turn}");
        assert!(found.balls().next().unwrap().center.distance(turn * GLOBE.center) < 2.0 * GLOBE.radius);
    }
}

/// Between a point and the globe's far side light is found by aiming at the globe; the density says how often.
#[test]
fn samples_aimed_at_lamps_have_the_density_stated() {
    let (turn, capture) = here();
    let world = globe_room();
    for from in [Vec3::new(1.0, -1.4, -1.3), Vec3::new(1.4, 0.6, -2.8), Vec3::new(-1.5, 0.0, 1.5)] {
        let (total, reached) = density_and_reached(&world, capture + turn * from, (1024, 512));
        // 10 000 trials know the share to ±0.5 %, the rim of the globe is integrated to ±1 %.
        assert!((total - reached).abs() < 0.02 && total < 1.005, "density {total}, reached {reached}");
    }
}

/// What aiming at lamps changes is noise, not light; and it is what makes the light of their far sides come often enough.
#[test]
fn aiming_at_lamps_takes_noise_and_no_light() {
    let (with, floor) = (globe_room(), surface(Vec3::new(1.0, LO.y, -1.9), Vec3::Y));
    let without = CapturedWorld { lamps: Lamps::default(), ..with.clone() };
    let (few, many) = (20_000, 200_000);
    let (a, noise) = irradiance(&with, &floor, few);
    let (b, noise_without) = irradiance(&without, &floor, many);
    let error = (noise * noise / f64::from(few) + noise_without * noise_without / f64::from(many)).sqrt();
    assert!((a - b).abs() < 4.0 * error, "{a} with, {b} without, ±{error}");
    assert!(noise_without > 2.0 * noise, "{noise} with, {noise_without} without");
}

/// E = π·L·(r/h)² below a globe, and π times what the walls shine.
#[test]
fn globes_light_what_is_below_them_as_globes_do() {
    let world = globe_room();
    let floor = surface(Vec3::new(GLOBE.center.x, LO.y, GLOBE.center.z), Vec3::Y);
    let share = (GLOBE.radius / (GLOBE.center.y - LO.y)).powi(2);
    let truth = f64::from(PI * (SHINES * share + WALLS * (1.0 - share)));
    let (measured, noise) = irradiance(&world, &floor, 20_000);
    assert!((measured / truth - 1.0).abs() < 0.12, "{measured} ± {} for {truth}", noise / 141.0);
}

/// A ball below the globe takes its light from the floor, another above it does not, however light is looked for.
#[test]
fn what_is_blocked_is_what_lies_before_the_lamp() {
    let (turn, capture) = here();
    let world = globe_room();
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 3)).unwrap());
    let ball = |at: Vec3, radius: f32| Placement {
        mesh: mesh.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(Vec3::splat(radius), Quat::IDENTITY, capture + turn * at),
        material: Some(Material::diffuse(Vec3::splat(0.5))),
    };
    // As the floor sees it, the ball above is hidden behind the globe.
    let (below, above) =
        (Vec3::new(1.0, -0.9, -1.6), GLOBE.center + (GLOBE.center - Vec3::new(1.0, LO.y, -1.8)).normalize() * 0.3);
    let camera = Camera {
        position: capture + turn * Vec3::new(1.0, LO.y + 0.05, -1.8),
        world_from_camera: turn * rotation_from_yaw_pitch(0.0, -90.0),
        projection: Projection::Perspective { vfov: 0.02 },
        width: 32,
        height: 32,
    };
    let change = |objects: &[Placement], mis: Mis, samples: u32| {
        let objects = Objects::new(objects);
        let params = TraceParams { samples, bounces: 1, second_order: false, mis, ..TraceParams::default() };
        let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
        let traced = render(&frame, &world, &params, &Silent).unwrap();
        let delta: Vec<f64> = traced.layers.delta.data().iter().map(|d| f64::from(d.x)).collect();
        let n = delta.len() as f64;
        let mean = delta.iter().sum::<f64>() / n;
        (mean, (delta.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n * (n - 1.0))).sqrt())
    };
    let both = [ball(below, 0.25), ball(above, 0.1)];
    let (balance, a) = change(&both, Mis::Balance, 256);
    let (by_bsdf, b) = change(&both, Mis::BsdfOnly, 1024);
    assert!((balance - by_bsdf).abs() < 4.0 * (a * a + b * b).sqrt(), "{balance} ± {a} and {by_bsdf} ± {b}");
    assert!(a < 0.1 * balance.abs(), "{balance} ± {a}");
    let (behind, c) = change(&both[1..], Mis::Balance, 256);
    assert!(behind.abs() < 0.005 * balance.abs(), "{behind} ± {c} of {balance}");
}
