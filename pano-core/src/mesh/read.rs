//! Which reader a mesh file needs, and what every mesh must pass after reading.

use super::{Mesh, gltf, obj, ply};
use crate::{Error, Result, file};
use std::io;
use std::path::Path;

/// How the files that a mesh file names (material libraries, buffers, textures) are read: their bytes by path.
pub type Files<'a> = dyn Fn(&Path) -> io::Result<Vec<u8>> + 'a;

/// Reads a triangle mesh: PLY, OBJ (with its MTL) or glTF 2.0 (`.gltf`, `.glb`), told apart by content and extension.
///
/// - Polygons become triangle fans; points and lines are left out.
/// - Normals are the file's own, made unit length; where a vertex has none that is usable it gets the area-weighted mean of
///   its faces. A file without normals gives a mesh without ([`Mesh::normals`] empty), whose faces are flat, as glTF
///   prescribes; OBJ smoothing groups (`s 1`) are honoured.
/// - Texture coordinates are turned to glTF's v down: PLY and OBJ have v up.
/// - Degenerate triangles are kept: they never meet a ray.
/// - Vertex colours, animation and morph targets are ignored; skinned meshes keep the shape they were modelled in.
///
/// # Errors
/// [`Error::File`] if the file or one it refers to is missing, is damaged, needs an extension that is not supported, has no
/// faces, or has a position that is not finite.
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    let files = |path: &Path| file::read(path, u64::MAX);
    let bytes = files(path).map_err(|e| Error::file(path, format!("cannot be read: {e}"), "Check the mesh's path."))?;
    decode_mesh(&bytes, path, &files)
}

/// [`read_mesh`] of a file in memory. `path` is for messages and tells the format by its extension where the content does not;
/// `files` reads what the mesh file names, by paths relative to where `path` is.
///
/// # Errors
/// As [`read_mesh`].
pub fn decode_mesh(bytes: &[u8], path: &Path, files: &Files<'_>) -> Result<Mesh> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let mut mesh = if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        ply::read(path, bytes)
    } else if bytes.starts_with(b"glTF") {
        gltf::read(path, bytes, files)
    } else {
        match extension.as_str() {
            "ply" => ply::read(path, bytes),
            "gltf" | "glb" => gltf::read(path, bytes, files),
            "obj" => obj::read(path, bytes, files),
            _ => Err(Error::file(
                path,
                if extension.is_empty() { "is not a mesh".into() } else { format!("`.{extension}` is not a known kind of mesh") },
                "Give a PLY, OBJ, glTF or GLB file; most 3D programs export one of them.",
            )),
        }
    }?;
    repair_normals(&mut mesh);
    match mesh.validate() {
        Ok(()) => Ok(mesh),
        Err(e) => Err(Error::file(path, e.to_string(), "Repair the mesh in a 3D program, and export its faces as polygons.")),
    }
}

/// Makes normals unit length, and replaces those that have no direction. Needs triangles within range to do the latter, so
/// leaves a broken mesh for `validate` to report.
fn repair_normals(mesh: &mut Mesh) {
    let mut unusable = false;
    for n in &mut mesh.normals {
        // Length 1 within rounding is kept bit for bit.
        if !n.is_normalized() {
            *n = n.try_normalize().unwrap_or(glam::Vec3::ZERO);
            unusable |= *n == glam::Vec3::ZERO;
        }
    }
    let vertices = mesh.positions.len();
    if unusable && mesh.normals.len() == vertices && mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices) {
        let computed = mesh.vertex_normals();
        for (n, c) in mesh.normals.iter_mut().zip(computed) {
            if *n == glam::Vec3::ZERO {
                *n = c;
            }
        }
    }
}
