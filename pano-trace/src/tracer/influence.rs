//! How much objects can change a pixel, before it is sampled: pixels that they hardly change take fewer samples.
//!
//! What a real point may lose or gain, as a share of its light, is told from three things that take no ray:
//! - the form factor of the objects' bounds: their share of an even light;
//! - what more than that lies behind them of the real light, by a few points of it ([`Lights`]): a low sun behind a small object
//!   takes all the light of its shadow;
//! - the form factor of the objects' surroundings, which are changed and change others (second order).
//!
//! The standard deviation of a sample is in proportion to that share (about half of it: what is looked for is found or not), and the
//! number of samples goes with its square: every pixel is left with about the same noise. As the number is settled before the first
//! sample, no mean is biased by it.

use super::delta::Aim;
use super::{First, Mis, Scene, Tracer, around};
use crate::directions::mirrored;
use crate::world::{LightTarget, RealHit, RealWorld};
use glam::{Vec2, Vec3};

/// Points of the light that are looked at, for the root of each of the frame's samples: the root tells apart the shares of light
/// that ask for more samples than the least, and each of those is seen by some ten points.
const LIGHTS_A_ROOT: f32 = 16.0;
/// …and at most.
const MOST_LIGHTS: u32 = 128;
/// What the root of the form factor counts where objects mirror or refract: their light is found or not as well, at any distance.
pub(super) const SPIKY: f32 = 2.0;
/// The fewest samples of a pixel are this part of the frame's: at 2048 samples, one.
pub(super) const MOST_THINNING: u32 = 2048;
/// The same where objects send images of lamps about: that noise does not go with the share.
pub(super) const MOST_THINNING_SPIKY: u32 = 16;
/// The same where objects shine, however little of the light they take, or a strategy that seldom finds them is left to itself.
pub(super) const MOST_THINNING_UNAIMED: u32 = 4;
/// Where less than this part of a sample is wanted for each that is taken, those look for changes less often. That is noise as well,
/// of four times the variance of what is found…
const ALWAYS: f32 = 1.0 / 4.0;
/// …and what is found would be too bright if it looked less often than this.
const LEAST_SHARE: f32 = 1.0 / 8.0;
/// The thinning of a pixel in which nothing can change: it takes no sample.
pub(super) const NO_SAMPLES: u32 = u32::MAX;
/// How much the surroundings change another surface, of what they would if they were all black: they are as bright as what lies
/// around them, on the average a quarter is taken, and the other surface returns only a part.
pub(super) const SECOND_ORDER_SHARE: f32 = 0.2;

/// A few points of a frame's light, drawn in proportion to what they send to the viewer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lights {
    /// Direction and 0 of what shines from infinity; else position and squared distance from the viewer.
    points: Vec<(Vec3, f32)>,
}

impl Lights {
    /// Those of `world` that `samples` a pixel call for; the same for every pixel, so that numbers of samples have no noise of
    /// their own.
    pub(crate) fn of(world: &impl RealWorld, viewer: Vec3, samples: u32) -> Self {
        let drawn = |i| {
            let sample = world.sample_light(viewer, spread_over_square(Vec2::splat(0.5), i))?;
            match sample.target {
                LightTarget::Infinity => Some((sample.direction, 0.0)),
                LightTarget::Surface(at) => Some((at, at.distance_squared(viewer))),
                // Lamps, which the panorama's own light holds as well.
                LightTarget::Anything => None,
            }
        };
        let count = ((LIGHTS_A_ROOT * (samples as f32).sqrt()) as u32).min(MOST_LIGHTS);
        Self { points: (0..count).filter_map(drawn).collect() }
    }

    /// How many there are.
    #[cfg(feature = "gpu")]
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Writes them for a shader: where they begin and how many there are.
    #[cfg(feature = "gpu")]
    pub(crate) fn pack(&self, words: &mut pano_core::gpu::Words) -> [u32; 2] {
        let at = words.at();
        for (point, r2) in &self.points {
            words.vec3(*point);
            words.number(*r2);
        }
        [at, self.points.len() as u32]
    }

