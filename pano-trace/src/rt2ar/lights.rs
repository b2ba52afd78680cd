//! Detected lights as spheres that stand somewhere, and the points of them that are sampled.

use super::Lighting;
use crate::bvh::Ray;
use crate::directions::cap_direction;
use crate::world::RealWorld;
use glam::{Vec2, Vec3};
use pano_core::light::DirectionalLight;
use std::f32::consts::PI;

/// A light, seen from a point of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Toward {
    /// Unit direction to its middle.
    pub(super) axis: Vec3,
    /// Cosine and sine of its angular radius.
    pub(super) cos: f32,
    pub(super) sin: f32,
    /// How far rays towards it are followed: up to the sphere.
    pub(super) end: f32,
    /// Irradiance on a surface that faces it.
    pub(super) irradiance: Vec3,
}

impl Toward {
    /// Whether a surface with unit `normal` faces away from the whole light.
    pub(super) fn below(&self, normal: Vec3) -> bool {
        self.cos > 0.0 && self.axis.dot(normal) <= -self.sin
    }
}

/// A light with a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalLight {
    /// Unit direction from the capture point.
    pub direction: Vec3,
    /// World position of its middle; of no meaning at infinity.
    pub center: Vec3,
    /// Metres from the capture point to its middle; infinite: at infinity.
    pub distance: f32,
    /// Cosine of its angular radius, seen from the capture point, in [−1, 1).
    pub cos_radius: f32,
    /// Irradiance at the capture point, on a surface that faces the light.
    pub irradiance: Vec3,
}

/// Nearer than this (as the sine of the angular radius) a light is not resolved: the point is in it.
pub(super) const MAX_SINE: f32 = 0.99;

impl SphericalLight {
    /// Sine of its angular radius, seen from the capture point.
    pub(super) fn sin_radius(&self) -> f32 {
        (1.0 - self.cos_radius * self.cos_radius).max(0.0).sqrt()
    }

    /// What the point `x` sees of the light. A uniform sphere's irradiance falls with the squared distance.
    pub(super) fn seen_from(&self, x: Vec3) -> Toward {
        let sin = self.sin_radius();
        if self.distance.is_infinite() {
            return Toward { axis: self.direction, cos: self.cos_radius, sin, end: f32::INFINITY, irradiance: self.irradiance };
        }
        let to = self.center - x;
        let radius = self.distance * sin.min(MAX_SINE);
        let distance = to.length().max(radius / MAX_SINE).max(f32::MIN_POSITIVE);
        let sin = radius / distance;
        let closer = self.distance / distance;
        Toward {
            axis: to.try_normalize().unwrap_or(self.direction),
            cos: (1.0 - sin * sin).sqrt(),
            sin,
            end: distance - radius,
            irradiance: self.irradiance * (closer * closer),
        }
    }
}

/// Rays that look for the rim of an opening, and how far off the light they look, in angular radii.
const RIM_RAYS: usize = 16;
const RIM: f32 = 1.4;

/// Where the lights stand. One that shines from a known surface stands there. One at infinity whose surroundings are mostly
/// known surfaces is an opening, such as a window, and stands at the surroundings' median distance: other points see its
/// light come from there. All others are at infinity.
pub fn place_lights<W: RealWorld>(world: &W, lighting: &Lighting) -> Vec<SphericalLight> {
    let distance_along = |d: Vec3| world.hit(&Ray::new(lighting.capture, d)).map(|hit| hit.t);
    let place = |light: &DirectionalLight| {
        let cos_radius = light.cos_radius().max(-1.0);
        let distance = distance_along(light.direction).or_else(|| {
            let rim = (RIM * cos_radius.acos()).cos();
            let ring = (0..RIM_RAYS).map(|i| cap_direction(light.direction, rim, Vec2::new(1.0, i as f32 / RIM_RAYS as f32)));
            let mut found: Vec<f32> = ring.filter_map(distance_along).collect();
            found.sort_unstable_by(f32::total_cmp);
            found.get(RIM_RAYS / 2).map(|_| found[found.len() / 2])
        });
        SphericalLight {
            direction: light.direction,
            center: lighting.capture + light.direction * distance.unwrap_or(0.0),
            distance: distance.unwrap_or(f32::INFINITY),
            cos_radius,
            irradiance: light.intensity,
        }
    };
    lighting.lights.iter().map(place).collect()
}

/// The points of a light that are looked at, as (height over the rim's plane, x, y) on the unit disc's cap: the first is its
/// middle, the next four are on its rim a quarter turn apart (figure 9), opposite ones in turn; all others between them.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    points: Vec<Point>,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    /// Share of the cap's solid angle that lies farther in.
    area: f32,
    /// Unit vector about the axis.
    turn: Vec2,
}

/// Points of a rim that the first probes look at.
const RIM_PROBES: u32 = 4;

impl Pattern {
    /// `count` points, the first `probes` of which are spread over the whole light.
    pub(super) fn new(count: u32, probes: u32) -> Self {
        // Each point stands for an equal share of the solid angle: the middle for the innermost, the rim for the outermost.
        let golden = PI * (3.0 - 5f32.sqrt());
        let inner = |from: u32, to: u32, k: u32| {
            let share = 1.0 / count as f32;
            let (lo, hi) = (share, 1.0 - RIM_PROBES as f32 * share);
            lo + (hi - lo) * (k as f32 + 0.5) / (to - from) as f32
        };
        let first = 1 + RIM_PROBES;
        let points = (0..count)
            .map(|i| {
                let (area, angle) = match i {
                    0 => (0.0, 0.0),
                    i if i < first => (1.0, [0.0, PI, 0.5 * PI, 1.5 * PI][i as usize - 1]),
                    // The further probes and the remaining points are two spirals over the same disc.
                    i if i < probes => (inner(first, probes.min(count), i - first), i as f32 * golden),
                    i => (inner(first.max(probes), count, i - first.max(probes)), (i as f32 + 0.5) * golden),
                };
                Point { area, turn: Vec2::from_angle(angle) }
            })
            .collect();
        Self { points }
    }

    /// Patterns of 1 to `count` points.
    pub(super) fn ladder(count: u32, probes: u32) -> Vec<Self> {
        (1..=count.max(1)).map(|points| Self::new(points, probes)).collect()
    }

    /// Of each point the share of the solid angle and the unit vector, for shaders.
    #[cfg(feature = "gpu")]
    pub(super) fn numbers(&self) -> impl Iterator<Item = f32> {
        self.points.iter().flat_map(|p| [p.area, p.turn.x, p.turn.y])
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Direction to point `i` of the light, the pattern turned by the unit vector `turn`; `across` are the axes of the disc.
    #[inline]
    pub(super) fn direction(&self, i: usize, toward: &Toward, across: (Vec3, Vec3), turn: Vec2) -> Vec3 {
        let Point { area, turn: own } = self.points[i];
        let at = own.rotate(turn);
        let height = area * (1.0 - toward.cos);
        let radius = (height * (2.0 - height)).max(0.0).sqrt();
        toward.axis * (1.0 - height) + (across.0 * at.x + across.1 * at.y) * radius
    }
}
