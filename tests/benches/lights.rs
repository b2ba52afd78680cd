//! Light from one frame of video: detection, tracking, maps. One thread, as beside a renderer that has the others.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use pano_core::image::RadianceImage;
use pano_light::track::{self, Tracker};
use pano_light::{WorkingMap, clipped, detect, ibl};
use pano_tests::scenes::{Lamp, sky};
use std::hint::black_box;
use std::time::Duration;

/// A sky with a sun and four lamps, clipped at 1.
fn frame(width: usize) -> RadianceImage {
    let lamp = |azimuth: f32, height: f32, degrees: f32| Lamp {
        direction: Vec3::new(azimuth.sin(), height, -azimuth.cos()).normalize(),
        cos_radius: degrees.to_radians().cos(),
        radiance: Vec3::splat(20.0),
    };
    let lamps = [lamp(0.8, 0.7, 3.0), lamp(-2.0, 0.5, 6.0), lamp(2.5, 1.5, 2.0), lamp(-0.7, 2.0, 4.0), lamp(1.6, 0.3, 8.0)];
    sky(width, Vec3::new(0.15, 0.12, 0.1), Vec3::new(0.35, 0.4, 0.5), &lamps).map(|p| p.min(Vec3::ONE))
}

fn lights(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing has run in parallel yet");
    let mut group = c.benchmark_group("lights");
    group.sample_size(20).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let params = detect::Params::default();
    let large = frame(4096);
    let small = frame(1024);
    let map = WorkingMap::from_ldr(&small);
    let found = detect::detect(&map, &params);
    let rest = found.clamped(&map);
    group.bench_function("detect at 600×150", |b| b.iter(|| detect::detect(black_box(&map), &params)));
    group.bench_function("detect in HDR 4096×2048", |b| {
        b.iter(|| detect::detect(&WorkingMap::upper_from_hdr(black_box(&large)), &params));
    });
    group.bench_function("detect in LDR 4096×2048", |b| {
        b.iter(|| detect::detect(&WorkingMap::upper_from_ldr(black_box(&large)), &params));
    });
    group.bench_function("detect in LDR 1024×512", |b| {
        b.iter(|| detect::detect(&WorkingMap::upper_from_ldr(black_box(&small)), &params));
    });
    group.bench_function("detect clipped in LDR 1024×512", |b| {
        b.iter(|| clipped::detect(black_box(&small), &map, &clipped::Params::default()));
    });
    let mut tracker = Tracker::new(track::Params::default());
    group.bench_function("track", |b| b.iter(|| tracker.update(black_box(&map), &found.lights)));
    group.bench_function("maps", |b| b.iter(|| ibl::radiance_maps(black_box(&rest))));
    group.bench_function("spherical harmonics", |b| b.iter(|| ibl::sh9::Sh9::project(black_box(&rest))));
    group.bench_function("median cut to 32 lights", |b| b.iter(|| ibl::median_cut::median_cut(black_box(&rest), 5)));
    group.finish();
}

criterion_group!(benches, lights);
criterion_main!(benches);
