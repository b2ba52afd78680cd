//! Lamps, and the points of them that are sampled, as shaders read them.

use super::super::frame::patterns;
use super::super::lights::{MAX_SINE, Pattern, SphericalLight};
use super::super::{Lighting as Lights, Params};
use crate::mr360::gpu::lighting::Lighting;
use glam::Vec3;
use pano_core::gpu::{Constant, Piece, Words};

/// Words of a lamp, and of a point.
const LAMP_WORDS: u32 = 12;
const POINT_WORDS: u32 = 3;

/// Lamps and their points, for shaders to include after [`crate::mr360::gpu::lighting::MAPS`].
pub(super) const LAMPS: Piece = Piece {
    text: include_str!("lamps.wgsl"),
    constants: || {
        vec![
            Constant::u32("LAMP_WORDS", LAMP_WORDS),
            Constant::u32("POINT_WORDS", POINT_WORDS),
            Constant::f32("MAX_SINE", MAX_SINE),
        ]
    },
};

/// Where the tables begin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tables {
    pub(super) lighting: Lighting,
    /// Of patterns of 1, 2, … points, and how many the largest has.
    pub(super) patterns: [u32; 2],
    /// Of the points for which surfaces are asked how they respond, and how many there are.
    pub(super) response: [u32; 2],
}

impl Tables {
    /// Adds lamps, patterns and maps.
    pub(super) fn pack(
        lights: &[SphericalLight],
        of: &Lights,
        params: &Params<'_>,
        words: &mut Words,
        pictures: &mut Vec<f32>,
    ) -> Self {
        let lamps = [words.at(), lights.len() as u32];
        lights.iter().for_each(|light| pack_lamp(light, words));
        let (ladder, response) = patterns(params);
        let begin = words.at();
        for pattern in &ladder {
            pack_pattern(pattern, words);
        }
        let response = [pack_pattern(&response, words), response.len() as u32];
        let lighting = Lighting::pack_with(lamps, of, [params.gloss, params.gloss_roughness], words, pictures);
        Self { lighting, patterns: [begin, ladder.len() as u32], response }
    }
}

fn pack_lamp(light: &SphericalLight, words: &mut Words) {
    let stands = light.distance.is_finite();
    words.vec3(light.direction);
    words.vec3(light.irradiance);
    words.number(light.cos_radius);
    words.number(light.sin_radius());
    words.number(if stands { light.distance } else { -1.0 });
    words.vec3(if stands { light.center } else { Vec3::ZERO });
}

/// Where it begins.
fn pack_pattern(pattern: &Pattern, words: &mut Words) -> u32 {
    words.numbers(pattern.numbers())
}
