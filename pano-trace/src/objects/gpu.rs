//! Objects as shaders read them: places, materials, textures, faces, shining faces.

use super::{Ball, CompiledMaterial, Objects, PreparedMesh};

use crate::bsdf::CoatTable;
use glam::Vec4;
use pano_core::gpu::{Constant, Piece, Words};
use pano_core::image::Image;
use pano_core::texture::Wrap;
use std::collections::HashMap;
use std::sync::Arc;

/// "There is none", where a table's beginning is asked for.
pub(crate) const NONE: u32 = u32::MAX;
/// Words of an object, of a material, of a shining face.
const OBJECT_WORDS: u32 = 29;
const MATERIAL_WORDS: u32 = 25;
const EMITTER_WORDS: u32 = 14;
/// Of a material's words, where its index is, and colour and distance of what it absorbs.
const IOR_WORD: u32 = 9;
const ABSORPTION_WORD: u32 = 13;
/// Words of an object's move; see [`Objects::pack_moves`].
pub(crate) const MOVE_WORDS: u32 = 13;

/// Codes of a texel's channel, from 0 on: sixteen bits, a thousand times finer than the eight that most pictures have where they are
/// bright.
const CODES: f32 = 65535.0;

/// What hits on objects mean, for shaders to include after [`crate::bsdf::gpu::BSDF`] and [`pano_core::gpu::WORDS`].
pub(crate) const OBJECTS: Piece = Piece {
    text: concat!(include_str!("textures.wgsl"), "\n", include_str!("objects.wgsl")),
    constants: || {
        vec![
            Constant::u32("OBJECT_WORDS", OBJECT_WORDS),
            Constant::u32("MATERIAL_WORDS", MATERIAL_WORDS),
            Constant::u32("EMITTER_WORDS", EMITTER_WORDS),
            Constant::u32("IOR_WORD", IOR_WORD),
            Constant::u32("ABSORPTION_WORD", ABSORPTION_WORD),
            Constant::u32("MIRROR", Wrap::Mirror as u32),
            Constant::u32("CLAMP", Wrap::Clamp as u32),
        ]
    },
};

/// What rays cover of surfaces, for shaders to include after [`OBJECTS`].
pub(crate) const DIFFERENTIALS: Piece = Piece {
    text: include_str!("differentials.wgsl"),
    constants: || vec![Constant::f32("LEAST_COSINE", super::differentials::LEAST_COSINE)],
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
    /// Where the boxes of each ball's object begin and how many there are, two words each.
    pub(crate) boxes: u32,
    /// The same as `balls`, of the clusters.
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
    /// Adds all tables; with `pyramids`, after each texture's picture the smaller ones.
    pub(crate) fn pack(&self, words: &mut Words, pyramids: bool) -> PackedObjects {
        let (mut coats, mut meshes, mut pictures) = (HashMap::new(), HashMap::new(), HashMap::new());
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
                let mut uvs = mesh.uvs.iter().flat_map(|uv| uv.to_array().map(f32::to_bits));
                let uvs = some(!mesh.uvs.is_empty(), words, &mut uvs);
                [indices, positions, normals, ids, uvs]
            });
            let looks: Vec<(u32, [u32; 4])> = placed
                .materials
                .iter()
                .map(|m| (pack_coat(m, &mut coats, words), pack_textures(m, pyramids, &mut pictures, words)))
                .collect();
            let materials = words.at();
            placed.materials.iter().zip(looks).for_each(|(m, (coat, textures))| pack_material(m, coat, textures, words));
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
            boxes: pack_boxes(&self.boxes, words),
            clusters: pack_balls(&self.clusters, words),
        }
    }

    /// Adds where the points of each object were `earlier`, by [`Objects::was_at`]: where the table begins.
    pub(crate) fn pack_moves(&self, earlier: &Self, words: &mut Words) -> u32 {
        let at = words.at();
        for (i, now) in self.placed.iter().enumerate() {
            let then = earlier.placed.get(i).filter(|then| Arc::ptr_eq(&now.mesh, &then.mesh));
            let moved = then.map(|then| then.world_from_mesh * now.world_from_mesh.inverse());
            let place = moved.unwrap_or_default();
            words.matrix(&place.matrix3);
            words.vec3(place.translation.into());
            words.word(u32::from(moved.is_some()));
        }
        at
    }

    /// The hierarchy over them.
    pub(crate) fn tlas(&self) -> &crate::bvh::Tlas {
        &self.tlas
    }
}

