//! The path tracers.

use crate::Test;
use crate::frames::{
    GREY, assert_same, assert_sampled_alike, both_of, of_all_kinds, plain, plane, rmse, sky, textured, under, view, worlds,
};
use glam::{Affine3A, Quat, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::RadianceImage;
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::tracer::gpu;
use pano_trace::tracer::{self, Frame, Method, Mis, TraceParams, Traced};
use pano_trace::world::ProxyWorld;
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("trace::frames_equal_the_cpu", frames_equal_the_cpu),
    ("trace::strategies_equal_the_cpu", strategies_equal_the_cpu),
    ("trace::odd_scenes_equal_the_cpu", odd_scenes_equal_the_cpu),
    ("trace::textures_equal_the_cpu", textures_equal_the_cpu),
    ("trace::bands_and_submissions_make_no_difference", bands_and_submissions_make_no_difference),
    ("trace::adaptive_frames_equal_the_cpu", adaptive_frames_equal_the_cpu),
    ("trace::what_does_not_fit_is_refused", what_does_not_fit_is_refused),
];

const METHODS: [Method; 4] = [Method::Ibl, Method::OnePass, Method::TwoPass, Method::Dpt];

fn both(gpu: &Gpu, camera: &Camera, objects: &Objects, world: &ProxyWorld, params: &TraceParams) -> [Traced; 2] {
    both_of(camera, objects, world, params, |frame| gpu::render(gpu, frame, world, params, &Silent))
}

fn frames_equal_the_cpu(gpu: &Gpu) {
    let camera = view(37, 26);
    // Compiling takes the longest: not every pair of method and world.
    let frames: [(Objects, &[Method]); 3] = [
        (of_all_kinds(), &METHODS),
        (plain(), &[Method::OnePass, Method::Dpt]),
        (of_all_kinds(), &[Method::TwoPass, Method::Dpt]),
    ];
    for (i, (world, (objects, methods))) in worlds(30.0).iter().zip(&frames).enumerate() {
        for &method in *methods {
            let params = TraceParams { method, samples: 4, bounces: 3, ..TraceParams::default() };
            let [got, want] = both(gpu, &camera, objects, world, &params);
            let lit = want.layers.object.data().iter().chain(want.layers.delta.data()).filter(|p| p.length() > 0.01).count();
            assert!(lit > 100, "{method:?}: {lit} pixels are lit");
            assert_same(&format!("{method:?}, world {i}"), &got, &want);
        }
    }
}

fn strategies_equal_the_cpu(gpu: &Gpu) {
    let camera = Camera { projection: Projection::Panorama, position: Vec3::new(0.1, 0.9, 0.4), ..view(40, 20) };
    let worlds = worlds(3.0);
    for method in [Method::OnePass, Method::Dpt] {
        for mis in [Mis::LightOnly, Mis::BsdfOnly] {
            // Enough bounces for Russian roulette.
            let params = TraceParams { method, mis, samples: 3, bounces: 7, ..TraceParams::default() };
            let [got, want] = both(gpu, &camera, &of_all_kinds(), &worlds[1], &params);
            assert_same(&format!("{method:?}, {mis:?}"), &got, &want);
        }
    }
    for everywhere in [false, true] {
        let params = TraceParams { everywhere, second_order: false, samples: 6, bounces: 2, ..TraceParams::default() };
        let [got, want] = both(gpu, &camera, &plain(), &worlds[1], &params);
        assert_same(&format!("everywhere {everywhere}"), &got, &want);
    }
}

