//! Rays per second through the BVH of one mesh, and of one placed mesh, against bare `obvhs` on the same rays.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams, cwbvh::CwBvh, cwbvh::builder::build_cwbvh_from_tris, ray::RayHit, rt_triangle::RtTriangle, triangle::Triangle,
};
use pano_core::builtin::primitives;
use pano_core::mesh::Mesh;
use pano_tests::random::Random;
use pano_tests::scenes::view;
use pano_trace::bvh::{Blas, Ray, Tlas};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

/// The mesh in `obvhs`' own terms, as its examples do it.
struct Bare {
    bvh: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Bare {
    fn new(mesh: &Mesh) -> Self {
        let corner = |v: u32| Vec3A::from(mesh.positions[v as usize]);
        let triangles: Vec<Triangle> =
            mesh.triangles.iter().map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) }).collect();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        Self { bvh, triangles }
    }

    fn intersect(&self, ray: &Ray) -> Option<f32> {
        let ray = obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max);
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray)).then_some(hit.t)
    }
}

/// Primary rays of a view that the mesh fills.
fn coherent() -> Vec<Ray> {
    let camera = view(Vec3::new(0.4, 0.8, 3.0), Vec3::ZERO, 38.0, 128, 128);
    let pixels = (0..128 * 128).map(|i| glam::Vec2::new((i % 128) as f32 + 0.5, (i / 128) as f32 + 0.5));
    pixels.map(|p| Ray::new(camera.position, camera.direction(p))).collect()
}

/// Rays from anywhere near the mesh in any direction, as paths have them after a bounce.
fn incoherent() -> Vec<Ray> {
    let mut random = Random::new(1);
    (0..128 * 128)
        .map(|_| {
            let (origin, target) = (random.direction() * 1.1, random.direction() * random.unit());
            Ray::new(origin, (target - origin).normalize())
        })
        .collect()
}

fn bvh(c: &mut Criterion) {
    let meshes = [
        ("sphere-20k", primitives::icosphere(1.0, 5)),
        ("knot-20k", primitives::torus_knot(2, 3, 0.6, 0.18, 500, 20)),
        ("sphere-200k", primitives::uv_sphere(1.0, 400, 250)),
        ("knot-200k", primitives::torus_knot(2, 3, 0.6, 0.18, 2000, 50)),
    ];
    let rays = [("coherent", coherent()), ("incoherent", incoherent())];
    for (mesh_name, mesh) in &meshes {
        let bare = Bare::new(mesh);
        let blas = Arc::new(Blas::build(&mesh.positions, &mesh.triangles));
        let tlas = Tlas::build([(blas.clone(), Affine3A::IDENTITY)]);
        for (rays_name, rays) in &rays {
            let hits = rays.iter().filter(|r| bare.intersect(r).is_some()).count();
            let ours = rays.iter().filter(|r| blas.intersect(r).is_some()).count();
            assert!(hits.abs_diff(ours) * 1000 <= hits, "{mesh_name}, {rays_name}: {hits} rays hit bare obvhs, {ours} ours");
            let mut group = c.benchmark_group(format!("bvh/{mesh_name}/{rays_name}"));
            group.throughput(Throughput::Elements(rays.len() as u64));
            group.sample_size(30).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
            let id = |what: &str| BenchmarkId::from_parameter(what);
            group.bench_function(id("obvhs"), |b| {
                b.iter(|| rays.iter().filter(|r| bare.intersect(black_box(r)).is_some()).count())
            });
            group.bench_function(id("blas"), |b| {
                b.iter(|| rays.iter().filter(|r| blas.intersect(black_box(r)).is_some()).count())
            });
            group.bench_function(id("tlas"), |b| {
                b.iter(|| rays.iter().filter(|r| tlas.intersect(black_box(r)).is_some()).count())
            });
            group.bench_function(id("occluded"), |b| b.iter(|| rays.iter().filter(|r| tlas.occluded(black_box(r))).count()));
            group.finish();
        }
    }
}

criterion_group!(benches, bvh);
criterion_main!(benches);
