//! The panorama as the objects have changed it: what the first pass writes and the second one reads (`UpdateGbuffer`).

use super::{Frame, GBuffer};
use crate::bvh::Ray;
use crate::world::{Environment, LightSample, RealHit, RealWorld, mirror_ray};
use glam::{Quat, Vec2, Vec3};
use pano_core::{image::Image, sphere};

/// A world whose surfaces shine E_RV / E_R times as bright where a view has seen them change.
#[derive(Debug)]
pub struct UpdatedWorld<'a, W> {
    world: &'a W,
    capture: Vec3,
    pano_from_world: Quat,
    update: &'a Update,
}

/// What a view has found out about the panorama's surfaces, as pictures of the panorama.
#[derive(Clone, Debug)]
pub struct Update {
    /// E_RV / E_R; 1 where nothing is known.
    pub ratio: Image<Vec3>,
    /// x: the share of the radiance that leaves in all directions, [0, 1]; the rest is a mirror image. y: the mirror's
    /// reflectance, [0, 1], by which other viewpoints see other images. (1, 0) where nothing is known.
    pub gloss: Image<Vec2>,
}

impl Default for Update {
    /// Nothing is known.
    fn default() -> Self {
        Self { ratio: Image::filled(1, 1, Vec3::ONE), gloss: Image::filled(1, 1, Vec2::X) }
    }
}

impl<'a, W: RealWorld> UpdatedWorld<'a, W> {
    /// `world`, captured at `capture`, with an `update` of [`panorama_update`].
    pub fn new(world: &'a W, capture: Vec3, update: &'a Update) -> Self {
        Self { world, capture, pano_from_world: world.environment().pano_from_world, update }
    }

    /// The world as it was.
    pub(super) fn original(&self) -> &W {
        self.world
    }

    /// The radiance that a surface sends back along `direction`, without and with the objects. What it mirrors is what the
    /// world without objects shows.
    pub(super) fn radiance(&self, hit: &RealHit, direction: Vec3) -> (Vec3, Vec3) {
        let radiance = hit.radiance.unwrap_or(Vec3::ZERO);
        let seen = hit.position - self.capture;
        // Only the side that the panorama shows is known to have changed.
        if hit.surface != 0 || hit.normal.dot(seen) >= 0.0 {
            return (radiance, radiance);
        }
        let uv = sphere::uv_from_direction(self.pano_from_world * seen);
        let gloss = sphere::bilinear(&self.update.gloss, uv);
        let mirrored = if gloss.y > 0.0 { self.mirrored(hit, direction) * gloss.y } else { Vec3::ZERO };
        let matte = radiance * gloss.x;
        (matte + mirrored, matte * sphere::bilinear(&self.update.ratio, uv) + mirrored)
    }

    /// What the world without objects shows there.
    pub(super) fn mirrored(&self, hit: &RealHit, direction: Vec3) -> Vec3 {
        let ray = mirror_ray(self.world, hit, direction);
        self.world.arriving(ray.direction, self.world.hit(&ray).as_ref())
    }

    fn updated(&self, hit: RealHit, direction: Vec3) -> RealHit {
        RealHit { radiance: hit.radiance.map(|_| self.radiance(&hit, direction).1), ..hit }
    }
}

impl<W: RealWorld> RealWorld for UpdatedWorld<'_, W> {
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        self.world.hit(ray).map(|hit| self.updated(hit, ray.direction))
    }

    fn surface(&self, ray: &Ray) -> Option<RealHit> {
        self.world.surface(ray)
    }

    fn blocks(&self, ray: &Ray) -> bool {
        self.world.blocks(ray)
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
        Some(self.world.reach(ray, sample)?.map(|hit| self.updated(hit, ray.direction)))
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

/// Carries E_RV / E_R and the `gloss` ([`Update::gloss`]) from the view over to the panorama, as pictures of `size`.
pub fn panorama_update<W: RealWorld>(
    frame: &Frame<'_>,
    world: &W,
    buffer: &GBuffer,
    ratio: &Image<Vec3>,
    gloss: &Image<Vec2>,
    size: (usize, usize),
) -> Update {
    let world_from_pano = world.environment().pano_from_world.inverse();
    let camera = frame.camera;
    let found = Image::par_from_fn(size.0, size.1, |x, y| {
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
            return None;
        }
        let hit = world.hit(&Ray::new(frame.capture, direction))?;
        match look(hit.position - camera.position) {
            Some((px, py)) if buffer.shows(px, py, &hit, camera) => Some((ratio.get(px, py), gloss.get(px, py))),
            _ => None,
        }
    });
    Update { ratio: found.map(|f| f.map_or(Vec3::ONE, |f| f.0)), gloss: found.map(|f| f.map_or(Vec2::X, |f| f.1)) }
}
