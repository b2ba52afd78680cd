//! What a ray sees: the nearest of object, ghost and captured depth, shaded (stages I to III of the paper's figure 14).

use super::frame::MAX_LIGHTS;
use super::lights::{Pattern, SphericalLight, Toward};
use super::media::{Media, reflectance, refracted};
use super::shadow::{Lightable, Lit, Real, Turns};
use super::trail::{Path, Trail};
use super::{Lighting, Params};
use crate::bsdf::{gloss_fresnel, masking, sample_visible_normal, shadowing};
use crate::bvh::{InstanceHit, Ray, offset_point};
use crate::directions::{lobe_direction, lobe_pdf, mirrored};
use crate::objects::{Body, Surface};
use crate::tracer::{First, Tracer};
use crate::world::{RealHit, RealWorld};
use glam::{Vec2, Vec3};
use pano_core::color::luminance;
use std::f32::consts::{FRAC_1_PI, PI};

/// Surfaces that a ray passes without being bent: enough for any nesting that is told apart, and an end for faulty meshes.
pub(super) const MAX_CROSSED: usize = 64;
/// A ray that contributes less than this share to its pixel is not followed: a sun of 10⁴ at its end would be one code of 8
/// bits times a few.
pub(super) const LEAST_WEIGHT: f32 = 1e-4;
/// From this roughness on a mirror image of real surfaces is looked up in the convolved panorama.
pub(super) const BLURRED: f32 = 0.5;

/// Width of what a ray of a rough lobe covers, in its α: half of the lobe to each side, of which the samples average.
pub(super) const LOBE_WIDTH: f32 = 1.0;

/// Everything the rays of a frame share.
pub(super) struct Shader<'a, W> {
    pub(super) tracer: Tracer<'a, W>,
    pub(super) lighting: &'a Lighting,
    pub(super) lights: &'a [SphericalLight],
    /// [`Pattern::ladder`].
    pub(super) patterns: Vec<Pattern>,
    /// The points of a light for which surfaces are asked how they respond; no rays go there.
    pub(super) response: Pattern,
    /// The largest luminance that is no light's: the lights are counted apart.
    pub(super) brightest: f32,
    pub(super) params: &'a Params<'a>,
}

/// What a ray meets, past bodies that do not show.
pub(super) struct Met {
    pub(super) first: First,
    /// The media there.
    pub(super) media: Media,
    /// What the media on the way left of the light.
    pub(super) left: Vec3,
}

/// How objects change a real surface.
#[derive(Default)]
pub(super) struct Change {
    /// Irradiance without them.
    pub(super) without: Vec3,
    /// What they change of it.
    pub(super) irradiance: Vec3,
    /// What the surface mirrors without them: of lights, and of what they hide.
    pub(super) highlight: Vec3,
    /// What they change of that.
    pub(super) dimmed: Vec3,
    /// What it mirrors of them.
    pub(super) mirrored: Vec3,
}

impl Change {
    /// The change of a surface that shows `radiance` without the objects: in proportion to its irradiance, as far as that is
    /// not a lamp's own light.
    pub(super) fn of(&self, radiance: Vec3, cap: f32) -> Vec3 {
        let one = |l: f32, e: f32, c: f32| {
            let most = cap * FRAC_1_PI * c.abs();
            // A change that is no number, of a light beyond all numbers, is none.
            if e > 0.0 && most >= 0.0 { (l * (c / e).max(-1.0)).clamp(-most, most) } else { 0.0 }
        };
        let (l, e, c) = (radiance, self.without, self.irradiance);
        let diffuse = Vec3::new(one(l.x, e.x, c.x), one(l.y, e.y, c.y), one(l.z, e.z, c.z));
        (diffuse + self.dimmed * self.is_shown(radiance) + self.mirrored).max(-radiance)
    }

    /// How far a picture with `radiance` here can show the highlight, [0, 1]: one brighter than the picture in any channel is not
    /// in it, and must not be taken from it. The square makes what is taken fall from there on.
    fn is_shown(&self, radiance: Vec3) -> f32 {
        let share = |shown: f32, told: f32| if told > shown { (shown.max(0.0) / told).powi(2) } else { 1.0 };
        let (l, h) = (radiance, self.highlight);
        share(l.x, h.x).min(share(l.y, h.y)).min(share(l.z, h.z))
    }
}

