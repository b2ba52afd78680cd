//! Assignment and smoothing. A frame has a dozen lights, so that every pair is looked at.

use super::{Track, TrackedLight, Tracker};
use crate::expand::LUMA_WEIGHTS;
use pano_core::light::DirectionalLight;

/// Degrees that a factor of e in irradiance counts as, when it is decided which of two lights close by is which.
const LIKENESS: f32 = 3.0;

/// See [`Tracker::update`]; with `at_once` new lights do not fade in.
pub(super) fn update(tracker: &mut Tracker, found: &[DirectionalLight], at_once: bool) -> Vec<TrackedLight> {
    let params = tracker.params;
    let step = 1.0 / params.fade_frames.max(1) as f32;
    let known = tracker.tracks.len();
    let owners = assigned(&tracker.tracks, found, params.gate_degrees);

    let mut seen = vec![false; known];
    for (light, owner) in found.iter().zip(owners) {
        match owner {
            Some(i) => {
                let track = &mut tracker.tracks[i];
                track.light = blended(&track.light, light, params.smoothing, params.direction_smoothing);
                track.presence = (track.presence + step).min(1.0);
                seen[i] = true;
            }
            None => {
                tracker.tracks.push(Track { id: tracker.next_id, light: *light, presence: if at_once { 1.0 } else { step } });
                tracker.next_id += 1;
            }
        }
    }
    for (track, _) in tracker.tracks.iter_mut().zip(&seen).filter(|(_, seen)| !**seen) {
        track.presence -= step;
    }
    // Half a step: the sum of ten tenths is not one.
    tracker.tracks.retain(|track| track.presence > 0.5 * step);

    let mut lights: Vec<TrackedLight> = tracker.tracks.iter().map(shown).collect();
    let strength = |t: &TrackedLight| t.light.intensity.dot(LUMA_WEIGHTS);
    lights.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    lights
}

/// Which track each light belongs to. The likeliest pair is taken first, and no track twice.
fn assigned(tracks: &[Track], found: &[DirectionalLight], gate_degrees: f32) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (f, light) in found.iter().enumerate() {
        for (t, track) in tracks.iter().enumerate() {
            let angle = light.direction.dot(track.light.direction).clamp(-1.0, 1.0).acos().to_degrees();
            let radius = light.solid_angle.max(track.light.solid_angle);
            let radius = DirectionalLight { solid_angle: radius, ..*light }.cos_radius().clamp(-1.0, 1.0).acos().to_degrees();
            if angle <= gate_degrees + radius {
                let ratio = light.irradiance.dot(LUMA_WEIGHTS) / track.light.irradiance.dot(LUMA_WEIGHTS);
                pairs.push((angle + LIKENESS * ratio.ln().abs(), f, t));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut owners, mut taken) = (vec![None; found.len()], vec![false; tracks.len()]);
    for (_, f, t) in pairs {
        if owners[f].is_none() && !taken[t] {
            owners[f] = Some(t);
            taken[t] = true;
        }
    }
    owners
}

/// `old`, moved towards `new`.
fn blended(old: &DirectionalLight, new: &DirectionalLight, share: f32, direction_share: f32) -> DirectionalLight {
    DirectionalLight {
        // Opposite directions have no way between them; there the new one counts.
        direction: old.direction.lerp(new.direction, direction_share).try_normalize().unwrap_or(new.direction),
        irradiance: old.irradiance.lerp(new.irradiance, share),
        solid_angle: old.solid_angle + (new.solid_angle - old.solid_angle) * share,
        intensity: old.intensity.lerp(new.intensity, share),
    }
}

/// A track as it is rendered.
fn shown(track: &Track) -> TrackedLight {
    let light = DirectionalLight {
        irradiance: track.light.irradiance * track.presence,
        intensity: track.light.intensity * track.presence,
        ..track.light
    };
    TrackedLight { id: track.id, light }
}
