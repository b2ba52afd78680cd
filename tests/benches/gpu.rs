//! Each stage that has a twin, on the CPU and on the GPU there is, copies to and from it included: prints the table of
//! docs/benchmarks.md. Not criterion's: two backends in one row, and bytes beside them.

use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_compose::composite::{self, Composite};
use pano_compose::lens;
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::gpu::{Gpu, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_core::sphere::resample;
use pano_denoise::{atrous, cross_bilateral, firefly, mean, temporal};
use pano_light::{WorkingMap, detect, expand, ibl};
use pano_tests::random::Random;
use pano_tests::rooms::{Cuboid, Room, captured, texel_direction};
use pano_trace::bvh::{Blas, Ray, Tlas, gpu::GpuTlas};
use pano_trace::iprt::gpu::GpuFrame;
use pano_trace::iprt::{self, GBuffer, Update, UpdatedWorld};
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::prt::{DepthField, FieldOptions, gpu::GpuDepthField};
use pano_trace::sparse;
use pano_trace::tracer::{self, TraceParams};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use std::sync::Arc;
use std::time::Instant;

/// The frame, and the panorama behind it.
const FRAME: (usize, usize) = (640, 480);
const PANORAMA: (usize, usize) = (2048, 1024);
/// Each time is the median of so many, after one that compiles and warms.
const RUNS: usize = 5;
/// What the roofline is for: a desktop GPU of 2023 by its data sheet, and its bus.
const DESKTOP: &str = "NVIDIA RTX 4060";
const FLOPS: f64 = 15.1e12;
const BUS: f64 = 12e9;

/// Keeps a result from being optimised away.
fn consume<T>(value: T) {
    std::hint::black_box(value);
}

/// Milliseconds of the median run.
fn time(mut run: impl FnMut()) -> f64 {
    run();
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let begin = Instant::now();
            run();
            begin.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

/// One row. `flop` are counted from the shader's text: operations of an element times elements.
fn row(gpu: &Gpu, name: &str, flop: f64, cpu: impl FnMut(), on_gpu: impl FnMut()) {
    let cpu_ms = time(cpu);
    let before = gpu.traffic();
    let gpu_ms = time(on_gpu);
    let after = gpu.traffic();
    let bytes = (after.uploaded - before.uploaded + after.read - before.read) as f64 / (RUNS + 1) as f64;
    let roofline = (flop / FLOPS + bytes / BUS) * 1e3;
    println!("| {name} | {cpu_ms:.1} | {gpu_ms:.1} | {:.1} | {:.2} | {roofline:.2} |", bytes / 1e6, flop / 1e9);
}

fn noise((w, h): (usize, usize)) -> RadianceImage {
    let mut random = Random::new(1);
    Image::from_fn(w, h, |_, _| random.color(0.0, 1.0))
}

/// A slanted floor with noise all over it.
fn layers() -> TracedLayers {
    let (w, h) = FRAME;
    let mut layers = TracedLayers::empty(w, h);
    layers.coverage = Image::from_fn(w, h, |x, _| if x * 2 < w { 0.0 } else { 1.0 });
    layers.object = noise(FRAME);
    layers.delta = noise(FRAME);
    layers.depth = Image::from_fn(w, h, |_, y| 500.0 / (y + 100) as f32);
    layers.normal = Image::filled(w, h, Vec3::Y);
    layers.albedo = Image::filled(w, h, Vec3::splat(0.5));
    layers
}

fn main() {
    let gpu = match Gpu::new(&GpuOptions::default()) {
        Ok(gpu) => gpu,
        Err(why) => return println!("{why}"),
    };
    println!("{}, driver {}; roofline of {DESKTOP}\n", gpu.adapter(), gpu.adapter().driver);
    println!("| stage | CPU ms | GPU ms | MB moved | GFLOP | roofline ms |\n|---|--:|--:|--:|--:|--:|");
    let pixels = (FRAME.0 * FRAME.1) as f64;
    let source = (PANORAMA.0 * PANORAMA.1) as f64;
    images(&gpu, pixels, source);
    filters(&gpu, pixels);
    rays(&gpu);
    tracing(&gpu);
    passes(&gpu);
}

fn images(gpu: &Gpu, pixels: f64, source: f64) {
    let panorama = noise(PANORAMA);
    let (mut a, mut b) = (panorama.clone(), panorama.clone());
    let cpu = || expand::expand(&panorama, &mut a).unwrap();
    row(gpu, "expand, 2048 × 1024", 15.0 * source, cpu, || expand::gpu::expand_picture(gpu, &panorama, &mut b).unwrap());
    let (width, height) = FRAME;
    let projection = Projection::Perspective { vfov: 1.0 };
    let camera = Camera { position: Vec3::ZERO, world_from_camera: Quat::IDENTITY, projection, width, height };
    let turn = Quat::from_rotation_y(0.3);
    let (mut a, mut b) = (noise(FRAME), noise(FRAME));
    let cpu = || resample::view_from_panorama(&panorama, turn, &camera, &mut a).unwrap();
    let on_gpu = || resample::gpu::view_from_panorama(gpu, &panorama, turn, &camera, &mut b).unwrap();
    row(gpu, "view of it", 150.0 * pixels, cpu, on_gpu);
    let cpu = || consume(WorkingMap::from_ldr(&panorama));
    row(gpu, "working map of it", 25.0 * source, cpu, || consume(WorkingMap::on_gpu(gpu, &panorama, true).unwrap()));
    let (map, params) = (WorkingMap::from_ldr(&panorama), detect::Params::default());
    let cpu = || consume(detect::detect(&map, &params));
    row(gpu, "detection", 600.0 * 150.0 * 40.0, cpu, || consume(detect::gpu::detect(gpu, &map, &params).unwrap()));
    let cpu = || consume(ibl::radiance_maps(map.radiance()));
    let lookups = 36.0 * f64::from(32 * 16 * 3 + 128 * 64 + 64 * 32);
    row(gpu, "lighting maps", 30.0 * lookups, cpu, || consume(ibl::gpu::radiance_maps(gpu, map.radiance()).unwrap()));
}

fn filters(gpu: &Gpu, pixels: f64) {
    let layers = layers();
    let params = cross_bilateral::Params::default();
    let cpu = || consume(cross_bilateral::filter(&params, &mut layers.clone()).unwrap());
    let on_gpu = || consume(cross_bilateral::gpu::filter_layers(gpu, &params, &mut layers.clone()).unwrap());
    row(gpu, "cross-bilateral, four passes", 4.0 * 5000.0 * pixels, cpu, on_gpu);

    let params = atrous::Params::default();
    let guides = atrous::Guides { depth: &layers.depth, normal: &layers.normal };
    let ones = layers.coverage.map(|_| 1.0);
    let cpu = || {
        let mut signal = layers.object.clone();
        let mut variance = layers.coverage.clone();
        atrous::filter(&params, &guides, &ones, &mut variance, &mut signal).unwrap();
    };
    let on_gpu = || {
        consume(
            atrous::gpu::filter_pictures(gpu, &params, &guides, &ones, &mut layers.coverage.clone(), &mut layers.object.clone())
                .unwrap(),
        )
    };
    row(gpu, "à-trous, five levels", 5.0 * 2000.0 * pixels, cpu, on_gpu);

    let params = firefly::Params::default();
    let cpu = || consume(firefly::clamp(&params, &ones, &mut layers.object.clone()).unwrap());
    let on_gpu = || consume(firefly::gpu::clamp_picture(gpu, &params, &ones, &mut layers.object.clone()).unwrap());
    row(gpu, "fireflies", 90.0 * pixels, cpu, on_gpu);

    let params = mean::Params::default();
    let (penumbra, photo) = (layers.coverage.map(|_| true), noise(FRAME));
    let cpu = || consume(mean::filter(&params, &penumbra, &photo, &mut layers.clone()).unwrap());
    let on_gpu = || consume(mean::gpu::filter_layers(gpu, &params, &penumbra, &photo, &mut layers.clone()).unwrap());
    row(gpu, "mean, penumbrae everywhere", 2.0 * 9.0 * 90.0 * pixels, cpu, on_gpu);

    let params = temporal::Params::default();
    let (w, h) = FRAME;
    let thing = Image::filled(w, h, 0u32);
    let previous = Image::from_fn(w, h, |x, y| Vec2::new(x as f32 + 1.2, y as f32 + 0.7));
    let (depth, normal) = (&layers.depth, &layers.normal);
    let guides =
        temporal::Guides { depth, normal, thing: &thing, previous: &previous, previous_depth: depth, sharp: None, level: None };
    let mut past = None;
    temporal::accumulate(&params, &guides, None, &mut layers.object.clone(), &mut past).unwrap();
    let cpu = || consume(temporal::accumulate(&params, &guides, None, &mut layers.object.clone(), &mut past.clone()).unwrap());
    let on_gpu = || {
        let (signal, past) = (&mut layers.object.clone(), &mut past.clone());
        consume(temporal::gpu::accumulate_picture(gpu, &params, &guides, None, signal, past).unwrap());
    };
    row(gpu, "temporal", 2000.0 * pixels, cpu, on_gpu);

    let params = sparse::Params::default();
    let (position, active) = (layers.depth.map(|d| Vec3::Z * d), Image::filled(w, h, 0u32));
    let cpu = || consume(sparse::levels(&params, &position, normal, &active));
    row(gpu, "sparse mask", 25.0 * 20.0 * pixels, cpu, || {
        consume(sparse::gpu::levels(gpu, &params, &position, normal, &active).unwrap())
    });

    let (mut a, mut b) = (Composite::new(w, h), Composite::new(w, h));
    let cpu = || consume(composite::composite(&photo, &layers, &mut a).unwrap());
    let on_gpu = || consume(composite::gpu::composite_pictures(gpu, &photo, &layers, &mut b).unwrap());
    row(gpu, "composite", 40.0 * pixels, cpu, on_gpu);

    let params = lens::Params { bloom: 0.1, glare: 0.1, threshold: 0.5, everything: true, ..lens::Params::default() };
    let cpu = || consume(lens::apply(&params, &photo, &mut photo.clone()).unwrap());
    let on_gpu = || consume(lens::gpu::apply_picture(gpu, &params, &photo, &mut photo.clone()).unwrap());
    // Four rays of three passes of four samples, and the bloom's lookup.
    row(gpu, "bloom and glare", (4.0 * 3.0 * 4.0 * 12.0 + 100.0) * pixels, cpu, on_gpu);
}

/// A metal ball over a plane, traced by dpt: tables are packed and copied each time.
fn tracing(gpu: &Gpu) {
    let radiance = |x, y| Vec3::splat(0.5) + if texel_direction(512, 256, x, y).y > 0.95 { 30.0 } else { 0.0 };
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(8.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    let world = ProxyWorld::new(Arc::new(Image::from_fn(512, 256, radiance)), Quat::IDENTITY, Vec3::Y, &[plane]);
    let ball = Placement {
        mesh: Arc::new(PreparedMesh::new(primitives::icosphere(0.4, 4)).unwrap()),
        world_from_mesh: Affine3A::from_translation(Vec3::new(0.0, 0.4, -1.5)),
        material: Some(Material::metal(Vec3::new(0.9, 0.7, 0.4), 0.5)),
    };
    let objects = Objects::new(&[ball]);
    let camera = Camera {
        position: Vec3::new(0.0, 1.2, 0.4),
        world_from_camera: rotation_from_yaw_pitch(0.0, -25.0),
        projection: Projection::Perspective { vfov: 0.8 },
        width: 320,
        height: 240,
    };
    let frame = tracer::Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let params = TraceParams { samples: 16, ..TraceParams::default() };
    let traced = tracer::render(&frame, &world, &params, &Silent).unwrap();
    let cpu = || consume(tracer::render(&frame, &world, &params, &Silent).unwrap());
    // About forty nodes or faces a ray of some forty operations, and as much again for what it has met.
    let flop = traced.rays as f64 * 40.0 * 80.0;
    let name = format!("dpt, 320 × 240, 16 samples, {} rays", traced.rays);
    row(gpu, &name, flop, cpu, || consume(tracer::gpu::render(gpu, &frame, &world, &params, &Silent).unwrap()));
}

/// A metal ball in a room, by the passes of iprt with one sample a pixel.
fn passes(gpu: &Gpu) {
    let walls = Cuboid { lo: Vec3::new(-2.0, -1.5, -3.0), hi: Vec3::new(2.5, 1.2, 2.0) };
    let table = Some(Cuboid { lo: Vec3::new(-1.3, -1.5, -1.9), hi: Vec3::new(-0.2, -0.7, -1.1) });
    let colors = [Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.7, 0.8, 0.9)];
    let room = Room { walls, table, window: None, colors, lights: [Vec3::splat(3.0), Vec3::splat(12.0)] };
    let world = captured(&room.radiance(1024), &room.depth(1024), Quat::IDENTITY, Vec3::ZERO);
    let ball = Placement {
        mesh: Arc::new(PreparedMesh::new(primitives::icosphere(0.3, 4)).unwrap()),
        world_from_mesh: Affine3A::from_translation(Vec3::new(0.3, -1.2, -1.5)),
        material: Some(Material::metal(Vec3::new(0.9, 0.7, 0.4), 0.5)),
    };
    let objects = Objects::new(&[ball]);
    let camera = Camera {
        position: Vec3::ZERO,
        world_from_camera: rotation_from_yaw_pitch(0.0, -30.0),
        projection: Projection::Perspective { vfov: 0.9 },
        width: 320,
        height: 240,
    };
    let frame = iprt::Frame { camera: &camera, objects: &objects, capture: Vec3::ZERO, stream: Stream::default() };
    // A ray is marched over some fifty cells, and asks the objects' tree.
    let flop = |rays: u64| rays as f64 * (50.0 * 60.0 + 40.0 * 80.0);
    let held = GpuFrame::new(gpu, &frame, &world, None).unwrap();
    row(gpu, "iprt's scene, 1024 × 512", 0.0, || (), || consume(GpuFrame::new(gpu, &frame, &world, None).unwrap()));
    let buffer = GBuffer::new(&frame, &world);
    let cpu = || consume(GBuffer::new(&frame, &world));
    row(gpu, "its g-buffer, 320 × 240", flop(320 * 240), cpu, || consume(held.gbuffer(gpu, &frame).unwrap()));
    let (params, known) = (iprt::Params { attempts: 16, ..iprt::Params::default() }, Update::default());
    let updated = UpdatedWorld::new(&world, Vec3::ZERO, &known);
    let all = |_: usize, _: usize| true;
    let real = iprt::trace_real(&frame, &updated, &params, None, all, &Silent).unwrap();
    let cpu = || consume(iprt::trace_real(&frame, &updated, &params, None, all, &Silent).unwrap());
    let on_gpu = || consume(held.trace_real(gpu, &frame, &world, &known, &params, all, &Silent).unwrap());
    row(gpu, &format!("its real pixels, {} rays", real.rays), flop(real.rays), cpu, on_gpu);
    let (ratio, gloss) = (Image::filled(320, 240, Vec3::splat(0.9)), Image::filled(320, 240, Vec2::X));
    let cpu = || consume(iprt::panorama_update(&frame, &world, &buffer, &ratio, &gloss, (1024, 512)));
    let on_gpu = || consume(held.panorama_update(gpu, &frame, &buffer, &ratio, &gloss, (1024, 512)).unwrap());
    row(gpu, "its update", 300.0 * 1024.0 * 512.0, cpu, on_gpu);
    let seen = iprt::trace_virtual(&frame, &updated, &params, &Silent).unwrap();
    let cpu = || consume(iprt::trace_virtual(&frame, &updated, &params, &Silent).unwrap());
    let on_gpu = || consume(held.trace_virtual(gpu, &frame, &known, &params, &Silent).unwrap());
    row(gpu, &format!("its virtual pixels, {} rays", seen.rays), flop(seen.rays), cpu, on_gpu);
}

fn rays(gpu: &Gpu) {
    /// Faces along each side of a bumpy sheet, and rays.
    const SIDE: u32 = 100;
    const RAYS: usize = 1 << 17;
    let mut random = Random::new(5);
    let point =
        |i: u32| Vec3::new((i % SIDE) as f32, random.between(0.0, 3.0), (i / SIDE) as f32) * (2.0 / SIDE as f32) - Vec3::ONE;
    let positions: Vec<Vec3> = (0..SIDE * SIDE).map(point).collect();
    let quad = |i: u32| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]];
    let faces: Vec<[u32; 3]> = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE < SIDE - 1).flat_map(quad).collect();
    let mesh = Arc::new(Blas::build(&positions, &faces));
    let tlas = Tlas::build((0..3).map(|i| (mesh.clone(), Affine3A::from_translation(Vec3::Y * i as f32))));
    let ray = |_| {
        let origin = random.direction() * 3.0;
        Ray::new(origin, (random.direction() - origin).normalize())
    };
    let rays: Vec<Ray> = (0..RAYS).map(ray).collect();
    let held = GpuTlas::new(gpu, &tlas).unwrap();
    // Forty nodes of two boxes and eight faces a ray.
    let flop = RAYS as f64 * (40.0 * 2.0 * 20.0 + 8.0 * 40.0);
    let cpu = || consume(rays.iter().map(|r| tlas.intersect(r)).collect::<Vec<_>>());
    row(gpu, "131 072 rays, 3 × 20 k faces (CPU: one thread)", flop, cpu, || consume(held.intersect(gpu, &rays).unwrap()));
    let cpu = || consume(rays.iter().map(|r| tlas.occluded(r)).collect::<Vec<_>>());
    row(gpu, "the same, any hit", flop, cpu, || consume(held.occluded(gpu, &rays).unwrap()));

    // A room with a pillar in it.
    let (walls, pillar) = (Cuboid { lo: Vec3::splat(-2.0), hi: Vec3::splat(2.5) }, Vec3::new(1.0, 0.0, 0.3));
    let depth = Image::from_fn(2048, 1024, |x, y| {
        let d = texel_direction(2048, 1024, x, y);
        let wall = walls.span(Vec3::ZERO, d).map_or(f32::INFINITY, |s| s.1);
        if d.dot(pillar) > 1.0 { 0.8 } else { wall }
    });
    let field = DepthField::new(&depth, &FieldOptions { back_faces: false, ..FieldOptions::default() });
    let held = GpuDepthField::new(gpu, &field).unwrap();
    let rays: Vec<Ray> = (0..RAYS).map(|_| Ray::new(random.direction() * 0.5, random.direction())).collect();
    let cpu = || consume(rays.iter().map(|r| field.march(r.origin, r.direction, r.t_max)).collect::<Vec<_>>());
    let on_gpu = || consume(held.march(gpu, &rays).unwrap());
    // Some fifty cells a ray.
    row(gpu, "131 072 rays through the depth of 2048 × 1024 (CPU: one thread)", RAYS as f64 * 50.0 * 60.0, cpu, on_gpu);
}
