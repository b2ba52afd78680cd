//! Objects as screen space knows them: what a view somewhat larger than the frame shows of them.

use super::Frame;
use crate::bvh::{InstanceHit, Ray};
use crate::world::RealWorld;
use glam::Vec2;
use pano_core::camera::{Camera, Projection};
use pano_core::image::Image;

/// How much larger than the frame the view is in which objects are looked for (the paper's 110 %).
pub const EXTENSION: f32 = 1.1;

/// Which object each pixel of the extended view shows, and how far away.
#[derive(Clone, Debug)]
pub struct ScreenObjects {
    camera: Camera,
    seen: Image<(u32, f32)>,
}

/// No object.
const NONE: u32 = u32::MAX;

impl ScreenObjects {
    /// What the view of `frame`, extended by [`EXTENSION`], shows.
    pub fn new<W: RealWorld>(frame: &Frame<'_>, world: &W) -> Self {
        let camera = extended(frame.camera);
        let seen = Image::par_from_fn(camera.width, camera.height, |x, y| {
            let ray = Ray::new(camera.position, camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
            match frame.objects.intersect(&ray) {
                Some(hit) if !world.blocks(&ray.up_to(hit.hit.t)) => (hit.instance, hit.hit.t),
                _ => (NONE, 0.0),
            }
        });
        Self { camera, seen }
    }

    /// Whether the extended view shows the point where `ray` met an object.
    pub(super) fn shows(&self, ray: &Ray, hit: &InstanceHit) -> bool {
        /// How far the depth of a pixel's centre may be off that of a point in it.
        const TOLERANCE: f32 = 0.02;
        let to = ray.at(hit.hit.t) - self.camera.position;
        let Some(at) = self.camera.pixel(to) else { return false };
        if at.cmplt(Vec2::ZERO).any() || at.x >= self.camera.width as f32 || at.y >= self.camera.height as f32 {
            return false;
        }
        let (instance, depth) = self.seen.get(at.x as usize, at.y as usize);
        instance == hit.instance && (depth - to.length()).abs() <= TOLERANCE * depth
    }
}

/// The view with a larger frame around the same pixels; a panorama has no outside.
fn extended(camera: &Camera) -> Camera {
    match camera.projection {
        Projection::Panorama => *camera,
        Projection::Perspective { vfov } => {
            let grown = |side: usize| (side as f32 * EXTENSION).ceil() as usize;
            let (width, height) = (grown(camera.width), grown(camera.height));
            let vfov = 2.0 * ((0.5 * vfov).tan() * height as f32 / camera.height as f32).atan();
            Camera { width, height, projection: Projection::Perspective { vfov }, ..*camera }
        }
        Projection::Pinhole { focal, center } => {
            let margin = |side: usize| (side as f32 * (EXTENSION - 1.0) / 2.0).ceil() as usize;
            let (x, y) = (margin(camera.width), margin(camera.height));
            let center = center + Vec2::new(x as f32, y as f32);
            let (width, height) = (camera.width + 2 * x, camera.height + 2 * y);
            Camera { width, height, projection: Projection::Pinhole { focal, center }, ..*camera }
        }
    }
}
