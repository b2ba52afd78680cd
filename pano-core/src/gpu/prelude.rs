//! The shared shader text. A shader names the pieces it needs before its own; [`NUMBER`] comes before [`SPHERE`], and that
//! before [`IMAGE`].

use super::shader::{Constant, Piece, Value};
use crate::color::LUMINANCE_WEIGHTS;
use crate::random::Sampler;
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

/// Largest magnitude that shaders calculate with: a thousand of its squares are below the largest `f32`. The brightest thing
/// in the sky, the sun, is at 2·10⁹ W/(m²·sr).
pub const LARGEST: f32 = 1e17;

/// Finite or not, sine and cosine, arcus tangent.
pub const NUMBER: Piece = Piece {
    text: include_str!("prelude/number.wgsl"),
    constants: || vec![Constant::f32("PI", PI), Constant::f32("TAU", TAU), Constant::f32("LARGEST", LARGEST)],
};

/// Directions, texels and bilinear lookups of equirectangular pictures.
pub const SPHERE: Piece = Piece::plain(include_str!("prelude/sphere.wgsl"));

/// Pictures in buffers, and neighbours in them.
pub const IMAGE: Piece = Piece::plain(include_str!("prelude/image.wgsl"));

/// Tables of many kinds in one buffer: [`super::Words`].
pub const WORDS: Piece = Piece::plain(include_str!("prelude/words.wgsl"));

/// Luminance.
pub const COLOR: Piece = Piece {
    text: include_str!("prelude/color.wgsl"),
    constants: || vec![Constant::vec3("LUMINANCE_WEIGHTS", LUMINANCE_WEIGHTS)],
};

/// Random numbers.
pub const RANDOM: Piece = Piece {
    text: include_str!("prelude/random.wgsl"),
    constants: || {
        let vectors = Value::U32s(SOBOL_VECTORS.as_slice());
        vec![Constant::u32("SEQUENCE_LENGTH", Sampler::SEQUENCE_LENGTH), Constant { name: "SOBOL_VECTORS", value: vectors }]
    },
};

/// Direction vectors of the Sobol sequence's first four dimensions, bits reversed: four for each bit of the reversed index,
/// highest first. Asked of the generator that the CPU uses.
static SOBOL_VECTORS: LazyLock<[u32; 64]> =
    LazyLock::new(|| std::array::from_fn(|i| sobol_burley::parts::sobol_rev(1 << (31 - i / 4), (i % 4) as u32)));
