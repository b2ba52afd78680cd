//! The change of mirror images on real surfaces.
//!
//! A captured surface is taken for diffuse up to the largest reflectance; what it sends out beyond that is a lamp's own light or
//! the image of what lies in the direction of mirror reflection. It is taken for the image if what lies there is bright
//! enough, with the quotient as the mirror's reflectance: a lamp is brighter than what it mirrors and keeps its light. Where an
//! object comes in between, it shows in place of what was there. That is what the surface sends out beyond diffuse, to the colour: of
//! what is known to lie there only the luminance counts, for it need not be the very spot. What objects see in such surfaces is
//! [`RealWorld::sent_back`].

use super::path::{First, Scene};
use super::{Tracer, Walk};
use crate::world::{RealHit, RealWorld, mirror_ray};
use glam::Vec3;
use pano_core::color::luminance;

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// One estimate of that change at a real surface seen along `direction`.
    pub(super) fn mirror_change(&self, hit: &RealHit, direction: Vec3, bounces: u32, walk: &mut Walk) -> Vec3 {
        let beyond = self.world.beyond_diffuse(hit);
        if beyond == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let ray = mirror_ray(self.world, hit, direction);
        walk.rays += 1;
        let Some(object) = self.objects.intersect(&ray) else { return Vec3::ZERO };
        walk.rays += 1;
        let behind = self.world.hit(&ray);
        if behind.is_some_and(|real| real.t < object.hit.t) {
            return Vec3::ZERO;
        }
        let bright = luminance(self.world.arriving(ray.direction, behind.as_ref()));
        let share = luminance(beyond) / bright;
        if share.is_nan() || share > 1.0 {
            return Vec3::ZERO;
        }
        let after = self.radiance(ray, First::Object(object), None, bounces - 1, Scene::Mixed, walk);
        after * share - beyond
    }
}
