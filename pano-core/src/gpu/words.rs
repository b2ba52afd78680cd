//! Tables of many kinds in one buffer: shaders have eight buffers at most.

use glam::{Mat3A, Vec3};

/// Words of 32 bits that a shader reads by index, numbers by their bits; the shared text `WORDS` reads them.
#[derive(Clone, Debug, Default)]
pub struct Words(Vec<u32>);

impl Words {
    /// Where the next word will be.
    ///
    /// # Panics
    /// If there are 2³² already, sixteen gigabytes.
    pub fn at(&self) -> u32 {
        u32::try_from(self.0.len()).expect("words are counted in 32 bits")
    }

    /// All of them, one at least: nothing cannot be bound.
    pub fn finish(mut self) -> Vec<u32> {
        if self.0.is_empty() {
            self.0.push(0);
        }
        self.0
    }

    /// Adds an integer.
    pub fn word(&mut self, word: u32) {
        self.0.push(word);
    }

    /// Adds integers; where they begin.
    pub fn words(&mut self, words: impl IntoIterator<Item = u32>) -> u32 {
        let at = self.at();
        self.0.extend(words);
        at
    }

    /// Adds a number.
    pub fn number(&mut self, number: f32) {
        self.0.push(number.to_bits());
    }

    /// Adds numbers; where they begin.
    pub fn numbers(&mut self, numbers: impl IntoIterator<Item = f32>) -> u32 {
        self.words(numbers.into_iter().map(f32::to_bits))
    }

    /// Adds three numbers.
    pub fn vec3(&mut self, v: Vec3) {
        self.numbers(v.to_array());
    }

    /// Adds a matrix by columns.
    pub fn matrix(&mut self, m: &Mat3A) {
        self.numbers(m.to_cols_array());
    }
}
