//! Objects as shaders read them: places, materials, faces, shining faces. Textures are left out: a shader's objects have none.

use super::{Ball, CompiledMaterial, Objects, PreparedMesh};
use crate::bsdf::CoatTable;
use pano_core::gpu::{Constant, Piece, Words};
use std::collections::HashMap;
use std::sync::Arc;

/// "There is none", where a table's beginning is asked for.
pub(crate) const NONE: u32 = u32::MAX;
/// Words of an object, of a material, of a shining face.
const OBJECT_WORDS: u32 = 28;
const MATERIAL_WORDS: u32 = 20;
const EMITTER_WORDS: u32 = 14;

/// What hits on objects mean, for shaders to include after [`crate::bsdf::gpu::BSDF`] and [`pano_core::gpu::WORDS`].
pub(crate) const OBJECTS: Piece = Piece {
    text: include_str!("objects.wgsl"),
    constants: || {
        vec![
            Constant::u32("OBJECT_WORDS", OBJECT_WORDS),
            Constant::u32("MATERIAL_WORDS", MATERIAL_WORDS),
            Constant::u32("EMITTER_WORDS", EMITTER_WORDS),
        ]
    },
};

/// Where the tables of some objects begin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedObjects {
    /// Of the objects.
    pub(crate) objects: u32,
    /// Cumulative probabilities of the shining faces, and how many there are; the faces come after.
    pub(crate) emitters: [u32; 2],
    /// The balls around them, four numbers each, and how many there are.
    pub(crate) balls: [u32; 2],
    /// The same of the clusters.
    pub(crate) clusters: [u32; 2],
}

impl PreparedMesh {
    /// Adds the corners of its faces: where the faces' indices begin, and where the positions.
    pub(crate) fn pack(&self, words: &mut Words) -> [u32; 2] {
        let indices = words.words(self.mesh.triangles.iter().flatten().copied());
        [indices, words.numbers(self.mesh.positions.iter().flat_map(|p| p.to_array()))]
    }
}

impl Objects {
    /// Adds all tables.
    pub(crate) fn pack(&self, words: &mut Words) -> PackedObjects {
        let (mut coats, mut meshes) = (HashMap::new(), HashMap::new());
        let mut tables = Vec::new();
        for (i, placed) in self.placed.iter().enumerate() {
            let mesh = *meshes.entry(Arc::as_ptr(&placed.mesh)).or_insert_with(|| {
                let [indices, positions] = placed.mesh.pack(words);
                let mesh = &placed.mesh.mesh;
                let some = |given: bool, words: &mut Words, values: &mut dyn Iterator<Item = u32>| {
                    if given { words.words(values) } else { NONE }
                };
                let mut normals = mesh.normals.iter().flat_map(|n| n.to_array().map(f32::to_bits));
                let normals = some(!mesh.normals.is_empty(), words, &mut normals);
                // Faces without an id have the first material.
                let mut ids = (0..mesh.triangles.len()).map(|t| mesh.material_ids.get(t).copied().unwrap_or(0));
                let ids = some(!mesh.material_ids.is_empty(), words, &mut ids);
                [indices, positions, normals, ids]
            });
            let coats: Vec<u32> = placed.materials.iter().map(|m| pack_coat(m, &mut coats, words)).collect();
            let materials = words.at();
            placed.materials.iter().zip(coats).for_each(|(m, coat)| pack_material(m, coat, words));
            let shining = self.emitters.ranks(i).map_or(NONE, |ranks| words.words(ranks.iter().copied()));
            tables.push((placed, mesh, [materials, placed.materials.len() as u32, shining]));
        }
        let objects = words.at();
        for (placed, mesh, rest) in tables {
            words.matrix(&placed.world_from_mesh.matrix3);
            words.vec3(placed.world_from_mesh.translation.into());
            words.matrix(&placed.world_from_normal);
            words.words(mesh);
            words.words(rest);
        }
        PackedObjects {
            objects,
            emitters: self.emitters.pack(words),
            balls: pack_balls(&self.balls, words),
            clusters: pack_balls(&self.clusters, words),
        }
    }

    /// The hierarchy over them.
    pub(crate) fn tlas(&self) -> &crate::bvh::Tlas {
        &self.tlas
    }

    /// Whether any surface reflects other than diffusely.
    pub(crate) fn gloss(&self) -> bool {
        let glossy = |m: &CompiledMaterial| m.material.metallic > 0.0 || m.coat.is_some();
        self.placed.iter().flat_map(|p| &p.materials).any(glossy)
    }
}

/// Adds a coat's table unless it is there already; where it begins.
fn pack_coat(material: &CompiledMaterial, packed: &mut HashMap<*const CoatTable, u32>, words: &mut Words) -> u32 {
    let Some(coat) = &material.coat else { return NONE };
    *packed.entry(Arc::as_ptr(coat)).or_insert_with(|| words.numbers(coat.values()))
}

fn pack_material(compiled: &CompiledMaterial, coat: u32, words: &mut Words) {
    let m = &compiled.material;
    let absorbs = m.attenuation_distance.is_finite() && m.attenuation_distance > 0.0;
    words.vec3(m.base_color);
    words.number(m.metallic.clamp(0.0, 1.0));
    words.vec3(m.specular_color);
    words.number(m.specular);
    words.number((m.roughness * m.roughness).clamp(0.0, 1.0));
    words.number(m.ior);
    words.number(m.transmission);
    words.word(u32::from(m.thin));
    words.word(coat);
    words.vec3(m.attenuation_color.clamp(glam::Vec3::ZERO, glam::Vec3::ONE));
    words.number(if absorbs { m.attenuation_distance } else { 0.0 });
    words.vec3(m.emissive);
}

fn pack_balls(balls: &[Ball], words: &mut Words) -> [u32; 2] {
    let at = words.at();
    for ball in balls {
        words.vec3(ball.center);
        words.number(ball.radius);
    }
    [at, balls.len() as u32]
}
