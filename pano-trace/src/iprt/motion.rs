//! Motion vectors: where the point that a pixel shows was in the previous frame.

use super::GBuffer;
use crate::objects::Objects;
use glam::{Vec2, Vec3};
use pano_core::{camera::Camera, image::Image};

/// The view and the objects of an earlier frame.
#[derive(Clone, Debug)]
pub struct Earlier {
    /// The view.
    pub camera: Camera,
    /// The objects, in the same order.
    pub objects: Objects,
}

/// Where the points of a view's pixels were in an earlier view, and how far from its camera; see [`motion`].
pub type Motion = (Image<Vec2>, Image<f32>);

/// For each pixel of `buffer`, a view of `camera` and `objects`: where its point was in the earlier view, in pixels (centres
/// at +½; NaN if it was behind it), and how far from the earlier camera. Real surfaces stand still; objects move by their
/// placements. What has no depth lies in a direction.
pub fn motion(buffer: &GBuffer, camera: &Camera, objects: &Objects, earlier: &Earlier) -> Motion {
    let (w, h) = buffer.size();
    let found = Image::par_from_fn(w, h, |x, y| {
        let depth = buffer.depth.get(x, y);
        if !depth.is_finite() {
            let direction = camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            return (earlier.camera.pixel(direction).unwrap_or(Vec2::NAN), f32::INFINITY);
        }
        let now = buffer.position.get(x, y);
        let before = match buffer.thing.get(x, y) {
            0 => Some(now),
            thing => objects.was_at(thing - 1, now, &earlier.objects),
        };
        let Some(before) = before else { return (Vec2::NAN, 0.0) };
        let seen: Vec3 = before - earlier.camera.position;
        (earlier.camera.pixel(seen).unwrap_or(Vec2::NAN), seen.length())
    });
    (found.map(|f| f.0), found.map(|f| f.1))
}
