//! Two-level bounding volume hierarchy over triangle meshes, on `obvhs`' eight-wide compressed BVH.
//!
//! A [`Blas`] holds one mesh in its own space and is built once; a [`Tlas`] places instances of meshes in the world. Moving
//! an object rebuilds the top level only, which holds one box an instance.

mod blas;
mod faces;
#[cfg(feature = "gpu")]
pub mod gpu;
mod tlas;

pub use blas::{Blas, TriangleHit};
pub use faces::Faces;
pub use tlas::{InstanceHit, Tlas};

use glam::Vec3;

/// A ray segment: points `origin + t·direction` with t in (0, `t_max`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, in metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Largest t looked at; infinite for none.
    pub t_max: f32,
}

impl Ray {
    /// A ray without end.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// The same ray, ending at `t_max`.
    #[inline]
    pub fn up_to(self, t_max: f32) -> Self {
        Self { t_max, ..self }
    }

    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Moves a surface point `p` off its surface, to the side `n` points to, by a few units in the last place: far enough that a
/// ray from there does not meet its own surface, near enough that nothing is skipped (Wächter & Binder 2019, "A fast and
/// robust method for avoiding self-intersection").
#[inline]
pub fn offset_point(p: Vec3, n: Vec3) -> Vec3 {
    /// Below this coordinate the integer offset shrinks too far and a fixed one takes over.
    const ORIGIN: f32 = 1.0 / 32.0;
    const FLOAT_SCALE: f32 = 1.0 / 65536.0;
    const INT_SCALE: f32 = 256.0;
    let one = |p: f32, n: f32| {
        if p.abs() < ORIGIN {
            return p + FLOAT_SCALE * n;
        }
        let steps = (INT_SCALE * n) as i32;
        f32::from_bits((p.to_bits() as i32 + if p < 0.0 { -steps } else { steps }) as u32)
    };
    Vec3::new(one(p.x, n.x), one(p.y, n.y), one(p.z, n.z))
}

#[cfg(test)]
mod tests;
