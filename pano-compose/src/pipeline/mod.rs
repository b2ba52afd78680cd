//! The frame pipeline: reads what a scene names, picks the method, runs the stages in order, and reports what they did.
//!
//! ```text
//! load ──> world (proxies | captured field) ──> trace ──> denoise ──> composite
//! ```

mod device;
mod error;
mod estimate;
mod folder;
mod frame;
mod iprt;
mod lights;
mod load;
mod output;
mod path_traced;
mod rt2ar;
mod sequence;
mod settings;
mod stats;
mod view;
mod world;

pub use device::{Backend, GPU_STAGES, GpuSettings};
pub use error::{Error, Result};
#[cfg(feature = "tradeoff")]
pub(crate) use estimate::shrunk;
pub use estimate::{Plan, PlannedStage, plan};
pub use folder::Folder;
pub use lights::Detector;
#[cfg(all(feature = "demo", feature = "markers"))]
pub(crate) use load::find_markers;
pub use load::{CameraInputs, Inputs, Loader, prepare_objects};
pub use output::write_output;
pub use sequence::Sequence;
pub use settings::{SETTINGS, Setting, Settings};
pub use stats::{SamplingStats, StageStats, Stats};
pub use world::{World, build_world, resolve_method};

use crate::composite::{Composite, Irradiance};
pub(crate) use frame::Frame;
use pano_core::{
    camera::Camera,
    image::{Image, RadianceImage},
    io::SourceEncoding,
    layers::TracedLayers,
    progress::Progress,
    scene::Scene,
};
pub(crate) use stats::Clock;

/// What a caller decides besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// Filter the layers after tracing.
    pub denoise: bool,
    /// Where the stages run. Default the CPU: no driver is touched unless asked for.
    pub backend: Backend,
    /// Changes all random numbers.
    pub seed: u32,
    /// Which frame of a sequence, where only one is rendered.
    pub frame: u32,
    /// `--set key=value`.
    pub settings: Settings,
    /// Effects that are on or off whatever the scene calls for; see [`RenderOptions::force`].
    pub forced: Vec<(&'static str, bool)>,
}

/// Effects that can be forced on or off; every other one costs nothing where the scene does not call for it.
pub const FORCEABLE: [&str; 6] = ["multi_bounce", "light_shadows", "ambient_occlusion", "back_faces", "sparse", "influence"];

impl RenderOptions {
    /// Turns an effect on or off by force.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the effect is none of [`FORCEABLE`].
    pub fn force(&mut self, effect: &str, on: bool) -> Result<()> {
        let Some(effect) = FORCEABLE.into_iter().find(|e| *e == effect) else {
            return Err(Error::unsupported(
                format!("effect `{effect}` cannot be forced"),
                format!("use one of {}", FORCEABLE.join(", ")),
            ));
        };
        match effect {
            "back_faces" => self.settings.captured.field.back_faces = on,
            "sparse" => self.settings.sparse = on,
            _ => {}
        }
        self.forced.retain(|(e, _)| *e != effect);
        self.forced.push((effect, on));
        Ok(())
    }
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { denoise: true, backend: Backend::Cpu, seed: 0, frame: 0, settings: Settings::default(), forced: Vec::new() }
    }
}

/// A finished frame.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The view.
    pub camera: Camera,
    /// The real picture in the view.
    pub photo: RadianceImage,
    /// How the panorama's file stored its colours.
    pub encoding: SourceEncoding,
    /// What was traced (and filtered).
    pub layers: TracedLayers,
    /// Irradiance of the real surfaces, of methods that find it.
    pub irradiance: Option<Irradiance>,
    /// Per light, strongest first, the share of it that reaches what the pixel shows; of `mr360` only.
    pub shadows: Vec<Image<f32>>,
    /// Standard error of every pixel's luminance before any filter, where sampling was adaptive.
    pub error: Option<Image<f32>>,
    /// The composite.
    pub composite: Composite,
    /// What was done.
    pub stats: Stats,
}

/// Renders one frame of a scene, [`RenderOptions::frame`].
///
/// # Errors
/// Faults of the files the scene names, of the options, or [`Error::Cancelled`].
pub fn render(scene: &Scene, options: &RenderOptions, progress: &dyn Progress) -> Result<Rendered> {
    Sequence::new(scene, options).render(options.frame, progress)
}

#[cfg(test)]
mod tests;
