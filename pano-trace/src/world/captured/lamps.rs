//! Lamps that the panorama has seen from one side only. What they light may face the other side, where their assumed back
//! faces shine, and no sample of the panorama's own light is ever aimed at those: such light came in rare bright specks.

use crate::cone::Cone;
use crate::objects::Ball;
use crate::prt::DepthField;
use glam::{Vec2, Vec3};
use pano_core::{image::Image, sphere};

/// A patch of the panorama is a lamp if it is this many times brighter than the panorama is on average…
const BRIGHT: f32 = 4.0;
/// …gives this share of its light…
const LEAST_POWER: f32 = 0.01;
/// …has this share of its rim before something farther away…
const FREE_RIM: f32 = 0.25;
/// …and fits into a ball of this many times its distance.
const LARGEST: f32 = 0.5;
/// Neighbours whose distances differ by no more than this factor are of one thing.
const ONE_LAYER: f32 = 1.1;
/// A back face reaches as far behind a lamp's rim as the lamp is wide: the ball is this many times that of the front, …
const GROWN: f32 = 1.5;
/// … and its centre this many radii of the front's farther away.
const BEHIND: f32 = 1.0;
/// So many of them, the brightest ones.
const MOST: usize = 8;
/// The share of light samples aimed at lamps is this part of the lamps' share of the light.
const EFFORT: f32 = 0.5;

/// Numbers of a lamp on the GPU.
#[cfg(feature = "gpu")]
pub(super) const LAMP_WORDS: u32 = 5;

#[derive(Clone, Copy, Debug)]
struct Lamp {
    /// Holds it and its assumed back. Panorama frame.
    ball: Ball,
    /// Radiance times the area of its image: irradiance falls with the distance squared.
    intensity: f32,
}

/// Directions towards lamps, whichever side they show. Positions are relative to the capture point, in the panorama's frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Lamps {
    lamps: Vec<Lamp>,
    share: f32,
}

/// A lamp as a point sees it.
struct Seen {
    cone: Cone,
    weight: f32,
}

impl Lamps {
    /// The lamps of a panorama of that `luminance`.
    pub(super) fn find(luminance: &Image<f32>, field: &DepthField) -> Self {
        let (w, h) = luminance.size();
        let direction = |i: usize| {
            let at = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            sphere::direction_from_uv(at / Vec2::new(w as f32, h as f32))
        };
        let power = |i: usize| luminance.data()[i] * sphere::pixel_solid_angle(w, h, i / w) as f32;
        let all: f32 = (0..w * h).map(power).filter(|p| p.is_finite()).sum();
        let threshold = BRIGHT * all / (4.0 * std::f32::consts::PI);
        let inverse: Vec<f32> = (0..w * h).map(|i| field.inverse_distance(direction(i))).collect();
        let shines = |i: usize| luminance.data()[i] > threshold && inverse[i] > 0.0;
        let mut taken = vec![false; w * h];
        let mut lamps = Vec::new();
        for first in 0..w * h {
            if taken[first] || !shines(first) {
                continue;
            }
            taken[first] = true;
            let mut members = vec![first];
            let (mut rim, mut free, mut next) = (0, 0, 0);
            while next < members.len() {
                let i = members[next];
                next += 1;
                for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                    let (x, y) = sphere::wrap_texel(w, h, (i % w) as isize + dx, (i / w) as isize + dy);
                    let j = y * w + x;
                    let same = inverse[j] * ONE_LAYER > inverse[i] && inverse[j] < inverse[i] * ONE_LAYER;
                    if shines(j) && same {
                        if !taken[j] {
                            taken[j] = true;
                            members.push(j);
                        }
                    } else {
                        rim += 1;
                        free += usize::from(inverse[j] * ONE_LAYER <= inverse[i]);
                    }
                }
            }
            let lit: f32 = members.iter().map(|&i| power(i)).sum();
            if lit < LEAST_POWER * all || (free as f32) < FREE_RIM * rim as f32 {
                continue;
            }
            let place = |i: &usize| direction(*i) / inverse[*i];
            let middle = members.iter().map(place).sum::<Vec3>() / members.len() as f32;
            let half_texel = std::f32::consts::PI / h as f32 * 0.5 * middle.length();
            let radius = half_texel + members.iter().map(|i| place(i).distance(middle)).fold(0.0, f32::max);
            let distance = middle.length();
            if radius < LARGEST * distance {
                let ball = Ball { center: middle * (1.0 + BEHIND * radius / distance), radius: GROWN * radius };
                lamps.push((lit, Lamp { ball, intensity: lit * distance * distance }));
            }
        }
        lamps.sort_by(|a, b| b.0.total_cmp(&a.0));
        lamps.truncate(MOST);
        let share = EFFORT * lamps.iter().map(|l| l.0).sum::<f32>() / all;
        Self { lamps: lamps.into_iter().map(|l| l.1).collect(), share: if share.is_finite() { share } else { 0.0 } }
    }

    /// The balls that samples are aimed at.
    #[cfg(test)]
    pub(super) fn balls(&self) -> impl Iterator<Item = Ball> {
        self.lamps.iter().map(|lamp| lamp.ball)
    }

    /// Adds them for a shader: where they begin and how many there are.
    #[cfg(feature = "gpu")]
    pub(super) fn pack(&self, words: &mut pano_core::gpu::Words) -> (u32, u32) {
        let at = words.at();
        for lamp in &self.lamps {
            words.vec3(lamp.ball.center);
            words.numbers([lamp.ball.radius, lamp.intensity]);
        }
        (at, self.lamps.len() as u32)
    }

    /// [`Self::share`] of points that see one.
    #[cfg(feature = "gpu")]
    pub(super) fn largest_share(&self) -> f32 {
        self.share
    }

    fn seen(&self, from: Vec3) -> impl Iterator<Item = Seen> + Clone {
        self.lamps.iter().filter_map(move |lamp| {
            let cone = Cone::around(&lamp.ball, from)?;
            Some(Seen { cone, weight: lamp.intensity / lamp.ball.center.distance_squared(from) })
        })
    }

    /// The share of light samples at `from` that are aimed at lamps.
    #[inline]
    pub(super) fn share(&self, from: Vec3) -> f32 {
        if self.seen(from).next().is_some() { self.share } else { 0.0 }
    }

    /// A direction towards one of them, for points whose [`Self::share`] is not 0.
    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<Vec3> {
        let seen = self.seen(from);
        let total: f32 = seen.clone().map(|s| s.weight).sum();
        let mut pick = u.x * total;
        let last = seen.clone().last()?;
        for lamp in seen {
            if pick < lamp.weight {
                return Some(lamp.cone.sample(Vec2::new(pick / lamp.weight, u.y)));
            }
            pick -= lamp.weight;
        }
        Some(last.cone.sample(Vec2::new(0.5, u.y)))
    }

    /// Density per steradian of [`Self::sample`].
    #[inline]
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3) -> f32 {
        let (mut density, mut total) = (0.0, 0.0);
        for lamp in self.seen(from) {
            total += lamp.weight;
            if lamp.cone.contains(direction) {
                density += lamp.weight / lamp.cone.solid_angle();
            }
        }
        if density > 0.0 { density / total } else { 0.0 }
    }
}
