//! Lens effects on the finished picture: bloom and glare (RT²AR: Santos et al. 2012, section IV.F).
//!
//! Bright light is taken out of the picture, above a threshold, and spread: by successive Gaussian filters (bloom), and along
//! diagonal rays (glare) in `n` passes of `s` samples, each `b = 4^(n−1)` pixels from the next (equations 1 and 2), weighted by
//! `a^(b·s)` (equation 3), once for each pair of signs.
//!
//! *Departures*. The paper adds the spread light to the picture. A lens scatters light and makes none: here its share is taken
//! away from where it came from, and the weights add up to 1, so that the picture keeps its energy but for what leaves the
//! frame, which [`Report`] tells. And the photo went through a lens already: unless [`Params::everything`] is asked for, only
//! the light that the objects add is spread, and whatever lies beyond its reach keeps its bits.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
mod shapes;

use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::RadianceImage;
use pano_core::{Error, Result};

/// What is spread, how far, and how much of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Share of bright light that goes into the bloom, [0, 1]; 0 switches it off.
    pub bloom: f32,
    /// Share of still brighter light that goes into the glare, [0, 1]; 0 switches it off.
    pub glare: f32,
    /// Luminance above which light is bright, ≥ 0, in units of the picture. The glare's is half as high again: "a little
    /// higher".
    pub threshold: f32,
    /// Standard deviation of the bloom as a share of the picture's height, (0, 0.25].
    pub radius: f32,
    /// Attenuation a pixel of the glare's rays, [0.5, 0.99]; the paper takes 0.85 to 0.95.
    pub attenuation: f32,
    /// Passes of the glare, [1, 4]; each makes its rays four times as long.
    pub passes: u32,
    /// Spread the photo's own bright light as well, as the paper does.
    pub everything: bool,
    /// The picture is a whole panorama: columns wrap.
    pub wrap: bool,
}

impl Default for Params {
    /// Both off.
    fn default() -> Self {
        Self { bloom: 0.0, glare: 0.0, threshold: 1.0, radius: 0.02, attenuation: 0.9, passes: 3, everything: false, wrap: false }
    }
}

impl Params {
    /// Whether anything is asked for.
    pub fn is_on(&self) -> bool {
        self.bloom > 0.0 || self.glare > 0.0
    }

    /// That every value is in its range, and photo and picture are of one size.
    fn check(&self, photo: (usize, usize), picture: (usize, usize)) -> Result<()> {
        let ranges = [
            ("bloom", self.bloom, 0.0, 1.0),
            ("glare", self.glare, 0.0, 1.0),
            ("threshold", self.threshold, 0.0, f32::MAX),
            ("radius", self.radius, f32::MIN_POSITIVE, 0.25),
            ("attenuation", self.attenuation, 0.5, 0.99),
            ("passes", self.passes as f32, 1.0, 4.0),
            ("bloom and glare together", self.bloom + self.glare, 0.0, 1.0),
        ];
        if let Some((name, value, low, high)) = ranges.into_iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            return Err(Error::argument(format!("lens effects: {name} is {value}; give a value in [{low}, {high}]")));
        }
        if photo != picture {
            return Err(Error::argument(format!("lens effects: the photo has {photo:?} pixels, the picture {picture:?}")));
        }
        Ok(())
    }
}

/// What the effects did to the picture, in luminance summed over its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Before.
    pub before: f64,
    /// Taken from where it was and spread.
    pub spread: f64,
    /// After less before: what left the frame, ≤ 0 up to rounding.
    pub change: f64,
}

/// Applies the effects to `picture`, the composite over `photo`. Finite input ≥ 0 gives finite output ≥ 0; what is no number, or
/// infinite, is no light to spread.
///
/// # Errors
/// [`Error::Argument`] if a parameter is out of range or the pictures differ in size.
pub fn apply(params: &Params, photo: &RadianceImage, picture: &mut RadianceImage) -> Result<Report> {
    params.check(photo.size(), picture.size())?;
    let before = total(picture);
    let spread = if params.is_on() { cpu::apply(params, photo, picture) } else { 0.0 };
    Ok(Report { before, spread, change: total(picture) - before })
}

/// Luminance summed over the pixels.
fn total(picture: &RadianceImage) -> f64 {
    picture.data().iter().map(|&p| f64::from(luminance(p))).sum()
}

/// The brightest light that is spread, a channel; what is brighter loses and spreads as much. Sums over a frame of 3·10⁸ pixels
/// stay finite in `f32`.
const BRIGHTEST: f32 = 1e30;

/// The part of `radiance` above a luminance of `threshold`.
fn bright(radiance: Vec3, threshold: f32) -> Vec3 {
    if !radiance.is_finite() {
        return Vec3::ZERO;
    }
    let radiance = radiance.min(Vec3::splat(BRIGHTEST));
    let l = luminance(radiance);
    if l > threshold { radiance * (1.0 - threshold / l) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests;
