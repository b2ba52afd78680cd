//! What of a light reaches a point: hard, soft and adaptive soft shadows (section IV.E), through clear bodies, too.

use super::lights::{Pattern, SphericalLight, Toward};
use super::media::{Media, reflectance};
use super::shade::{MAX_CROSSED, Shader, just_beyond};
use super::survey::{Agreed, Looks, Sums, Survey};
use super::trail::Trail;
use super::{Params, Shadow};
use crate::bvh::Ray;
use crate::objects::Ball;
use crate::tracer::First;
use crate::world::RealWorld;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Values of probes that differ by less are alike: a step in 8 bits.
pub(super) const ALIKE: f32 = 1.0 / 256.0;

/// The probes that make sure of what is known of the same surface: two opposite points of the rim.
pub(super) const SECOND_LOOKS: Range<usize> = 1..3;
/// How many probes tell whether real surfaces keep the light from a real point: the middle and two opposite points of the rim.
/// The photo shows these shadows already; only what objects take away there counts.
pub(super) const REAL_PROBES: usize = 3;
/// The one that makes sure.
pub(super) const SECOND_REAL_LOOK: Range<usize> = 1..2;

/// A light at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lit {
    /// Share of it that real surfaces let through; 1 where that was not asked.
    pub(super) open: f32,
    /// Share of it, per channel, that arrives past real surfaces and objects.
    pub(super) reaches: Vec3,
}

impl Lit {
    pub(super) const FULLY: Self = Self { open: 1.0, reaches: Vec3::ONE };
}

/// When it is asked what real surfaces let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Real {
    /// For each sample that gets past the objects.
    Blocks,
    /// Only if an object is in the way of a probe.
    IfObjectsDo,
    /// For each sample, whatever the objects do.
    Always,
}

/// A point that is lit.
#[derive(Clone, Copy)]
pub(super) struct Lightable<F> {
    /// The point itself.
    pub(super) position: Vec3,
    /// Where a ray in a direction leaves it.
    pub(super) from: F,
    /// Unit normal: light from below its horizon does not count.
    pub(super) normal: Vec3,
    /// The object it is on; `None`: a real surface.
    pub(super) instance: Option<u32>,
    /// It is what a pixel shows, not what something shows of it.
    pub(super) shown: bool,
    /// What it counts for of its pixel, (0, 1].
    pub(super) share: f32,
}

/// The golden share of a turn.
pub(super) const GOLDEN: f32 = 0.618_034;

/// By how much the samples of each light are turned at one point. The number is drawn whatever follows, so that a shadow does
/// not change the numbers of what comes after it.
#[derive(Clone, Copy)]
pub(super) struct Turns(f32);

impl Turns {
    pub(super) fn new(trail: &mut Trail) -> Self {
        Self(trail.walk.sampler.next_1d())
    }

    /// Of light number `light`: one number serves all, each a golden share of a turn on.
    pub(super) fn of(self, light: usize) -> Vec2 {
        Vec2::from_angle((self.0 + GOLDEN * light as f32) * std::f32::consts::TAU)
    }
}

/// What the samples of one light have found at pixels' first hits, as bits per light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Verdicts {
    pub(super) bright: u32,
    pub(super) dark: u32,
    /// Samples of one point have disagreed.
    pub(super) penumbra: u32,
}

impl Verdicts {
    pub(super) fn join(&mut self, other: Self) {
        self.bright |= other.bright;
        self.dark |= other.dark;
        self.penumbra |= other.penumbra;
    }

    /// The lights about which the neighbours say something that the probes here have not seen.
    pub(super) fn doubted_by(&self, neighbours: &Self) -> bool {
        let agreed = (self.bright | self.dark) & !self.penumbra;
        let other_side = (self.bright & neighbours.dark) | (self.dark & neighbours.bright);
        agreed & (neighbours.penumbra | other_side) != 0
    }
}

