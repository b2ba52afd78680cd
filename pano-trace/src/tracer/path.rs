//! Path tracing of objects and real surfaces together, or of the real world alone.

use super::{Mis, Tracer, Walk};
use crate::bsdf::Bsdf;
use crate::bvh::{InstanceHit, Ray, offset_point};
use crate::world::{RealHit, RealWorld};
use glam::{Vec2, Vec3};

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub(crate) enum First {
    Object(InstanceHit),
    Real(RealHit),
    Infinity,
}

/// Which surfaces a path can meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scene {
    /// Real surfaces and virtual objects.
    #[default]
    Mixed,
    /// Real surfaces only.
    Real,
}

/// A vertex at which a path scatters.
pub(super) struct Vertex<'a> {
    pub(super) bsdf: Bsdf<'a>,
    /// For objects the surface point; for real surfaces the point from which rays leave.
    pub(super) position: Vec3,
    pub(super) on_object: bool,
}

impl Vertex<'_> {
    #[inline]
    pub(super) fn leave(&self, direction: Vec3) -> Vec3 {
        if self.on_object { offset_point(self.position, self.bsdf.offset_normal(direction)) } else { self.position }
    }
}

/// Below this throughput paths are thinned out by Russian roulette, after this many bounces. Both only shift noise.
pub(super) const ROULETTE_FROM: u32 = 4;

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// What the ray meets first.
    #[inline]
    pub(crate) fn first(&self, ray: &Ray, scene: Scene, walk: &mut Walk) -> First {
        walk.rays += 1;
        let object = if scene == Scene::Mixed { self.objects.intersect(ray) } else { None };
        let real = self.world.hit(&ray.up_to(object.map_or(ray.t_max, |h| h.hit.t)));
        match (real, object) {
            (Some(real), _) => First::Real(real),
            (None, Some(object)) => First::Object(object),
            (None, None) => First::Infinity,
        }
    }

    /// Density with which light sampling finds `direction`, at whose end is `first`.
    #[inline]
    fn light_pdf(&self, scene: Scene, ray: &Ray, first: &First) -> f32 {
        let share = self.world_share(scene);
        match first {
            First::Object(hit) => (1.0 - share) * self.objects.emitter_pdf(ray, hit),
            First::Real(hit) => share * self.world.light_pdf(ray.origin, ray.direction, Some(hit)),
            First::Infinity => share * self.world.light_pdf(ray.origin, ray.direction, None),
        }
    }

    /// Share of light samples aimed at the real world; the others are aimed at shining objects.
    #[inline]
    fn world_share(&self, scene: Scene) -> f32 {
        match scene {
            Scene::Mixed if self.objects.emit() && self.world.environment().light.is_none() => 0.0,
            Scene::Mixed if self.objects.emit() => 0.5,
            _ => 1.0,
        }
    }

    /// Radiance that arrives along `ray`, which meets `first`, after at most `bounces` scattering events. `found_by` is the
    /// density with which the ray's direction was found; `None`: light sampling was not tried for it.
    pub(crate) fn radiance(
        &self,
        mut ray: Ray,
        mut first: First,
        mut found_by: Option<f32>,
        bounces: u32,
        scene: Scene,
        walk: &mut Walk,
    ) -> Vec3 {
        let mut light = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        let mut from_object = false;
        for depth in 0.. {
            let remaining = bounces - depth;
            let weight = |tracer: &Self, first: &First| match (found_by, tracer.params.mis) {
                (None, _) | (_, Mis::BsdfOnly) => 1.0,
                (_, Mis::LightOnly) => 0.0,
                (Some(pdf), Mis::Balance) => tracer.balance(pdf, tracer.light_pdf(scene, &ray, first)),
            };
            let vertex = match &first {
                First::Infinity => {
                    let radiance = self.world.infinity(ray.direction);
                    if radiance != Vec3::ZERO {
                        light += throughput * radiance * weight(self, &first);
                    }
                    break;
                }
                First::Real(hit) => {
                    let told = if from_object { self.world.sent_back(hit, ray.direction) } else { hit.radiance };
                    if let Some(radiance) = told {
                        light += throughput * radiance * weight(self, &first);
                        if scene == Scene::Mixed && remaining > 0 && self.params.second_order {
                            let image = from_object && found_by.is_none();
                            let change = if image { Self::delta_of_an_image } else { Self::delta_once };
                            light += throughput * change(self, hit, remaining, walk);
                        }
                        break;
                    }
                    if remaining == 0 {
                        break;
                    }
                    let bsdf = Bsdf::lambert(self.world.reflectance(hit), hit.normal, -ray.direction);
                    Vertex { bsdf, position: self.world.leave(hit), on_object: false }
                }
                First::Object(hit) => {
                    let surface = self.objects.surface(&ray, hit);
                    throughput *= surface.transmittance;
                    if surface.emission != Vec3::ZERO {
                        light += throughput * surface.emission * weight(self, &first);
                    }
                    Vertex { bsdf: surface.bsdf, position: surface.position, on_object: true }
                }
            };
            if remaining == 0 {
                break;
            }
            if !vertex.bsdf.is_specular() && self.params.mis != Mis::BsdfOnly {
                light += throughput * self.sample_direct(&vertex, scene, walk);
            }
            let Some(sample) = vertex.bsdf.sample(walk.sampler.next_4d()) else { break };
            throughput *= sample.weight;
            if depth >= ROULETTE_FROM {
                let survive = throughput.max_element().min(1.0);
                if walk.sampler.next_1d() >= survive {
                    break;
                }
                throughput /= survive;
            }
            if throughput == Vec3::ZERO {
                break;
            }
            found_by = (!sample.specular).then_some(sample.pdf_solid_angle);
            from_object = vertex.on_object;
            ray = Ray::new(vertex.leave(sample.direction), sample.direction);
            first = self.first(&ray, scene, walk);
        }
        light
    }

    /// Next event estimation: light from the real world and from shining objects that arrives at a vertex directly.
    pub(super) fn sample_direct(&self, vertex: &Vertex<'_>, scene: Scene, walk: &mut Walk) -> Vec3 {
        let u = walk.sampler.next_4d();
        let share = self.world_share(scene);
        let weigh = |f_cos: Vec3, pdf_light: f32, pdf_bsdf: f32| match self.params.mis {
            Mis::Balance => f_cos / (pdf_light + pdf_bsdf),
            _ => f_cos / pdf_light,
        };
        if u[2] >= share {
            // The unused half of the choosing number picks the face.
            let picked = [u[0], u[1], (u[2] - share) / (1.0 - share), u[3]];
            let Some(sample) = self.objects.sample_emitter(vertex.position, picked) else { return Vec3::ZERO };
            // Aimed from where the ray starts: a face close by or seen edge on is missed from elsewhere.
            let origin = vertex.leave(sample.direction);
            let to = sample.point - origin;
            let distance = to.length();
            let ray = Ray::new(origin, to / distance).up_to(distance * 1.001);
            let value = vertex.bsdf.eval(ray.direction);
            if value.f_cos == Vec3::ZERO {
                return Vec3::ZERO;
            }
            let first = self.first(&ray, scene, walk);
            let First::Object(hit) = first else { return Vec3::ZERO };
            if hit.hit.t < distance * 0.999 {
                return Vec3::ZERO;
            }
            let pdf = (1.0 - share) * self.objects.emitter_pdf(&ray, &hit);
            if pdf <= 0.0 {
                return Vec3::ZERO;
            }
            return weigh(value.f_cos, pdf, value.pdf_solid_angle) * self.objects.surface(&ray, &hit).emission;
        }
        let Some(sample) = self.world.sample_light(vertex.position, Vec2::new(u[0], u[1])) else { return Vec3::ZERO };
        let value = vertex.bsdf.eval(sample.direction);
        if value.f_cos == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let ray = Ray::new(vertex.leave(sample.direction), sample.direction);
        walk.rays += 1;
        let Some(behind) = self.world.reach(&ray, &sample) else { return Vec3::ZERO };
        let reach = behind.as_ref().map_or(f32::INFINITY, |b| b.t);
        if scene == Scene::Mixed && self.objects.occluded(&ray.up_to(reach)) {
            return Vec3::ZERO;
        }
        let radiance = match &behind {
            Some(hit) if vertex.on_object => self.world.sent_back(hit, sample.direction).unwrap_or(Vec3::ZERO),
            behind => self.world.arriving(sample.direction, behind.as_ref()),
        };
        let pdf = share * self.world.light_pdf(ray.origin, sample.direction, behind.as_ref());
        if pdf > 0.0 { weigh(value.f_cos, pdf, value.pdf_solid_angle) * radiance } else { Vec3::ZERO }
    }
}
