//! The panorama as the objects have changed it: what the first pass writes and the second one reads (`UpdateGbuffer`).

use super::{Frame, GBuffer};
use crate::bvh::Ray;
use crate::world::{Environment, LightSample, RealHit, RealWorld};
use glam::{Quat, Vec2, Vec3};
use pano_core::{image::Image, sphere};

/// A world whose surfaces shine E_RV / E_R times as bright where a view has seen them change.
#[derive(Debug)]
pub struct UpdatedWorld<'a, W> {
    world: &'a W,
    capture: Vec3,
    pano_from_world: Quat,
    ratio: &'a Image<Vec3>,
}

impl<'a, W: RealWorld> UpdatedWorld<'a, W> {
    /// `world`, captured at `capture`, with a `ratio` of [`panorama_ratio`].
    pub fn new(world: &'a W, capture: Vec3, ratio: &'a Image<Vec3>) -> Self {
        Self { world, capture, pano_from_world: world.environment().pano_from_world, ratio }
    }

    /// The world as it was.
    pub(super) fn original(&self) -> &W {
        self.world
    }

    /// How much brighter than before the surface at a hit is.
    pub(super) fn ratio(&self, hit: &RealHit) -> Vec3 {
        let seen = hit.position - self.capture;
        // Only the side that the panorama shows is known to have changed.
        if hit.surface != 0 || hit.normal.dot(seen) >= 0.0 {
            return Vec3::ONE;
        }
        sphere::bilinear(self.ratio, sphere::uv_from_direction(self.pano_from_world * seen))
    }

    fn update(&self, hit: RealHit) -> RealHit {
        let ratio = self.ratio(&hit);
        RealHit { radiance: hit.radiance.map(|radiance| radiance * ratio), ..hit }
    }
}

impl<W: RealWorld> RealWorld for UpdatedWorld<'_, W> {
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        self.world.hit(ray).map(|hit| self.update(hit))
    }

    fn shown_surface(&self, hit: RealHit, direction: Vec3, u: f32) -> RealHit {
        self.world.shown_surface(hit, direction, u)
    }

    fn infinity(&self, direction: Vec3) -> Vec3 {
        self.world.infinity(direction)
    }

    fn reflectance(&self, hit: &RealHit) -> Vec3 {
        self.world.reflectance(hit)
    }

    fn sample_light(&self, from: Vec3, u: Vec2) -> Option<LightSample> {
        self.world.sample_light(from, u)
    }

    fn light_pdf(&self, from: Vec3, direction: Vec3, behind: Option<&RealHit>) -> f32 {
        self.world.light_pdf(from, direction, behind)
    }

    fn reach(&self, ray: &Ray, sample: &LightSample) -> Option<Option<RealHit>> {
        Some(self.world.reach(ray, sample)?.map(|hit| self.update(hit)))
    }

    fn environment(&self) -> Environment<'_> {
        self.world.environment()
    }

    fn sees_itself(&self) -> bool {
        self.world.sees_itself()
    }

    fn leave(&self, hit: &RealHit) -> Vec3 {
        self.world.leave(hit)
    }
}

/// The ratio of a panorama in which nothing has changed.
pub fn unchanged() -> Image<Vec3> {
    Image::filled(1, 1, Vec3::ONE)
}

/// Carries E_RV / E_R from the view over to the panorama, as a picture of `size`: 1 where the view does not see the
/// panorama's surface.
pub fn panorama_ratio<W: RealWorld>(
    frame: &Frame<'_>,
    world: &W,
    buffer: &GBuffer,
    ratio: &Image<Vec3>,
    size: (usize, usize),
) -> Image<Vec3> {
    let world_from_pano = world.environment().pano_from_world.inverse();
    let camera = frame.camera;
    Image::par_from_fn(size.0, size.1, |x, y| {
        let uv = Vec2::new((x as f32 + 0.5) / size.0 as f32, (y as f32 + 0.5) / size.1 as f32);
        let direction = world_from_pano * sphere::direction_from_uv(uv);
        // From the capture point itself the place in the view needs no depth.
        let look = |d: Vec3| {
            let at = camera.pixel(d)?;
            let inside = at.cmpge(Vec2::ZERO).all() && at.x < camera.width as f32 && at.y < camera.height as f32;
            inside.then_some((at.x as usize, at.y as usize))
        };
        let here = camera.position == frame.capture;
        if here && look(direction).is_none() {
            return Vec3::ONE;
        }
        let Some(hit) = world.hit(&Ray::new(frame.capture, direction)) else { return Vec3::ONE };
        match look(hit.position - camera.position) {
            Some((px, py)) if buffer.shows(px, py, &hit, camera) => ratio.get(px, py),
            _ => Vec3::ONE,
        }
    })
}