impl<W: RealWorld> Shader<'_, W> {
    /// What of light number `light`, seen as `toward`, reaches a point in `media`; the light's samples are turned by `turn`.
    pub(super) fn lit(
        &self,
        light: usize,
        toward: &Toward,
        point: &Lightable<impl Fn(Vec3) -> Vec3>,
        media: &Media,
        (real, turn): (Real, Vec2),
        trail: &mut Trail,
    ) -> Lit {
        let params: &Params<'_> = self.params;
        if !params.shadows {
            return Lit::FULLY;
        }
        // All samples everywhere is the algorithm without any optimisation, to compare with.
        let objects_reach = params.shadow == Shadow::Soft || self.objects_may_block(toward, point.position);
        let pattern = self.pattern(point.share);
        let all = pattern.len();
        // Doubt is about what a pixel itself shows, and about objects: real shadows on real surfaces are in the photo.
        let settle = params.shadow == Shadow::Adaptive && point.shown;
        let looks = |certain: bool, probes: usize, again: Range<usize>| match params.shadow {
            Shadow::Adaptive if !certain && probes < all => Looks { first: 0..probes, again },
            _ => Looks { first: 0..all, again: 0..all },
        };
        let thorough = trail.thorough && point.shown;
        let object_looks = looks(thorough, params.probes as usize, SECOND_LOOKS);
        let real_looks = match real {
            Real::IfObjectsDo => looks(false, REAL_PROBES, SECOND_REAL_LOOK),
            _ => object_looks.clone(),
        };
        let known = if settle { trail.consensus.at(light, point) } else { Agreed::default() };
        if !objects_reach && real == Real::IfObjectsDo {
            if settle {
                trail.consensus.keep(light, point, Agreed { passes: Some(Vec3::ONE), ..known });
            }
            trail.note(light, point, Lit::FULLY, true, false);
            return Lit::FULLY;
        }
        let across = toward.axis.any_orthonormal_pair();
        let ray_to = |i: usize| self.ray_to(pattern.direction(i, toward, across, turn), toward, point);
        let ask_objects = |i: usize, trail: &mut Trail| Some(self.transmittance(&ray_to(i)?, media, trail));
        let ask_real = |i: usize, objects: &Survey<Vec3>, trail: &mut Trail| {
            // What objects block anyway is not asked about.
            let blocked = real == Real::Blocks && objects.of(i) == Some(Vec3::ZERO);
            let ray = if blocked { None } else { ray_to(i) }?;
            trail.shadow_rays += 1;
            Some(!self.tracer.world.blocks(&ray))
        };

        let passes = if objects_reach { known.passes } else { Some(Vec3::ONE) };
        let mut objects = Survey::new(passes, |a, b| (a - b).abs().max_element() < ALIKE);
        let mut surfaces = Survey::new(known.open, |a, b| a == b);
        let (mut lit, mut penumbra) = (Lit::FULLY, false);
        // What real surfaces are known to keep in the dark, objects cannot darken: only that is made sure of.
        let dark = real == Real::IfObjectsDo
            && known.open == Some(false)
            && surfaces.begin(&real_looks, |i| ask_real(i, &objects, trail)) == Some(false);
        if objects_reach && !dark {
            objects.begin(&object_looks, |i| ask_objects(i, trail));
        }
        let clear = real == Real::IfObjectsDo && !dark && objects.answers().all(|passes| passes == Vec3::ONE);
        if !clear {
            if !dark && surfaces.begin(&real_looks, |i| ask_real(i, &objects, trail)) != Some(false) {
                objects.finish(all, |i| ask_objects(i, trail));
                surfaces.finish(all, |i| ask_real(i, &objects, trail));
            }
            let sums = match (objects.agreed(), surfaces.agreed()) {
                (Some(Vec3::ZERO), None) if real == Real::Blocks => Sums::of([(false, Vec3::ZERO)]),
                (_, Some(false)) => Sums::of([(false, Vec3::ZERO)]),
                (Some(passes), Some(true)) => Sums::of([(true, passes)]),
                _ => Sums::of((0..all).filter(|&i| ray_to(i).is_some()).map(|i| {
                    let open = surfaces.of(i) == Some(true);
                    (open, objects.of(i).filter(|_| open).unwrap_or(Vec3::ZERO))
                })),
            };
            (lit, penumbra) = (sums.mean(), !sums.agree());
        }
        if settle {
            let passes = if clear { Some(Vec3::ONE) } else { objects.agreed() };
            trail.consensus.keep(light, point, Agreed { open: surfaces.agreed(), passes });
        }
        // Of a real surface it is the objects' part that shows.
        let most = if real == Real::Blocks { 1.0 } else { lit.open };
        trail.note(light, point, lit, (most - lit.reaches).max_element() < ALIKE, penumbra);
        lit
    }

    /// Share of a light that real surfaces let through to a point, as far as the probes tell.
    pub(super) fn open(&self, toward: &Toward, point: &Lightable<impl Fn(Vec3) -> Vec3>, turn: Vec2, trail: &mut Trail) -> f32 {
        let across = toward.axis.any_orthonormal_pair();
        let pattern = self.pattern(point.share);
        let probes = if self.params.shadow == Shadow::Hard { 1 } else { (self.params.probes as usize).min(pattern.len()) };
        let rays = (0..probes).filter_map(|i| self.ray_to(pattern.direction(i, toward, across, turn), toward, point));
        let sums = Sums::of(rays.map(|ray| (!self.tracer.world.blocks(&ray), Vec3::ONE)));
        trail.shadow_rays += u64::from(sums.count);
        sums.mean().open
    }

    /// The points that are sampled for a ray that counts for `share` of its pixel: a step of its penumbra is to be as small a
    /// step of the pixel as that of any other.
    fn pattern(&self, share: f32) -> &Pattern {
        let most = self.patterns.len();
        let points = if self.params.shadow == Shadow::Adaptive { (share * most as f32).ceil() as usize } else { most };
        &self.patterns[points.clamp(1, most) - 1]
    }

    /// The ray from a point in a `direction` of the light, if that is above the horizon.
    #[inline]
    fn ray_to(&self, direction: Vec3, toward: &Toward, point: &Lightable<impl Fn(Vec3) -> Vec3>) -> Option<Ray> {
        (direction.dot(point.normal) > 0.0).then(|| Ray::new((point.from)(direction), direction).up_to(toward.end))
    }

    /// Share of the light along `ray` that objects let through, per channel: clear bodies dim it on its straight way. A body
    /// with the index of its surroundings and factors of 1 leaves it as it is, to the bit.
    pub(super) fn transmittance(&self, ray: &Ray, media: &Media, trail: &mut Trail) -> Vec3 {
        let objects = self.tracer.objects;
        trail.shadow_rays += 1;
        if objects.opaque_on(ray) {
            return Vec3::ZERO;
        }
        if !objects.transmit() {
            return Vec3::ONE;
        }
        let (mut media, mut left) = (*media, Vec3::ONE);
        let (mut passed, mut beyond) = (0.0, 0.0);
        let mut faces = objects.clear_on(ray);
        for _ in 0..MAX_CROSSED {
            let Some(hit) = faces.next_beyond(beyond) else {
                return left * media.transmittance(ray.t_max - passed);
            };
            let surface = objects.surface(ray, &hit);
            let Some(body) = surface.body else { return Vec3::ZERO };
            left *= media.transmittance(hit.hit.t - passed) * body.factors;
            let cos = ray.direction.dot(surface.bsdf.normal()).abs();
            if body.thin {
                left *= 1.0 - reflectance(&body, cos, 1.0);
            } else {
                let (inside, eta) = media.beyond(hit.instance, &body, surface.outside);
                // From within, the straight way stands for the bent one outside, which always gets out.
                left *= 1.0 - reflectance(&body, cos, eta.max(1.0 / eta));
                media = inside;
            }
            if left == Vec3::ZERO {
                return left;
            }
            (passed, beyond) = (hit.hit.t, just_beyond(hit.hit.t));
        }
        Vec3::ZERO
    }

    /// The lights that shine on what is there, whatever is in the way, as bits.
    pub(super) fn faced(&self, first: &First) -> u32 {
        let First::Real(hit) = first else { return 0 };
        let faced = |light: &SphericalLight| !light.seen_from(hit.position).below(hit.normal);
        self.lights.iter().enumerate().map(|(i, light)| u32::from(faced(light)) << i).sum()
    }

    /// Whether objects can change what is there at all.
    pub(super) fn may_change(&self, first: &First) -> bool {
        match first {
            First::Infinity => false,
            First::Object(_) => true,
            First::Real(hit) => {
                let lit = |light: &SphericalLight| {
                    let toward = light.seen_from(hit.position);
                    !toward.below(hit.normal) && self.objects_may_block(&toward, hit.position)
                };
                self.params.gloss > 0.0 || (self.params.shadows && self.lights.iter().any(lit))
            }
        }
    }

    /// Whether the bounds of any object reach into the cone between `x` and the light: exact, up to rounding, where it says
    /// no.
    fn objects_may_block(&self, toward: &Toward, x: Vec3) -> bool {
        self.tracer.objects.clusters().iter().any(|ball| reaches_cone(ball, toward, x))
    }
}

fn reaches_cone(ball: &Ball, toward: &Toward, x: Vec3) -> bool {
    let to = ball.center - x;
    let distance = to.length();
    if distance <= ball.radius {
        return true;
    }
    let (sin_b, cos_a) = (ball.radius / distance, toward.cos);
    let cos_b = (1.0 - sin_b * sin_b).max(0.0).sqrt();
    // The sum of both angular radii; beyond half a turn everything overlaps.
    let sum = cos_a * cos_b - toward.sin * sin_b;
    let over = cos_a <= -cos_b;
    over || to.dot(toward.axis) / distance >= sum - 1e-5
}
