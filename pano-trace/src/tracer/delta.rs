//! The change of a real surface: Algorithm 1 of the DPT paper at its first vertex, made exact for real surfaces that see
//! one another, and sampled where the change is.
//!
//! At a real point x, for a direction ω:
//! - an object lies first: f·cos·(L_object − L_real), where L_real is what the object hides — the *blocked* light;
//! - a real surface lies first: f·cos times *its* change (second order, from two bounces on);
//! - nothing lies first: no change.
//!
//! Three strategies find directions: the cones in which the objects' bounds are seen, the light (only the blocked light
//! needs it), and the cosine (inside the bounds, and for the second order). The balance heuristic joins them. A point
//! whose hemisphere does not see the bounds has no first-order change and costs nothing.

use super::influence::spread_over_square;
use super::path::{First, Scene};
use super::{Mis, Tracer, Walk};
use crate::bsdf::concentric_disc;
use crate::bvh::Ray;
use crate::cone::Cone;
use crate::objects::{Ball, MAX_CLUSTERS};
use crate::world::{LightSample, LightTarget, RealHit, RealWorld};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Share of the irradiance from which on every sample looks for objects; a smaller one is looked for less often, in
/// proportion. Its noise is in proportion to the share as well, which makes this the best use of a ray (the number of
/// samples should go with the standard deviation).
pub(super) const FULL_EFFORT: f32 = 0.25;
/// …but at least this often, so that no pixel is left with a handful of samples.
pub(super) const LEAST_EFFORT: f32 = 1.0 / 64.0;
/// The same for points that are met once by a path, where a thinner effort would only make the rare find brighter.
pub(super) const LEAST_EFFORT_ONCE: f32 = 0.5;
/// How often the ends of paths are asked for their change.
pub(super) const PATHS_END_SHARE: f32 = 0.5;
/// How often the second order is sampled: it is small, and smooth. Where few samples stand for many, more often by the root.
pub(super) const SECOND_ORDER_EFFORT: f32 = 0.125;
/// Light samples of a point that changes another. Most meet no object and take no ray; with one, the few that do would be bright.
pub(super) const SECOND_ORDER_LIGHTS: u32 = 8;
/// Light samples of a point that a mirror or glass shows: with 4 the mirror ball of the living room has 1.7 times less error² · time
/// than with one sample in every other path, and 1.2 times less than with 8 (display-encoded, 32 samples).
pub(super) const LIGHTS_OF_AN_IMAGE: u32 = 4;
/// Share of the third strategy's directions that are aimed at the surroundings of the objects, which hold most of what has changed:
/// of those by the cosine alone few would find it, and each be bright.
pub(super) const AROUND: f32 = 0.5;

/// A cone that holds objects.
#[derive(Clone, Copy)]
struct Target {
    cone: Cone,
    /// Probability of being chosen, divided by the solid angle.
    density: f32,
    probability: f32,
}

/// Where the objects are, seen from a point.
pub(super) struct Aim {
    targets: [Target; MAX_CLUSTERS],
    count: usize,
    /// The point lies inside the bounds of an object: any direction may meet it.
    pub(super) inside: bool,
    /// About the share of the irradiance that comes through the cones.
    pub(super) form_factor: f32,
}

impl Aim {
    pub(super) fn new(balls: &[Ball], x: Vec3, normal: Vec3) -> Self {
        let none = Target { cone: Cone { axis: Vec3::Y, cap: 0.0 }, density: 0.0, probability: 0.0 };
        let mut aim = Self { targets: [none; MAX_CLUSTERS], count: 0, inside: false, form_factor: 0.0 };
        let mut total = 0.0;
        for ball in balls {
            let form_factor = ball.form_factor(x, normal);
            if form_factor <= 0.0 {
                continue;
            }
            // Close to the ball the cosine does as well.
            let Some(cone) = Cone::around(ball, x) else {
                aim.inside = true;
                continue;
            };
            let facing = form_factor * ball.center.distance_squared(x) / (ball.radius * ball.radius);
            let probability = cone.cap * facing;
            aim.form_factor += form_factor;
            aim.targets[aim.count] = Target { cone, density: facing / TAU, probability };
            aim.count += 1;
            total += probability;
        }
        for target in &mut aim.targets[..aim.count] {
            target.probability /= total;
            target.density /= total;
        }
        aim
    }

    pub(super) fn nothing(&self) -> bool {
        self.count == 0 && !self.inside
    }