impl<W: RealWorld> Shader<'_, W> {
    /// What `ray` meets first. Bodies with the index of their surroundings that take nothing away are passed as if they were
    /// not there: what lies behind is met by the whole ray, from its beginning.
    ///
    /// `find` is [`RealWorld::hit`], or [`RealWorld::surface`] where the picture is not asked for.
    pub(super) fn meet(
        &self,
        ray: &Ray,
        media: Media,
        look: bool,
        find: impl Fn(&W, &Ray) -> Option<RealHit>,
        rays: &mut u64,
    ) -> Met {
        *rays += 1;
        let (mut media, mut left) = (media, Vec3::ONE);
        let (mut passed, mut beyond) = (0.0, 0.0);
        for _ in 0..MAX_CROSSED {
            let object = if look { self.tracer.objects.intersect_beyond(ray, beyond) } else { None };
            let reach = object.map_or(ray.t_max, |hit| hit.hit.t);
            if let Some(real) = find(self.tracer.world, &ray.up_to(reach)) {
                let left = left * media.transmittance(real.t - passed);
                return Met { first: First::Real(real), media, left };
            }
            let Some(hit) = object else { break };
            left *= media.transmittance(hit.hit.t - passed);
            let surface = self.tracer.objects.surface(ray, &hit);
            let Some(inside) = unseen(&surface, hit.instance, &media) else {
                return Met { first: First::Object(hit), media, left };
            };
            media = inside;
            (passed, beyond) = (hit.hit.t, just_beyond(hit.hit.t));
        }
        Met { first: First::Infinity, media, left: left * media.transmittance(f32::INFINITY) }
    }

    /// Radiance that arrives along a secondary ray.
    fn follow(&self, ray: &Ray, path: Path, roughness: f32, trail: &mut Trail) -> Vec3 {
        if path.depth > self.params.depth || path.weight < LEAST_WEIGHT {
            return self.environment(ray.direction, roughness);
        }
        let met = self.meet(ray, path.media, true, W::hit, &mut trail.walk.rays);
        let path = Path { media: met.media, weight: path.weight * met.left.max_element(), ..path };
        met.left
            * match met.first {
                First::Object(hit) => self.object(ray, &hit, path, trail),
                First::Real(hit) => self.real(ray, &hit, path, trail),
                First::Infinity if roughness == 0.0 => self.tracer.world.infinity(ray.direction),
                First::Infinity => self.environment(ray.direction, roughness),
            }
    }

    /// What the panorama shows in a direction, whatever stands there. Perfect mirrors see it lights and all; rougher lobes get
    /// the lights apart.
    fn environment(&self, direction: Vec3, roughness: f32) -> Vec3 {
        match roughness {
            0.0 => self.tracer.world.environment().look(direction),
            roughness => self.lighting.maps.specular(self.lighting.pano_from_world * direction, roughness),
        }
    }

    /// Radiance that the object at `hit` sends back along `ray`.
    pub(super) fn object(&self, ray: &Ray, hit: &InstanceHit, path: Path, trail: &mut Trail) -> Vec3 {
        let surface = match &path.beam {
            Some(beam) => self.tracer.objects.surface_over(ray, hit, beam, self.params.max_anisotropy),
            None => self.tracer.objects.surface(ray, hit),
        };
        let lobes = surface.bsdf.lobes();
        let normal = surface.bsdf.normal();
        let mut light = surface.emission;
        if let Some(body) = &surface.body {
            light += self.through(ray, hit.instance, &surface, body, path, trail);
        }
        if lobes.diffuse.max_element() > 0.0 {
            light += lobes.diffuse * self.ambient(normal);
        }
        if lobes.specular.max_element() > 0.0 {
            let axis = self.above(mirrored(ray.direction, normal), ray, &surface);
            light += lobes.specular * self.reflection((ray, axis), &surface, lobes.roughness, lobes.specular, path, trail);
        }
        if lobes.diffuse == Vec3::ZERO && (lobes.roughness == 0.0 || surface.bsdf.is_specular()) {
            // Mirrors see the lights in the panorama itself.
            return light;
        }
        let from = |d: Vec3| offset_point(surface.position, surface.bsdf.offset_normal(d));
        let facing = surface.bsdf.offset_normal(-ray.direction);
        let point = Lightable {
            position: surface.position,
            from,
            normal: facing,
            instance: Some(hit.instance),
            shown: path.depth == 0,
            share: path.weight,
        };
        let turns = Turns::new(trail);
        for (i, source) in self.lights.iter().enumerate() {
            let toward = source.seen_from(surface.position);
            let unshadowed = if lobes.specular == Vec3::ZERO && surface.body.is_none() {
                lobes.diffuse * FRAC_1_PI * self.irradiance(&toward, surface.bsdf.normal())
            } else {
                self.unshadowed(&toward, facing, |d| surface.bsdf.eval(d).f_cos)
            };
            if unshadowed != Vec3::ZERO {
                light += unshadowed * self.lit(i, &toward, &point, &path.media, (Real::Blocks, turns.of(i)), trail).reaches;
            }
        }
        light
    }

    /// What a surface sends back of a light that nothing blocks; `f_cos` is its response to a direction above `horizon`.
    fn unshadowed(&self, toward: &Toward, horizon: Vec3, f_cos: impl Fn(Vec3) -> Vec3) -> Vec3 {
        if toward.below(horizon) {
            return Vec3::ZERO;
        }
        let across = toward.axis.any_orthonormal_pair();
        let n = self.response.len();
        let sum: Vec3 = (0..n).map(|i| f_cos(self.response.direction(i, toward, across, Vec2::X))).sum();
        // Irradiance is that of a surface which faces the light: radiance × solid angle × the mean cosine of the cap.
        sum * toward.irradiance * (2.0 / (n as f32 * (1.0 + toward.cos)))
    }

    /// Irradiance of a light that nothing blocks: exact as long as all of it is above the horizon.
    fn irradiance(&self, toward: &Toward, normal: Vec3) -> Vec3 {
        let cos = toward.axis.dot(normal);
        if cos >= toward.sin && toward.cos > 0.0 {
            return toward.irradiance * cos;
        }
        self.unshadowed(toward, normal, |d| Vec3::splat(d.dot(normal).max(0.0)))
    }

    /// Mean radiance by normal, from everything but the lights.
    fn ambient(&self, normal: Vec3) -> Vec3 {
        self.lighting.maps.diffuse(self.lighting.pano_from_world * normal)
    }

    /// `direction`, which leaves a surface on the ray's side; where the shading normal sends it into the surface, as the
    /// geometric one has it.
    fn above(&self, direction: Vec3, ray: &Ray, surface: &Surface<'_>) -> Vec3 {
        let geometric = surface.bsdf.offset_normal(-ray.direction);
        if direction.dot(geometric) > 0.0 { direction } else { mirrored(ray.direction, geometric) }
    }

    /// Mean radiance in the lobe about `axis`. One ray looks for what is there.
    fn reflection(
        &self,
        (ray, axis): (&Ray, Vec3),
        surface: &Surface<'_>,
        roughness: f32,
        weight: Vec3,
        path: Path,
        trail: &mut Trail,
    ) -> Vec3 {
        let direction = if roughness > 0.0 { lobe_direction(axis, roughness, trail.walk.sampler.next_2d()) } else { axis };
        let beam = surface.neighbours.map(|n| match roughness {
            0.0 => n.reflected(ray.direction, surface.bsdf.normal()),
            roughness => n.scattered(direction, LOBE_WIDTH * roughness * roughness),
        });
        let ray = Ray::new(offset_point(surface.position, surface.bsdf.offset_normal(direction)), direction);
        let onward = path.onward(path.media, weight, beam);
        if roughness >= BLURRED {
            // The convolved map holds the real surfaces as well, and without noise.
            return self.follow_objects(&ray, onward, self.environment(axis, roughness), trail);
        }
        self.follow(&ray, onward, roughness, trail)
    }

    /// As [`Self::follow`], with `behind` in place of everything real.
    fn follow_objects(&self, ray: &Ray, path: Path, behind: Vec3, trail: &mut Trail) -> Vec3 {
        if path.depth > self.params.depth || path.weight < LEAST_WEIGHT {
            return behind;
        }
        let met = self.meet(ray, path.media, true, W::surface, &mut trail.walk.rays);
        match met.first {
            First::Object(hit) => met.left * self.object(ray, &hit, Path { media: met.media, ..path }, trail),
            _ => met.left * behind,
        }
    }

    /// Radiance off and through a clear surface: two rays, weighted by the Fresnel term.
    fn through(&self, ray: &Ray, instance: u32, surface: &Surface<'_>, body: &Body, path: Path, trail: &mut Trail) -> Vec3 {
        let out = -ray.direction;
        let shading = surface.bsdf.normal();
        let normal = if surface.outside || body.thin { shading } else { -shading };
        let normal = if normal.dot(out) > 0.0 { normal } else { surface.bsdf.offset_normal(out) };
        let (beyond, eta) = if body.thin { (path.media, 1.0) } else { path.media.beyond(instance, body, surface.outside) };
        // A rough surface is a smooth one of random slope.
        let rough = body.alpha > 0.0 && !body.thin;
        let facet = if rough { facet(normal, out, body.alpha, trail.walk.sampler.next_2d()) } else { normal };
        let reflected = reflectance(body, out.dot(facet).max(0.0), eta);
        let geometric = surface.bsdf.offset_normal(out);
        let beam_of = |direction: Vec3, above: bool| {
            surface.neighbours.map(|n| match () {
                () if rough => n.scattered(direction, LOBE_WIDTH * body.alpha),
                () if above => n.reflected(ray.direction, facet),
                () => n.refracted(ray.direction, facet, eta),
            })
        };
        let mut send = |direction: Vec3, media: Media, weight: Vec3, above: bool| {
            // A facet may send light to the wrong side: it is lost (single scattering).
            if weight == Vec3::ZERO || (direction.dot(geometric) > 0.0) != above {
                return Vec3::ZERO;
            }
            let seen = if rough { visible(normal, out, direction, body.alpha) } else { 1.0 };
            let ray = Ray::new(offset_point(surface.position, surface.bsdf.offset_normal(direction)), direction);
            let onward = path.onward(media, weight, beam_of(direction, above));
            weight * seen * self.follow(&ray, onward, 0.0, trail)
        };
        let mirror = mirrored(ray.direction, facet);
        let mirror = if rough || mirror.dot(geometric) > 0.0 { mirror } else { mirrored(ray.direction, geometric) };
        let mut light = send(mirror, path.media, Vec3::splat(reflected * body.clear), true);
        let bent = if body.thin { Some(ray.direction) } else { refracted(ray.direction, facet, eta) };
        if let Some(direction) = bent {
            light += send(direction, beyond, body.factors * (1.0 - reflected), false);
        }
        light
    }

    /// Radiance of a real surface that a secondary ray sees.
    fn real(&self, ray: &Ray, hit: &RealHit, path: Path, trail: &mut Trail) -> Vec3 {
        let world = self.tracer.world;
        match world.pictured(hit) {
            Some(radiance) => {
                let change = self.change(ray, hit, Real::IfObjectsDo, path, trail);
                (radiance + change.of(radiance, self.params.reflectance_cap)).max(Vec3::ZERO)
            }
            // A ghost of known reflectance is shaded like anything else.
            None => {
                let change = self.change(ray, hit, Real::Always, path, trail);
                let irradiance = change.without + change.irradiance;
                let mirrored = change.highlight + change.dimmed + change.mirrored;
                (world.reflectance(hit) * FRAC_1_PI * irradiance + mirrored).max(Vec3::ZERO)
            }
        }
    }

    /// How objects change the real surface at `hit`; `real` is when it is asked what other real surfaces block.
    pub(super) fn change(&self, ray: &Ray, hit: &RealHit, real: Real, path: Path, trail: &mut Trail) -> Change {
        let origin = self.tracer.world.leave(hit);
        let point = Lightable {
            position: origin,
            from: |_| origin,
            normal: hit.normal,
            instance: None,
            shown: path.depth == 0,
            share: path.weight,
        };
        let turns = Turns::new(trail);
        let mut lits = [Lit::FULLY; MAX_LIGHTS];
        for (i, (source, lit)) in self.lights.iter().zip(&mut lits).enumerate() {
            let toward = source.seen_from(origin);
            if !toward.below(hit.normal) {
                *lit = self.lit(i, &toward, &point, &path.media, (real, turns.of(i)), trail);
            }
        }
        let mut change = Change::default();
        if real == Real::Always || lits.iter().any(|lit| lit.reaches != Vec3::splat(lit.open)) {
            change.without = self.ambient(hit.normal) * PI;
            for (i, (source, lit)) in self.lights.iter().zip(lits).enumerate() {
                let toward = source.seen_from(origin);
                let irradiance = self.irradiance(&toward, hit.normal);
                // Something is blocked: now it counts how much of the other lights arrives at all.
                let unasked = real == Real::IfObjectsDo && lit == Lit::FULLY && irradiance != Vec3::ZERO;
                let open = if unasked { self.open(&toward, &point, turns.of(i), trail) } else { lit.open };
                let highlight = self.highlight(ray, hit, &toward, &path);
                change.without += irradiance * open;
                change.highlight += highlight * open;
                if !unasked {
                    change.irradiance += irradiance * (lit.reaches - lit.open);
                    change.dimmed += highlight * (lit.reaches - lit.open);
                }
            }
        }
        if let Some((before, after)) = self.gloss(ray, hit, origin, path, trail) {
            change.highlight += before;
            change.dimmed -= before;
            change.mirrored += after;
        }
        change
    }

    /// Share of what a real surface mirrors that it sends along `ray`.
    fn gloss_weight(&self, ray: &Ray, hit: &RealHit, path: &Path) -> f32 {
        if path.depth >= self.params.depth { 0.0 } else { gloss_fresnel(-ray.direction.dot(hit.normal)) * self.params.gloss }
    }

    /// What a real surface mirrors of a light that nothing blocks.
    fn highlight(&self, ray: &Ray, hit: &RealHit, toward: &Toward, path: &Path) -> Vec3 {
        let weight = self.gloss_weight(ray, hit, path);
        if weight <= 0.0 {
            return Vec3::ZERO;
        }
        let axis = mirrored(ray.direction, hit.normal);
        let lobe = |d: Vec3| Vec3::splat(lobe_pdf(axis, self.params.gloss_roughness, d));
        weight * self.unshadowed(toward, hit.normal, lobe)
    }

    /// What a real surface mirrors without and with the object that a ray of its lobe meets, but for what it mirrors of the
    /// lights: of these [`Self::lit`] knows better than one ray how much the objects hide.
    fn gloss(&self, ray: &Ray, hit: &RealHit, origin: Vec3, path: Path, trail: &mut Trail) -> Option<(Vec3, Vec3)> {
        let params = self.params;
        let weight = self.gloss_weight(ray, hit, &path);
        if weight <= 0.0 {
            return None;
        }
        let axis = mirrored(ray.direction, hit.normal);
        let direction = lobe_direction(axis, params.gloss_roughness, trail.walk.sampler.next_2d());
        let beam = path.beam.map(|beam| {
            beam.on_plane(ray, hit.t, hit.normal)
                .scattered(direction, LOBE_WIDTH * params.gloss_roughness * params.gloss_roughness)
        });
        let onward = path.onward(path.media, Vec3::splat(weight), beam);
        if direction.dot(hit.normal) <= 0.0 || onward.weight < LEAST_WEIGHT {
            return None;
        }
        let ray = Ray::new(origin, direction);
        let met = self.meet(&ray, path.media, true, W::surface, &mut trail.walk.rays);
        let First::Object(object) = met.first else { return None };
        let radiance = met.left * self.object(&ray, &object, Path { media: met.media, ..onward }, trail);
        trail.walk.rays += 1;
        let behind = match self.tracer.world.hit(&ray) {
            Some(real) => self.tracer.world.pictured(&real).unwrap_or_else(|| self.tracer.world.infinity(direction)),
            None => self.tracer.world.infinity(direction),
        };
        let lamp = luminance(behind) / self.brightest;
        Some((behind * weight / lamp.max(1.0), radiance * weight))
    }
}

