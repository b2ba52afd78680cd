//! glTF 2.0, `.gltf` and `.glb`: the default scene's triangles in world space, with their materials.
//!
//! The `gltf` crate parses and validates the JSON; everything that touches buffers is checked here, because a file may
//! declare any offset, count and hierarchy.

mod accessor;
mod material;
mod uri;

use super::{Files, Mesh};
use crate::{Error, Result};
use ::gltf::json::{self, Index, mesh::Mode, mesh::Semantic, validation::Checked, validation::Validate};
use accessor::Buffers;
use glam::{Affine3A, Mat4, Quat, Vec2, Vec3};
use material::Materials;
use std::path::Path;

/// Required extensions this reader understands.
const EXTENSIONS: [&str; 9] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

const REMEDY: &str = "Check it with a glTF validator, or export the mesh again.";

/// Reads the glTF or GLB file `bytes`; `path` is for messages and for finding the files it names, which `files` reads.
pub(super) fn read(path: &Path, bytes: &[u8], files: &Files<'_>) -> Result<Mesh> {
    let (text, blob) = if bytes.starts_with(b"glTF") { split_glb(path, bytes)? } else { (bytes, None) };
    let mut root: json::Root =
        json::deserialize::from_slice(text).map_err(|e| Error::file(path, format!("is not glTF: {e}"), REMEDY))?;
    check_extensions(path, &root)?;
    // Checked above against what *this* reader does, which is more than the crate knows.
    root.extensions_required.clear();
    check(path, &root)?;
    let buffers = Buffers::load_all(path, &root, blob, files)?;
    let mut reader =
        Reader { path, root: &root, materials: Materials::new(path, &root, &buffers), buffers: &buffers, mesh: Mesh::default() };
    reader.scene()?;
    let Reader { materials, mut mesh, .. } = reader;
    if mesh.triangles.is_empty() {
        return Err(Error::file(path, "its default scene shows no triangles", "Export a scene with a mesh in it."));
    }
    mesh.materials = materials.finish();
    if mesh.materials.is_empty() {
        mesh.material_ids.clear();
    }
    Ok(mesh)
}

/// The JSON and binary chunks of a GLB file.
fn split_glb<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let broken = |problem: String| Error::file(path, problem, REMEDY);
    match word(4) {
        Some(2) => {}
        Some(v) => return Err(broken(format!("is GLB version {v}; version 2 is supported"))),
        None => return Err(broken("is a GLB file cut off in its header".into())),
    }
    let (mut at, mut text, mut blob) = (12, None, None);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let chunk = (at + 8)
            .checked_add(length as usize)
            .and_then(|end| bytes.get(at + 8..end))
            .ok_or_else(|| broken(format!("has a chunk of {length} bytes at byte {at}, beyond its end: the file is cut off")))?;
        match &kind.to_le_bytes() {
            b"JSON" if text.is_none() => text = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk),
            // Other chunks are to be ignored.
            _ => {}
        }
        at += 8 + chunk.len();
    }
    text.map(|t| (t, blob)).ok_or_else(|| broken("has no JSON chunk".into()))
}

fn check_extensions(path: &Path, root: &json::Root) -> Result<()> {
    let Some(name) = root.extensions_required.iter().find(|e| !EXTENSIONS.contains(&e.as_str())) else { return Ok(()) };
    let remedy = match name.as_str() {
        "KHR_draco_mesh_compression" => "Decompress it: `gltf-transform copy in.glb out.glb`.",
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "Decompress it: `gltf-transform copy in.glb out.glb`, or pack it without: `gltfpack -noq -i in.glb -o out.glb`."
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" => {
            "Convert its textures to PNG: `gltf-transform png in.glb out.glb` (for KTX2: `gltf-transform ktxdecompress`)."
        }
        "KHR_materials_pbrSpecularGlossiness" => "Convert its materials: `gltf-transform metalrough in.glb out.glb`.",
        "EXT_mesh_gpu_instancing" => "Unfold the instances by importing and exporting it in Blender.",
        _ => "Export the mesh without this extension; importing and exporting it in Blender removes most.",
    };
    Err(Error::file(path, format!("requires the glTF extension {name:.80}, which is not supported"), remedy))
}

fn check(path: &Path, root: &json::Root) -> Result<()> {
    // The crate's validation (1.4) looks these accessors up before it checks that they exist.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).map(Index::value);
            if let Some(missing) = positions.filter(|&accessor| accessor >= root.accessors.len()) {
                let problem = format!("mesh {m}, primitive {p}: POSITION is accessor {missing} of {}", root.accessors.len());
                return Err(Error::file(path, problem, REMEDY));
            }
        }
    }
    let mut first = None;
    root.validate(root, json::Path::new, &mut |place, error| {
        first.get_or_insert_with(|| format!("{}: {error}", place().as_str()));
    });
    first.map_or(Ok(()), |problem| Err(Error::file(path, problem, REMEDY)))
}

struct Reader<'a> {
    path: &'a Path,
    root: &'a json::Root,
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    mesh: Mesh,
}

