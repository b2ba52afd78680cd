//! The light on sides that the panorama has not seen.

use super::CapturedWorld;
use super::irradiance::estimate;
use crate::world::{RealHit, proxy::reflectance_from};
use glam::{UVec2, Vec3};
use pano_core::random::{Sampler, Stream};
use std::f32::consts::FRAC_1_PI;

impl CapturedWorld {
    /// Radiance of an assumed back face at `hit`, made of what the panorama shows along `q`.
    ///
    /// The paper gives it the colour of q. *Departure*: it gets the reflectance of q and the light that it faces itself: the
    /// far side of a lamp may hang in full daylight. That light is an estimate, unbiased over many rays, with random numbers
    /// drawn from the place itself; back faces met by its own rays keep the colour of their fronts.
    pub(super) fn relit(&self, hit: &RealHit, q: Vec3) -> Vec3 {
        let shown = hit.radiance.unwrap_or(Vec3::ZERO);
        let lit = self.hidden_samples > 0 && self.irradiance.is_some();
        let Some(front) = lit.then(|| self.look(q)).flatten() else { return shown };
        let received = self.irradiance(&front);
        let reflectance = reflectance_from(shown, received, self.cap);
        let own = (shown - reflectance * received * FRAC_1_PI).max(Vec3::ZERO);
        let [x, y, z] = hit.position.to_array().map(f32::to_bits);
        let stream = Stream { frame: u32::MAX, seed: z };
        let received =
            (0..self.hidden_samples).map(|i| estimate(self, hit, &mut Sampler::new(UVec2::new(x, y), i, stream))).sum::<Vec3>();
        own + reflectance * received * (FRAC_1_PI / self.hidden_samples as f32)
    }
}
