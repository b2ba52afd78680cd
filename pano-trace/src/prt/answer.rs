//! What a ray through the depth field meets.

use glam::Vec3;

/// Where a ray met the captured surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldHit {
    /// Distance in metres.
    pub t: f32,
    /// Unit normal of the surface just there, on the side the ray came from ([`super::DepthField::smooth_normal`] is that of the
    /// surface around).
    pub normal: Vec3,
    /// The ray came from behind: it met the side that the panorama has not seen.
    pub back: bool,
    /// The surface was met at a gap, on the half cell of its last sample.
    pub at_gap: bool,
    /// The ray met what is only assumed.
    pub hidden_side: Option<HiddenSide>,
}

/// What is assumed where the panorama has not seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HiddenSide {
    /// The back of a front layer, made of what the layer shows in this direction.
    BackFace(Vec3),
    /// The layer behind a front one, going on as it is in this direction.
    BackLayer(Vec3),
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The captured surface.
    Surface(FieldHit),
    /// An assumed back face at a gap.
    BackFace(FieldHit),
    /// Nothing nearer than its end.
    Left,
    /// Nothing within the steps allowed ([`super::FieldOptions::max_steps`]).
    OutOfSteps,
}

impl Answer {
    /// The hit, on a surface or at a gap.
    #[inline]
    pub fn hit(self) -> Option<FieldHit> {
        match self {
            Self::Surface(hit) | Self::BackFace(hit) => Some(hit),
            Self::Left | Self::OutOfSteps => None,
        }
    }
}
