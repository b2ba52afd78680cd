//! Stage: lights over the frames of a video, so that shadows follow them and do not flicker.
//!
//! Detection looks at each frame by itself: compression, noise and passing clouds let lights appear, vanish, jump and change in
//! brightness from frame to frame. The tracker gives each light an identity, follows it by its direction (over the seam and
//! the zenith as anywhere else), smooths what it sends, and fades lights in and out. Where the picture is suddenly another
//! one, it forgets everything: the first frame after a cut is lit by what is in it.
//!
//! MR360 leaves this to the game engine; this is an addition.

mod cpu;
mod signature;

use crate::WorkingMap;
use pano_core::light::DirectionalLight;
use signature::Signature;

/// Knobs of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Share of a light's irradiance and size that is taken from each new frame, (0, 1]. Lower flickers less and follows changes
    /// later: 0.15 has adopted 80 % of a change after ten frames.
    pub smoothing: f32,
    /// The same for its direction. Directions flicker less and lag shows, so that more is new.
    pub direction_smoothing: f32,
    /// Frames in which a light that appears comes to full strength, and one that is no longer found vanishes, ≥ 1.
    pub fade_frames: u32,
    /// Degrees that a light may move between two frames, besides its own radius.
    pub gate_degrees: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { smoothing: 0.15, direction_smoothing: 0.35, fade_frames: 10, gate_degrees: 10.0 }
    }
}

/// A light with an identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedLight {
    /// Never used again for another light of the tracker, also after a cut.
    pub id: u64,
    /// Smoothed, and dimmed while it fades in or out.
    pub light: DirectionalLight,
}

/// Follows lights from frame to frame.
#[derive(Clone, Debug)]
pub struct Tracker {
    params: Params,
    tracks: Vec<Track>,
    next_id: u64,
    /// What the last frame looked like.
    last: Option<Signature>,
}

/// A light that is followed.
#[derive(Clone, Copy, Debug)]
struct Track {
    id: u64,
    light: DirectionalLight,
    /// How much of it shows, (0, 1].
    presence: f32,
}

impl Tracker {
    /// Knows no light yet.
    pub fn new(params: Params) -> Self {
        Self { params, tracks: Vec::new(), next_id: 0, last: None }
    }

    /// Takes in the next frame: what it looks like, and the lights found in it. Returns the lights to render it with, strongest
    /// first.
    pub fn update(&mut self, map: &WorkingMap, found: &[DirectionalLight]) -> Vec<TrackedLight> {
        let seen = Signature::of(map);
        let cut = self.last.as_ref().is_none_or(|last| last.is_cut(&seen));
        self.last = Some(seen);
        if cut {
            self.tracks.clear();
        }
        cpu::update(self, found, cut)
    }
}

#[cfg(test)]
mod tests;
