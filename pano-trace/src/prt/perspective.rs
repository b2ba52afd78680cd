//! The depth of a perspective picture, and rays against it (RT²AR's depth-map traversal, section IV.B, figures 5 and 6).
//!
//! The paper walks along the projected ray with Bresenham's algorithm, one pixel a column, and looks at the two nearest rows.
//! Here the picture is one face of a [`DepthField`]: a linear map takes the camera's frustum to that of the face, under which
//! rays stay straight, inverse depth stays linear, and distances along the ray stay what they are. The march visits every cell
//! between pixels' centres that the ray passes (to a thousandth of a pixel), over a min/max pyramid.
//!
//! Beyond the border pixels, which keep their outer halves, there is nothing. A ray that passes behind the front layer at a gap
//! goes on to what lies behind: with the frustum bent to a cube's, back faces have no shape of their own, and there are none.

use super::field::{AXES, DepthField, FieldOptions};
use glam::{Mat3, Vec2, Vec3};
use pano_core::image::Image;

/// A perspective picture's depth, ready for rays. Positions are relative to the camera, which looks to −Z, +Y up.
#[derive(Clone, Debug)]
pub struct PerspectiveField {
    field: DepthField,
    /// From the camera's frame to the one in which the picture fills the face.
    face_from_camera: Mat3,
}

/// Where a ray met the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerspectiveHit {
    /// Distance in metres.
    pub t: f32,
    /// Unit normal of the surface on the side the ray came from.
    pub normal: Vec3,
    /// The surface was met at a gap, on the half pixel of its last sample.
    pub at_gap: bool,
}

/// The face that looks to −Z.
const FACE: usize = 5;

impl PerspectiveField {
    /// From the distance along the ray at each pixel's centre (not finite or ≤ 0: nothing there) of a camera with these focal
    /// lengths and this centre, in pixels. Of the options, the resolution and the back faces do not count.
    pub fn new(depth: &Image<f32>, focal: Vec2, center: Vec2, options: &FieldOptions) -> Self {
        let (w, h) = depth.size();
        // A sample a pixel, and one of nothing all around, at which the border pixels end.
        let n = (w.max(h) + 1).max(2);
        let mut inverse = vec![0.0; (n + 1) * (n + 1)];
        for y in 0..h {
            for x in 0..w {
                let d = depth.get(x, y);
                if d.is_finite() && d > 0.0 {
                    let at = (Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - center) / focal;
                    // Depth along the axis is the distance divided by the length of (x, y, 1).
                    inverse[(y + 1) * (n + 1) + x + 1] = (1.0 + at.length_squared()).sqrt() / d;
                }
            }
        }
        // Pixel (x, y) of the picture is at 2(x + ½)/n − 1 on the face.
        let scale = focal * (2.0 / n as f32);
        let shift = (center + 0.5) * (2.0 / n as f32) - 1.0;
        let face_from_camera = Mat3::from_cols(Vec3::X * scale.x, Vec3::Y * scale.y, Vec3::new(-shift.x, shift.y, 1.0));
        let options = FieldOptions { back_faces: false, ..*options };
        Self { field: DepthField::of_face(FACE, inverse, n, &options), face_from_camera }
    }

    /// The face.
    #[cfg(test)]
    pub(super) fn field(&self) -> &DepthField {
        &self.field
    }

    /// What the picture itself shows along unit `direction`.
    pub fn look(&self, direction: Vec3) -> Option<PerspectiveHit> {
        let d = self.face_from_camera * direction;
        let [forward, ..] = AXES[FACE];
        if d.dot(forward) <= d.x.abs().max(d.y.abs()) {
            return None;
        }
        let (inverse, plane) = self.field.look(d);
        let normal = -(self.face_from_camera.transpose() * plane).try_normalize()?;
        (inverse > 0.0).then(|| PerspectiveHit { t: 1.0 / inverse, normal, at_gap: self.field.near_gap(d) })
    }

    /// The first crossing of the surface by the ray from `origin` along unit `direction`, nearer than `t_max`.
    pub fn march(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<PerspectiveHit> {
        let (o, d) = (self.face_from_camera * origin, self.face_from_camera * direction);
        let hit = self.field.march(o, d, t_max).hit()?;
        let smooth = self.field.smooth_normal(o + d * hit.t, d, &hit);
        // Planes go the other way: p·x = p·A⁻¹·(A·x).
        let normal = (self.face_from_camera.transpose() * smooth).try_normalize()?;
        Some(PerspectiveHit { t: hit.t, normal, at_gap: hit.at_gap })
    }
}
