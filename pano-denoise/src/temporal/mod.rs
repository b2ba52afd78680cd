//! Temporal accumulation along motion vectors (IPRT, "filtering"; Schied et al. 2017).
//!
//! Each pixel asks where its point was in the previous frame. The four texels around that place take part if they show the
//! same surface: the same thing, at the distance expected, turned the same way. What is left of them is clamped to the
//! range of the pixel's neighbourhood in the new frame, which ends ghosts of shadows and reflections that no motion vector
//! follows, and blended with the new value. A pixel's first frames count equally, then the new one counts
//! [`Params::blend`].

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
    /// Largest relative difference between the distance a point should have had and the one that was seen. Default 0.05.
    pub depth: f32,
    /// Least cosine between the normals. Default 0.9.
    pub normal: f32,
    /// History stays within this many standard deviations of the mean of the 5×5 pixels around it in the new frame, ≥ 0.
    /// Lower ends ghosts sooner and keeps more noise; infinity switches the clamp off. Default 1.5.
    pub clamp: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { wrap: false, blend: 0.1, depth: 0.05, normal: 0.9, clamp: 1.5 }
    }
}

/// What a frame shows and where that was before. All pictures have one size.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Distance along the ray, not finite where nothing is.
    pub depth: &'a Image<f32>,
    /// World-space unit normal, zero where there is nothing.
    pub normal: &'a Image<Vec3>,
    /// Which thing is seen: 0 for real surfaces, n + 1 for the n-th object.
    pub thing: &'a Image<u32>,
    /// Where the point seen at the pixel's centre was in the previous frame, in pixels (centres at +½); NaN where it was not
    /// in sight.
    pub previous: &'a Image<Vec2>,
    /// The point's distance from the previous camera.
    pub previous_depth: &'a Image<f32>,
}

impl Params {
    /// That every value is in its range.
    fn check(&self) -> Result<()> {
        if !(self.blend > 0.0 && self.blend <= 1.0) {
            return Err(Error::argument(format!("temporal filter: blend is {}; give a value in (0, 1]", self.blend)));
        }
        if self.clamp.is_nan() || self.clamp < 0.0 {
            return Err(Error::argument(format!("temporal filter: clamp is {}; give 0 or more", self.clamp)));
        }
        Ok(())
    }
}

impl Guides<'_> {
    /// That all pictures have the signal's size.
    fn check(&self, size: (usize, usize)) -> Result<()> {
        crate::check_sizes(
            "temporal filter",
            size,
            &[
                ("depth", self.depth.size()),
                ("normal", self.normal.size()),
                ("thing", self.thing.size()),
                ("previous", self.previous.size()),
                ("previous_depth", self.previous_depth.size()),
            ],
        )
    }
}

/// What is kept of a frame for the next one.
#[derive(Clone, Debug)]
pub struct History {
    pub(crate) signal: Image<Vec3>,
    pub(crate) depth: Image<f32>,
    pub(crate) normal: Image<Vec3>,
    pub(crate) thing: Image<u32>,
    /// Frames that each pixel's value is made of.
    pub(crate) length: Image<u32>,
}

impl History {
    /// The accumulated signal.
    pub fn signal(&self) -> &Image<Vec3> {
        &self.signal
    }

    /// Frames that each pixel's value is made of, ≥ 1.
    pub fn length(&self) -> &Image<u32> {
        &self.length
    }
}

/// Blends `history` into `signal` and makes the new history of it. Without history (the first frame, or one after a cut, or
/// of another size) the signal stays as it is. Values of `signal` that are not finite are replaced by history or 0.
///
/// # Errors
/// [`Error::Argument`] if a parameter is out of range or the pictures differ in size.
pub fn accumulate(params: &Params, guides: &Guides<'_>, signal: &mut Image<Vec3>, history: &mut Option<History>) -> Result<()> {
    params.check()?;
    guides.check(signal.size())?;
    let past = history.take().filter(|h| h.signal.size() == signal.size());
    *history = Some(cpu::accumulate(params, guides, signal, past.as_ref()));
    Ok(())
}

#[cfg(test)]
mod tests;
