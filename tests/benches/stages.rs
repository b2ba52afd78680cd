//! Stages and parts of stages by themselves.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Quat, UVec2, Vec2, Vec3};
use pano_compose::composite::{Composite, composite};
use pano_core::image::RadianceImage;
use pano_core::random::{Sampler, Stream};
use pano_core::sphere::resample::view_from_panorama;
use pano_core::{color, distribution::SphereDistribution};
use pano_denoise::cross_bilateral;
use pano_tests::random::Random;
use pano_tests::rooms::{Cuboid, Room, captured};
use pano_tests::scenes::{plane_with_two_windows, view};
use pano_trace::bvh::Ray;
use pano_trace::prt::{DepthField, FieldOptions};
use pano_trace::tracer::TraceParams;
use pano_trace::world::RealWorld;
use std::hint::black_box;
use std::time::Duration;

const RAYS: usize = 10_000;

fn room() -> Room {
    Room {
        walls: Cuboid { lo: Vec3::new(-2.0, -1.5, -3.0), hi: Vec3::new(2.5, 1.2, 2.0) },
        table: Some(Cuboid { lo: Vec3::new(-1.3, -1.5, -1.9), hi: Vec3::new(-0.2, -0.7, -1.1) }),
        window: Some((Vec2::new(0.2, -0.5), Vec2::new(1.5, 0.7))),
        colors: [Vec3::splat(0.2), Vec3::splat(0.7)],
        lights: [Vec3::splat(4.0), Vec3::splat(10.0)],
    }
}

fn stages(c: &mut Criterion) {
    let mut group = c.benchmark_group("stages");
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    let room = room();
    let (radiance, depth) = (room.radiance(1024), room.depth(1024));

    let camera = view(Vec3::ZERO, Vec3::new(0.3, -0.4, -1.0), 60.0, 640, 480);
    let mut picture = RadianceImage::filled(640, 480, Vec3::ZERO);
    group.throughput(Throughput::Elements(640 * 480));
    group.bench_function("resample 1024×512 to 640×480", |b| {
        b.iter(|| view_from_panorama(&radiance, Quat::from_rotation_y(0.3), &camera, &mut picture));
    });

    group.throughput(Throughput::Elements(1024 * 512));
    group.bench_function("depth field of 1024×512", |b| b.iter(|| DepthField::new(&depth, &FieldOptions::default())));
    let luminance = radiance.map(color::luminance);
    group.bench_function("light table of 1024×512", |b| b.iter(|| SphereDistribution::new(&luminance)));

    let mut random = Random::new(1);
    let rays: Vec<(Vec3, Vec3)> = (0..RAYS)
        .map(|_| {
            let share = random.color(0.05, 0.95);
            (room.walls.lo + (room.walls.hi - room.walls.lo) * share, random.direction())
        })
        .collect();
    let field = DepthField::new(&depth, &FieldOptions::default());
    group.throughput(Throughput::Elements(RAYS as u64));
    group.bench_function("march", |b| {
        b.iter(|| rays.iter().filter(|(o, d)| field.march(black_box(*o), *d, f32::INFINITY).hit().is_some()).count());
    });
    let world = captured(&radiance, &depth, Quat::IDENTITY, Vec3::ZERO);
    group.bench_function("captured hit with radiance", |b| {
        b.iter(|| rays.iter().filter(|(o, d)| world.hit(&Ray::new(black_box(*o), *d)).is_some()).count());
    });
    let numbers: Vec<Vec2> = (0..RAYS).map(|_| Vec2::new(random.unit(), random.unit())).collect();
    let light = SphereDistribution::new(&luminance).expect("the room is not black");
    group.bench_function("light sample", |b| b.iter(|| numbers.iter().filter_map(|&u| light.sample(black_box(u))).count()));
    group.bench_function("light density", |b| b.iter(|| rays.iter().map(|(_, d)| light.pdf(black_box(*d))).sum::<f32>()));
    group.bench_function("four random numbers", |b| {
        b.iter(|| (0..RAYS as u32).map(|i| Sampler::new(UVec2::ONE, i, Stream::default()).next_4d()[3]).sum::<f32>());
    });

    let traced = plane_with_two_windows(640, 480).trace(&TraceParams { samples: 1, ..TraceParams::default() }, 0).layers;
    group.throughput(Throughput::Elements(640 * 480));
    group.bench_function("cross-bilateral 640×480", |b| {
        b.iter_batched(
            || traced.clone(),
            |mut layers| cross_bilateral::filter(&cross_bilateral::Params::default(), &mut layers),
            criterion::BatchSize::LargeInput,
        );
    });
    let mut out = Composite::new(640, 480);
    group.bench_function("composite 640×480", |b| b.iter(|| composite(&picture, &traced, &mut out)));
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