/// Where a ray goes on that has crossed a face at `t`: past it and past its copies along shared edges.
pub(super) fn just_beyond(t: f32) -> f32 {
    t * (1.0 + 1e-6) + 1e-7
}

/// The media beyond a surface that cannot be seen: clear, with the index of its surroundings, and nothing taken away.
fn unseen(surface: &Surface<'_>, instance: u32, media: &Media) -> Option<Media> {
    let body = surface.body.filter(|b| !b.thin && b.factors == Vec3::ONE && surface.emission == Vec3::ZERO)?;
    let (beyond, eta) = media.beyond(instance, &body, surface.outside);
    let clear = !body.absorption.distance.is_finite() || body.absorption.color == Vec3::ONE;
    (eta == 1.0 && clear).then_some(beyond)
}

/// A microfacet of a rough surface with unit `normal`, as seen from unit direction `out`.
fn facet(normal: Vec3, out: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let (a, b) = normal.any_orthonormal_pair();
    let local = Vec3::new(out.dot(a), out.dot(b), out.dot(normal).max(0.0));
    let half = sample_visible_normal(local, alpha, u);
    a * half.x + b * half.y + normal * half.z
}

/// Share of the light along `direction` that other facets do not block, of what is seen from `out`.
fn visible(normal: Vec3, out: Vec3, direction: Vec3, alpha: f32) -> f32 {
    let (o, i) = (out.dot(normal).abs().max(1e-6), direction.dot(normal).abs().max(1e-6));
    shadowing(o, i, alpha) / masking(o, alpha)
}
