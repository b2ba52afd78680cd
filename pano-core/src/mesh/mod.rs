//! Triangle meshes.

use crate::{Error, Result, material::Material};
use glam::{Vec2, Vec3};

/// A triangle mesh in its own space, +Y up, metres.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals per vertex; empty: the faces' own.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex, v down as in glTF; empty: none.
    pub uvs: Vec<Vec2>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials` per triangle; empty: all 0.
    pub material_ids: Vec<u32>,
    /// The mesh file's own materials; empty: none were given.
    pub materials: Vec<Material>,
}

impl Mesh {
    /// Checks that the arrays fit together and every value is usable.
    ///
    /// # Errors
    /// [`Error::Argument`] names the first fault: no faces, an index out of range, a position, normal or uv that is not
    /// finite, or arrays of different length.
    pub fn validate(&self) -> Result<()> {
        let fail = |problem: String| Err(Error::argument(problem));
        if self.triangles.is_empty() {
            return fail("the mesh has no faces".into());
        }
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return fail(format!("vertex {i} has position {}, which is not finite", self.positions[i]));
        }
        if let Some(i) = self.normals.iter().position(|n| !n.is_finite()) {
            return fail(format!("vertex {i} has a normal that is not finite"));
        }
        if let Some(i) = self.uvs.iter().position(|t| !t.is_finite()) {
            return fail(format!("vertex {i} has texture coordinates that are not finite"));
        }
        for (name, len) in [("normals", self.normals.len()), ("texture coordinates", self.uvs.len())] {
            if len != 0 && len != self.positions.len() {
                return fail(format!("{len} {name} for {} vertices", self.positions.len()));
            }
        }
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= self.positions.len())) {
            return fail(format!("face {i} uses vertex {:?} of {}", self.triangles[i], self.positions.len()));
        }
        if !self.material_ids.is_empty() && self.material_ids.len() != self.triangles.len() {
            return fail(format!("{} material indices for {} faces", self.material_ids.len(), self.triangles.len()));
        }
        if let Some(&id) = self.material_ids.iter().find(|&&id| id as usize >= self.materials.len().max(1)) {
            return fail(format!("material {id} of {}", self.materials.len()));
        }
        Ok(())
    }

    /// Smallest and largest corner; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
    }

    /// Appends `other`, with its materials.
    pub fn append(&mut self, other: &Mesh) {
        let (vertex, material) = (self.positions.len() as u32, self.materials.len() as u32);
        let pad = |mine: usize, theirs: usize| mine != 0 || theirs != 0;
        if pad(self.normals.len(), other.normals.len()) {
            let mine = if self.normals.is_empty() { self.vertex_normals() } else { std::mem::take(&mut self.normals) };
            let theirs = if other.normals.is_empty() { other.vertex_normals() } else { other.normals.clone() };
            self.normals = [mine, theirs].concat();
        }
        if pad(self.uvs.len(), other.uvs.len()) {
            self.uvs.resize(self.positions.len(), Vec2::ZERO);
            self.uvs.extend_from_slice(&other.uvs);
            self.uvs.resize(self.positions.len() + other.positions.len(), Vec2::ZERO);
        }
        let own_ids = |m: &Mesh| if m.material_ids.is_empty() { vec![0; m.triangles.len()] } else { m.material_ids.clone() };
        let (mine, theirs) = (own_ids(self), own_ids(other));
        self.material_ids = mine.into_iter().chain(theirs.into_iter().map(|id| id + material)).collect();
        self.materials.extend_from_slice(&other.materials);
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + vertex)));
    }

    /// Area-weighted unit normals per vertex; +Y where a vertex belongs to no proper face.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            let n = (b - a).cross(c - a);
            for &v in t {
                sums[v as usize] += n;
            }
        }
        sums.into_iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y)).collect()
    }
}