    #[inline]
    fn pdf(&self, d: Vec3) -> f32 {
        self.targets[..self.count].iter().filter(|t| t.cone.contains(d)).map(|t| t.density).sum()
    }

    #[inline]
    pub(super) fn meets(&self, d: Vec3) -> bool {
        self.inside || self.targets[..self.count].iter().any(|t| t.cone.contains(d))
    }

    #[inline]
    fn sample(&self, at: Vec2, mut pick: f32) -> Vec3 {
        let mut chosen = self.targets[self.count - 1];
        for target in &self.targets[..self.count] {
            if pick < target.probability {
                chosen = *target;
                break;
            }
            pick -= target.probability;
        }
        chosen.cone.sample(at)
    }
}

/// Which strategy found a direction; light sampling has a function of its own.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Found {
    Cone,
    Cosine,
}

/// How much work goes into one estimate.
#[derive(Clone, Copy)]
struct Effort {
    /// How often any strategy is used, (0, 1].
    share: f32,
    /// How often, of that, objects are looked for at least.
    least: f32,
    /// How many times as often as usual strategies are used that are not used every time, ≥ 1.
    boost: f32,
    /// Light samples.
    lights: u32,
}

/// Of points that only colour a path's end, in every other path.
const OF_A_PATHS_END: Effort = Effort { share: PATHS_END_SHARE, least: LEAST_EFFORT_ONCE, boost: 1.0, lights: 1 };
/// Of points that change another. They are asked for seldom, and then with all strategies: a find that two rare choices led to would
/// be brighter still.
const OF_ANOTHER: Effort = Effort { share: 1.0, least: LEAST_EFFORT_ONCE, boost: 1.0, lights: SECOND_ORDER_LIGHTS };

/// Of points that a mirror or glass shows as they are: one path is a whole sample of what is seen.
const OF_AN_IMAGE: Effort = Effort { share: 1.0, least: LEAST_EFFORT_ONCE, boost: 1.0, lights: LIGHTS_OF_AN_IMAGE };

/// A real point whose change is asked for, and how often each strategy is used there.
struct Point<'a> {
    hit: &'a RealHit,
    x: Vec3,
    aim: Aim,
    /// Where the surroundings of the objects are, which are changed and change this point, if that is asked for.
    around: Option<Aim>,
    cone_rate: f32,
    light_rate: f32,
    cosine_rate: f32,
    second_order: bool,
    bounces: u32,
}

