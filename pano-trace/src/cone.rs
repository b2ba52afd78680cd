//! The directions in which a ball is seen.

use crate::bsdf::concentric_disc;
use crate::objects::Ball;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// How much larger, in solid angle, a cone is than the ball it is aimed at. Directions that meet the ball lie inside by more than
/// rounding can move them, so that none of them is without density; what lies at the rim meets nothing.
const MARGIN: f32 = 1.01;
/// Narrower cones are widened to this sin²: 10⁻⁴ rad, of which rounding of a direction is a thousandth.
const NARROWEST: f32 = 1e-8;
/// From this many squared radii on a ball is seen in a cone; nearer, the cone is nearly the hemisphere.
const NEAREST: f32 = 1.05;

/// Cones on the GPU, for shaders to include after [`crate::bsdf::gpu::DIRECTIONS`].
#[cfg(feature = "gpu")]
pub(crate) const CONES: pano_core::gpu::Piece = pano_core::gpu::Piece {
    text: include_str!("cone.wgsl"),
    constants: || {
        use pano_core::gpu::Constant;
        vec![
            Constant::f32("CONE_MARGIN", MARGIN),
            Constant::f32("NARROWEST_CONE", NARROWEST),
            Constant::f32("NEAREST_BALL", NEAREST),
        ]
    },
};

/// A cone of directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    pub(crate) axis: Vec3,
    /// 1 − cos of its half angle, which for narrow cones is lost in the cosine itself.
    pub(crate) cap: f32,
}

impl Cone {
    /// The cone in which `x` sees the ball; `None` inside it or close to it.
    #[inline]
    pub(crate) fn around(ball: &Ball, x: Vec3) -> Option<Self> {
        let to = ball.center - x;
        let (d2, r2) = (to.length_squared(), ball.radius * ball.radius);
        if d2 <= NEAREST * r2 {
            return None;
        }
        let sin2 = (MARGIN * r2 / d2).max(NARROWEST);
        // 1 − cos without cancellation.
        Some(Self { axis: to / d2.sqrt(), cap: sin2 / (1.0 + (1.0 - sin2).sqrt()) })
    }

    /// Steradians.
    #[inline]
    pub(crate) fn solid_angle(&self) -> f32 {
        TAU * self.cap
    }

    /// By the chord between direction and axis: its square is 2·(1 − cos), and exact where the cosine is not.
    #[inline]
    pub(crate) fn contains(&self, d: Vec3) -> bool {
        (d - self.axis).length_squared() <= 2.0 * self.cap
    }

    /// Uniform over the cone.
    #[inline]
    pub(crate) fn sample(&self, u: Vec2) -> Vec3 {
        // The disc's radius squared is uniform, and so is the height.
        let disc = concentric_disc(u);
        let r2 = disc.length_squared();
        let height = self.cap * r2;
        let sin = (height * (2.0 - height)).max(0.0).sqrt();
        let scale = if r2 > 0.0 { sin / r2.sqrt() } else { 0.0 };
        let (t, b) = self.axis.any_orthonormal_pair();
        (t * (disc.x * scale) + b * (disc.y * scale) + self.axis * (1.0 - height)).normalize()
    }
}
