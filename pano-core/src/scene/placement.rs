//! Where things are in the world, and how they move.

use glam::{Affine3A, Quat, Vec3};

/// Orientation, as the scene file gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// Degrees about +Y, counter-clockwise seen from above.
    Yaw(f32),
    /// Unit quaternion.
    Quaternion(Quat),
}

impl Rotation {
    /// As a unit quaternion.
    pub fn quat(self) -> Quat {
        match self {
            Self::Yaw(degrees) => Quat::from_rotation_y(degrees.to_radians()),
            Self::Quaternion(q) => q,
        }
    }

    /// The rotation a share `t` of the way to `other`. Between two yaws the angle itself goes linearly, so that 0° to 360°
    /// is a full turn; otherwise the shorter arc is taken.
    fn lerp(self, other: Self, t: f32) -> Self {
        match (self, other) {
            (Self::Yaw(a), Self::Yaw(b)) => Self::Yaw(a + (b - a) * t),
            (a, b) => Self::Quaternion(a.quat().slerp(b.quat(), t).normalize()),
        }
    }
}

impl Default for Rotation {
    fn default() -> Self {
        Self::Yaw(0.0)
    }
}

/// A place in the world: scaled, then rotated, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// World position of the local origin, metres.
    pub position: Vec3,
    /// Orientation.
    pub rotation: Rotation,
    /// Metres a local unit, positive.
    pub scale: f32,
}

impl Default for Placement {
    /// At the origin, unrotated, scale 1.
    fn default() -> Self {
        Self { position: Vec3::ZERO, rotation: Rotation::default(), scale: 1.0 }
    }
}

impl Placement {
    /// Maps local points into the world.
    pub fn world_from_local(&self) -> Affine3A {
        Affine3A::from_scale_rotation_translation(Vec3::splat(self.scale), self.rotation.quat(), self.position)
    }

    fn lerp(&self, other: &Self, t: f32) -> Self {
        Self {
            position: self.position.lerp(other.position, t),
            rotation: self.rotation.lerp(other.rotation, t),
            scale: self.scale + (other.scale - self.scale) * t,
        }
    }
}

/// A place at a time; what the scene file leaves out of it is the object's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Seconds, ≥ 0; frame n of a sequence is at n / fps.
    pub time: f32,
    /// Where the object is then.
    pub placement: Placement,
}

/// The place at `time` between `keyframes`, which are sorted by time without duplicates; `None` if there are none.
pub(super) fn at(keyframes: &[Keyframe], time: f32) -> Option<Placement> {
    let (first, last) = (keyframes.first()?, keyframes.last()?);
    let next = keyframes.partition_point(|k| k.time <= time);
    Some(match (next.checked_sub(1), keyframes.get(next)) {
        (Some(i), Some(b)) => {
            let a = &keyframes[i];
            a.placement.lerp(&b.placement, (time - a.time) / (b.time - a.time))
        }
        (None, _) => first.placement,
        (_, None) => last.placement,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f32, x: f32, yaw: f32) -> Keyframe {
        let placement = Placement { position: Vec3::X * x, rotation: Rotation::Yaw(yaw), scale: 1.0 };
        Keyframe { time, placement }
    }

    #[test]
    fn keyframes_interpolate_and_hold_at_the_ends() {
        let keys = [key(1.0, 0.0, 0.0), key(2.0, 4.0, 360.0), key(4.0, 0.0, 360.0)];
        for (time, x, yaw) in
            [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.25, 1.0, 90.0), (2.0, 4.0, 360.0), (3.0, 2.0, 360.0), (9.0, 0.0, 360.0)]
        {
            let p = at(&keys, time).unwrap();
            assert_eq!((p.position.x, p.rotation), (x, Rotation::Yaw(yaw)), "at {time}");
        }
        assert_eq!(at(&[], 0.0), None);
        assert_eq!(at(&keys, f32::NAN).unwrap(), keys[0].placement);
    }

    #[test]
    fn quaternions_take_the_shorter_arc() {
        let q = |degrees: f32| Rotation::Quaternion(Quat::from_rotation_y(degrees.to_radians()));
        let half = q(-80.0).lerp(Rotation::Yaw(280.0), 0.5).quat();
        assert!(half.angle_between(q(280.0).quat()) < 1e-3);
        let half = q(0.0).lerp(q(90.0), 0.5).quat();
        assert!(half.angle_between(q(45.0).quat()) < 1e-3);
    }

    #[test]
    fn yaw_turns_counter_clockwise_seen_from_above() {
        let placement = Placement { position: Vec3::Y, rotation: Rotation::Yaw(90.0), scale: 2.0 };
        // From above (+Y, −Z up the page) a quarter turn counter-clockwise takes +X to −Z.
        let p = placement.world_from_local().transform_point3(Vec3::X);
        assert!(p.distance(Vec3::new(0.0, 1.0, -2.0)) < 1e-6, "{p}");
    }
}