impl Reader<'_> {
    fn broken(&self, problem: String) -> Error {
        Error::file(self.path, problem, REMEDY)
    }

    /// Adds every mesh of the default scene; without scenes, of all root nodes; without nodes, every mesh as it is.
    fn scene(&mut self) -> Result<()> {
        let root = self.root;
        let scene = root.scene.and_then(|s| root.scenes.get(s.value())).or(root.scenes.first());
        let mut open: Vec<(usize, Affine3A)> = match scene {
            Some(scene) => scene.nodes.iter().map(|n| (n.value(), Affine3A::IDENTITY)).collect(),
            None => {
                let mut is_child = vec![false; root.nodes.len()];
                root.nodes.iter().flat_map(|n| n.children.iter().flatten()).for_each(|c| is_child[c.value()] = true);
                (0..root.nodes.len()).filter(|&n| !is_child[n]).map(|n| (n, Affine3A::IDENTITY)).collect()
            }
        };
        if root.nodes.is_empty() {
            return (0..root.meshes.len()).try_for_each(|m| self.mesh(m, &Affine3A::IDENTITY));
        }
        open.reverse();
        let mut seen = vec![false; root.nodes.len()];
        while let Some((index, world_from_parent)) = open.pop() {
            if std::mem::replace(&mut seen[index], true) {
                return Err(self.broken(format!("node {index} has two parents or is its own ancestor")));
            }
            let node = &root.nodes[index];
            let world_from_node = world_from_parent * local_transform(node);
            if !world_from_node.is_finite() {
                return Err(self.broken(format!("node {index} has a transform that is not finite")));
            }
            if let Some(mesh) = node.mesh {
                self.mesh(mesh.value(), &world_from_node)?;
            }
            open.extend(node.children.iter().flatten().rev().map(|c| (c.value(), world_from_node)));
        }
        Ok(())
    }

    fn mesh(&mut self, index: usize, world_from_mesh: &Affine3A) -> Result<()> {
        let root = self.root;
        for (i, primitive) in root.meshes[index].primitives.iter().enumerate() {
            let place = format!("mesh {index}, primitive {i}");
            let Some(mut part) = self.primitive(primitive, &place)? else { continue };
            let most = self.buffers.most_unfolded();
            let vertices = self.mesh.positions.len() + part.positions.len();
            let faces = self.mesh.triangles.len() + part.triangles.len();
            if vertices.max(faces) > most {
                return Err(self.broken(format!("unfolds to more than the {most} vertices or faces its data can be meant for")));
            }
            part.transform(world_from_mesh);
            let material = match primitive.material {
                Some(m) => self.materials.material(m.value())?,
                None => self.materials.default_material(),
            };
            let triangles = part.triangles.len();
            self.mesh.append(&part);
            // `append` knows no materials yet: they are numbered here.
            let all = self.mesh.triangles.len();
            self.mesh.material_ids.resize(all - triangles, 0);
            self.mesh.material_ids.truncate(all - triangles);
            self.mesh.material_ids.resize(all, material);
        }
        Ok(())
    }

    /// A primitive's triangles in its own space; `None` if it is made of points or lines.
    fn primitive(&self, primitive: &json::mesh::Primitive, place: &str) -> Result<Option<Mesh>> {
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            _ => return Ok(None),
        };
        let Some(positions) = attribute(Semantic::Positions) else { return Ok(None) };
        let positions: Vec<Vec3> =
            self.buffers.read(positions, &format!("{place}, POSITION"))?.into_iter().map(Vec3::from_array).collect();
        let same_length = |n: usize, name: &str| match n == positions.len() {
            true => Ok(()),
            false => Err(self.broken(format!("{place}: {n} {name} for {} positions", positions.len()))),
        };
        let mut mesh = Mesh::default();
        if let Some(normals) = attribute(Semantic::Normals) {
            mesh.normals = self.buffers.read(normals, &format!("{place}, NORMAL"))?.into_iter().map(Vec3::from_array).collect();
            same_length(mesh.normals.len(), "normals")?;
        }
        let set = primitive.material.map_or(0, |m| material::texture_set(&self.root.materials[m.value()]));
        if let Some(uvs) = attribute(Semantic::TexCoords(set)) {
            let what = format!("{place}, TEXCOORD_{set}");
            mesh.uvs = self.buffers.read(uvs, &what)?.into_iter().map(Vec2::from_array).collect();
            same_length(mesh.uvs.len(), "texture coordinates")?;
        }
        let indices = match primitive.indices {
            Some(i) => self.buffers.read_indices(i.value(), &format!("{place}, indices"))?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(i) = indices.iter().find(|&&i| i as usize >= positions.len()) {
            return Err(self.broken(format!("{place}: index {i} of {} vertices", positions.len())));
        }
        mesh.positions = positions;
        mesh.triangles = match mode {
            Mode::TriangleStrip => {
                (2..indices.len()).map(|i| [indices[i - 2], indices[i - 1 + i % 2], indices[i - i % 2]]).collect()
            }
            Mode::TriangleFan => (2..indices.len()).map(|i| [indices[i - 1], indices[i], indices[0]]).collect(),
            _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        };
        Ok(Some(mesh))
    }
}

fn local_transform(node: &json::Node) -> Affine3A {
    match node.matrix {
        Some(m) => Affine3A::from_mat4(Mat4::from_cols_array(&m)),
        None => Affine3A::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from_array),
            // Rounding leaves stored quaternions a little off unit length.
            node.rotation
                .map_or(Quat::IDENTITY, |r| glam::Vec4::from_array(r.0).try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4)),
            node.translation.map_or(Vec3::ZERO, Vec3::from_array),
        ),
    }
}
