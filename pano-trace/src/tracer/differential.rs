//! The baselines: differential rendering in two passes and in one.

use super::path::{First, Scene, Vertex};
use super::{Mis, Tracer, Walk};
use crate::bsdf::Bsdf;
use crate::bvh::Ray;
use crate::world::{RealHit, RealWorld};
use glam::{Vec2, Vec3};

impl<'a, W: RealWorld> Tracer<'a, W> {
    fn real_vertex(&self, hit: &RealHit) -> Vertex<'static> {
        // Lambert looks the same from everywhere on its side.
        let bsdf = Bsdf::lambert(self.world.reflectance(hit), hit.normal, hit.normal);
        Vertex { bsdf, position: self.world.leave(hit), on_object: false }
    }

    /// Radiance that a real surface sends out in `scene`, after at most `bounces` ≥ 1 scattering events. Its emission, the
    /// same in both scenes, is left out.
    pub(super) fn outgoing(&self, hit: &RealHit, bounces: u32, scene: Scene, walk: &mut Walk) -> Vec3 {
        let vertex = self.real_vertex(hit);
        let mut light = Vec3::ZERO;
        if self.params.mis != Mis::BsdfOnly {
            light += self.sample_direct(&vertex, scene, walk);
        }
        if let Some(s) = vertex.bsdf.sample(walk.sampler.next_4d()) {
            let ray = Ray::new(vertex.leave(s.direction), s.direction);
            let first = self.first(&ray, scene, walk);
            light += s.weight * self.radiance(ray, first, Some(s.pdf_solid_angle), bounces - 1, scene, walk);
        }
        light
    }

    /// Two-pass differential rendering: both solutions with numbers of their own.
    pub(super) fn two_pass(&self, hit: &RealHit, bounces: u32, walk: &mut Walk) -> Vec3 {
        self.outgoing(hit, bounces, Scene::Mixed, walk) - self.outgoing(hit, bounces, Scene::Real, walk)
    }

    /// One-pass differential rendering: (mixed, real) along the same directions, each ray of which asks for both scenes.
    /// Shining objects are found by BSDF sampling only.
    pub(super) fn one_pass(&self, hit: &RealHit, bounces: u32, walk: &mut Walk) -> (Vec3, Vec3) {
        let vertex = self.real_vertex(hit);
        let (mut mixed, mut real) = (Vec3::ZERO, Vec3::ZERO);
        let weigh = |mine: f32, other: f32| match self.params.mis {
            Mis::Balance => self.balance(mine, other),
            _ => 1.0,
        };
        let u = walk.sampler.next_4d();
        if self.params.mis != Mis::BsdfOnly
            && let Some(sample) = self.world.sample_light(vertex.position, Vec2::new(u[0], u[1]))
        {
            let value = vertex.bsdf.eval(sample.direction);
            let ray = Ray::new(vertex.position, sample.direction);
            walk.rays += 2;
            if value.pdf_solid_angle > 0.0
                && let Some(behind) = self.world.reach(&ray, &sample)
            {
                let pdf = self.world.light_pdf(ray.origin, ray.direction, behind.as_ref());
                let radiance = self.world.arriving(ray.direction, behind.as_ref());
                if pdf > 0.0 {
                    let light = value.f_cos * radiance * (weigh(pdf, value.pdf_solid_angle) / pdf);
                    real += light;
                    if !self.objects.occluded(&ray.up_to(behind.as_ref().map_or(f32::INFINITY, |b| b.t))) {
                        mixed += light;
                    }
                }
            }
        }
        let Some(s) = vertex.bsdf.sample(walk.sampler.next_4d()) else { return (mixed, real) };
        let ray = Ray::new(vertex.position, s.direction);
        walk.rays += 2;
        let behind = self.world.hit(&ray);
        let object = self.objects.intersect(&ray.up_to(behind.as_ref().map_or(f32::INFINITY, |b| b.t)));
        let weight = match self.params.mis {
            Mis::LightOnly => 0.0,
            _ => weigh(s.pdf_solid_angle, self.world.light_pdf(ray.origin, ray.direction, behind.as_ref())),
        };
        if let Some(object) = object {
            mixed += s.weight * self.radiance(ray, First::Object(object), None, bounces - 1, Scene::Mixed, walk);
        }
        match &behind {
            Some(next) if next.radiance.is_none() => {
                if object.is_some() {
                    real += s.weight * self.radiance(ray, First::Real(*next), None, bounces - 1, Scene::Real, walk);
                } else if bounces > 1 {
                    let (m, r) = self.one_pass(next, bounces - 1, walk);
                    mixed += s.weight * m;
                    real += s.weight * r;
                }
            }
            end => {
                let light = s.weight * self.world.arriving(ray.direction, end.as_ref()) * weight;
                real += light;
                if object.is_none() {
                    mixed += light;
                    if let Some(next) = end
                        && bounces > 1
                        && self.params.second_order
                    {
                        mixed += s.weight * self.delta_once(next, bounces - 1, walk);
                    }
                }
            }
        }
        (mixed, real)
    }
}
