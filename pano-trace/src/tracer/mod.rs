//! The tracers: what the virtual objects look like, and what they change.
//!
//! | method | what it computes |
//! |---|---|
//! | [`Method::Dpt`] | delta path tracing (Xu et al.): only the change, in one pass |
//! | [`Method::OnePass`] | one-pass differential path tracing (Kán & Kaufmann): both solutions along shared rays |
//! | [`Method::TwoPass`] | differential rendering (Debevec): two independent solutions, subtracted |
//! | [`Method::Ibl`] | image-based lighting: objects lit from infinity, nothing blocked, nothing changed |
//!
//! All work on any [`RealWorld`]; on captured radiance, paths end at the first real surface.

mod adaptive;
mod delta;
mod differential;
#[cfg(feature = "gpu")]
pub mod gpu;
mod ibl;
mod influence;
mod mirror;
mod path;
mod render;

pub(crate) use influence::Lights;
pub(crate) use path::{First, Scene};
pub use render::{Frame, Sampling, Traced, render};
pub(crate) use render::{Pixel, around, layers, pixels};

use crate::objects::Objects;
use crate::world::RealWorld;
use pano_core::random::Sampler;

/// Which estimator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Delta path tracing.
    #[default]
    Dpt,
    /// One-pass differential path tracing.
    OnePass,
    /// Two-pass differential path tracing.
    TwoPass,
    /// Image-based lighting.
    Ibl,
}

/// How a frame is traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceParams {
    /// Which estimator.
    pub method: Method,
    /// Samples a pixel, ≥ 1. Noise falls with the root, time grows linearly.
    pub samples: u32,
    /// Scattering events after the camera, ≥ 1: 1 is direct light only.
    pub bounces: u32,
    /// Combine light and BSDF sampling (balance heuristic), or use one of them alone, for comparison.
    pub mis: Mis,
    /// Whether paths that end on captured radiance add that surface's own change (second order; `bounces` ≥ 2).
    pub second_order: bool,
    /// Ask every pixel and every direction for a change, also where the objects' bounds say that there is none: the same
    /// picture for more time, to compare with.
    pub everywhere: bool,
    /// Adaptive sampling: the root mean square error, in luminance before any filter, that the frame's noisy pixels may keep.
    /// `samples` is then the most that a pixel takes, and 16 the least. `None`: every pixel takes `samples`.
    pub error_target: Option<f32>,
}

/// Which sampling strategies direct light uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mis {
    /// Both, weighted by the balance heuristic.
    #[default]
    Balance,
    /// Light sampling only (BSDF sampling where a surface is perfectly smooth).
    LightOnly,
    /// BSDF sampling only.
    BsdfOnly,
}

impl Default for TraceParams {
    fn default() -> Self {
        Self {
            method: Method::Dpt,
            samples: 64,
            bounces: 3,
            mis: Mis::Balance,
            second_order: true,
            everywhere: false,
            error_target: None,
        }
    }
}

/// The scene and settings that every path of a frame shares.
#[derive(Debug)]
pub(crate) struct Tracer<'a, W> {
    pub(crate) objects: &'a Objects,
    pub(crate) world: &'a W,
    pub(crate) params: &'a TraceParams,
}

/// The state of one sample: its random numbers and how many rays it has cost.
#[derive(Debug)]
pub(crate) struct Walk {
    pub(crate) sampler: Sampler,
    pub(crate) rays: u64,
}

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// Weight of a sample drawn with density `mine` that the strategy with density `other` could have drawn as well.
    #[inline]
    fn balance(&self, mine: f32, other: f32) -> f32 {
        if mine > 0.0 { mine / (mine + other) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests;
