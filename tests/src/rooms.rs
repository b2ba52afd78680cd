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

/// Distance from `origin` along unit `direction` to the inside of the box between `lo` and `hi`.
pub fn box_distance(lo: Vec3, hi: Vec3, origin: Vec3, direction: Vec3) -> f32 {
    let far = Vec3::select(direction.cmpgt(Vec3::ZERO), hi, lo);
    ((far - origin) / direction).to_array().into_iter().filter(|t| t.is_finite()).fold(f32::INFINITY, f32::min)
}

/// Depth of a box room, seen from the origin.
pub fn box_depth(width: usize, lo: Vec3, hi: Vec3) -> Image<f32> {
    let height = width / 2;
    Image::from_fn(width, height, |x, y| box_distance(lo, hi, Vec3::ZERO, texel_direction(width, height, x, y)))
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

/// A picture of constant radiance.
pub fn constant(width: usize, radiance: Vec3) -> RadianceImage {
    Image::filled(width, width / 2, radiance)
}

/// The captured world of a panorama taken at `capture`, with a small map of irradiance.
pub fn captured(radiance: &RadianceImage, depth: &Image<f32>, turn: Quat, capture: Vec3) -> CapturedWorld {
    let options = CapturedOptions { irradiance_width: 128, ..CapturedOptions::default() };
    CapturedWorld::new(Arc::new(radiance.clone()), depth, turn, capture, &options, &Silent).expect("nobody cancels")
}
