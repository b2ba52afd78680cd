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
pub(super) const GLOW: f32 = 0.5;

/// Cells along what lies between a place and the capture point, which share random numbers: so many, as a power of two, or up to
/// twice that. More would let rounding choose the numbers, and backends differ; with fewer, what a mirror shows would be blocks of one
/// noise. A pixel is some ten cells wide.
pub(super) const CELL_BITS: u32 = 12;

/// The cell of a place relative to the capture point.
fn cell_around(place: Vec3) -> [u32; 3] {
    let exponent = (place.length().to_bits() >> 23).clamp(64, 190);
    let scale = f32::from_bits((254 + CELL_BITS - exponent) << 23);
    (place * scale).floor().to_array().map(|c| (c as i32).cast_unsigned())
}

impl CapturedWorld {
    /// Radiance of an assumed back face at `hit`, made of what the panorama shows along `q`.
    ///
    /// The paper gives it the colour of q. *Departure*: it gets the reflectance of q and the light that it faces itself: the
    /// far side of a lamp may hang in full daylight. That light is an estimate, unbiased over many rays, with random numbers
    /// drawn from the place itself ([`cell_around`]); back faces met by its own rays keep the colour of their fronts.
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
        let [x, y, z] = cell_around(hit.position - self.capture);
        // A stream of its own again; the place takes the seed's place, and the seed that of the frame.
        let stream = Stream { frame: !self.seed, seed: z };
        let received = (0..self.hidden_samples)
            .map(|i| estimate(self, hit, Back::AsFront, &mut Sampler::new(UVec2::new(x, y), i, stream)))
            .sum::<Vec3>();
        own + reflectance * received * (FRAC_1_PI / self.hidden_samples as f32)
    }
}
