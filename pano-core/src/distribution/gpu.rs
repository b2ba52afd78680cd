//! Distributions as shaders read them. *Departure*: entries are found by halving instead of a guide table, which would take as much
//! memory again; the entry is the same.

use super::SphereDistribution;
use crate::gpu::{Constant, Piece, Words};

/// Sampling of tabulated distributions, for shaders to include after [`crate::gpu::NUMBER`], [`crate::gpu::SPHERE`] and
/// [`crate::gpu::WORDS`].
pub const DISTRIBUTION: Piece = Piece {
    text: include_str!("distribution.wgsl"),
    constants: || vec![Constant::f32("MIN_SIN", super::sphere::MIN_SIN), Constant::f32("BELOW_ONE", 1.0 - f32::EPSILON / 2.0)],
};

impl SphereDistribution {
    /// Adds its tables: luminance, a factor for each row of cells, the rows' cumulative probabilities, the columns' of each row.
    /// Where they begin, and the size of the picture.
    pub fn pack(&self, words: &mut Words) -> (u32, [u32; 2]) {
        let (w, h) = self.luminance.size();
        let at = words.numbers(self.luminance.data().iter().copied());
        words.numbers(self.row_factor.iter().copied());
        words.numbers(self.rows.cdf().iter().copied());
        for column in &self.columns {
            match column {
                Some(column) => words.numbers(column.cdf().iter().copied()),
                // A sum of 0 says that the row is black.
                None => words.numbers(std::iter::repeat_n(0.0, w + 1)),
            };
        }
        (at, [w as u32, h as u32])
    }
}
