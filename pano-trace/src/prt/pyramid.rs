//! The smallest and largest inverse depth of the cells of a face and of blocks of them, packed: marching waits for memory
//! more than for anything else.

use rayon::prelude::*;

/// Smallest and largest inverse depth of a block of cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) min: f32,
    pub(super) max: f32,
}

impl Range {
    /// What every range lies around.
    pub(super) const NOTHING: Self = Self { min: f32::MAX, max: 0.0 };

    /// The range of both.
    pub(super) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// In 32 bits, at most 1/2048 wider: each bound as the 5 low bits of an exponent and the 11 first ones of a mantissa.
    fn pack(self) -> u32 {
        let low = code(self.min).min(u16::MAX - 1);
        let high = code(self.max);
        let exact = value(high) >= self.max;
        u32::from(low) | u32::from(if exact { high } else { high.saturating_add(1) }) << 16
    }

    #[inline]
    fn unpack(packed: u32) -> Self {
        Self { min: value(packed as u16), max: value((packed >> 16) as u16) }
    }
}

/// Bits of an `f32` that a code leaves out.
pub(super) const SHIFT: u32 = 12;
/// The bits, shifted, of the largest number that is taken for 0: 2⁻¹⁷, of a depth of 131 km. The largest code stands for 2¹⁵,
/// a depth of 0.03 mm, and for all beyond it.
pub(super) const BIAS: u32 = (127 - 17) << (23 - SHIFT);

/// The largest code whose value is not above `w`.
fn code(w: f32) -> u16 {
    (w.max(0.0).to_bits() >> SHIFT).saturating_sub(BIAS).min(u32::from(u16::MAX)) as u16
}

/// The inverse depth that a code stands for.
#[inline]
fn value(code: u16) -> f32 {
    match code {
        0 => 0.0,
        u16::MAX => f32::INFINITY,
        code => f32::from_bits((u32::from(code) + BIAS) << SHIFT),
    }
}

/// Blocks along the side of a tile, which fills a cache line.
pub(super) const TILE: usize = 4;

/// One level: blocks in row-major tiles of row-major blocks.
#[derive(Clone, Debug)]
pub(super) struct Level {
    /// Tiles along the side.
    across: usize,
    packed: Vec<u32>,
}

impl Level {
    fn new(side: usize, range: impl Fn(usize, usize) -> Range + Sync) -> Self {
        let across = side.div_ceil(TILE);
        let mut packed = vec![0; across * across * TILE * TILE];
        packed.par_chunks_mut(across * TILE * TILE).enumerate().for_each(|(row, tiles)| {
            for (k, packed) in tiles.iter_mut().enumerate() {
                let (tile, x, y) = (k / (TILE * TILE), k % TILE, k / TILE % TILE);
                let (x, y) = (tile * TILE + x, row * TILE + y);
                if x < side && y < side {
                    *packed = range(x, y).pack();
                }
            }
        });
        Self { across, packed }
    }

    #[inline]
    fn at(&self, x: usize, y: usize) -> Range {
        let tile = y / TILE * self.across + x / TILE;
        Range::unpack(self.packed[tile * (TILE * TILE) + y % TILE * TILE + x % TILE])
    }

    /// The packed blocks.
    #[cfg(feature = "gpu")]
    pub(super) fn packed(&self) -> &[u32] {
        &self.packed
    }
}

/// All levels of a face: level 0 has its n² cells, each further level half the side (rounded up).
#[derive(Clone, Debug)]
pub(super) struct Pyramid {
    levels: Vec<Level>,
}

impl Pyramid {
    /// Over `n` × `n` cells, of which `range` tells the range.
    pub(super) fn new(n: usize, range: impl Fn(usize, usize) -> Range + Sync) -> Self {
        let mut levels = vec![Level::new(n, range)];
        let mut side = n;
        while side > 1 {
            let (below, half) = (&levels[levels.len() - 1], side.div_ceil(2));
            let next = Level::new(half, |i, j| {
                let inside = |(x, y): &(usize, usize)| *x < side && *y < side;
                let four = [(2 * i, 2 * j), (2 * i + 1, 2 * j), (2 * i, 2 * j + 1), (2 * i + 1, 2 * j + 1)];
                four.iter().filter(|p| inside(p)).fold(Range::NOTHING, |range, p| range.union(below.at(p.0, p.1)))
            });
            levels.push(next);
            side = half;
        }
        Self { levels }
    }

    /// The range of block (`x`, `y`) of a level.
    #[inline]
    pub(super) fn at(&self, level: usize, x: usize, y: usize) -> Range {
        self.levels[level].at(x, y)
    }

    /// The topmost level.
    #[inline]
    pub(super) fn top(&self) -> usize {
        self.levels.len() - 1
    }

    /// The levels, from the cells up.
    #[cfg(feature = "gpu")]
    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The range of the whole face.
    #[inline]
    pub(super) fn whole(&self) -> Range {
        self.at(self.top(), 0, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Packed ranges hold what they were made of, and hardly more.
        #[test]
        fn packed_ranges_hold_what_they_are_of(a in 0.0f32..1e6, b in prop_oneof![Just(0.0f32), 1e-9f32..1e-3, 1e-3f32..3e4]) {
            let range = Range { min: a.min(b), max: a.max(b) };
            let unpacked = Range::unpack(range.pack());
            prop_assert!(unpacked.min <= range.min && unpacked.max >= range.max, "{range:?} {unpacked:?}");
            let within = |w: f32| (1.6e-5..3e4).contains(&w);
            if within(range.min) {
                prop_assert!(unpacked.min >= range.min * (1.0 - 1.0 / 2048.0), "{range:?} {unpacked:?}");
            }
            if within(range.max) {
                prop_assert!(unpacked.max <= range.max * (1.0 + 1.0 / 2048.0), "{range:?} {unpacked:?}");
            }
        }

        /// Every block holds the cells below it.
        #[test]
        fn blocks_hold_their_cells(n in 1usize..40, seed in any::<u32>()) {
            let cell = |x: usize, y: usize| {
                let w = ((x * 131 + y * 17 + seed as usize % 1000) % 97) as f32 * 0.01;
                Range { min: w, max: w + 0.5 }
            };
            let pyramid = Pyramid::new(n, cell);
            for level in 0..=pyramid.top() {
                for (x, y) in (0..n * n).map(|k| (k % n, k / n)) {
                    let (block, cell) = (pyramid.at(level, x >> level, y >> level), cell(x, y));
                    prop_assert!(block.min <= cell.min && block.max >= cell.max);
                }
            }
            prop_assert!(pyramid.whole().max <= 0.96 + 0.5 + 1e-3 && pyramid.top() == n.next_power_of_two().ilog2() as usize);
        }
    }

    #[test]
    fn nothing_stays_nothing_and_too_near_is_near() {
        let nothing = Range::unpack(Range { min: 0.0, max: 0.0 }.pack());
        assert_eq!(nothing, Range { min: 0.0, max: 0.0 });
        assert_eq!(Range::unpack(Range { min: 1e6, max: f32::INFINITY }.pack()).max, f32::INFINITY);
    }
}
