//! Panoramas of places whose every ray is known in closed form.

use glam::{Quat, Vec2, Vec3};
use pano_core::image::{Image, RadianceImage};
use pano_core::{progress::Silent, sphere};
use pano_trace::world::{CapturedOptions, CapturedWorld};
use std::sync::Arc;

/// Direction of the centre of texel `(x, y)`.
pub fn texel_direction(width: usize, height: usize, x: usize, y: usize) -> Vec3 {
    sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32))
}

/// A picture of constant radiance.
pub fn constant(width: usize, radiance: Vec3) -> RadianceImage {
    Image::filled(width, width / 2, radiance)
}

/// A box seen from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Smallest corner.
    pub lo: Vec3,
    /// Largest corner.
    pub hi: Vec3,
}

impl Cuboid {
    /// Distances at which the line enters and leaves, if it meets the box.
    pub fn span(&self, origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
        let (a, b) = ((self.lo - origin) / direction, (self.hi - origin) / direction);
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        (enter <= leave).then_some((enter, leave))
    }
}

/// A room: a box around the capture point (the origin), with a box standing in it, a window in the wall at the back (−Z)
/// behind which there is nothing but sky, and a lamp on the ceiling.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// The walls.
    pub walls: Cuboid,
    /// What stands in it.
    pub table: Option<Cuboid>,
    /// Opening in the wall at −Z: smallest and largest (x, y).
    pub window: Option<(Vec2, Vec2)>,
    /// Radiance of the surfaces at the room's smallest and largest corner.
    pub colors: [Vec3; 2],
    /// Radiance of the sky behind the window, of a disc in the middle of the ceiling.
    pub lights: [Vec3; 2],
}

impl Room {
    /// Distance to the first surface from a point in the room; infinite through the window.
    pub fn distance(&self, origin: Vec3, direction: Vec3) -> f32 {
        let wall = self.walls.span(origin, direction).map_or(f32::INFINITY, |s| s.1);
        if let Some((enter, _)) = self.table.and_then(|t| t.span(origin, direction))
            && enter > 0.0
            && enter < wall
        {
            return enter;
        }
        let at = origin + direction * wall;
        let behind = self.window.is_some_and(|(lo, hi)| {
            (at.z - self.walls.lo.z).abs() < 1e-4 && at.truncate().cmpge(lo).all() && at.truncate().cmple(hi).all()
        });
        if behind { f32::INFINITY } else { wall }
    }

    /// Depth seen from the origin.
    pub fn depth(&self, width: usize) -> Image<f32> {
        let height = width / 2;
        Image::from_fn(width, height, |x, y| self.distance(Vec3::ZERO, texel_direction(width, height, x, y)))
    }

    /// The picture seen from the origin: colours that change smoothly from corner to corner.
    pub fn radiance(&self, width: usize) -> RadianceImage {
        let height = width / 2;
        RadianceImage::from_fn(width, height, |x, y| {
            let d = texel_direction(width, height, x, y);
            let t = self.distance(Vec3::ZERO, d);
            if !t.is_finite() {
                return self.lights[0];
            }
            let at = d * t;
            if at.y > self.walls.hi.y - 1e-3 && Vec2::new(at.x, at.z).length() < 0.4 {
                return self.lights[1];
            }
            let share = ((at - self.walls.lo) / (self.walls.hi - self.walls.lo)).dot(Vec3::splat(1.0 / 3.0));
            self.colors[0].lerp(self.colors[1], share)
        })
    }
}

/// Depth of a horizontal plane `below` metres under the origin; nothing above the horizon.
pub fn plane_depth(width: usize, below: f32) -> Image<f32> {
    let height = width / 2;
    Image::from_fn(width, height, |x, y| {
        let down = -texel_direction(width, height, x, y).y;
        // Beyond 1000 m the ground is as good as the horizon.
        if down * 1e3 > below { below / down } else { f32::INFINITY }
    })
}

/// The captured world of a panorama taken at `capture`, with a small map of irradiance (of which a quarter is made where no objects are named).
pub fn captured(radiance: &RadianceImage, depth: &Image<f32>, turn: Quat, capture: Vec3) -> CapturedWorld {
    captured_with_cap(radiance, depth, turn, capture, CapturedOptions::default().reflectance_cap)
}

/// The same with reflectance at most `cap`.
///
/// # Panics
/// Never: nobody cancels.
pub fn captured_with_cap(
    radiance: &RadianceImage,
    depth: &Image<f32>,
    turn: Quat,
    capture: Vec3,
    reflectance_cap: f32,
) -> CapturedWorld {
    let options =
        CapturedOptions { irradiance_width: 512, irradiance_samples: 16, reflectance_cap, ..CapturedOptions::default() };
    CapturedWorld::new(Arc::new(radiance.clone()), depth, turn, capture, &[], &options, &Silent).expect("nobody cancels")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_in_a_room() {
        let room = Room {
            walls: Cuboid { lo: Vec3::splat(-2.0), hi: Vec3::splat(2.0) },
            table: Some(Cuboid { lo: Vec3::new(-0.5, -2.0, 0.5), hi: Vec3::new(0.5, -1.0, 1.5) }),
            window: Some((Vec2::new(-1.0, -1.0), Vec2::new(1.0, 1.0))),
            colors: [Vec3::ONE; 2],
            lights: [Vec3::ONE; 2],
        };
        for (origin, direction, distance) in [
            (Vec3::ZERO, Vec3::X, 2.0),
            (Vec3::ZERO, Vec3::NEG_Z, f32::INFINITY),
            (Vec3::new(0.0, 1.5, 0.0), Vec3::NEG_Z, 2.0),
            (Vec3::new(0.0, 1.5, 1.0), Vec3::NEG_Y, 2.5),
            (Vec3::new(1.5, -1.5, 1.0), Vec3::NEG_X, 1.0),
        ] {
            assert_eq!(room.distance(origin, direction), distance, "{origin} {direction}");
        }
    }
}
