//! Frames one after the other. What they share is read and built once, and what a method carries from frame to frame lives
//! here.

use super::frame::{Carried, Frame};
use super::load::{Inputs, Loader, prepare_objects};
use super::world::{World, build_world, resolve_method};
use super::{Clock, RenderOptions, Rendered, Result};
use pano_core::{
    image::{Image, RadianceImage},
    progress::Progress,
    scene::Scene,
};
use pano_trace::objects::Objects;
use std::sync::Arc;

/// The frames of a scene, rendered in the order they are asked for.
#[derive(Debug)]
pub struct Sequence<'a> {
    scene: &'a Scene,
    options: &'a RenderOptions,
    loader: Loader,
    built: Option<Built>,
    carried: Carried,
}

/// A world and what it was built of.
#[derive(Debug)]
struct Built {
    radiance: Arc<RadianceImage>,
    depth: Option<Arc<Image<f32>>>,
    /// Of a depth camera.
    seen: Option<Arc<Image<f32>>>,
    world: World,
    warnings: Vec<String>,
}

impl<'a> Sequence<'a> {
    /// Of `scene`; [`RenderOptions::frame`] is not looked at.
    pub fn new(scene: &'a Scene, options: &'a RenderOptions) -> Self {
        Self { scene, options, loader: Loader::default(), built: None, carried: Carried::new(options) }
    }

    /// Renders frame `frame`.
    ///
    /// # Errors
    /// Faults of the files the scene names, of the options, or [`super::Error::Cancelled`].
    pub fn render(&mut self, frame: u32, progress: &dyn Progress) -> Result<Rendered> {
        let options = RenderOptions { frame, ..self.options.clone() };
        let mut clock = Clock::new();
        progress.begin("load", 1);
        let device = &mut self.carried.device;
        let inputs = self.loader.load_on(device, self.scene, frame)?;
        let objects = prepare_objects(self.scene, &inputs, frame);
        progress.advance(1);
        clock.stage_on(self.carried.device.last(), "load", 0, 0);
        // A method that does not exist is refused before the work.
        resolve_method(self.scene, &inputs, &mut Vec::new())?;
        let built = match self.built.take() {
            Some(built) if self.still_holds(&built, &inputs) => built,
            _ => {
                let built = self.build(&inputs, &objects, progress)?;
                clock.stage("world", 0, 0);
                built
            }
        };
        let mut rendered =
            Frame::new(self.scene, &inputs, &objects, &built.world, &options).render_next(&mut self.carried, clock, progress)?;
        rendered.stats.warnings.splice(0..0, inputs.warnings.iter().chain(&built.warnings).cloned());
        self.built = Some(built);
        Ok(rendered)
    }

    fn build(&self, inputs: &Inputs, objects: &Objects, progress: &dyn Progress) -> Result<Built> {
        let mut warnings = Vec::new();
        let world = build_world(self.scene, inputs, objects, self.options, &mut warnings, progress)?;
        Ok(Built { radiance: inputs.radiance().clone(), depth: inputs.depth.clone(), seen: seen_by(inputs), world, warnings })
    }

    /// Whether the world of an earlier frame is that of this one.
    fn still_holds(&self, built: &Built, inputs: &Inputs) -> bool {
        let same = |a: &Option<Arc<Image<f32>>>, b: &Option<Arc<Image<f32>>>| match (a, b) {
            (None, None) => true,
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        let same_depth = same(&built.depth, &inputs.depth) && same(&built.seen, &seen_by(inputs));
        // A captured world is refined where the objects are.
        let same_objects =
            !matches!(built.world, World::Captured(_)) || self.scene.objects.iter().all(|o| o.keyframes.is_empty());
        same_depth && same_objects && Arc::ptr_eq(&built.radiance, inputs.radiance())
    }
}

/// The depth of a depth camera; every frame of one has its own.
fn seen_by(inputs: &Inputs) -> Option<Arc<Image<f32>>> {
    inputs.camera.as_ref().map(|seen| seen.depth.clone())
}
