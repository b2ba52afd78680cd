//! Interactive panoramic ray tracing (Wu & Wang, "Panoramic Ray Tracing for Interactive Mixed Reality Rendering Based on
//! 360° RGBD Video"): irradiance of the view's pixels by rays against the panorama, with and without the virtual objects.
//!
//! Algorithm 1 runs in two passes, each with one sample a pixel and frame:
//!
//! 1. [`trace_real`]: real pixels. One ray finds E_R; if it meets an object on the way, it finds E_RV by following the light
//!    the object sends back, else E_RV = E_R. Both use the same ray, so that their ratio is free of noise where no object is
//!    met. [`UpdatedWorld`] then shows the panorama with the ratio E_RV / E_R applied where the view sees it.
//! 2. [`trace_virtual`]: virtual pixels, against the updated panorama.
//!
//! A still takes N such frames and averages them; a sequence takes one and keeps the past.
//!
//! Departures from the paper:
//! - Light is found in proportion to the cosine *or* to the panorama's radiance, half the samples each, joined by the balance
//!   heuristic. The paper's cosine alone needs far more filtering under a small lamp.
//! - Objects are met through their BVH. The paper's way, screen space alone, is [`Reach::Screen`].
//! - What is filtered is E_R and the change E_RV − E_R, not E_RV: the change has the sharp shadows, E_R is smooth.

mod gbuffer;
#[cfg(feature = "gpu")]
pub mod gpu;
mod motion;
mod screen;
mod trace;
mod update;

pub use gbuffer::GBuffer;
pub use motion::{Earlier, Motion, motion};
pub use screen::{EXTENSION, ScreenObjects};
pub use trace::{RealEstimate, VirtualEstimate, trace_real, trace_virtual};
pub use update::{Update, UpdatedWorld, panorama_update};

use crate::objects::Objects;
use glam::Vec3;
use pano_core::{camera::Camera, random::Stream};

/// What every pass of a frame shares.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The view.
    pub camera: &'a Camera,
    /// The virtual objects.
    pub objects: &'a Objects,
    /// Where the panorama was captured.
    pub capture: Vec3,
    /// Which random numbers.
    pub stream: Stream,
}

/// How rays of real pixels find objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// Through the BVH: all objects, all of their sides.
    #[default]
    Bvh,
    /// In screen space: only what the view, extended to 110 %, shows of them (the paper's way).
    Screen,
}

/// How a frame is traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Frames of one sample a pixel that are averaged, ≥ 1. Noise falls with the root, time grows linearly.
    pub samples: u32,
    /// Points of a pixel that a sample tries before it gives up finding a real surface (in the first pass) or an object (in
    /// the second), ≥ 1. With 1 the share of samples that find one is the pixel's; with more every pixel at a silhouette has
    /// a value of both kinds, and its share is [`GBuffer::coverage`]'s.
    pub attempts: u32,
    /// Scattering events after the camera, ≥ 1.
    pub bounces: u32,
    /// How rays find objects.
    pub reach: Reach,
}

impl Default for Params {
    fn default() -> Self {
        Self { samples: 1, attempts: 1, bounces: 3, reach: Reach::Bvh }
    }
}

#[cfg(test)]
mod tests;
