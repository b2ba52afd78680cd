//! The path tracers.

use crate::Test;
use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::material::{Material, Texture, Wrap};
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_tests::rooms::texel_direction;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::tracer::gpu::{self, Missing};
use pano_trace::tracer::{self, Frame, Method, Mis, TraceParams, Traced};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("trace::frames_equal_the_cpu", frames_equal_the_cpu),
    ("trace::strategies_equal_the_cpu", strategies_equal_the_cpu),
    ("trace::odd_scenes_equal_the_cpu", odd_scenes_equal_the_cpu),
    ("trace::textures_equal_the_cpu", textures_equal_the_cpu),
    ("trace::bands_and_submissions_make_no_difference", bands_and_submissions_make_no_difference),
    ("trace::what_is_missing_is_told", what_is_missing_is_told),
];

const METHODS: [Method; 4] = [Method::Ibl, Method::OnePass, Method::TwoPass, Method::Dpt];

/// A sky with a sun, about 1 bright without it.
fn sky(sun: f32) -> RadianceImage {
    let toward = Vec3::new(0.5, 1.0, 0.3).normalize();
    let radiance = |d: Vec3| if d.dot(toward) > 0.99 { Vec3::splat(sun) } else { Vec3::splat(0.6) + 0.4 * d };
    Image::from_fn(48, 24, |x, y| radiance(texel_direction(48, 24, x, y)))
}

fn plane(at: Vec3, turn: Quat, reflectance: Reflectance) -> Proxy {
    Proxy {
        shape: ProxyShape::Plane(Vec2::splat(8.0)),
        world_from_local: Affine3A::from_rotation_translation(turn, at),
        reflectance,
    }
}

fn under(sky: RadianceImage, proxies: &[Proxy]) -> ProxyWorld {
    ProxyWorld::new(Arc::new(sky), Quat::from_rotation_y(0.7), Vec3::new(0.0, 1.5, 2.0), proxies)
}

const GREY: Reflectance = Reflectance::Known(Vec3::new(0.6, 0.5, 0.4));

/// One floor; a floor and a wall that see each other; a floor that has the picture's colour, and a block on it.
fn worlds(sun: f32) -> Vec<ProxyWorld> {
    let floor = plane(Vec3::ZERO, Quat::IDENTITY, GREY);
    let wall = plane(Vec3::new(0.0, 0.0, -2.5), Quat::from_rotation_x(1.5), Reflectance::Known(Vec3::new(0.2, 0.7, 0.3)));
    let pictured = plane(Vec3::ZERO, Quat::IDENTITY, Reflectance::FromPicture { cap: 0.9 });
    let block = Proxy {
        shape: ProxyShape::Mesh(Arc::new(PreparedMesh::new(primitives::icosphere(0.5, 0)).unwrap())),
        world_from_local: Affine3A::from_rotation_translation(Quat::from_rotation_y(0.3), Vec3::new(-1.2, 0.3, -1.0)),
        reflectance: GREY,
    };
    vec![under(sky(sun), std::slice::from_ref(&floor)), under(sky(sun), &[floor, wall]), under(sky(sun), &[pictured, block])]
}

fn balls(materials: &[Material]) -> Objects {
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let place = |(i, material): (usize, &Material)| {
        let at = Vec3::new(0.75 * (i as f32 - 0.5 * (materials.len() - 1) as f32), 0.38, -0.6 - 0.2 * (i % 2) as f32);
        Placement {
            mesh: mesh.clone(),
            // Not the same along all axes, and the second one mirrored.
            world_from_mesh: Affine3A::from_scale_rotation_translation(
                Vec3::new(if i == 1 { -0.3 } else { 0.3 }, 0.35, 0.32),
                Quat::from_rotation_z(0.2),
                at,
            ),
            material: Some(material.clone()),
        }
    };
    Objects::new(&materials.iter().enumerate().map(place).collect::<Vec<_>>())
}

