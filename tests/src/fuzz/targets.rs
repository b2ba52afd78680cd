//! One target a format: how it is read, and what its files can be worth.

use super::{Target, seeds};
use pano_core::camera::Projection;
use pano_core::depth::{DepthFormat, DepthKind};
use pano_core::image::Image;
use pano_core::io::{decode_depth, decode_exr, decode_image};
use pano_core::material::{Material, Texture};
use pano_core::mesh::{Mesh, decode_mesh};
use pano_core::scene::Scene;
use pano_core::{Error, Result};
use std::io::ErrorKind;
use std::path::Path;

/// Part of the name of every file that is read.
pub(super) const FILE: &str = "damaged";

/// Bytes of a pixel's radiance.
const PIXEL: usize = 12;

/// Bytes that a byte of a zlib stream stands for at most.
const ZLIB: usize = 1032;

/// A picture's target; `declarable` is the worth of a byte.
const fn picture(name: &'static str, seeds: fn() -> Vec<Vec<u8>>, declarable: usize) -> Target {
    Target { name, seeds, read: read_picture, parsing: 16, declarable }
}

/// Every reader.
pub static TARGETS: [Target; 9] = [
    // DWA: two numbers of 2 bytes a block of 8×8, which go through zlib; half floats become floats.
    picture("exr", seeds::exr, 64 * ZLIB),
    // 127 pixels in 4 runs of 2 bytes.
    picture("hdr", seeds::hdr, 16 * PIXEL),
    // A bit a pixel.
    picture("png", seeds::png, 8 * ZLIB * PIXEL),
    // A bit a block of 8×8 pixels.
    picture("jpeg", seeds::jpeg, 512 * PIXEL),
    picture("pfm", seeds::pfm, 3),
    // A vertex of three bytes is parsed into 32 and kept in 12; a face without corners of one byte is parsed into 48.
    Target { name: "ply", seeds: seeds::ply, read: |bytes| read_mesh(bytes, "ply"), parsing: 128, declarable: 0 },
    // "f 1" is parsed into 52 bytes, "newmtl" into a material.
    Target { name: "obj", seeds: seeds::obj, read: read_obj, parsing: 256, declarable: 0 },
    // "{}," is parsed into a node or a material. A byte may stand for 256 vertices by repetition, a byte of texture for that
    // of a PNG.
    Target { name: "gltf", seeds: seeds::gltf, read: |bytes| read_mesh(bytes, "glb"), parsing: 1024, declarable: 8 * ZLIB * 16 },
    Target { name: "scene", seeds: seeds::scene, read: read_scene, parsing: 1024, declarable: 0 },
];

/// As channels, as a picture and as depth of every kind. An error only if nothing can be made of it.
fn read_picture(bytes: &[u8]) -> Result<usize> {
    let name = Path::new(FILE);
    let pixels = |image: &Image<f32>| {
        assert!(image.width() > 0 && image.height() > 0);
        4 * image.width() * image.height()
    };
    let channels = decode_exr(bytes, name).map(|file| file.channels.iter().map(|(_, image)| pixels(image)).sum());
    let radiance = decode_image(bytes, name).map(|image| {
        assert!(image.radiance.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
        let alpha = image.alpha.iter().flat_map(|alpha| alpha.data());
        alpha.for_each(|a| assert!((0.0..=1.0).contains(a)));
        image.radiance.data().len() * PIXEL + image.alpha.as_ref().map_or(0, pixels)
    });
    let depth = [(DepthKind::Ray, 0.001), (DepthKind::Z, 1.0), (DepthKind::Disparity, 50.0)].map(|(kind, scale)| {
        let format = DepthFormat { kind, scale, invalid: vec![65535.0] };
        decode_depth(bytes, name, &format, Projection::Perspective { vfov: 1.0 }).map(|depth| {
            depth.image().data().iter().for_each(|&d| assert!(d > 0.0 && !(1e9..f32::INFINITY).contains(&d), "{d}"));
            pixels(depth.image())
        })
    });
    let [ray, z, disparity] = depth;
    let mut all = [radiance, channels, ray, z, disparity];
    // Each result is gone before the next is made, and the largest is what the file is worth.
    all.sort_by_key(|result| std::cmp::Reverse(result.as_ref().ok().copied()));
    let [best, ..] = all;
    best
}

/// Memory of a mesh.
fn size(mesh: &Mesh) -> usize {
    let textures = |material: &Material| -> usize {
        let pixels = |t: &Option<Texture>| t.as_ref().map_or(0, |t| 16 * t.image().data().len());
        let Material { base_color_texture, metallic_roughness_texture, emissive_texture, normal_texture, .. } = material;
        [base_color_texture, metallic_roughness_texture, emissive_texture, normal_texture].into_iter().map(pixels).sum()
    };
    let vertices = 12 * (mesh.positions.len() + mesh.normals.len()) + 8 * mesh.uvs.len();
    let faces = 12 * mesh.triangles.len() + 4 * mesh.material_ids.len();
    let materials = mesh.materials.iter().map(|m| size_of::<Material>() + textures(m)).sum::<usize>();
    vertices + faces + materials
}

/// The texture that meshes may name, beside them.
const TEXTURE: &str = "t.png";

/// As a mesh beside a texture and, for OBJ, a library of materials. No other file exists, whatever the bytes name.
fn mesh_with(bytes: &[u8], extension: &str, library: &[u8]) -> Result<usize> {
    let files = |path: &Path| match path.file_name().and_then(|name| name.to_str()) {
        Some("a.mtl") => Ok(library.to_vec()),
        Some(TEXTURE) => Ok(seeds::texture()),
        _ => Err(ErrorKind::NotFound.into()),
    };
    let mesh = decode_mesh(bytes, Path::new(&format!("{FILE}.{extension}")), &files)?;
    mesh.validate().expect("what is read is valid");
    Ok(size(&mesh))
}

fn read_mesh(bytes: &[u8], extension: &str) -> Result<usize> {
    mesh_with(bytes, extension, b"")
}

/// Everything up to a NUL is the mesh, the rest its library of materials.
fn read_obj(bytes: &[u8]) -> Result<usize> {
    let middle = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    let renamed = |e: Error| match e {
        // An error of the library names the library.
        Error::File { path, problem, remedy } if path.file_name() == Some("a.mtl".as_ref()) => Error::file(FILE, problem, remedy),
        other => other,
    };
    mesh_with(&bytes[..middle], "obj", bytes.get(middle + 1..).unwrap_or_default()).map_err(renamed)
}

/// As a scene, whose camera can be asked for.
fn read_scene(bytes: &[u8]) -> Result<usize> {
    let text = String::from_utf8_lossy(bytes);
    let scene = Scene::parse(&text, Path::new(FILE))?;
    let camera = scene.camera((64, 32));
    assert!(camera.position.is_finite() && camera.world_from_camera.is_finite());
    for object in &scene.objects {
        for time in [-1.0, 0.0, 0.5, 1e9] {
            assert!(object.placement_at(time).world_from_local().is_finite(), "{object:?} at {time}");
        }
    }
    Ok(text.len())
}
