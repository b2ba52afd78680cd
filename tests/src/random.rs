//! Random numbers for making scenes: fixed by a seed, the same with every version of every library.

use glam::{Quat, Vec3};
use pano_core::random::combine;
use std::f32::consts::TAU;

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    seed: u32,
    counter: u32,
}

impl Random {
    /// The stream of that seed.
    pub fn new(seed: u32) -> Self {
        Self { seed: combine(0x7e57, seed), counter: 0 }
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.counter += 1;
        (combine(self.seed, self.counter) >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [`lo`, `hi`).
    pub fn between(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.unit()
    }

    /// Uniform in 0..`n`.
    pub fn below(&mut self, n: u32) -> u32 {
        (self.unit() * n as f32) as u32
    }

    /// A colour with every channel uniform in [`lo`, `hi`).
    pub fn color(&mut self, lo: f32, hi: f32) -> Vec3 {
        Vec3::new(self.between(lo, hi), self.between(lo, hi), self.between(lo, hi))
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> Vec3 {
        let (y, azimuth) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let horizontal = (1.0 - y * y).sqrt();
        Vec3::new(horizontal * azimuth.cos(), y, horizontal * azimuth.sin())
    }

    /// A uniform rotation.
    pub fn rotation(&mut self) -> Quat {
        let (a, b, c) = (self.unit(), self.between(0.0, TAU), self.between(0.0, TAU));
        let (near, far) = ((1.0 - a).sqrt(), a.sqrt());
        Quat::from_xyzw(near * b.sin(), near * b.cos(), far * c.sin(), far * c.cos())
    }
}
