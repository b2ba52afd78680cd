//! What lights a frame of MR360: its lights, tracked from frame to frame, and the maps of what is left.

use super::device::Device;
use super::{Inputs, Result, Settings};
use glam::Quat;
use pano_core::image::RadianceImage;
use pano_core::io::SourceEncoding;
use pano_core::light::{DirectionalLight, RadianceMaps};
use pano_core::scene::Scene;
use pano_light::track::{self, Tracker};
use pano_light::{WorkingMap, clipped, detect};
use pano_trace::mr360::Lighting;
use std::sync::Arc;

/// How lights are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detector {
    /// By brightness, as in the paper.
    #[default]
    Mr360,
    /// In LDR pictures by what tells how bright clipped patches were.
    Clipped,
}

/// The lights of a sequence.
#[derive(Debug)]
pub(super) struct Lights {
    tracker: Tracker,
    /// The last frame's panorama and what it gave: a still background is looked at once, apart from the tracker.
    last: Option<(Arc<RadianceImage>, Found)>,
}

/// What one panorama gives.
#[derive(Debug)]
struct Found {
    map: WorkingMap,
    lights: Vec<DirectionalLight>,
    /// Of what is left without the lights, in units of the photo.
    maps: RadianceMaps,
}

impl Lights {
    pub(super) fn new() -> Self {
        Self { tracker: Tracker::new(track::Params::default()), last: None }
    }

    /// What lights the next frame.
    pub(super) fn frame(&mut self, scene: &Scene, inputs: &Inputs, settings: &Settings, device: &mut Device) -> Result<Lighting> {
        let found = match self.last.take() {
            Some((photo, found)) if Arc::ptr_eq(&photo, &inputs.photo) => found,
            _ => Found::of(inputs, settings.detector, device)?,
        };
        let tracked = self.tracker.update(&found.map, &found.lights);
        let world_from_pano = scene.panorama.world_from_pano();
        let lighting = lighting(&found, tracked.iter().map(|t| t.light), world_from_pano, scene, inputs);
        self.last = Some((inputs.photo.clone(), found));
        Ok(lighting)
    }
}

impl Found {
    fn of(inputs: &Inputs, detector: Detector, device: &mut Device) -> Result<Self> {
        let ldr = inputs.encoding != SourceEncoding::LinearFloat;
        let map = device.working_map(&inputs.photo, ldr)?;
        let detection = match detector {
            Detector::Clipped if ldr => clipped::detect(&inputs.photo, &map, &clipped::Params::default()),
            _ => device.detect(&map, &detect::Params::default())?,
        };
        let scale = inputs.expansion().recip();
        let maps = device.radiance_maps(&detection.clamped(&map).map(|p| p * scale))?;
        Ok(Self { map, lights: detection.lights, maps })
    }
}

/// In the world, and in units of the photo: inverse tone mapping has multiplied everything by its least factor.
fn lighting(
    found: &Found,
    lights: impl Iterator<Item = DirectionalLight>,
    world_from_pano: Quat,
    scene: &Scene,
    inputs: &Inputs,
) -> Lighting {
    let scale = inputs.expansion().recip();
    let scaled = |light: DirectionalLight| DirectionalLight {
        irradiance: light.irradiance * scale,
        intensity: light.intensity * scale,
        ..light.rotated(world_from_pano)
    };
    Lighting {
        maps: found.maps.clone(),
        lights: lights.map(scaled).collect(),
        pano_from_world: world_from_pano.inverse(),
        capture: scene.panorama.position,
    }
}
