//! Triangle meshes, and reading them from PLY, OBJ and glTF files (feature `io`).

#[cfg(feature = "io")]
mod gltf;
#[cfg(feature = "io")]
mod mtl;
#[cfg(feature = "io")]
mod obj;
#[cfg(feature = "io")]
mod ply;
#[cfg(feature = "io")]
mod read;
#[cfg(feature = "io")]
mod texture_file;

#[cfg(all(test, feature = "io"))]
mod read_tests;
#[cfg(test)]
mod tests;

#[cfg(feature = "io")]
pub use read::{Files, decode_mesh, read_mesh};

use crate::{Error, Result, material::Material};
use glam::{Affine3A, Vec2, Vec3};

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

    /// Appends `other`, with its materials. A mesh without materials counts as made of [`Material::default`]; where only
    /// one of the two has normals, the other's faces become flat (its vertices are no longer shared between faces).
    pub fn append(&mut self, other: &Mesh) {
        if !self.normals.is_empty() && other.normals.is_empty() && !other.triangles.is_empty() {
            return self.append(&other.flat());
        }
        if self.normals.is_empty() && !other.normals.is_empty() && !self.triangles.is_empty() {
            *self = self.flat();
        }
        let (vertex, triangles) = (self.positions.len(), self.triangles.len());
        let material = if self.materials.is_empty() && other.materials.is_empty() {
            0
        } else {
            if self.materials.is_empty() && !self.triangles.is_empty() {
                self.materials.push(Material::default());
            }
            let first = self.materials.len() as u32;
            self.materials.extend_from_slice(&other.materials);
            if other.materials.is_empty() {
                self.materials.push(Material::default());
            }
            first
        };
        // Vertices without faces have no normal of their own; any unit vector will do.
        let pad = |n: usize| std::iter::repeat_n(Vec3::Y, n);
        if !self.normals.is_empty() || !other.normals.is_empty() {
            self.normals.extend(pad(vertex - self.normals.len()));
            self.normals.extend_from_slice(&other.normals);
            self.normals.extend(pad(vertex + other.positions.len() - self.normals.len()));
        }
        if !self.uvs.is_empty() || !other.uvs.is_empty() {
            self.uvs.resize(vertex, Vec2::ZERO);
            self.uvs.extend_from_slice(&other.uvs);
            self.uvs.resize(vertex + other.positions.len(), Vec2::ZERO);
        }
        self.material_ids.resize(triangles, 0);
        self.material_ids.extend((0..other.triangles.len()).map(|i| material + other.material_id(i)));
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + vertex as u32)));
    }

    /// Index into `materials` of triangle `triangle`.
    #[inline]
    pub fn material_id(&self, triangle: usize) -> u32 {
        self.material_ids.get(triangle).copied().unwrap_or(0)
    }

    /// Moves, turns and scales the mesh. Normals follow by the inverse transpose, and a mirroring transform turns the faces'
    /// winding round, so that outside stays outside.
    pub fn transform(&mut self, transform: &Affine3A) {
        for p in &mut self.positions {
            *p = transform.transform_point3(*p);
        }
        let m = transform.matrix3;
        // The cofactor matrix is the inverse transpose times the determinant, and exists for singular transforms too.
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let cofactors = glam::Mat3A::from_cols(
            m.y_axis.cross(m.z_axis) * sign,
            m.z_axis.cross(m.x_axis) * sign,
            m.x_axis.cross(m.y_axis) * sign,
        );
        // Scaled up first: the cofactors of a transform by 1e-20 would underflow when squared.
        let size = cofactors.to_cols_array().iter().fold(0.0f32, |a, b| a.max(b.abs()));
        for n in &mut self.normals {
            *n = (cofactors * (1.0 / size) * *n).try_normalize().unwrap_or(*n);
        }
        if sign < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
    }

    /// The same faces with vertices of their own and the faces' normals: a faceted look.
    pub fn flat(&self) -> Mesh {
        let corners = || self.triangles.iter().flatten().map(|&v| v as usize);
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Y)
        };
        Mesh {
            positions: corners().map(|v| self.positions[v]).collect(),
            normals: self.triangles.iter().flat_map(|t| [normal(t); 3]).collect(),
            uvs: if self.uvs.is_empty() { Vec::new() } else { corners().map(|v| self.uvs[v]).collect() },
            triangles: (0..self.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            material_ids: self.material_ids.clone(),
            materials: self.materials.clone(),
        }
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
