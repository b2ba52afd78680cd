//! Rays through the hierarchy.

use crate::Test;
use glam::{Affine3A, Quat, Vec3};
use pano_core::gpu::{Gpu, GpuOptions};
use pano_tests::random::Random;
use pano_trace::bvh::gpu::GpuTlas;
use pano_trace::bvh::{Blas, InstanceHit, Ray, Tlas};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("bvh::a_hundred_thousand_rays_equal_the_cpu", a_hundred_thousand_rays_equal_the_cpu),
    ("bvh::odd_meshes_equal_the_cpu", odd_meshes_equal_the_cpu),
    ("bvh::batches_make_no_difference", batches_make_no_difference),
];

/// A ball of faces that share their corners.
fn ball(rings: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let sectors = 2 * rings;
    let point = |i: u32| {
        let (theta, phi) = ((i / sectors) as f32 / rings as f32 * PI, (i % sectors) as f32 / sectors as f32 * TAU);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let positions = (0..(rings + 1) * sectors).map(point).collect();
    let at = |ring: u32, sector: u32| ring * sectors + sector % sectors;
    let quad = |ring, sector| {
        let [a, b, c, d] = [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector + 1), at(ring + 1, sector)];
        [[a, b, c], [a, c, d]]
    };
    (positions, (0..rings).flat_map(|r| (0..sectors).flat_map(move |s| quad(r, s))).collect())
}

/// Balls and loose faces in many places.
fn scene(random: &mut Random, places: usize) -> Tlas {
    let (positions, faces) = ball(24);
    let soup: Vec<Vec3> = (0..900).map(|_| random.direction() * random.between(0.2, 1.0)).collect();
    let loose: Vec<[u32; 3]> = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let meshes = [Arc::new(Blas::build(&positions, &faces)), Arc::new(Blas::build(&soup, &loose))];
    let place = |i: usize| {
        let at = random.direction() * random.between(0.0, 4.0);
        let scale = Vec3::new(random.between(0.3, 1.5), random.between(0.3, 1.5), random.between(0.3, 1.5));
        (meshes[i % 2].clone(), Affine3A::from_scale_rotation_translation(scale, random.rotation(), at))
    };
    Tlas::build((0..places).map(place).collect::<Vec<_>>())
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let ray = |i: usize| {
        let origin = random.direction() * random.between(0.0, 7.0);
        let towards = (random.direction() * 3.0 - origin).normalize();
        // Along the axes as well, and some that end.
        let direction = if i.is_multiple_of(20) { [Vec3::X, Vec3::NEG_Y, Vec3::Z][i / 20 % 3] } else { towards };
        Ray::new(origin, direction).up_to(if i.is_multiple_of(3) { random.between(0.1, 9.0) } else { f32::INFINITY })
    };
    (0..count).map(ray).collect()
}

/// How far a hit lies inside its face, in barycentric weights, 0 on an edge.
fn inside(hit: &InstanceHit) -> f32 {
    let w = hit.hit.barycentric;
    w.x.min(w.y).min(1.0 - w.x - w.y)
}

/// Rays on which both disagree beyond rounding. Möller & Trumbore in f32, on the GPU with fused products: distances agree to
/// 1e-4 of the scene's size in all but grazing hits, and a ray within 1e-3 of an edge, or ending at a face, may miss it.
fn compare(gpu: &Gpu, tlas: &Tlas, rays: &[Ray]) {
    let held = GpuTlas::new(gpu, tlas).unwrap();
    let (got, shadowed) = (held.intersect(gpu, rays).unwrap(), held.occluded(gpu, rays).unwrap());
    let (mut hits, mut edges) = (0, 0);
    for (i, (ray, got)) in rays.iter().zip(&got).enumerate() {
        let want = tlas.intersect(ray);
        hits += usize::from(want.is_some());
        let near_edge =
            |hit: &Option<InstanceHit>| hit.as_ref().is_some_and(|h| inside(h) < 1e-3 || h.hit.t > 0.9999 * ray.t_max);
        let same = match (got, &want) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                let close = (a.hit.t - b.hit.t).abs() <= 1e-4 * (1.0 + b.hit.t);
                let same_face = (a.instance, a.hit.triangle) == (b.instance, b.hit.triangle);
                close && (!same_face || a.hit.barycentric.distance(b.hit.barycentric) < 1e-2)
            }
            _ => false,
        };
        if !same {
            edges += 1;
            assert!(near_edge(got) || near_edge(&want), "ray {i} {ray:?}: GPU {got:?}, CPU {want:?}");
        }
        if shadowed[i] != tlas.occluded(ray) {
            edges += 1;
            assert!(near_edge(got) || near_edge(&want), "shadow ray {i} {ray:?}: GPU {}, CPU {want:?}", shadowed[i]);
        }
    }
    assert!(edges * 2000 <= rays.len().max(2000), "{edges} of {} rays disagree at edges", rays.len());
    println!("{} rays, {hits} hits, {edges} differ at an edge", rays.len());
}

fn a_hundred_thousand_rays_equal_the_cpu(gpu: &Gpu) {
    let mut random = Random::new(11);
    for places in [1, 3, 40] {
        let (tlas, rays) = (scene(&mut random, places), rays(&mut random, 34_000));
        compare(gpu, &tlas, &rays);
    }
}

fn odd_meshes_equal_the_cpu(gpu: &Gpu) {
    let mut random = Random::new(12);
    let rays = rays(&mut random, 500);
    compare(gpu, &Tlas::build([]), &rays);
    let triangle = [Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 1.5)];
    let one = Arc::new(Blas::build(&triangle, &[[0, 1, 2]]));
    compare(gpu, &Tlas::build([(one.clone(), Affine3A::IDENTITY)]), &rays);
    // The same face a hundred times, and faces without area.
    let many: Vec<[u32; 3]> = (0..100).map(|i| if i % 4 == 0 { [1, 1, 2] } else { [0, 1, 2] }).collect();
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_x(1.0), Vec3::new(0.1, 0.2, 0.3));
    let tlas = Tlas::build([(Arc::new(Blas::build(&triangle, &many)), turned)]);
    compare(gpu, &tlas, &rays);
    let point = Arc::new(Blas::build(&[Vec3::ZERO; 3], &[[0, 1, 2]]));
    compare(gpu, &Tlas::build([(point, Affine3A::IDENTITY), (one, turned)]), &rays);
}

fn batches_make_no_difference(gpu: &Gpu) {
    let mut random = Random::new(13);
    // Node, triangles and instances fit; rays go in eight batches.
    let small = Gpu::new(&GpuOptions { max_binding: Some(180_000), ..GpuOptions::default() }).unwrap();
    let (tlas, rays) = (scene(&mut random, 5), rays(&mut random, 40_000));
    let [a, b] = [&small, gpu].map(|g| GpuTlas::new(g, &tlas).unwrap().intersect(g, &rays).unwrap());
    assert!(a == b && small.submissions() >= 16, "{}", small.submissions());
}
