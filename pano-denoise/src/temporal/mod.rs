//! Temporal accumulation along motion vectors (IPRT, "filtering"; Schied et al. 2017).
//!
//! Each pixel asks where its point was in the previous frame. The four texels around that place take part if they show the
//! same surface: the same thing, at the distance expected, turned the same way. What they know is corrected by what the new
//! frame shows around the pixel, which ends ghosts of shadows and reflections that no motion vector follows, and blended with
//! the new value. A pixel's first frames count equally, then the new one counts [`Params::blend`], or [`Params::still`].
//!
//! *Departure*: the paper accumulates what it has filtered, and clamps history to the range of the neighbours. The filter then
//! has one frame to tell shadows from noise, and blurs what many frames would show. Here history is of unfiltered values, with
//! the variance from which the filter learns how much is left to do ([`crate::atrous`]). The range of unfiltered neighbours says
//! nothing of them; so history and new frame are compared by their means over 7×7 pixels, and history is moved by as much
//! of the difference as noise does not explain. Pixels without noise, those of mirrors, are clamped to their neighbours' range.
//! The paper's tenth leaves 1/4.4 of a frame's noise, however long nothing moves. As changes of the light are found by that
//! comparison, points that stay at their pixel can be remembered longer: [`Params::still`].

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use glam::{Vec2, Vec3};
use pano_core::image::Image;
use pano_core::{Error, Result};

/// How much of the past is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The picture is a whole panorama: places wrap at ±180° and step over the poles. Default false.
    pub wrap: bool,
    /// Weight of the new frame once a pixel has 1/blend frames, (0, 1]. Lower is smoother and lags longer. Default 0.1 (the
    /// paper's).
    pub blend: f32,
    /// The same where the point stays at its pixel and the light on it has not changed beyond noise; larger than `blend`, it
    /// counts as that. Default 1/32: a second of video; noise falls to 1/8.
    pub still: f32,
    /// Largest relative difference between the distance a point should have had and the one that was seen. Default 0.05.
    pub depth: f32,
    /// Least cosine between the normals. Default 0.9.
    pub normal: f32,
    /// The mean of history over 7×7 pixels stays within this many standard errors of that of the new frame, ≥ 0. Lower ends
    /// ghosts sooner and keeps more noise; infinity switches the correction off. Default 2: noise alone is beyond it in one
    /// pixel of twenty.
    pub clamp: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { wrap: false, blend: 0.1, still: 1.0 / 32.0, depth: 0.05, normal: 0.9, clamp: 2.0 }
    }
}

/// What a frame shows and where that was before. All pictures have one size.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Distance along the ray, not finite where nothing is.
    pub depth: &'a Image<f32>,
    /// World-space unit normal, zero where there is nothing.
    pub normal: &'a Image<Vec3>,
    /// Which thing is seen: 0 for real surfaces, n + 1 for the n-th object; below 2²⁹.
    pub thing: &'a Image<u32>,
    /// Where the point seen at the pixel's centre was in the previous frame, in pixels (centres at +½); NaN where it was not
    /// in sight.
    pub previous: &'a Image<Vec2>,
    /// The point's distance from the previous camera.
    pub previous_depth: &'a Image<f32>,
    /// Where there is no noise worth the name, as in mirrors; `None`: nowhere.
    pub sharp: Option<&'a Image<bool>>,
    /// 0 where the new value was sampled, n (≤ [`MOST_SPARSE`]) where it was interpolated between samples of one pixel in 4ⁿ:
    /// it counts that much less, tells nothing of noise and ends no ghost. `None`: sampled everywhere.
    pub level: Option<&'a Image<u8>>,
}

/// The greatest level of sparseness; higher ones count as this.
pub const MOST_SPARSE: u8 = 3;

impl Params {
    /// That every value is in its range.
    fn check(&self) -> Result<()> {
        if !(self.blend > 0.0 && self.blend <= 1.0) {
            return Err(Error::argument(format!("temporal filter: blend is {}; give a value in (0, 1]", self.blend)));
        }
        if !(self.still > 0.0 && self.still <= 1.0) {
            return Err(Error::argument(format!("temporal filter: still is {}; give a value in (0, 1]", self.still)));
        }
        if self.clamp.is_nan() || self.clamp < 0.0 {
            return Err(Error::argument(format!("temporal filter: clamp is {}; give 0 or more", self.clamp)));
        }
        Ok(())
    }

    /// Least weight of the new frame.
    fn blend_of(&self, still: bool) -> f64 {
        f64::from(if still { self.still.min(self.blend) } else { self.blend })
    }
}

impl Guides<'_> {
    fn is_sharp(&self, x: usize, y: usize) -> bool {
        self.sharp.is_some_and(|sharp| sharp.get(x, y))
    }

    fn level(&self, x: usize, y: usize) -> u8 {
        self.level.map_or(0, |level| level.get(x, y).min(MOST_SPARSE))
    }

    /// That all pictures have the signal's size.
    fn check(&self, size: (usize, usize), measured: Option<&Image<f32>>) -> Result<()> {
        let mut pictures = vec![
            ("depth", self.depth.size()),
            ("normal", self.normal.size()),
            ("thing", self.thing.size()),
            ("previous", self.previous.size()),
            ("previous_depth", self.previous_depth.size()),
        ];
        pictures.extend(self.sharp.map(|sharp| ("sharp", sharp.size())));
        pictures.extend(self.level.map(|level| ("level", level.size())));
        pictures.extend(measured.map(|measured| ("variance", measured.size())));
        crate::check_sizes("temporal filter", size, &pictures)
    }
}

/// What is kept of a frame for the next one.
#[derive(Clone, Debug)]
pub struct History {
    pub(crate) signal: Image<Vec3>,
    /// Of the luminance of one frame's value.
    pub(crate) variance: Image<f32>,
    pub(crate) depth: Image<f32>,
    pub(crate) normal: Image<Vec3>,
    pub(crate) thing: Image<u32>,
    /// See [`Self::frames`].
    pub(crate) frames: Image<f32>,
}

impl History {
    /// The accumulated signal.
    pub fn signal(&self) -> &Image<Vec3> {
        &self.signal
    }

    /// As many frames as each pixel's value is worth: the equal mean of so many would be as noisy. 0 where nothing is known and
    /// the value is 0.
    pub fn frames(&self) -> &Image<f32> {
        &self.frames
    }
}

/// Blends `history` into `signal` and makes the new history of it. Without history (the first frame, or one after a cut, or
/// of another size) the signal stays as it is. Values of `signal` that are not finite are replaced by history or 0.
///
/// Returns the variance of each pixel's luminance now. That of the new values is `measured` (≥ 0), if it is known, or that of
/// the differences between frame and history in the 7×7 pixels around that show the same surface: history knows what is no noise.
///
/// # Errors
/// [`pano_core::Error::Argument`] if a parameter is out of range or the pictures differ in size.
pub fn accumulate(
    params: &Params,
    guides: &Guides<'_>,
    measured: Option<&Image<f32>>,
    signal: &mut Image<Vec3>,
    history: &mut Option<History>,
) -> Result<Image<f32>> {
    params.check()?;
    guides.check(signal.size(), measured)?;
    let past = history.take().filter(|h| h.signal.size() == signal.size());
    let (kept, variance) = cpu::accumulate(params, guides, measured, signal, past.as_ref());
    *history = Some(kept);
    Ok(variance)
}

#[cfg(test)]
mod tests;
