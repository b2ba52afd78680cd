//! Closed forms of optics and shadows, properties, and what the shadows cost.

mod cost;
mod optics;
mod shadows;
mod textures;

use super::*;
use crate::objects::{Objects, Placement, PreparedMesh};
use crate::test_scenes::{PHOTO, SIZE, from_above, plane};
use crate::tracer::Frame;
use crate::world::RealWorld;
use glam::{Affine3A, Vec3};
use pano_core::camera::Camera;
use pano_core::image::{Image, RadianceImage};
use pano_core::material::Material;
use pano_core::mesh::Mesh;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use std::sync::Arc;

/// Meshes with their materials, where they stand.
fn objects(things: impl IntoIterator<Item = (Mesh, Vec3, Material)>) -> Objects {
    let placements: Vec<Placement> = things
        .into_iter()
        .map(|(mesh, at, material)| Placement {
            mesh: Arc::new(PreparedMesh::new(mesh).unwrap()),
            world_from_mesh: Affine3A::from_translation(at),
            material: Some(material),
        })
        .collect();
    Objects::new(&placements)
}

/// What a camera sees of objects in a world.
fn seen<W: RealWorld>(
    camera: &Camera,
    objects: &Objects,
    world: &W,
    lighting: &Lighting,
    change: impl Fn(&mut Params<'_>),
) -> Rendered {
    let photo = RadianceImage::filled(camera.width, camera.height, PHOTO);
    let mut params = Params { samples: 4, ..Params::new(&photo) };
    change(&mut params);
    let frame = Frame { camera, objects, stream: Stream::default() };
    let lights = place_lights(world, lighting);
    let rendered = render(&frame, world, lighting, &lights, &params, &Silent).unwrap();
    assert_eq!(rendered.traced.discarded, 0);
    rendered
}

/// Four by four metres of the plane.
fn lit(objects: &Objects, lighting: &Lighting, change: impl Fn(&mut Params<'_>)) -> Rendered {
    seen(&from_above(), objects, &plane(), lighting, change)
}

/// The largest difference between two pictures.
fn largest_difference(a: &Image<Vec3>, b: &Image<Vec3>) -> f32 {
    a.data().iter().zip(b.data()).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    use crate::test_scenes::{ball, lamp, under};
    let objects = ball(Vec3::new(0.0, 0.8, 0.0), 0.4, Material::glass(1.5, 0.2));
    let lighting = under(vec![lamp(Vec3::new(1.0, 1.0, 0.3), 8.0, 2.0)]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lit(&objects, &lighting, |p| p.gloss = 0.5))
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one.traced.layers.delta.data(), two.traced.layers.delta.data());
    assert_eq!(one.traced.layers.object.data(), two.traced.layers.object.data());
    assert_eq!((one.shadows, one.penumbra), (two.shadows, two.penumbra));
    assert_eq!((one.shadow_rays, one.doubted), (two.shadow_rays, two.doubted));
}

#[test]
fn without_lights_nothing_real_changes() {
    use crate::test_scenes::{ball, under};
    let out = lit(&ball(Vec3::Y, 0.5, Material::diffuse(Vec3::ONE)), &under(vec![]), |_| {});
    assert!(out.traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
    assert_eq!((out.shadow_rays, out.shadows.len()), (0, 0));
    let center = out.traced.layers.object.get(SIZE / 2, SIZE / 2);
    assert!(center.abs_diff_eq(crate::test_scenes::SKY, 1e-4), "a white ball shows the mean radiance: {center}");
}
