//! Cameras: the perspective view and the whole panorama, both with box-filtered pixels.

use crate::sphere;
use glam::{Quat, Vec2, Vec3};

/// How a view maps pixels to directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Rectilinear, with the vertical field of view in radians, in (0, π).
    Perspective {
        /// Vertical field of view in radians.
        vfov: f32,
    },
    /// Rectilinear with measured intrinsics, which need be neither square nor centred.
    Pinhole {
        /// Pixels along x and y of a step of one unit at one unit's depth, positive.
        focal: Vec2,
        /// Where the optical axis meets the picture, in pixels; the centre of the top left pixel is (½, ½).
        center: Vec2,
    },
    /// The whole sphere, equirectangular.
    Panorama,
}

impl Projection {
    /// Focal lengths and optical axis in pixels of a picture of this size; `None` for a panorama.
    pub fn intrinsics(&self, (width, height): (usize, usize)) -> Option<(Vec2, Vec2)> {
        match *self {
            Self::Perspective { vfov } => {
                let focal = height as f32 / (2.0 * (0.5 * vfov).tan());
                Some((Vec2::splat(focal), Vec2::new(0.5 * width as f32, 0.5 * height as f32)))
            }
            Self::Pinhole { focal, center } => Some((focal, center)),
            Self::Panorama => None,
        }
    }
}

/// A camera at a place, looking somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// World position in metres.
    pub position: Vec3,
    /// Rotates camera space (looking to −Z, +Y up, +X right) into the world.
    pub world_from_camera: Quat,
    /// How pixels map to directions.
    pub projection: Projection,
    /// Picture width in pixels, at least 1.
    pub width: usize,
    /// Picture height in pixels, at least 1.
    pub height: usize,
}

/// The rotation of a view turned `yaw` degrees to the right of −Z and then `pitch` degrees up.
pub fn rotation_from_yaw_pitch(yaw: f32, pitch: f32) -> Quat {
    Quat::from_rotation_y(-yaw.to_radians()) * Quat::from_rotation_x(pitch.to_radians())
}

impl Camera {
    /// World direction (unit) through the point `pixel` of the picture: x in [0, width], y in [0, height], pixel centres at
    /// +½, y down.
    #[inline]
    pub fn direction(&self, pixel: Vec2) -> Vec3 {
        let (w, h) = (self.width as f32, self.height as f32);
        let local = match self.projection {
            Projection::Perspective { vfov } => {
                let scale = 2.0 * (0.5 * vfov).tan() / h;
                Vec3::new((pixel.x - 0.5 * w) * scale, (0.5 * h - pixel.y) * scale, -1.0).normalize()
            }
            Projection::Pinhole { focal, center } => {
                Vec3::new((pixel.x - center.x) / focal.x, (center.y - pixel.y) / focal.y, -1.0).normalize()
            }
            Projection::Panorama => sphere::direction_from_uv(Vec2::new(pixel.x / w, pixel.y / h)),
        };
        self.world_from_camera * local
    }

    /// Where the picture shows world direction `d`, in pixels; `None` behind a perspective view. May lie outside the
    /// picture.
    pub fn pixel(&self, d: Vec3) -> Option<Vec2> {
        let local = self.world_from_camera.inverse() * d;
        let (w, h) = (self.width as f32, self.height as f32);
        match self.projection {
            Projection::Perspective { vfov } => (local.z < 0.0).then(|| {
                let scale = h / (2.0 * (0.5 * vfov).tan()) / -local.z;
                Vec2::new(0.5 * w + local.x * scale, 0.5 * h - local.y * scale)
            }),
            Projection::Pinhole { focal, center } => {
                let at = Vec2::new(local.x, -local.y) / -local.z;
                (local.z < 0.0).then_some(center + focal * at)
            }
            Projection::Panorama => Some(sphere::uv_from_direction(local) * Vec2::new(w, h)),
        }
    }

    /// Focal lengths and optical axis in pixels, as in [`Projection::Pinhole`]; `None` for a panorama.
    pub fn intrinsics(&self) -> Option<(Vec2, Vec2)> {
        self.projection.intrinsics((self.width, self.height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn yaw_turns_right_and_pitch_up() {
        assert!((rotation_from_yaw_pitch(90.0, 0.0) * Vec3::NEG_Z).distance(Vec3::X) < 1e-6);
        assert!((rotation_from_yaw_pitch(0.0, 90.0) * Vec3::NEG_Z).distance(Vec3::Y) < 1e-6);
        assert!((rotation_from_yaw_pitch(90.0, 45.0) * Vec3::NEG_Z).y > 0.7);
    }

    #[test]
    fn a_pinhole_in_the_middle_is_a_perspective_view() {
        let view = Camera {
            position: Vec3::ZERO,
            world_from_camera: Quat::IDENTITY,
            projection: Projection::Perspective { vfov: 0.8 },
            width: 40,
            height: 30,
        };
        let (focal, center) = view.intrinsics().unwrap();
        let pinhole = Camera { projection: Projection::Pinhole { focal, center }, ..view };
        for pixel in [Vec2::ZERO, Vec2::new(13.0, 7.5), Vec2::new(40.0, 30.0)] {
            assert!(view.direction(pixel).distance(pinhole.direction(pixel)) < 1e-6);
        }
        assert_eq!(Camera { projection: Projection::Panorama, ..view }.intrinsics(), None);
    }

    proptest! {
        #[test]
        fn pixel_and_direction_are_inverse(
            x in 0.0f32..64.0, y in 1.0f32..47.0, yaw in -180.0f32..180.0, pitch in -90.0f32..90.0, kind in 0usize..3,
        ) {
            let pinhole = Projection::Pinhole { focal: Vec2::new(50.0, 61.0), center: Vec2::new(25.0, 30.0) };
            let projection = [Projection::Panorama, Projection::Perspective { vfov: 0.9 }, pinhole][kind];
            let camera = Camera { position: Vec3::ZERO, world_from_camera: rotation_from_yaw_pitch(yaw, pitch), projection, width: 64, height: 48 };
            let back = camera.pixel(camera.direction(Vec2::new(x, y))).unwrap();
            let gap = (back.x - x).abs();
            prop_assert!(gap.min(64.0 - gap) < 2e-2 && (back.y - y).abs() < 2e-2, "{x} {y} -> {back}");
        }
    }
}
