//! What lights a frame in the GPU's memory.

use super::super::{self as mr360, Params};
use super::MAX_LIGHTS;
use glam::Vec3;
use pano_core::gpu::{Constant, Piece, Words};
use pano_core::light::GLOSSY_ROUGHNESS;

/// Words of a lamp, and of a map.
const SOURCE_WORDS: u32 = 7;
const MAP_WORDS: u32 = 4;

/// Convolved maps, for shaders to include after [`crate::tracer::gpu::scene::VIEW`].
pub(crate) const MAPS: Piece = Piece {
    text: include_str!("maps.wgsl"),
    constants: || {
        vec![
            Constant::u32("MAP_WORDS", MAP_WORDS),
            // The diffuse one, the mirror and the glossy ones.
            Constant::u32("MAPS", 2 + GLOSSY_ROUGHNESS.len() as u32),
        ]
    },
};

/// Lamps and pixels, for shaders to include after [`MAPS`].
pub(super) const LIGHTING: Piece =
    Piece { text: include_str!("lighting.wgsl"), constants: || vec![Constant::u32("SOURCE_WORDS", SOURCE_WORDS)] };

pano_core::uniform! {
    /// `Lighting` of the shader.
    pub(crate) struct Lighting {
        map_x: Vec3,
        maps: u32,
        map_y: Vec3,
        lamps: u32,
        map_z: Vec3,
        lamp_count: u32,
        capture: Vec3,
        gloss: f32,
        gloss_roughness: f32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

impl Lighting {
    /// Adds the maps and the lights that count to the tables and pictures.
    pub(super) fn pack(of: &mr360::Lighting, params: &Params<'_>, words: &mut Words, pictures: &mut Vec<f32>) -> Self {
        let lamps = [pack_lamps(of, words), of.lights.len().min(MAX_LIGHTS) as u32];
        Self::pack_with(lamps, of, [params.gloss, params.gloss_roughness], words, pictures)
    }

    /// Adds the maps; `lamps` is where a table of lamps begins and how many there are, `gloss` how much real surfaces mirror objects and
    /// how roughly.
    pub(crate) fn pack_with(
        [lamps, lamp_count]: [u32; 2],
        of: &mr360::Lighting,
        [gloss, gloss_roughness]: [f32; 2],
        words: &mut Words,
        pictures: &mut Vec<f32>,
    ) -> Self {
        let [map_x, map_y, map_z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| of.pano_from_world * axis);
        Self {
            map_x,
            maps: pack_maps(of, words, pictures),
            map_y,
            lamps,
            map_z,
            lamp_count,
            capture: of.capture,
            gloss,
            gloss_roughness,
            pad0: 0,
            pad1: 0,
            pad2: 0,
        }
    }

    /// How many lights count.
    pub(super) fn lamps(&self) -> usize {
        self.lamp_count as usize
    }
}

/// Adds the maps' pictures and their table: where that begins.
fn pack_maps(lighting: &mr360::Lighting, words: &mut Words, pictures: &mut Vec<f32>) -> u32 {
    let maps = &lighting.maps;
    let glossy = maps.glossy.iter().zip(GLOSSY_ROUGHNESS);
    let at = words.at();
    for (map, roughness) in [(&maps.diffuse, 1.0), (&maps.mirror, 0.0)].into_iter().chain(glossy) {
        words.words([pictures.len() as u32, map.width() as u32, map.height() as u32]);
        words.number(roughness);
        pictures.extend(map.data().iter().flat_map(|p| p.to_array()));
    }
    at
}

/// Adds the lights that count: where they begin.
fn pack_lamps(lighting: &mr360::Lighting, words: &mut Words) -> u32 {
    let at = words.at();
    for light in lighting.lights.iter().take(MAX_LIGHTS) {
        words.vec3(light.direction);
        words.number(light.cos_radius().max(-1.0));
        words.vec3(light.intensity);
    }
    at
}
