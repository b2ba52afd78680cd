//! Where other programs put the four compass directions in an equirectangular picture.

use super::direction_from_uv;
use glam::{Vec2, Vec3};

/// The u at which a program's panoramas show +X, −Z, −X and +Z. All conventions have +Y on top and u growing to the
/// right for a viewer inside; they differ by a yaw only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Convention {
    /// Pano's own: −Z in the middle.
    #[default]
    Forward,
    /// three.js: +X in the middle.
    Three,
    /// Blender, once its axes are swapped to +Y up: +X in the middle.
    Blender,
    /// Mitsuba: +Z in the middle.
    Mitsuba,
    /// USD dome lights and OpenEXR latlong: +Z in the middle.
    Usd,
}

impl Convention {
    /// Every convention.
    pub const ALL: [Self; 5] = [Self::Forward, Self::Three, Self::Blender, Self::Mitsuba, Self::Usd];

    /// What to add to Pano's u to get this convention's u.
    pub const fn u_offset(self) -> f32 {
        match self {
            Self::Forward => 0.0,
            Self::Three | Self::Blender => -0.25,
            Self::Mitsuba | Self::Usd => 0.5,
        }
    }

    /// Yaw in degrees, to the right of −Z, of the picture's centre.
    pub const fn center_yaw(self) -> f32 {
        // A direction at Pano's u stands at u + offset here, so the centre (½) shows Pano's ½ − offset.
        -self.u_offset() * 360.0
    }

    /// Direction of the point (u, v) of a picture in this convention.
    pub fn direction_from_uv(self, uv: Vec2) -> Vec3 {
        direction_from_uv(Vec2::new(uv.x - self.u_offset(), uv.y))
    }

    /// The point (u, v), u ∈ [0, 1), at which a picture in this convention shows `d`.
    pub fn uv_from_direction(self, d: Vec3) -> Vec2 {
        let uv = super::uv_from_direction(d);
        let u = (uv.x + self.u_offset()).rem_euclid(1.0);
        Vec2::new(if u >= 1.0 { 0.0 } else { u }, uv.y)
    }
}
