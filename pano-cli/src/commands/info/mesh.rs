//! What a mesh holds.

use super::{Content, FileInfo};
use pano_core::{
    Result,
    material::Material,
    mesh::{Mesh, read_mesh},
    metrics::MeshStats,
};
use serde::Serialize;
use std::path::Path;

/// A mesh.
#[derive(Debug, Serialize)]
pub(super) struct MeshInfo {
    faces: usize,
    vertices: usize,
    /// Smallest and largest corner.
    bounds: [[f32; 3]; 2],
    normals: bool,
    uvs: bool,
    /// Triangles without area.
    degenerate: usize,
    /// Edges that do not join two faces; 0: it bounds a body.
    pub(super) open_edges: usize,
    materials: Vec<MaterialInfo>,
}

/// A material of the mesh file.
#[derive(Debug, Serialize)]
struct MaterialInfo {
    base_color: [f32; 3],
    metallic: f32,
    roughness: f32,
    transmission: f32,
    emissive: [f32; 3],
    textures: usize,
}

/// Reads a mesh and lists its problems; gives the mesh, too.
pub(super) fn inspect(path: &Path) -> Result<(FileInfo, Mesh)> {
    let mesh = read_mesh(path)?;
    let info = MeshInfo::of(&mesh);
    let mut problems = vec![];
    if info.degenerate > 0 {
        problems.push(format!("{} faces have no area", info.degenerate));
    }
    if info.open_edges > 0 && mesh.materials.iter().any(is_body) {
        problems.push(open_body(info.open_edges));
    }
    let extent = info.extent();
    if !(1e-3..=100.0).contains(&extent) {
        problems.push(format!("is {extent} m large: if its unit is not the metre, give the object a `scale`"));
    }
    Ok((FileInfo { path: path.to_owned(), content: Content::Mesh(info), problems }, mesh))
}

/// Does light travel through the inside of what has this material?
pub(super) fn is_body(material: &Material) -> bool {
    material.transmission > 0.0 && !material.thin
}

/// The problem of a transparent body that is not closed.
pub(super) fn open_body(open_edges: usize) -> String {
    format!("is transparent but not closed ({open_edges} open edges): close it, or set `thin = true`")
}

impl MeshInfo {
    fn of(mesh: &Mesh) -> Self {
        let (lo, hi) = mesh.bounds().unwrap_or_default();
        let MeshStats { degenerate, open_edges } = MeshStats::of(mesh);
        Self {
            faces: mesh.triangles.len(),
            vertices: mesh.positions.len(),
            bounds: [lo.to_array(), hi.to_array()],
            normals: !mesh.normals.is_empty(),
            uvs: !mesh.uvs.is_empty(),
            degenerate,
            open_edges,
            materials: mesh.materials.iter().map(MaterialInfo::of).collect(),
        }
    }

    /// Longest side of the bounds.
    fn extent(&self) -> f32 {
        let [lo, hi] = self.bounds;
        (0..3).map(|i| hi[i] - lo[i]).fold(0.0, f32::max)
    }

    /// For the text output.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let has = |there: bool, what: &str| format!("{}{what}", if there { "" } else { "no " });
        let [lo, hi] = self.bounds;
        let closed = if self.open_edges == 0 { "closed".into() } else { format!("{} open edges", self.open_edges) };
        let mut facts = vec![
            ("faces", format!("{} on {} vertices, {closed}", self.faces, self.vertices)),
            ("bounds", format!("{lo:?} to {hi:?}")),
            ("attributes", format!("{}, {}", has(self.normals, "normals"), has(self.uvs, "texture coordinates"))),
        ];
        facts.extend(self.materials.iter().map(|m| ("material", m.to_text())));
        facts
    }
}

impl MaterialInfo {
    fn of(m: &Material) -> Self {
        let textures = [&m.base_color_texture, &m.metallic_roughness_texture, &m.emissive_texture, &m.normal_texture];
        Self {
            base_color: m.base_color.to_array(),
            metallic: m.metallic,
            roughness: m.roughness,
            transmission: m.transmission,
            emissive: m.emissive.to_array(),
            textures: textures.into_iter().flatten().count(),
        }
    }

    fn to_text(&self) -> String {
        let Self { base_color, metallic, roughness, transmission, emissive, textures } = self;
        format!(
            "base_color {base_color:?}, metallic {metallic}, roughness {roughness}, transmission {transmission}, emissive \
             {emissive:?}, {textures} textures"
        )
    }
}
