//! The light on sides that the panorama has not seen.

use super::irradiance::estimate;
use super::{Back, CapturedWorld};
use crate::world::{RealHit, proxy::reflectance_from};
use glam::{UVec2, Vec3};
use pano_core::random::{Sampler, Stream};
use std::f32::consts::FRAC_1_PI;

/// The share of a front's light beyond what white paint would send out that its assumed back face sends out. For a shining ball it is right: the side turned
/// from the eye adds half a disc to what is seen at right angles to the line of sight, where the assumed face, as long as the
/// front, adds a whole one.
const GLOW: f32 = 0.5;

impl CapturedWorld {
    /// Radiance of an assumed back face at `hit`, made of what the panorama shows along `q`.
    ///
    /// The paper gives it the colour of q. *Departure*: it gets the reflectance of q and the light that it faces itself: the
    /// far side of a lamp may hang in full daylight. That light is an estimate, unbiased over many rays, with random numbers
    /// drawn from the place itself; back faces met by its own rays keep the colour of their fronts.
    pub(super) fn relit(&self, hit: &RealHit, q: Vec3) -> Vec3 {
        let shown = hit.radiance.unwrap_or(Vec3::ZERO);
        let Some(front) = self.irradiance.is_some().then(|| self.look(q)).flatten() else { return shown };
        let received = self.irradiance(&front);
        let reflectance = reflectance_from(shown, received, self.cap);
        let (white, sent) = (received * FRAC_1_PI, reflectance * received * FRAC_1_PI);
        let own = (shown.min(white) - sent).max(Vec3::ZERO) + (shown - white).max(Vec3::ZERO) * GLOW;
        if self.hidden_samples == 0 {
            return own + sent;
        }
        let [x, y, z] = hit.position.to_array().map(f32::to_bits);
        let stream = Stream { frame: u32::MAX, seed: z };
        let received = (0..self.hidden_samples)
            .map(|i| estimate(self, hit, Back::AsFront, &mut Sampler::new(UVec2::new(x, y), i, stream)))
            .sum::<Vec3>();
        own + reflectance * received * (FRAC_1_PI / self.hidden_samples as f32)
    }
}
