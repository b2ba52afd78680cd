//! How far hierarchical and linear marching agree.

use crate::random::Random;
use glam::Vec3;
use pano_core::image::Image;
use pano_trace::prt::{DepthField, FieldHit, FieldOptions, march_linear};
use rayon::prelude::*;

/// How many of some rays met the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Rays marched.
    pub rays: usize,
    /// Those for which one way found something that the other did not, or another surface.
    pub apart: usize,
    /// Those of them on which neither hit lies at a gap.
    pub unexplained: usize,
}

impl Agreement {
    /// Share of rays that met the same.
    pub fn share(&self) -> f64 {
        1.0 - self.apart as f64 / self.rays.max(1) as f64
    }

    fn and(self, other: Self) -> Self {
        Self { rays: self.rays + other.rays, apart: self.apart + other.apart, unexplained: self.unexplained + other.unexplained }
    }
}

/// Marches `rays` random rays through a panorama's depth both ways, without back faces: from anywhere in front of the surface, in
/// any direction, `steps` linear ones for half a turn. The same is a distance within a thousandth, or nothing.
pub fn agreement(depth: &Image<f32>, rays: usize, steps: usize) -> Agreement {
    let field = DepthField::new(depth, &FieldOptions { back_faces: false, ..FieldOptions::default() });
    let near = |hit: Option<FieldHit>, origin: Vec3, direction: Vec3| {
        hit.is_some_and(|h| h.at_gap || field.near_gap((origin + direction * h.t).normalize()))
    };
    let one = |seed: u32| {
        let mut random = Random::new(seed);
        let (origin, direction) = loop {
            let toward = random.direction();
            let inverse = field.inverse_distance(toward);
            if inverse > 0.0 {
                break (toward * (random.between(0.02, 0.98) / inverse), random.direction());
            }
        };
        let found = field.march(origin, direction, f32::INFINITY).hit();
        let expected = march_linear(&field, origin, direction, f32::INFINITY, steps);
        let same = match (found, expected) {
            (None, None) => true,
            (Some(a), Some(b)) => (a.t - b.t).abs() < 1e-3 * (1.0 + a.t),
            _ => false,
        };
        let explained = near(found, origin, direction) || near(expected, origin, direction);
        Agreement { rays: 1, apart: usize::from(!same), unexplained: usize::from(!same && !explained) }
    };
    (0..rays as u32).into_par_iter().map(one).reduce(Agreement::default, Agreement::and)
}