/// Adds a coat's table unless it is there already; where it begins.
fn pack_coat(material: &CompiledMaterial, packed: &mut HashMap<*const CoatTable, u32>, words: &mut Words) -> u32 {
    let Some(coat) = &material.coat else { return NONE };
    *packed.entry(Arc::as_ptr(coat)).or_insert_with(|| words.numbers(coat.values()))
}

/// Adds the textures of a material, for base colour, metal and roughness, light and normals: where each begins. A picture that is in
/// `packed` already is not added again.
fn pack_textures(
    material: &CompiledMaterial,
    pyramids: bool,
    packed: &mut HashMap<*const Image<Vec4>, (u32, f32)>,
    words: &mut Words,
) -> [u32; 4] {
    let m = &material.material;
    [&m.base_color_texture, &m.metallic_roughness_texture, &m.emissive_texture, &m.normal_texture].map(|texture| {
        let Some(texture) = texture else { return NONE };
        let image = texture.image();
        let (texels, scale) = *packed.entry(Arc::as_ptr(image)).or_insert_with(|| {
            let scale = image.data().iter().map(|t| t.max_element()).fold(1.0, f32::max);
            let code = |value: f32| (value / scale * CODES).round().clamp(0.0, CODES) as u32;
            let texel = |t: &Vec4| [code(t.x) | code(t.y) << 16, code(t.z)];
            let smaller = if pyramids { texture.smaller() } else { &[] };
            let at = words.words(image.data().iter().flat_map(texel));
            for image in smaller {
                words.words(image.data().iter().flat_map(texel));
            }
            (at, scale)
        });
        let at = words.words([texels, image.width() as u32, image.height() as u32, texture.wrap_u as u32, texture.wrap_v as u32]);
        words.numbers(texture.texture_from_mesh.to_cols_array());
        words.number(scale);
        at
    })
}

fn pack_material(compiled: &CompiledMaterial, coat: u32, textures: [u32; 4], words: &mut Words) {
    let m = &compiled.material;
    let absorbs = m.attenuation_distance.is_finite() && m.attenuation_distance > 0.0;
    words.vec3(m.base_color);
    words.number(m.metallic);
    words.vec3(m.specular_color);
    words.number(m.specular);
    words.number(m.roughness);
    words.number(m.ior);
    words.number(m.transmission);
    words.word(u32::from(m.thin));
    words.word(coat);
    words.vec3(m.attenuation_color.clamp(glam::Vec3::ZERO, glam::Vec3::ONE));
    words.number(if absorbs { m.attenuation_distance } else { 0.0 });
    words.vec3(m.emissive);
    words.words(textures);
    words.number(m.normal_scale);
}

fn pack_balls(balls: &[Ball], words: &mut Words) -> [u32; 2] {
    let at = words.at();
    for ball in balls {
        words.vec3(ball.center);
        words.number(ball.radius);
    }
    [at, balls.len() as u32]
}

fn pack_boxes(boxes: &[Vec<[glam::Vec3; 2]>], words: &mut Words) -> u32 {
    let ranges: Vec<[u32; 2]> = boxes
        .iter()
        .map(|boxes| {
            let at = words.at();
            boxes.iter().flatten().for_each(|corner| words.vec3(*corner));
            [at, boxes.len() as u32]
        })
        .collect();
    words.words(ranges.into_flattened())
}