/// Black skies, no proxies, one pixel, objects behind and around the camera, more objects than clusters, one sample, one bounce.
fn odd_scenes_equal_the_cpu(gpu: &Gpu) {
    let params = TraceParams { samples: 1, bounces: 1, ..TraceParams::default() };
    let [got, want] = both(gpu, &view(1, 1), &plain(), &worlds(3.0)[0], &params);
    assert_same("one pixel", &got, &want);

    let floor = plane(Vec3::ZERO, Quat::IDENTITY, GREY);
    let black = under(RadianceImage::filled(2, 1, Vec3::ZERO), std::slice::from_ref(&floor));
    for (objects, method) in [(of_all_kinds(), Method::OnePass), (of_all_kinds(), Method::Dpt), (plain(), Method::Ibl)] {
        let params = TraceParams { method, samples: 3, bounces: 2, ..TraceParams::default() };
        let [got, want] = both(gpu, &view(20, 14), &objects, &black, &params);
        assert_same(&format!("{method:?} in the dark"), &got, &want);
    }
    let empty = under(sky(4.0), &[]);
    let [got, want] = both(gpu, &view(20, 14), &of_all_kinds(), &empty, &TraceParams { samples: 4, ..TraceParams::default() });
    assert_same("nothing real", &got, &want);

    let mut random = Random::new(51);
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 1)).unwrap());
    let mut many: Vec<Placement> = (0..14)
        .map(|i| Placement {
            mesh: mesh.clone(),
            world_from_mesh: Affine3A::from_scale_rotation_translation(
                Vec3::splat(if i == 0 { 1e-4 } else { random.between(0.05, 0.3) }),
                random.rotation(),
                Vec3::new(random.between(-3.0, 3.0), random.between(-0.3, 1.5), random.between(-3.0, 3.0)),
            ),
            material: Some(Material::diffuse(random.color(0.1, 0.9))),
        })
        .collect();
    let params = TraceParams { samples: 4, bounces: 2, ..TraceParams::default() };
    let [got, want] = both(gpu, &view(30, 20), &Objects::new(&many), &worlds(3.0)[1], &params);
    assert_same("many", &got, &want);
    // A shell around everything.
    many[1].world_from_mesh = Affine3A::from_scale(Vec3::splat(5.0));
    let [got, want] = both(gpu, &view(30, 20), &Objects::new(&many), &worlds(3.0)[1], &params);
    assert_same("inside", &got, &want);
}

fn textures_equal_the_cpu(gpu: &Gpu) {
    let objects = textured();
    for method in [Method::Ibl, Method::Dpt] {
        let params = TraceParams { method, samples: 8, bounces: 2, ..TraceParams::default() };
        let [got, want] = both(gpu, &view(48, 32), &objects, &worlds(3.0)[0], &params);
        assert_same(&format!("{method:?} with textures"), &got, &want);
    }
}

/// More pixels than one submission takes, and more samples.
fn bands_and_submissions_make_no_difference(gpu: &Gpu) {
    let world = &worlds(3.0)[0];
    let objects = plain();
    let trace = |camera: &Camera, samples: u32| {
        let params = TraceParams { method: Method::Ibl, samples, ..TraceParams::default() };
        let before = gpu.submissions();
        let frame = Frame { camera, objects: &objects, stream: Stream::default() };
        let traced = gpu::render(gpu, &frame, world, &params, &Silent).unwrap().unwrap();
        (traced, gpu.submissions() - before)
    };
    let wide = Camera { width: 700, height: 400, ..view(700, 400) };
    let (whole, submissions) = trace(&wide, 1);
    assert!(submissions >= 6, "{submissions}");
    // The lower rows' own random numbers.
    let frame = Frame { camera: &wide, objects: &objects, stream: Stream::default() };
    let params = TraceParams { method: Method::Ibl, samples: 1, ..TraceParams::default() };
    let want = tracer::render(&frame, world, &params, &Silent).unwrap();
    assert!(rmse(&whole, &want) < 2e-3, "{}", rmse(&whole, &want));

    let tall = view(64, 32);
    let ((long, submissions), (again, _)) = (trace(&tall, 200), trace(&tall, 200));
    assert!(submissions >= 6 && long.layers.object == again.layers.object, "{submissions}");
    let frame = Frame { camera: &tall, objects: &objects, stream: Stream::default() };
    let want = tracer::render(&frame, world, &TraceParams { method: Method::Ibl, samples: 200, ..params }, &Silent).unwrap();
    assert_same("200 samples", &long, &want);
}

/// Samples go where the CPU's go; of fewer than a pilot there is one part only.
fn adaptive_frames_equal_the_cpu(gpu: &Gpu) {
    for (method, samples, objects) in [
        (Method::Dpt, 64, of_all_kinds()),
        (Method::Dpt, 6, plain()),
        (Method::OnePass, 48, plain()),
        (Method::Ibl, 128, plain()),
    ] {
        let params = TraceParams { method, samples, bounces: 2, error_target: Some(0.01), ..TraceParams::default() };
        let [got, want] = both(gpu, &view(37, 26), &objects, &worlds(3.0)[1], &params);
        let what = format!("{method:?}, at most {samples} samples");
        assert_same(&what, &got, &want);
        assert_sampled_alike(&what, &got, &want);
    }
}

fn what_does_not_fit_is_refused(_: &Gpu) {
    let small = Gpu::new(&GpuOptions { max_binding: Some(3000), ..GpuOptions::default() }).unwrap();
    let (camera, objects) = (view(4, 4), plain());
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let refused = gpu::render(&small, &frame, &worlds(3.0)[0], &TraceParams::default(), &Silent);
    assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
}
