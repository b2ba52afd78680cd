//! Textures over what rays cover of them.

use super::*;
use crate::test_scenes::{SKY, under};
use glam::{Affine2, Vec2, Vec4};
use pano_core::builtin::primitives;
use pano_core::camera::{Projection, rotation_from_yaw_pitch};
use pano_core::material::Texture;

const WIDTH: usize = 64;

/// A floor of 400 m, its squares half a metre wide, from 1 m up to the horizon.
fn checkered(max_anisotropy: u32, mirror: bool) -> Image<Vec3> {
    let squares = Image::from_fn(64, 64, |x, y| Vec4::splat(if (x / 32 + y / 32) % 2 == 0 { 0.0 } else { 1.0 }));
    let mut texture = Texture::new(Arc::new(squares));
    texture.texture_from_mesh = Affine2::from_scale(Vec2::splat(400.0));
    let painted = Material { base_color_texture: Some(texture), ..Material::diffuse(Vec3::ONE) };
    let floor = primitives::quad(Vec3::new(-200.0, 0.0, 200.0), Vec3::X * 400.0, Vec3::NEG_Z * 400.0);
    let mut things = vec![(floor, Vec3::ZERO, painted)];
    let mut yaw = 0.0;
    if mirror {
        // The same view, turned round in a mirror that stands behind the camera.
        let wall = primitives::quad(Vec3::new(200.0, 0.0, 0.5), Vec3::NEG_X * 400.0, Vec3::Y * 300.0);
        things.push((wall, Vec3::ZERO, Material::metal(Vec3::ONE, 0.0)));
        yaw = 180.0;
    }
    let camera = Camera {
        position: Vec3::Y,
        world_from_camera: rotation_from_yaw_pitch(yaw, -15.0),
        projection: Projection::Perspective { vfov: 30f32.to_radians() },
        width: WIDTH,
        height: WIDTH,
    };
    let world = crate::world::ProxyWorld::new(Arc::new(RadianceImage::filled(8, 4, SKY)), glam::Quat::IDENTITY, Vec3::Y, &[]);
    let out = seen(&camera, &objects(things), &world, &under(vec![]), |p| (p.samples, p.max_anisotropy) = (1, max_anisotropy));
    out.traced.layers.object
}

/// Mean and standard deviation of the brightness of a row, as a share of the sky's.
fn row(picture: &Image<Vec3>, y: usize) -> (f32, f32) {
    let values: Vec<f32> = (0..WIDTH).map(|x| picture.get(x, y).x / SKY.x).collect();
    let mean = values.iter().sum::<f32>() / WIDTH as f32;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / WIDTH as f32).sqrt())
}

#[test]
fn a_checkered_floor_is_grey_at_the_horizon_and_sharp_near() {
    for mirror in [false, true] {
        let (filtered, plain) = (checkered(16, mirror), checkered(0, mirror));
        // The horizon is the picture's upper edge; 0.7° below it a pixel is five squares long.
        for y in 1..4 {
            let (mean, deviation) = row(&filtered, y);
            assert!((mean - 0.5).abs() < 0.03 && deviation < 0.05, "mirror {mirror}, row {y}: {mean} ± {deviation}");
            assert!(row(&plain, y).1 > 0.3, "without the filter there is moiré: {:?}", row(&plain, y));
        }
        let (_, deviation) = row(&filtered, WIDTH - 2);
        assert!(deviation > 0.4, "mirror {mirror}: near squares stay black and white: {deviation}");
    }
}

#[test]
fn anisotropic_filtering_is_sharper_than_isotropic() {
    let [isotropic, anisotropic] = [1, 16].map(|most| checkered(most, false));
    // 4° below the horizon a pixel is a ninth of a square wide and a square and a half long.
    let [a, b] = [&isotropic, &anisotropic].map(|picture| (8..11).map(|y| row(picture, y).1).sum::<f32>());
    assert!(b > 1.3 * a, "{a} {b}");
}

#[test]
fn degenerate_coordinates_are_finite() {
    let texture = Texture::new(Arc::new(Image::from_fn(8, 8, |x, _| Vec4::splat(x as f32 / 7.0))));
    let material = Material {
        base_color_texture: Some(texture.clone()),
        normal_texture: Some(texture.clone()),
        metallic_roughness_texture: Some(texture),
        ..Material::default()
    };
    for uv in [Vec2::ZERO, Vec2::splat(1e30), Vec2::new(1e-30, 0.5)] {
        let mut mesh = primitives::icosphere(0.8, 3);
        mesh.uvs = vec![uv; mesh.positions.len()];
        let things = objects([(mesh, Vec3::Y, material.clone())]);
        let out = lit(&things, &under(vec![crate::test_scenes::lamp(Vec3::Y, 3.0, 1.0)]), |p| p.samples = 1);
        assert!(out.traced.layers.object.data().iter().all(|v| v.is_finite()), "{uv}");
    }
}

#[test]
fn a_constant_texture_is_the_colour_itself_to_the_bit() {
    let grey = Vec3::new(0.3, 0.6, 0.9);
    let texture = Texture::new(Arc::new(Image::filled(12, 7, grey.extend(1.0))));
    let pictures = [None, Some(texture)].map(|texture| {
        let base_color = if texture.is_some() { Vec3::ONE } else { grey };
        let material = Material { base_color_texture: texture, ..Material::diffuse(base_color) };
        let mesh = primitives::uv_sphere(0.8, 24, 12);
        lit(&objects([(mesh, Vec3::Y, material)]), &under(vec![]), |p| p.samples = 2).traced.layers.object
    });
    assert_eq!(pictures[0].data(), pictures[1].data());
}
