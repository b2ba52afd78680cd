//! What goes along with a pixel's samples and with each ray.

use super::frame::MAX_LIGHTS;
use super::media::Media;
use super::shadow::{Lightable, Lit, Verdicts};
use super::survey::Consensus;
use crate::objects::Differentials;
use crate::tracer::Walk;
use glam::{UVec2, Vec3};
use pano_core::random::{Sampler, Stream};

/// The state of a pixel's samples, one after the other.
pub(super) struct Trail {
    pub(super) walk: Walk,
    pub(super) shadow_rays: u64,
    /// All samples of a light, whatever the probes say.
    pub(super) thorough: bool,
    pub(super) verdicts: Verdicts,
    /// Per light what the probes of the samples so far agree on.
    pub(super) consensus: Consensus,
    /// Per light the share that reaches what the sample shows.
    pub(super) reached: [f32; MAX_LIGHTS],
}

impl Trail {
    /// Before the first sample.
    pub(super) fn new(thorough: bool) -> Self {
        Self {
            walk: Walk { sampler: Sampler::new(UVec2::ZERO, 0, Stream::default()), rays: 0 },
            shadow_rays: 0,
            thorough,
            verdicts: Verdicts::default(),
            consensus: Consensus::default(),
            reached: [0.0; MAX_LIGHTS],
        }
    }

    /// Keeps what is found about a light where a pixel shows it.
    pub(super) fn note<F>(&mut self, light: usize, point: &Lightable<F>, lit: Lit, bright: bool, penumbra: bool) {
        if point.shown {
            let bit = 1 << light;
            let found = if bright { (bit, 0) } else { (0, bit) };
            self.verdicts.join(Verdicts { bright: found.0, dark: found.1, penumbra: if penumbra { bit } else { 0 } });
            self.reached[light] = lit.reaches.element_sum() / 3.0;
        }
    }
}

/// A ray that is followed: where it is, and what it still counts.
#[derive(Clone, Copy)]
pub(super) struct Path {
    /// Surfaces that have bent it.
    pub(super) depth: u32,
    /// The bodies it is in.
    pub(super) media: Media,
    /// Its share of the pixel.
    pub(super) weight: f32,
    /// What it covers, where textures are filtered.
    pub(super) beam: Option<Differentials>,
}

impl Path {
    /// From the camera, which is in air.
    pub(super) fn primary() -> Self {
        Self { depth: 0, media: Media::default(), weight: 1.0, beam: None }
    }

    pub(super) fn onward(&self, media: Media, weight: Vec3, beam: Option<Differentials>) -> Self {
        Self { depth: self.depth + 1, media, weight: self.weight * weight.max_element(), beam }
    }
}
