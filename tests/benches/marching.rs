//! Rays per second through the depth of a panorama: hierarchical marching against linear marching, whose step is a texel.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use pano_core::image::Image;
use pano_core::sphere;
use pano_tests::random::Random;
use pano_trace::prt::{DepthField, FieldOptions, march_linear};
use std::hint::black_box;

/// A room of 5 × 3 × 6 m with a table in it.
fn depth(width: usize) -> Image<f32> {
    let span = |lo: Vec3, hi: Vec3, d: Vec3| {
        let (a, b) = (lo / d, hi / d);
        (a.min(b).max_element(), a.max(b).min_element())
    };
    Image::par_from_fn(width, width / 2, |x, y| {
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / (width / 2) as f32);
        let d = sphere::direction_from_uv(uv);
        let wall = span(Vec3::new(-2.5, -1.5, -3.0), Vec3::new(2.5, 1.5, 3.0), d).1;
        let (near, far) = span(Vec3::new(-0.9, -1.5, -1.9), Vec3::new(0.5, -0.7, -1.1), d);
        if near > 0.0 && near < far { near } else { wall }
    })
}

/// Rays from anywhere in the room in any direction, as paths have them after a bounce.
fn rays() -> Vec<(Vec3, Vec3)> {
    let mut random = Random::new(1);
    (0..1024)
        .map(|_| {
            let origin = Vec3::new(random.between(-2.4, 2.4), random.between(-1.4, 1.4), random.between(-2.9, 2.9));
            (origin, random.direction())
        })
        .collect()
}

fn marching(c: &mut Criterion) {
    let rays = rays();
    for width in [2048, 4096] {
        let options = FieldOptions { back_faces: false, ..FieldOptions::default() };
        let field = DepthField::new(&depth(width), &options);
        let mut group = c.benchmark_group(format!("marching, {width}×{}", width / 2));
        group.throughput(Throughput::Elements(rays.len() as u64));
        group.sample_size(10);
        group.bench_function(BenchmarkId::from_parameter("hierarchical"), |b| {
            b.iter(|| rays.iter().filter(|(o, d)| black_box(field.march(*o, *d, f32::INFINITY)).hit().is_some()).count());
        });
        group.bench_function(BenchmarkId::from_parameter("linear"), |b| {
            // Half a turn at most, a texel a step.
            b.iter(|| {
                rays.iter().filter(|(o, d)| black_box(march_linear(&field, *o, *d, f32::INFINITY, width / 2)).is_some()).count()
            });
        });
        group.finish();
    }
}

criterion_group!(benches, marching);
criterion_main!(benches);
