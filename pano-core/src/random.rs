//! Counter-based randomness: a number is a function of (pixel, sample, dimension, frame, seed) and of nothing else, so that
//! the same command gives the same picture whatever the number of threads, and a shader can draw the same numbers.

use glam::{UVec2, Vec2};

/// A well-mixing 32-bit integer hash ("lowbias32", found by the hash prospector search of C. Wellons).
#[inline]
pub const fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Mixes `value` into the running hash `state`.
#[inline]
pub const fn combine(state: u32, value: u32) -> u32 {
    hash(state ^ value.wrapping_mul(0x9e37_79b9).wrapping_add(0x85eb_ca6b))
}

/// What identifies a stream of random numbers besides the sample index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stream {
    /// Frame number of a sequence.
    pub frame: u32,
    /// The user's seed.
    pub seed: u32,
}

/// Random numbers of one sample of one pixel: an Owen-scrambled Sobol sequence (Burley 2020), four dimensions at a time,
/// padded: each group of four is stratified in itself over the samples of a pixel and independent of the other groups.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    scramble: u32,
    group: u32,
}

impl Sampler {
    /// Samples of a sequence that the Sobol generator tells apart; beyond them a new scramble begins.
    pub const SEQUENCE_LENGTH: u32 = 1 << 16;

    /// The numbers of sample `index` of `pixel`.
    #[inline]
    pub fn new(pixel: UVec2, index: u32, stream: Stream) -> Self {
        let scramble = combine(combine(combine(combine(0x5eed, pixel.x), pixel.y), stream.frame), stream.seed);
        let scramble = combine(scramble, index / Self::SEQUENCE_LENGTH);
        Self { index: index % Self::SEQUENCE_LENGTH, scramble, group: 0 }
    }

    /// The next four numbers in [0, 1).
    #[inline]
    pub fn next_4d(&mut self) -> [f32; 4] {
        let seed = combine(self.scramble, self.group);
        self.group += 1;
        sobol_burley::sample_4d(self.index, 0, seed)
    }

    /// The next two numbers in [0, 1); uses up a group of four.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        let [x, y, ..] = self.next_4d();
        Vec2::new(x, y)
    }

    /// The next number in [0, 1); uses up a group of four.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        self.next_4d()[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_power_of_two_prefix_is_stratified() {
        for n in [16u32, 64, 256] {
            let mut seen = vec![false; n as usize];
            for i in 0..n {
                let x = Sampler::new(UVec2::new(3, 7), i, Stream::default()).next_1d();
                seen[(x * n as f32) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "{n} samples fill {n} strata");
        }
    }

    #[test]
    fn streams_groups_and_pixels_are_uncorrelated() {
        let draw = |pixel: UVec2, stream: Stream, skip: usize| -> Vec<f32> {
            (0..4096)
                .map(|i| {
                    let mut s = Sampler::new(pixel, i, stream);
                    for _ in 0..skip {
                        s.next_4d();
                    }
                    s.next_1d()
                })
                .collect()
        };
        let base = draw(UVec2::ZERO, Stream::default(), 0);
        for other in [
            draw(UVec2::X, Stream::default(), 0),
            draw(UVec2::Y, Stream::default(), 0),
            draw(UVec2::ZERO, Stream { frame: 1, seed: 0 }, 0),
            draw(UVec2::ZERO, Stream { frame: 0, seed: 1 }, 0),
            draw(UVec2::ZERO, Stream::default(), 1),
        ] {
            let correlation: f32 = base.iter().zip(&other).map(|(a, b)| (a - 0.5) * (b - 0.5)).sum::<f32>() / 4096.0 * 12.0;
            // The standard error of the correlation of 4096 independent pairs is 1/64.
            assert!(correlation.abs() < 4.0 / 64.0, "{correlation}");
        }
    }

    #[test]
    fn sequences_longer_than_the_generator_start_a_new_scramble() {
        let a = Sampler::new(UVec2::ZERO, 5, Stream::default()).next_4d();
        let b = Sampler::new(UVec2::ZERO, 5 + Sampler::SEQUENCE_LENGTH, Stream::default()).next_4d();
        assert_ne!(a, b);
    }
}