/// Every kind of surface.
fn of_all_kinds() -> Objects {
    balls(&[
        Material::metal(Vec3::new(0.9, 0.7, 0.5), 0.4),
        Material { roughness: 0.5, base_color: Vec3::new(0.2, 0.4, 0.8), ..Material::default() },
        Material { attenuation_color: Vec3::new(0.9, 0.5, 0.3), attenuation_distance: 0.3, ..Material::glass(1.5, 0.0) },
        Material::emitter(Vec3::new(3.0, 2.0, 1.0)),
        Material { transmission: 0.5, ..Material::glass(1.4, 0.6) },
    ])
}

/// Nothing but diffuse.
fn plain() -> Objects {
    balls(&[Material::diffuse(Vec3::splat(0.7)), Material::diffuse(Vec3::new(0.1, 0.6, 0.9))])
}

fn view(width: usize, height: usize) -> Camera {
    Camera {
        position: Vec3::new(0.1, 1.3, 1.9),
        world_from_camera: rotation_from_yaw_pitch(2.0, -24.0),
        projection: Projection::Perspective { vfov: 0.9 },
        width,
        height,
    }
}

fn both(gpu: &Gpu, camera: &Camera, objects: &Objects, world: &ProxyWorld, params: &TraceParams) -> [Traced; 2] {
    let frame = Frame { camera, objects, stream: Stream { frame: 3, seed: 5 } };
    let mut got = gpu::render(gpu, &frame, world, params, &Silent).unwrap().expect("nobody cancels");
    let want = tracer::render(&frame, world, params, &Silent).expect("nobody cancels");
    if params.method == Method::TwoPass {
        // The GPU leaves out the second pass where nothing is used of it.
        assert!(got.rays <= want.rays, "{} {}", got.rays, want.rays);
        got.rays = want.rays;
    }
    [got, want]
}

/// Root mean square difference over the pixels of object, delta and coverage.
fn rmse(a: &Traced, b: &Traced) -> f64 {
    let squares = |a: &Image<Vec3>, b: &Image<Vec3>| {
        a.data().iter().zip(b.data()).map(|(a, b)| f64::from((*a - *b).length_squared())).sum::<f64>()
    };
    let coverage = a.layers.coverage.data().iter().zip(b.layers.coverage.data()).map(|(a, b)| f64::from(a - b).powi(2));
    let sum = squares(&a.layers.object, &b.layers.object) + squares(&a.layers.delta, &b.layers.delta) + coverage.sum::<f64>();
    (sum / a.layers.coverage.data().len() as f64).sqrt()
}

