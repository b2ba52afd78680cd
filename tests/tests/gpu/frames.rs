//! Small scenes for the tracers, and how frames of both backends are compared.

use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::gpu::GpuResult;
use pano_core::image::{Image, RadianceImage};
use pano_core::material::{Material, Texture, Wrap};
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_tests::rooms::texel_direction;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::tracer::{self, Frame, Method, Sampling, TraceParams, Traced};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, RealWorld, Reflectance};
use std::sync::Arc;

/// A sky with a sun, about 1 bright without it.
pub(crate) fn sky(sun: f32) -> RadianceImage {
    let toward = Vec3::new(0.5, 1.0, 0.3).normalize();
    let radiance = |d: Vec3| if d.dot(toward) > 0.99 { Vec3::splat(sun) } else { Vec3::splat(0.6) + 0.4 * d };
    Image::from_fn(48, 24, |x, y| radiance(texel_direction(48, 24, x, y)))
}

pub(crate) fn plane(at: Vec3, turn: Quat, reflectance: Reflectance) -> Proxy {
    Proxy {
        shape: ProxyShape::Plane(Vec2::splat(8.0)),
        world_from_local: Affine3A::from_rotation_translation(turn, at),
        reflectance,
    }
}

pub(crate) fn under(sky: RadianceImage, proxies: &[Proxy]) -> ProxyWorld {
    ProxyWorld::new(Arc::new(sky), Quat::from_rotation_y(0.7), Vec3::new(0.0, 1.5, 2.0), proxies)
}

pub(crate) const GREY: Reflectance = Reflectance::Known(Vec3::new(0.6, 0.5, 0.4));

/// One floor; a floor and a wall that see each other; a floor that has the picture's colour, and a block on it.
pub(crate) fn worlds(sun: f32) -> Vec<ProxyWorld> {
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

pub(crate) fn balls(materials: &[Material]) -> Objects {
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
pub(crate) fn of_all_kinds() -> Objects {
    balls(&[
        Material::metal(Vec3::new(0.9, 0.7, 0.5), 0.4),
        Material { roughness: 0.5, base_color: Vec3::new(0.2, 0.4, 0.8), ..Material::default() },
        Material { attenuation_color: Vec3::new(0.9, 0.5, 0.3), attenuation_distance: 0.3, ..Material::glass(1.5, 0.0) },
        Material::emitter(Vec3::new(3.0, 2.0, 1.0)),
        Material { transmission: 0.5, ..Material::glass(1.4, 0.6) },
    ])
}

/// Nothing but diffuse.
pub(crate) fn plain() -> Objects {
    balls(&[Material::diffuse(Vec3::splat(0.7)), Material::diffuse(Vec3::new(0.1, 0.6, 0.9))])
}

pub(crate) fn view(width: usize, height: usize) -> Camera {
    Camera {
        position: Vec3::new(0.1, 1.3, 1.9),
        world_from_camera: rotation_from_yaw_pitch(2.0, -24.0),
        projection: Projection::Perspective { vfov: 0.9 },
        width,
        height,
    }
}

/// Root mean square difference over the pixels of object, delta and coverage.
pub(crate) fn rmse(a: &Traced, b: &Traced) -> f64 {
    let squares = |a: &Image<Vec3>, b: &Image<Vec3>| {
        a.data().iter().zip(b.data()).map(|(a, b)| f64::from((*a - *b).length_squared())).sum::<f64>()
    };
    let coverage = a.layers.coverage.data().iter().zip(b.layers.coverage.data()).map(|(a, b)| f64::from(a - b).powi(2));
    let sum = squares(&a.layers.object, &b.layers.object) + squares(&a.layers.delta, &b.layers.delta) + coverage.sum::<f64>();
    (sum / a.layers.coverage.data().len() as f64).sqrt()
}

/// A frame by `on_gpu`, and by the CPU.
pub(crate) fn both_of(
    camera: &Camera,
    objects: &Objects,
    world: &impl RealWorld,
    params: &TraceParams,
    on_gpu: impl FnOnce(&Frame<'_>) -> GpuResult<Option<Traced>>,
) -> [Traced; 2] {
    let frame = Frame { camera, objects, stream: Stream { frame: 3, seed: 5 } };
    let mut got = on_gpu(&frame).unwrap().expect("nobody cancels");
    let want = tracer::render(&frame, world, params, &Silent).expect("nobody cancels");
    if params.method == Method::TwoPass {
        // The GPU leaves out the second pass where nothing is used of it.
        assert!(got.rays <= want.rays, "{} {}", got.rays, want.rays);
        got.rays = want.rays;
    }
    [got, want]
}

/// How far frames of both backends may be apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Apart {
    /// Root mean square of the pixels that are not off.
    pub(crate) rest: f64,
    /// One pixel in how many may have other guides.
    pub(crate) guides: usize,
}

/// Over proxies.
pub(crate) const SAME: Apart = Apart { rest: 2e-5, guides: usize::MAX };

/// Frames of light of about 1. Rounding moves values by 10⁻⁵ or so of what adds up; a path for which it turns a choice over (of a
/// lobe, of an edge's side, of Russian roulette) ends elsewhere, and its pixel is off by one sample. Those pixels are counted apart:
/// there are fewer than one in a hundred.
pub(crate) fn assert_same(what: &str, got: &Traced, want: &Traced) {
    assert_alike(what, got, want, SAME);
}

/// The same with another tolerance.
pub(crate) fn assert_alike(what: &str, got: &Traced, want: &Traced, apart: Apart) {
    assert_eq!((got.discarded, want.discarded), (0, 0), "{what}");
    let size = got.layers.size();
    let (mut off, mut guides_off) = (Vec::new(), Vec::new());
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
        if !((g.0 == w.0 || (g.0 - w.0).abs() < 1e-4 * w.0) && g.1.distance(w.1) < 1e-3 && g.2.distance(w.2) < 1e-4) {
            guides_off.push(((i % size.0, i / size.0), g, w));
        }
    }
    let rest = (squares / (size.0 * size.1) as f64).sqrt();
    println!(
        "{what}: {rest:.1e} but for {} pixels; with them {:.1e}; {} guides; rays {} {}",
        off.len(),
        rmse(got, want),
        guides_off.len(),
        got.rays,
        want.rays
    );
    assert!(off.len() * 100 <= size.0 * size.1, "{what}: {} pixels are off: {off:?}", off.len());
    assert!(guides_off.len() <= size.0 * size.1 / apart.guides, "{what}: guides are off: {guides_off:?}");
    assert!(rest < apart.rest, "{what}: {rest}");
    assert!(got.rays.abs_diff(want.rays) * 200 <= want.rays, "{what}: {} rays, not {}", got.rays, want.rays);
}

/// Adaptive sampling took nearly as many samples, and tells nearly the same error of them.
pub(crate) fn assert_sampled_alike(what: &str, got: &Traced, want: &Traced) {
    let [got, want] = [got, want].map(|traced| traced.sampling.as_ref().expect("noise is measured"));
    let error = |sampling: &Sampling| sampling.error.data().iter().sum::<f32>() / sampling.error.data().len() as f32;
    let (got_error, want_error) = (error(got), error(want));
    println!("{what}: {} and {} samples a pixel, error {got_error} and {want_error}", got.samples, want.samples);
    assert!((got.samples - want.samples).abs() <= 0.05 * want.samples, "{what}: {} {}", got.samples, want.samples);
    assert!((got_error - want_error).abs() <= 0.05 * want_error, "{what}: {got_error} {want_error}");
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
pub(crate) fn textured() -> Objects {
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
    objects
}
