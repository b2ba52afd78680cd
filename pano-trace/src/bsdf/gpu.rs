//! Scattering on the GPU: shader text that tracers include. The formulas are those of the CPU, in `f32` as there; products may be
//! fused.

use super::{SMOOTH_ALPHA, coat, fresnel};
use pano_core::gpu::{Constant, Piece};

/// Directions about an axis, for shaders to include after [`pano_core::gpu::NUMBER`].
pub const DIRECTIONS: Piece = Piece::plain(include_str!("../directions.wgsl"));

/// Evaluation, sampling and density of every lobe, for shaders to include after [`DIRECTIONS`].
pub const BSDF: Piece = Piece {
    text: include_str!("bsdf.wgsl"),
    constants: || {
        vec![
            Constant::f32("SMOOTH_ALPHA", SMOOTH_ALPHA),
            Constant::u32("COAT_ALPHAS", coat::ALPHAS as u32),
            Constant::u32("COAT_COSINES", coat::COSINES as u32),
            Constant::f32("GLOSS_F0", fresnel::GLOSS_F0),
        ]
    },
};
