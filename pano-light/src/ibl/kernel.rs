//! The lobes that panoramas are convolved with, and the 18 + 18 directions that stand for each.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A lobe that is symmetric about its axis, as a density over the sphere of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// A Lambertian surface's, about its normal: cos θ / π.
    Diffuse,
    /// That of a GGX surface of this roughness (α = roughness², in [0, 1]) looked at from straight above, about the
    /// mirrored direction: D(θ/2)·cos θ up to a factor, the approximation game engines make for all views (Karis 2013).
    Glossy(f32),
}

/// Directions of one kernel.
const SAMPLES: usize = 36;
/// Sectors of each ring.
const SECTORS: usize = 6;
/// Steps of the numerical integral over θ: lobes are smooth, and the narrowest map's (α = 1/16) is 40 steps wide.
const STEPS: usize = 2048;

/// What stands for one kernel.
pub(super) type Lookups = [Sample; SAMPLES];

/// One lookup, relative to the lobe's axis. All of a kernel's lookups weigh the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    /// Where to look: unit length, the axis being +Z.
    pub(super) direction: Vec3,
    /// Steradians it stands for.
    pub(super) solid_angle: f32,
}

impl Kernel {
    /// The lobe's value, not normalised, for the cosine of the angle to its axis.
    pub(super) fn value(self, cos: f32) -> f32 {
        let cos = cos.min(1.0);
        if cos <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Diffuse => cos,
            Self::Glossy(roughness) => {
                let alpha2 = roughness.powi(4).max(1e-8);
                // The half vector stands at half the angle; its cosine squared is (1 + cos)/2.
                let denominator = 0.5 * (1.0 + cos) * (alpha2 - 1.0) + 1.0;
                cos * alpha2 * alpha2 / (denominator * denominator)
            }
        }
    }

    /// The lookups: three rings that share the inner half of the lobe's light and three that share the outer one.
    pub(super) fn samples(self) -> Lookups {
        const RINGS: usize = SAMPLES / SECTORS;
        let step = 0.5 * PI / STEPS as f32;
        let mut cumulative = vec![0.0; STEPS + 1];
        for i in 0..STEPS {
            let theta = (i as f32 + 0.5) * step;
            cumulative[i + 1] = cumulative[i] + f64::from(self.value(theta.cos()) * theta.sin());
        }
        let total = cumulative[STEPS];
        // The angle within which a share of the light comes from.
        let angle = |share: f32| {
            let target = f64::from(share) * total;
            let i = cumulative.partition_point(|&c| c < target).clamp(1, STEPS);
            let (a, b) = (cumulative[i - 1], cumulative[i]);
            let t = if b > a { (target - a) / (b - a) } else { 0.0 };
            // All of it comes from the hemisphere, however little from its rim.
            if share >= 1.0 { 0.5 * PI } else { (i as f32 - 1.0 + t.clamp(0.0, 1.0) as f32) * step }
        };
        std::array::from_fn(|i| {
            let (ring, sector) = (i / SECTORS, i % SECTORS);
            let at = |part: f32| angle((ring as f32 + part) / RINGS as f32);
            // Neighbouring rings are turned against each other.
            let phi = (sector as f32 + 0.5 * (ring % 2) as f32) * TAU / SECTORS as f32;
            let (theta_sin, theta_cos) = at(0.5).sin_cos();
            Sample {
                direction: Vec3::new(theta_sin * phi.cos(), theta_sin * phi.sin(), theta_cos),
                solid_angle: TAU * (at(0.0).cos() - at(1.0).cos()) / SECTORS as f32,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_diffuse_lobe_lies_within_45_degrees() {
        let samples = Kernel::Diffuse.samples();
        let (inner, outer) = samples.split_at(18);
        let cos = (0.25 * PI).cos();
        assert!(inner.iter().all(|s| s.direction.z > cos) && outer.iter().all(|s| s.direction.z < cos));
        // sin²θ of the ring's middle is (2·ring + 1)/12.
        for (i, s) in samples.iter().enumerate() {
            let share = (2 * (i / 6) + 1) as f32 / 12.0;
            assert!((1.0 - s.direction.z.powi(2) - share).abs() < 1e-3, "{i}: {s:?}");
        }
    }

    #[test]
    fn sectors_cover_the_hemisphere_once() {
        for kernel in [Kernel::Diffuse, Kernel::Glossy(0.25), Kernel::Glossy(0.5), Kernel::Glossy(1.0)] {
            let sum: f32 = kernel.samples().iter().map(|s| s.solid_angle).sum();
            assert!((sum - TAU).abs() < 1e-3, "{kernel:?}: {sum}");
        }
    }

    #[test]
    fn rougher_lobes_are_wider() {
        let width = |r: f32| Kernel::Glossy(r).samples()[17].direction.z.acos();
        assert!(width(0.25) < width(0.5) && width(0.5) < width(0.75) && width(0.75) < width(1.0));
    }
}