    /// The share of the light at `x` that comes from behind what `aim` holds.
    fn behind(&self, aim: &Aim, x: Vec3, normal: Vec3) -> f32 {
        let (mut all, mut behind) = (0.0, 0.0);
        for &(at, r2) in &self.points {
            let to = if r2 > 0.0 { at - x } else { at };
            let d2 = to.length_squared().max(1e-12);
            let d = to / d2.sqrt();
            let cos = d.dot(normal);
            if cos <= 0.0 {
                continue;
            }
            let light = if r2 > 0.0 { cos * r2 / d2 } else { cos };
            all += light;
            if aim.meets(d) {
                behind += light;
            }
        }
        if all > 0.0 { behind / all } else { 0.0 }
    }
}

/// Point `i` of those that are even over the unit square, whatever their number, and begin at `first`: Roberts' sequence R2.
#[inline]
pub(super) fn spread_over_square(first: Vec2, i: u32) -> Vec2 {
    (first + Vec2::new(0.754_877_7, 0.569_840_3) * i as f32).fract()
}

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// One sample in how many is enough where a ray along `direction` shows `first`, a real surface or infinity.
    pub(crate) fn thinning(&self, first: &First, direction: Vec3, lights: &Lights) -> u32 {
        let hit = match first {
            First::Object(_) => return 1,
            // What shows at the sky's rims, its neighbours tell.
            First::Infinity => return MOST_THINNING,
            First::Real(hit) => hit,
        };
        let x = self.world.leave(hit);
        if self.may_mirror_objects(hit, x, direction) {
            return 1;
        }
        let clusters = self.objects.clusters();
        let aim = Aim::new(clusters, x, hit.normal);
        let second_order = self.has_second_order(self.params.bounces);
        if aim.inside {
            return 1;
        }
        if aim.nothing() && !second_order {
            return MOST_THINNING;
        }
        let behind = lights.behind(&aim, x, hit.normal) - aim.form_factor;
        let spiky = self.objects.gloss() || self.objects.transmit();
        let found = if spiky { SPIKY * aim.form_factor.sqrt() } else { aim.form_factor };
        let mut share = found.max(behind);
        if second_order {
            share = share.max(SECOND_ORDER_SHARE * Aim::new(self.objects.surroundings(), x, hit.normal).form_factor);
        }
        let most = match spiky {
            _ if self.params.mis != Mis::Balance || self.objects.emit() => MOST_THINNING_UNAIMED,
            true => MOST_THINNING_SPIKY,
            false => MOST_THINNING,
        };
        thinning_of(share, most)
    }

    /// Whether the mirror image of an object may show at a real surface.
    fn may_mirror_objects(&self, hit: &RealHit, x: Vec3, direction: Vec3) -> bool {
        if self.world.beyond_diffuse(hit) == Vec3::ZERO {
            return false;
        }
        let axis = mirrored(direction, hit.normal);
        self.objects.balls().iter().any(|ball| {
            let to = ball.center - x;
            let along = to.dot(axis);
            along > -ball.radius && (to - axis * along).length_squared() <= ball.radius * ball.radius
        })
    }
}

/// One sample in how many is enough where `share` of the light may change: a power of two, at most `most`.
fn thinning_of(share: f32, most: u32) -> u32 {
    let mut thinning = 1;
    while thinning < most && share * share * ((2 * thinning) as f32) <= 1.0 {
        thinning *= 2;
    }
    thinning
}

/// What thinning leaves of a pixel's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Thinned {
    /// How many.
    pub(super) samples: u32,
    /// How many of the frame's samples each stands for.
    pub(super) boost: f32,
    /// How many of these look for changes, as a share, (0, 1]; the others count as none.
    pub(super) share: f32,
}

impl Thinned {
    /// For a pixel that shows what may be in `scene`: where an object may show, each sample has to tell whether it does.
    pub(super) fn of(scene: Scene, all: u32, thinning: u32, least: u32) -> Self {
        match scene {
            Scene::Mixed => Self::shared(all, thinning),
            Scene::Real => Self::new(all, thinning, least),
        }
    }

