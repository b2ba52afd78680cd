//! What one sample sees.

use super::frame::MAX_LIGHTS;
use super::{Lighting, Params};
use crate::bsdf::{Lobes, gloss_fresnel};
use crate::bvh::{InstanceHit, Ray, offset_point};
use crate::directions::{cap_direction, cosine_direction, lobe_direction};
use crate::objects::Surface;
use crate::tracer::{First, Scene, Tracer, Walk};
use crate::world::{RealHit, RealWorld};
use glam::Vec3;
use pano_core::light::DirectionalLight;
use std::f32::consts::PI;

/// Reflections and refractions that a ray goes through: enough to enter and leave a hollow glass.
pub(super) const MAX_DEPTH: u32 = 6;
/// Roughness of the map that tells what lies behind a blocker: half of what it shows comes from within 27°.
pub(super) const BEHIND_ROUGHNESS: f32 = 0.5;

/// Everything the samples of a frame share.
pub(super) struct Shader<'a, W> {
    pub(super) tracer: Tracer<'a, W>,
    pub(super) lighting: &'a Lighting,
    pub(super) params: &'a Params<'a>,
}

/// What a light gives to a point, in one sample.
struct Sun {
    direction: Vec3,
    intensity: Vec3,
    visible: bool,
}

impl<W: RealWorld> Shader<'_, W> {
    /// The lights that count.
    pub(super) fn lights(&self) -> &[DirectionalLight] {
        &self.lighting.lights[..self.lighting.lights.len().min(MAX_LIGHTS)]
    }

    /// Radiance that the object at `hit` sends back along `ray`; `shadows` counts, per light, the samples it reaches.
    pub(super) fn object(&self, ray: &Ray, hit: &InstanceHit, depth: u32, walk: &mut Walk, shadows: &mut [u32]) -> Vec3 {
        let surface = self.tracer.objects.surface(ray, hit);
        let lobes = surface.bsdf.lobes();
        let mut light = surface.emission;
        if lobes.transmission > 0.0 {
            return (light + self.through(&surface, depth, walk)) * surface.transmittance;
        }
        if lobes.diffuse.max_element() > 0.0 {
            light += lobes.diffuse * self.ambient(&surface, depth, walk);
        }
        for (i, source) in self.lights().iter().enumerate() {
            let from = |d: Vec3| offset_point(surface.position, surface.bsdf.offset_normal(d));
            let sun = self.sun(source, from, surface.bsdf.normal(), walk);
            if sun.visible {
                light += surface.bsdf.eval(sun.direction).f_cos * sun.intensity;
                if let Some(count) = shadows.get_mut(i) {
                    *count += 1;
                }
            }
        }
        // Last, so that the random numbers of ambient light and lamps do not depend on what is mirrored.
        if lobes.specular.max_element() > 0.0 {
            light += lobes.specular * self.mirrored(ray, &surface, &lobes, depth, walk);
        }
        light * surface.transmittance
    }

    /// Mean radiance by normal. One ray looks for what is in the way of it.
    fn ambient(&self, surface: &Surface<'_>, depth: u32, walk: &mut Walk) -> Vec3 {
        let normal = surface.bsdf.normal();
        let open = self.lighting.maps.diffuse(self.lighting.pano_from_world * normal);
        if depth > 0 || !self.params.ambient_occlusion {
            return open;
        }
        let direction = cosine_direction(normal, walk.sampler.next_2d());
        let ray = Ray::new(offset_point(surface.position, surface.bsdf.offset_normal(direction)), direction);
        // The map's mean stays for all rays that are free; a blocked one gives up what lies behind.
        open + self.blocked(&ray, walk)
    }

    /// By how much the nearest object on the ray changes the light that arrives along it.
    ///
    /// What it reflects counts at most as much as what it hides: where things touch, their undersides lie in a shadow that is
    /// not traced, and would light up the ground.
    fn blocked(&self, ray: &Ray, walk: &mut Walk) -> Vec3 {
        let Some(hit) = self.object_in_sight(ray, walk) else { return Vec3::ZERO };
        let surface = self.tracer.objects.surface(ray, &hit);
        let lobes = surface.bsdf.lobes();
        let behind = self.environment(ray.direction);
        if lobes.transmission > 0.0 {
            // Glass lets through, roughly, what lies behind it.
            return behind * (lobes.transmission - 1.0);
        }
        let to_map = self.lighting.pano_from_world;
        let normal = surface.bsdf.normal();
        let mirrored = ray.direction - normal * (2.0 * ray.direction.dot(normal));
        let reflected = lobes.diffuse * self.lighting.maps.diffuse(to_map * normal)
            + lobes.specular * self.lighting.maps.specular(to_map * mirrored, lobes.roughness);
        surface.emission + reflected.min(behind) - behind
    }

    /// The object that lies first along the ray, if no real surface lies before it: what stands behind a wall neither darkens nor
    /// shows on this side of it.
    fn object_in_sight(&self, ray: &Ray, walk: &mut Walk) -> Option<InstanceHit> {
        walk.rays += 1;
        let object = self.tracer.objects.intersect(ray)?;
        walk.rays += 1;
        (!self.tracer.world.blocks(&ray.up_to(object.hit.t))).then_some(object)
    }

    /// Mean radiance in the lobe about the mirrored direction. A ray of the lobe looks for objects and real surfaces there.
    fn mirrored(&self, ray: &Ray, surface: &Surface<'_>, lobes: &Lobes, depth: u32, walk: &mut Walk) -> Vec3 {
        let normal = surface.bsdf.normal();
        let axis = ray.direction - normal * (2.0 * ray.direction.dot(normal));
        let free = |d: Vec3| match lobes.roughness {
            // A perfect mirror shows the panorama, lights and all; rougher lobes get the lights apart.
            0.0 => self.tracer.world.infinity(d),
            roughness => self.lighting.maps.specular(self.lighting.pano_from_world * d, roughness),
        };
        if depth >= MAX_DEPTH {
            return free(axis);
        }
        let direction = if lobes.roughness > 0.0 { lobe_direction(axis, lobes.roughness, walk.sampler.next_2d()) } else { axis };
        let ray = Ray::new(offset_point(surface.position, surface.bsdf.offset_normal(direction)), direction);
        match self.tracer.first(&ray, Scene::Mixed, walk) {
            First::Object(hit) => self.object(&ray, &hit, depth + 1, walk, &mut []),
            // The lower half of the maps holds the ground as well; a mirror shows the very point.
            First::Real(hit) if lobes.roughness < 0.5 => self.photo_at(&hit, &ray),
            _ => free(axis),
        }
    }

    /// Radiance from a body that lets light in: one of its lobes is followed.
    fn through(&self, surface: &Surface<'_>, depth: u32, walk: &mut Walk) -> Vec3 {
        let Some(sample) = surface.bsdf.sample(walk.sampler.next_4d()).filter(|_| depth < MAX_DEPTH) else { return Vec3::ZERO };
        let ray = Ray::new(offset_point(surface.position, surface.bsdf.offset_normal(sample.direction)), sample.direction);
        let incoming = match self.tracer.first(&ray, Scene::Mixed, walk) {
            First::Object(hit) => self.object(&ray, &hit, depth + 1, walk, &mut []),
            First::Real(hit) => self.photo_at(&hit, &ray),
            First::Infinity => self.tracer.world.infinity(sample.direction),
        };
        sample.weight * incoming
    }

    /// Change of the irradiance at a real surface, relative to what it is without objects, and what it mirrors of them.
    pub(super) fn real(&self, ray: &Ray, hit: &RealHit, walk: &mut Walk, shadows: &mut [u32]) -> (Vec3, Vec3) {
        let origin = self.tracer.world.leave(hit);
        let mut without = self.lighting.maps.diffuse(self.lighting.pano_from_world * hit.normal) * PI;
        let mut change = Vec3::ZERO;
        if self.params.ambient_occlusion {
            let direction = cosine_direction(hit.normal, walk.sampler.next_2d());
            change += self.blocked(&Ray::new(origin, direction), walk) * PI;
        }
        for (source, count) in self.lights().iter().zip(shadows) {
            without += source.intensity * source.direction.dot(hit.normal).max(0.0);
            let sun = self.sun(source, |_| origin, hit.normal, walk);
            if sun.visible {
                *count += 1;
            } else {
                change -= sun.intensity * sun.direction.dot(hit.normal).max(0.0);
            }
        }
        let ratio = |c: f32, e: f32| if e > 0.0 { (c / e).max(-1.0) } else { 0.0 };
        let relative = Vec3::new(ratio(change.x, without.x), ratio(change.y, without.y), ratio(change.z, without.z));
        (relative, self.gloss(ray, hit, origin, walk))
    }

    /// Change of the mirror image in a real surface.
    fn gloss(&self, ray: &Ray, hit: &RealHit, origin: Vec3, walk: &mut Walk) -> Vec3 {
        if self.params.gloss <= 0.0 {
            return Vec3::ZERO;
        }
        let cos = -ray.direction.dot(hit.normal);
        let axis = ray.direction + hit.normal * (2.0 * cos);
        let direction = lobe_direction(axis, self.params.gloss_roughness, walk.sampler.next_2d());
        if direction.dot(hit.normal) <= 0.0 {
            return Vec3::ZERO;
        }
        let ray = Ray::new(origin, direction);
        let Some(object) = self.object_in_sight(&ray, walk) else { return Vec3::ZERO };
        let fresnel = gloss_fresnel(cos);
        let radiance = self.object(&ray, &object, 1, walk, &mut []);
        let behind = self.lighting.maps.specular(self.lighting.pano_from_world * direction, self.params.gloss_roughness);
        (radiance - behind) * (fresnel * self.params.gloss)
    }

    /// What the clamped panorama shows behind something, blurred: it has patches as bright as the threshold, which would make
    /// single rays noise.
    fn environment(&self, direction: Vec3) -> Vec3 {
        self.lighting.maps.specular(self.lighting.pano_from_world * direction, BEHIND_ROUGHNESS)
    }

    /// What the panorama shows of a real point.
    fn photo_at(&self, hit: &RealHit, ray: &Ray) -> Vec3 {
        let seen = (hit.position - self.lighting.capture).try_normalize().unwrap_or(ray.direction);
        hit.radiance.unwrap_or_else(|| self.tracer.world.infinity(seen))
    }

    /// A point of the light's disc, and whether objects hide it from a surface with `normal`. Lights below the surface's horizon
    /// are hidden by the surface itself.
    fn sun(&self, source: &DirectionalLight, from: impl Fn(Vec3) -> Vec3, normal: Vec3, walk: &mut Walk) -> Sun {
        let u = walk.sampler.next_2d();
        let direction = cap_direction(source.direction, source.cos_radius().max(-1.0), u);
        let lit = direction.dot(normal) > 0.0;
        let visible = lit
            && (!self.params.shadows || {
                let ray = Ray::new(from(direction), direction);
                walk.rays += 1;
                !self.tracer.objects.occluded(&ray) || self.object_in_sight(&ray, walk).is_none()
            });
        Sun { direction, intensity: source.intensity, visible }
    }
}
