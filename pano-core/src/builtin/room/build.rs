//! Putting placed, coloured parts together.

use super::super::primitives::rounded_box;
use crate::material::Material;
use crate::mesh::Mesh;
use glam::{Affine3A, Vec3};

/// The mesh so far. Every part has normals and texture coordinates, as the primitives do.
#[derive(Default)]
pub(super) struct Builder {
    pub(super) mesh: Mesh,
}

impl Builder {
    /// The id of a new material.
    pub(super) fn material(&mut self, material: Material) -> u32 {
        self.mesh.materials.push(material);
        self.mesh.materials.len() as u32 - 1
    }

    /// Adds `part`, moved by `place`.
    pub(super) fn add(&mut self, mut part: Mesh, material: u32, place: Affine3A) {
        part.transform(&place);
        let first = self.mesh.positions.len() as u32;
        self.mesh.material_ids.extend(std::iter::repeat_n(material, part.triangles.len()));
        self.mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        self.mesh.positions.append(&mut part.positions);
        self.mesh.normals.append(&mut part.normals);
        self.mesh.uvs.append(&mut part.uvs);
    }

    /// Adds `part` with its origin at `at`.
    pub(super) fn put(&mut self, part: Mesh, material: u32, at: Vec3) {
        self.add(part, material, Affine3A::from_translation(at));
    }

    /// Adds a box from corner `low` to corner `high` with edges rounded by `radius`.
    pub(super) fn block(&mut self, low: Vec3, high: Vec3, radius: f32, material: u32, place: Affine3A) {
        let part = rounded_box(high - low, radius, if radius > 0.02 { 3 } else { 1 });
        self.add(part, material, place * Affine3A::from_translation(0.5 * (low + high)));
    }
}