    /// Of `all` of the frame's samples one in `thinning`, but at `least` as many as that.
    fn new(all: u32, thinning: u32, least: u32) -> Self {
        let wanted = if thinning == NO_SAMPLES { 0.0 } else { all as f32 / thinning as f32 };
        let samples = (wanted.ceil() as u32).max(least);
        let share = (wanted / (ALWAYS * samples.max(1) as f32)).clamp(LEAST_SHARE, 1.0);
        Self { samples, boost: all as f32 / samples.max(1) as f32, share }
    }

    /// All of them, of which those that show real surfaces look for changes less often.
    fn shared(all: u32, thinning: u32) -> Self {
        let share = (1.0 / thinning as f32).max(LEAST_SHARE);
        Self { samples: all, boost: 1.0 / share, share }
    }
}

/// The least of each pixel's and its neighbours' thinning, `width` in a row: a pixel's centre does not tell what shows at its
/// edges. Columns wrap if `wrap`.
pub(super) fn least_of_neighbours(thinning: &[u32], width: usize, wrap: bool) -> Vec<u32> {
    let size = (width, thinning.len() / width);
    let least = |i: usize| around(i, size, 1, wrap).map(|n| thinning[n]).fold(thinning[i], u32::min);
    (0..thinning.len()).map(least).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_share_settles_the_samples() {
        assert_eq!([1.0, 0.8, 0.7, 0.5, 0.24, 0.12, 0.0].map(|share| thinning_of(share, 64)), [1, 1, 2, 4, 16, 64, 64]);
        assert_eq!(thinning_of(0.0, 4), 4);
        assert_eq!(thinning_of(f32::NAN, 64), 1);
        let thinned = |all, thinning, least| {
            let Thinned { samples, boost, share } = Thinned::new(all, thinning, least);
            (samples, boost, share)
        };
        assert_eq!([(64, 1), (64, 16), (65, 64)].map(|(all, t)| thinned(all, t, 0).0), [64, 4, 2]);
        assert_eq!(thinned(64, 16, 0), (4, 16.0, 1.0));
        assert_eq!(thinned(64, 256, 0), (1, 64.0, 1.0));
        assert_eq!(thinned(64, 1024, 0), (1, 64.0, 0.25));
        assert_eq!(thinned(16, 2048, 0), (1, 16.0, 0.125));
        assert_eq!(thinned(64, 4, 16), (16, 4.0, 1.0));
        assert_eq!(thinned(64, 32, 16), (16, 4.0, 0.5));
        assert_eq!(thinned(64, NO_SAMPLES, 0).0, 0);
        let shared = |thinning| Thinned::shared(64, thinning);
        assert_eq!(shared(1), Thinned { samples: 64, boost: 1.0, share: 1.0 });
        assert_eq!(shared(4), Thinned { samples: 64, boost: 4.0, share: 0.25 });
        assert_eq!(shared(2048).share, LEAST_SHARE);
    }

    proptest! {
        #[test]
        fn neighbours_are_those_around(
            (width, thinning) in (1usize..7, 1usize..6).prop_flat_map(|(w, h)| (Just(w), prop::collection::vec(1u32..65, w * h))),
            wrap in any::<bool>(),
        ) {
            let (w, h) = (width as i64, (thinning.len() / width) as i64);
            let found = least_of_neighbours(&thinning, width, wrap);
            for (i, found) in found.into_iter().enumerate() {
                let (x, y) = (i as i64 % w, i as i64 / w);
                let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
                let least = around
                    .map(|(x, y)| (if wrap { x.rem_euclid(w) } else { x }, y))
                    .filter(|&(x, y)| (0..w).contains(&x) && (0..h).contains(&y))
                    .map(|(x, y)| thinning[(y * w + x) as usize])
                    .min();
                prop_assert_eq!(Some(found), least);
            }
        }
    }
}
