//! Image-based lighting: the panorama at infinity lights the objects, nothing blocks it, and nothing real changes.

use super::{Tracer, Walk};
use crate::bvh::{InstanceHit, Ray};
use crate::world::RealWorld;
use glam::{Vec2, Vec3};

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// Radiance that an object sends back along `ray`.
    pub(super) fn image_based(&self, ray: &Ray, hit: &InstanceHit, walk: &mut Walk) -> Vec3 {
        let environment = self.world.environment();
        let surface = self.objects.surface(ray, hit);
        let mut light = surface.emission;
        if !surface.bsdf.is_specular() {
            let u = walk.sampler.next_2d();
            if let Some(d) = environment.sample(Vec2::new(u.x, u.y)) {
                let value = surface.bsdf.eval(d);
                let pdf = environment.pdf(d);
                if pdf > 0.0 {
                    light += value.f_cos * environment.look(d) / (pdf + value.pdf_solid_angle);
                }
            }
        }
        if let Some(s) = surface.bsdf.sample(walk.sampler.next_4d()) {
            let weight = if s.specular { 1.0 } else { self.balance(s.pdf_solid_angle, environment.pdf(s.direction)) };
            light += s.weight * environment.look(s.direction) * weight;
        }
        light
    }
}