impl Point<'_> {
    /// Density per steradian of the third strategy.
    #[inline]
    fn cosine_pdf(&self, d: Vec3, cos: f32) -> f32 {
        match &self.around {
            Some(around) => AROUND * around.pdf(d) + (1.0 - AROUND) * cos * FRAC_1_PI,
            None => cos * FRAC_1_PI,
        }
    }
}

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// One estimate of the change of the radiance a real surface sends out, all strategies used; those that are not used every
    /// time `boost` times as often as usual.
    pub(super) fn delta(&self, hit: &RealHit, bounces: u32, boost: f32, walk: &mut Walk) -> Vec3 {
        // Light samples that meet no bounds take no ray, so that some more cost little; those that do are rare, and bright.
        let lights = boost.sqrt() as u32;
        self.delta_at(hit, bounces, Effort { share: 1.0, least: LEAST_EFFORT, boost, lights }, walk)
    }

    /// Whether changed surfaces change one another.
    pub(super) fn has_second_order(&self, bounces: u32) -> bool {
        bounces >= 2 && self.params.second_order && self.world.sees_itself()
    }

    /// The same with about one ray, for points that only colour a path's end.
    pub(crate) fn delta_once(&self, hit: &RealHit, bounces: u32, walk: &mut Walk) -> Vec3 {
        self.delta_at(hit, bounces, OF_A_PATHS_END, walk)
    }

    /// The same for points that a mirror or glass shows.
    pub(super) fn delta_of_an_image(&self, hit: &RealHit, bounces: u32, walk: &mut Walk) -> Vec3 {
        self.delta_at(hit, bounces, OF_AN_IMAGE, walk)
    }

    fn delta_at(&self, hit: &RealHit, bounces: u32, effort: Effort, walk: &mut Walk) -> Vec3 {
        let x = self.world.leave(hit);
        let aim = Aim::new(self.objects.clusters(), x, hit.normal);
        let second_order = self.has_second_order(bounces);
        let everywhere = self.params.everywhere;
        if aim.nothing() && !second_order && !everywhere {
            return Vec3::ZERO;
        }
        let reflectance = self.world.reflectance(hit);
        if reflectance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let mis = self.params.mis;
        let cosine_rate = if aim.inside || mis == Mis::BsdfOnly || everywhere {
            effort.share
        } else if second_order {
            effort.share * (SECOND_ORDER_EFFORT * effort.boost.sqrt()).min(1.0)
        } else {
            0.0
        };
        let around = (second_order && mis != Mis::BsdfOnly)
            .then(|| Aim::new(self.objects.surroundings(), x, hit.normal))
            .filter(|around| around.count > 0);
        let cones = aim.count > 0 && mis != Mis::BsdfOnly;
        let cone_rate = match cones {
            true => effort.share * (effort.boost * (aim.form_factor / FULL_EFFORT).max(effort.least)).min(1.0),
            false => 0.0,
        };
        let lights = match mis {
            Mis::BsdfOnly => 0,
            // Here all take rays.
            _ if everywhere => 1,
            _ if aim.nothing() => 0,
            _ => effort.lights,
        };
        let light_rate = effort.share * lights as f32;
        let point = Point { hit, x, aim, around, cone_rate, light_rate, cosine_rate, second_order, bounces };

        let u = walk.sampler.next_4d();
        let mut change = Vec3::ZERO;
        if u[2] < effort.share {
            for i in 0..lights {
                if let Some(sample) = self.world.sample_light(x, spread_over_square(Vec2::new(u[0], u[1]), i)) {
                    change += self.blocked_light(&point, &sample, walk);
                }
            }
        }
        if u[3] < cone_rate {
            let v = walk.sampler.next_4d();
            let d = point.aim.sample(Vec2::new(v[0], v[1]), v[2]);
            change += self.change_along(&point, d, Found::Cone, walk);
        }
        if cosine_rate > 0.0 {
            let w = walk.sampler.next_4d();
            if w[2] < cosine_rate {
                let d = match &point.around {
                    Some(around) if w[3] < AROUND => around.sample(Vec2::new(w[0], w[1]), w[3] / AROUND),
                    _ => {
                        let disc = concentric_disc(Vec2::new(w[0], w[1]));
                        let (t, b) = hit.normal.any_orthonormal_pair();
                        t * disc.x + b * disc.y + hit.normal * (1.0 - disc.length_squared()).max(0.0).sqrt()
                    }
                };
                change += self.change_along(&point, d, Found::Cosine, walk);
            }
        }
        reflectance * FRAC_1_PI * change
    }

    /// What objects block of a light sample: −cos·L over the density of finding it.
    fn blocked_light(&self, point: &Point<'_>, sample: &LightSample, walk: &mut Walk) -> Vec3 {
        let d = sample.direction;
        let cos = d.dot(point.hit.normal);
        if cos <= 0.0 || !(point.aim.meets(d) || self.params.everywhere) {
            return Vec3::ZERO;
        }
        let ray = Ray::new(point.x, d);
        walk.rays += 1;
        // What lies behind the light blocks none of it; where that is, is not known of a sample aimed at anything.
        let end = match sample.target {
            LightTarget::Surface(target) => target.distance(point.x),
            LightTarget::Infinity | LightTarget::Anything => f32::INFINITY,
        };
        if !self.objects.occluded(&ray.up_to(end)) {
            return Vec3::ZERO;
        }
        walk.rays += 1;
        let Some(behind) = self.world.reach(&ray, sample) else { return Vec3::ZERO };
        if let (LightTarget::Anything, Some(behind)) = (sample.target, &behind) {
            walk.rays += 1;
            if !self.objects.occluded(&ray.up_to(behind.t)) {
                return Vec3::ZERO;
            }
        }
        let blocked = self.real_light(&ray, behind.as_ref(), point.bounces - 1, walk);
        -blocked * (cos * self.weights(point, d, cos, behind.as_ref()).blocked)
    }

    /// cos·(change of the radiance from `d`) over the density of finding it.
    fn change_along(&self, point: &Point<'_>, d: Vec3, found: Found, walk: &mut Walk) -> Vec3 {
        let cos = d.dot(point.hit.normal);
        if cos <= 0.0 {
            return Vec3::ZERO;
        }
        let ray = Ray::new(point.x, d);
        walk.rays += 1;
        let object = self.objects.intersect(&ray);
        let second_order = found == Found::Cosine && point.second_order;
        if object.is_none() && !second_order {
            return Vec3::ZERO;
        }
        walk.rays += 1;
        let behind = self.world.hit(&ray);
        let object = match (object, &behind) {
            (Some(object), Some(real)) if real.t < object.hit.t => None,
            (object, _) => object,
        };
        let Some(object) = object else {
            // A real surface lies first, or nothing does.
            return match &behind {
                Some(real) if second_order => {
                    self.delta_at(real, point.bounces - 1, OF_ANOTHER, walk)
                        * (cos / (point.cosine_rate * point.cosine_pdf(d, cos)))
                }
                _ => Vec3::ZERO,
            };
        };
        let weights = self.weights(point, d, cos, behind.as_ref());
        let mut change = Vec3::ZERO;
        if weights.blocked > 0.0 && !(self.params.mis == Mis::LightOnly && weights.light_finds_it) {
            change -= self.real_light(&ray, behind.as_ref(), point.bounces - 1, walk) * weights.blocked;
        }
        if weights.sent > 0.0 {
            let sent = self.radiance(ray, First::Object(object), None, point.bounces - 1, Scene::Mixed, walk);
            change += sent * weights.sent;
        }
        change * cos
    }

    /// The light that arrives along `ray` without the objects.
    fn real_light(&self, ray: &Ray, behind: Option<&RealHit>, bounces: u32, walk: &mut Walk) -> Vec3 {
        match behind {
            None => self.world.infinity(ray.direction),
            Some(real) => match real.radiance {
                Some(radiance) => radiance,
                None => self.radiance(*ray, First::Real(*real), None, bounces, Scene::Real, walk),
            },
        }
    }

    /// The balance heuristic's weights over densities for direction `d`, behind whose objects the real world shows `behind`.
    fn weights(&self, point: &Point<'_>, d: Vec3, cos: f32, behind: Option<&RealHit>) -> Weights {
        let by_aim = point.cone_rate * point.aim.pdf(d) + point.cosine_rate * point.cosine_pdf(d, cos);
        let by_light = point.light_rate * self.world.light_pdf(point.x, d, behind);
        let all = match self.params.mis {
            Mis::LightOnly if by_light > 0.0 => by_light,
            _ => by_aim + by_light,
        };
        // At the rim of a cone rounding decides whether a direction has a density.
        if by_aim <= 0.0 || !all.is_finite() {
            return Weights { blocked: 0.0, sent: 0.0, light_finds_it: false };
        }
        // What the object sends has nothing to do with where the light is.
        Weights { blocked: 1.0 / all, sent: 1.0 / by_aim, light_finds_it: by_light > 0.0 }
    }
}

