//! Marching through a panorama's depth.

use crate::Test;
use glam::{Vec2, Vec3};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::Image;
use pano_tests::random::Random;
use pano_tests::rooms::{Cuboid, Room};
use pano_trace::bvh::Ray;
use pano_trace::prt::gpu::GpuDepthField;
use pano_trace::prt::{Answer, DepthField, FieldHit, FieldOptions, HiddenSide};

pub(crate) const TESTS: &[Test] = &[
    ("march::rays_in_a_room_equal_the_cpu", rays_in_a_room_equal_the_cpu),
    ("march::back_faces_equal_the_cpu", back_faces_equal_the_cpu),
    ("march::odd_fields_equal_the_cpu", odd_fields_equal_the_cpu),
    ("march::a_field_that_does_not_fit_is_refused", a_field_that_does_not_fit_is_refused),
];

fn field(depth: &Image<f32>) -> DepthField {
    DepthField::new(depth, &FieldOptions { back_faces: false, ..FieldOptions::default() })
}

/// Rays from all over, from the capture point, through it, and along the axes.
fn rays(random: &mut Random, count: usize, reach: f32) -> Vec<Ray> {
    let ray = |i: usize| {
        let origin = match i % 10 {
            0 => Vec3::ZERO,
            1 => random.direction() * 1e-5,
            _ => random.direction() * random.between(0.0, reach),
        };
        let direction = match i % 7 {
            0 if origin.length() > 1e-3 => -origin.normalize(),
            1 => [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z][i / 7 % 6],
            _ => random.direction(),
        };
        Ray::new(origin, direction).up_to(if i.is_multiple_of(3) { random.between(0.1, 6.0) } else { f32::INFINITY })
    };
    (0..count).map(ray).collect()
}

/// How many rays disagree: another kind of answer, or another place. All sums are f32 on both sides, those of the GPU with fused
/// products: a crossing that grazes a surface or a rim may be missed by one of them, and the ray goes on.
fn disagreements(gpu: &Gpu, field: &DepthField, rays: &[Ray]) -> usize {
    let held = GpuDepthField::new(gpu, field).unwrap();
    let got = held.march(gpu, rays).unwrap();
    let mut apart = 0;
    for (ray, got) in rays.iter().zip(got) {
        let same = match (got.answer, field.march(ray.origin, ray.direction, ray.t_max)) {
            (Answer::Surface(a), Answer::Surface(b)) => {
                let smooth = field.smooth_normal(ray.at(b.t), ray.direction, &b);
                (a.t - b.t).abs() <= 1e-3 * (1.0 + b.t)
                    && a.back == b.back
                    && (a.at_gap != b.at_gap || (a.normal.dot(b.normal) > 0.99 && got.smooth_normal.dot(smooth) > 0.99))
            }
            (Answer::BackFace(a), Answer::BackFace(b)) => {
                let shown = |hit: FieldHit| match hit.hidden_side {
                    Some(HiddenSide::BackFace(q)) => (1, q),
                    Some(HiddenSide::BackLayer(q)) => (2, q),
                    None => (0, Vec3::ZERO),
                };
                let ((kind, q), (wanted, p)) = (shown(a), shown(b));
                kind == wanted && q.dot(p) > 0.9999 && (a.t - b.t).abs() <= 1e-3 * (1.0 + b.t) && a.normal.dot(b.normal) > 0.99
            }
            (a, b) => std::mem::discriminant(&a) == std::mem::discriminant(&b),
        };
        apart += usize::from(!same);
    }
    apart
}

/// A room with a table and a window.
fn room() -> Room {
    Room {
        walls: Cuboid { lo: Vec3::new(-2.0, -1.5, -3.0), hi: Vec3::new(2.5, 1.2, 2.0) },
        table: Some(Cuboid { lo: Vec3::new(-1.3, -1.5, -1.9), hi: Vec3::new(-0.2, -0.7, -1.1) }),
        window: Some((Vec2::new(-0.5, -0.3), Vec2::new(0.8, 0.6))),
        colors: [Vec3::ONE; 2],
        lights: [Vec3::ONE; 2],
    }
}

fn rays_in_a_room_equal_the_cpu(gpu: &Gpu) {
    let room = room();
    let mut random = Random::new(21);
    for width in [64, 512] {
        let (field, rays) = (field(&room.depth(width)), rays(&mut random, 30_000, 1.1));
        let hits = rays.iter().filter(|r| field.march(r.origin, r.direction, r.t_max).hit().is_some()).count();
        let apart = disagreements(gpu, &field, &rays);
        println!("{width}: {} rays, {hits} hits, {apart} apart", rays.len());
        assert!(hits > rays.len() / 3 && apart * 500 <= rays.len(), "{apart} of {} rays, of which {hits} hit", rays.len());
    }
}

/// Rays that pass behind the table and through the window, of which a good part meets what is only assumed.
fn back_faces_equal_the_cpu(gpu: &Gpu) {
    let mut random = Random::new(23);
    for width in [128, 512] {
        let field = DepthField::new(&room().depth(width), &FieldOptions::default());
        // From anywhere towards the table.
        let rays: Vec<Ray> = (0..30_000)
            .map(|_| {
                let origin = random.direction() * random.between(0.0, 1.1);
                let target = Vec3::new(random.between(-1.5, 0.0), random.between(-1.5, -0.5), random.between(-2.0, -1.0));
                Ray::new(origin, (target - origin).normalize())
            })
            .collect();
        let assumed = rays.iter().filter(|r| matches!(field.march(r.origin, r.direction, r.t_max), Answer::BackFace(_))).count();
        let apart = disagreements(gpu, &field, &rays);
        println!("{width}: {} rays, {assumed} meet what is assumed, {apart} apart", rays.len());
        assert!(assumed > rays.len() / 50 && apart * 200 <= rays.len(), "{apart} of {} rays, {assumed} assumed", rays.len());
    }
}

fn odd_fields_equal_the_cpu(gpu: &Gpu) {
    let mut random = Random::new(22);
    let rays = rays(&mut random, 2000, 2.0);
    let odd = [f32::NAN, f32::INFINITY, 0.0, -1.0, 1e-6, 1e9, 1.0, 2.0];
    for (w, h) in [(1, 1), (2, 1), (7, 3), (64, 32)] {
        for depth in [
            Image::filled(w, h, f32::INFINITY),
            Image::filled(w, h, 1.5),
            Image::from_fn(w, h, |_, _| random.between(0.5, 3.0)),
            Image::from_fn(w, h, |_, _| odd[random.below(8) as usize]),
        ] {
            // Noise is nothing but gaps, and a ray that misses one rim goes far.
            let apart = disagreements(gpu, &field(&depth), &rays);
            assert!(apart * 50 <= rays.len(), "{w}×{h}: {apart} of {} rays", rays.len());
        }
    }
}

fn a_field_that_does_not_fit_is_refused(_: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(10_000), ..GpuOptions::default() }).unwrap();
    let field = field(&Image::filled(128, 64, 1.0));
    assert!(matches!(GpuDepthField::new(&small, &field), Err(GpuError::TooLarge { .. })));
}