/// Frames of light of about 1. Rounding moves values by 10⁻⁵ or so of what adds up; a path for which it turns a choice over (of a
/// lobe, of an edge's side, of Russian roulette) ends elsewhere, and its pixel is off by one sample. Those pixels are counted apart:
/// there are fewer than one in a hundred.
fn assert_same(what: &str, got: &Traced, want: &Traced) {
    assert_eq!((got.discarded, want.discarded), (0, 0), "{what}");
    let size = got.layers.size();
    let mut off = Vec::new();
    let mut squares = 0.0;
    for i in 0..size.0 * size.1 {
        let at = |t: &Traced| [t.layers.object.data()[i], t.layers.delta.data()[i], Vec3::splat(t.layers.coverage.data()[i])];
        let (a, b) = (at(got), at(want));
        let apart = a.iter().zip(&b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
        let most = b.iter().map(|b| b.abs().max_element()).fold(1.0, f32::max);
        if apart > 2e-3 * most {
            off.push(((i % size.0, i / size.0), a, b));
        } else {
            squares += f64::from(apart * apart);
        }
        let guides = |t: &Traced| (t.layers.depth.data()[i], t.layers.normal.data()[i], t.layers.albedo.data()[i]);
        let (g, w) = (guides(got), guides(want));
        let same = (g.0 == w.0 || (g.0 - w.0).abs() < 1e-4 * w.0) && g.1.distance(w.1) < 1e-3 && g.2.distance(w.2) < 1e-4;
        assert!(same, "{what}, pixel {} {}: {g:?} {w:?}", i % size.0, i / size.0);
    }
    let rest = (squares / (size.0 * size.1) as f64).sqrt();
    println!(
        "{what}: {rest:.1e} but for {} pixels; with them {:.1e}; rays {} {}",
        off.len(),
        rmse(got, want),
        got.rays,
        want.rays
    );
    assert!(off.len() * 100 <= size.0 * size.1, "{what}: {} pixels are off: {off:?}", off.len());
    assert!(rest < 2e-5, "{what}: {rest}");
    assert!(got.rays.abs_diff(want.rays) * 200 <= want.rays, "{what}: {} rays, not {}", got.rays, want.rays);
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

/// A picture of noise, as a texture that wraps in any way.
fn noise(random: &mut Random, (width, height): (usize, usize), least: f32, wrap: [Wrap; 2]) -> Option<Texture> {
    let picture = Image::from_fn(width, height, |_, _| random.color(least, 1.0).extend(1.0));
    let mut texture = Texture::new(Arc::new(picture));
    [texture.wrap_u, texture.wrap_v] = wrap;
    texture.texture_from_mesh = Affine2::from_scale_angle_translation(Vec2::new(3.0, 2.5), 0.4, Vec2::new(-0.7, 0.3));
    Some(texture)
}

/// Every texture in every way to wrap, on faces with a normal and on faces without, and an object without texture coordinates.
fn textures_equal_the_cpu(gpu: &Gpu) {
    let mut random = Random::new(61);
    let mut material = |wrap: [Wrap; 2]| Material {
        base_color: Vec3::ONE,
        base_color_texture: noise(&mut random, (7, 5), 0.1, wrap),
        metallic: 0.8,
        roughness: 0.9,
        metallic_roughness_texture: noise(&mut random, (4, 4), 0.3, wrap),
        emissive: Vec3::new(0.4, 0.1, 0.0),
        emissive_texture: noise(&mut random, (2, 1), 0.0, wrap),
        normal_texture: noise(&mut random, (6, 3), 0.4, wrap),
        normal_scale: 0.6,
        ..Material::default()
    };
    let materials = [
        material([Wrap::Repeat, Wrap::Mirror]),
        material([Wrap::Mirror, Wrap::Clamp]),
        material([Wrap::Clamp, Wrap::Repeat]),
        Material::diffuse(Vec3::splat(0.5)),
    ];
    let mut bare = primitives::icosphere(1.0, 1);
    bare.uvs.clear();
    let bare = Arc::new(PreparedMesh::new(bare).unwrap());
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let place = |i: usize| Placement {
        mesh: if i == 1 { bare.clone() } else { mesh.clone() },
        world_from_mesh: Affine3A::from_scale_rotation_translation(
            Vec3::splat(0.35),
            Quat::from_rotation_y(i as f32),
            Vec3::new(0.8 * i as f32 - 1.2, 0.4, -0.6),
        ),
        material: Some(materials[i].clone()),
    };
    let objects = Objects::new(&(0..4).map(place).collect::<Vec<_>>());
    assert!(objects.textured());
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

fn what_is_missing_is_told(_: &Gpu) {
    let adaptive = TraceParams { error_target: Some(0.1), ..TraceParams::default() };
    assert_eq!(gpu::missing(&adaptive), Some(Missing::AdaptiveSampling));
    assert_eq!(gpu::missing(&TraceParams::default()), None);
    let small = Gpu::new(&GpuOptions { max_binding: Some(3000), ..GpuOptions::default() }).unwrap();
    let (camera, objects) = (view(4, 4), plain());
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let refused = gpu::render(&small, &frame, &worlds(3.0)[0], &TraceParams::default(), &Silent);
    assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
}