/// See [`Tracer::weights`].
struct Weights {
    /// For the light that is blocked.
    blocked: f32,
    /// For the light that the object sends instead.
    sent: f32,
    light_finds_it: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the size: a direction that meets the ball has a density, and drawn directions have the density they were
        /// drawn with. Of cones kept by their cosines, those narrower than 10⁻³ rad lost half of their directions to rounding.
        #[test]
        fn directions_that_meet_the_ball_have_a_density(
            size in -9.0f32..0.0, distance in -2.0f32..4.0, at in prop::array::uniform2(0.0f32..1.0),
            azimuth in 0.0f32..TAU, height in 0.05f32..1.0,
        ) {
            let distance = 10f32.powf(distance);
            let radius = 10f32.powf(size) * distance;
            let level = (1.0 - height * height).sqrt();
            let axis = Vec3::new(level * azimuth.cos(), height, level * azimuth.sin());
            let ball = Ball { center: axis * distance, radius };
            let aim = Aim::new(&[ball], Vec3::ZERO, Vec3::Y);
            prop_assume!(!aim.inside);
            prop_assert!(aim.count == 1 && aim.targets[0].cone.cap > 0.0);
            let drawn = aim.sample(Vec2::from_array(at), 0.5);
            // Over the ball's disc, up to its rim.
            let disc = concentric_disc(Vec2::from_array(at));
            let (t, b) = axis.any_orthonormal_pair();
            let met = (ball.center + (t * disc.x + b * disc.y) * radius * (1.0 - (radius / distance).powi(2)).sqrt()).normalize();
            prop_assert!(aim.meets(met) && aim.pdf(met) > 0.0, "{met}");
            // The solid angle of the cone times its density is 1.
            prop_assert!((aim.pdf(met) * TAU * aim.targets[0].cone.cap - 1.0).abs() < 1e-4, "{}", aim.pdf(met));
            let inner = (drawn - axis).length_squared() < 1.99 * aim.targets[0].cone.cap;
            prop_assert!(!inner || aim.pdf(drawn) == aim.pdf(met), "{drawn}");
        }
    }
}
