//! One frame: which method makes it, and what every method ends with.

use super::device::Device;
use super::lights::Lights;
use super::view::view_of_photo;
use super::{Clock, Inputs, RenderOptions, Rendered, Result, SamplingStats, World, iprt, path_traced, resolve_method, rt2ar};
use crate::composite::{Composite, Irradiance};
use crate::lens;
use crate::plan::EffectPlan;
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    layers::TracedLayers,
    progress::Progress,
    scene::{Method, Scene},
};
use pano_trace::objects::Objects;
use pano_trace::tracer::Sampling;

/// Everything a frame is made of.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) inputs: &'a Inputs,
    pub(crate) objects: &'a Objects,
    pub(crate) world: &'a World,
    pub(crate) options: &'a RenderOptions,
    pub(super) camera: Camera,
}

/// What a sequence carries from frame to frame.
#[derive(Debug)]
pub(super) struct Carried {
    /// The lights that mr360 and rt2ar follow.
    lights: Lights,
    /// The past of iprt.
    past: Option<iprt::State>,
    /// Where stages run.
    pub(super) device: Device,
}

impl Carried {
    pub(super) fn new(options: &RenderOptions) -> Self {
        Self { lights: Lights::new(), past: None, device: Device::new(options) }
    }
}

/// The real picture in the view.
pub(super) struct View {
    pub(super) photo: RadianceImage,
    /// Of what lights the scene, if that is another picture.
    pub(super) lighting: Option<RadianceImage>,
}

/// A frame before it is composited.
pub(super) struct Filtered {
    pub(super) photo: RadianceImage,
    pub(super) layers: TracedLayers,
    pub(super) irradiance: Option<Irradiance>,
    pub(super) shadows: Vec<Image<f32>>,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(
        scene: &'a Scene,
        inputs: &'a Inputs,
        objects: &'a Objects,
        world: &'a World,
        options: &'a RenderOptions,
    ) -> Self {
        Self { scene, inputs, objects, world, options, camera: inputs.view(scene) }
    }

    /// Pixels of the view.
    pub(super) fn pixels(&self) -> u64 {
        (self.camera.width * self.camera.height) as u64
    }

    /// Renders the frame by itself.
    pub(crate) fn render(&self, clock: Clock, progress: &dyn Progress) -> Result<Rendered> {
        self.render_next(&mut Carried::new(self.options), clock, progress)
    }

    /// Renders the frame as the next of those that carry `carried` from one to the next.
    pub(super) fn render_next(&self, carried: &mut Carried, mut clock: Clock, progress: &dyn Progress) -> Result<Rendered> {
        let mut warnings = Vec::new();
        let (scene, inputs, settings) = (self.scene, self.inputs, &self.options.settings);
        let device = &mut carried.device;
        device.begin_frame();
        let method = resolve_method(scene, inputs, &mut warnings)?;
        let (photo, lighting) = view_of_photo(scene, inputs, self.world, &self.camera, device)?;
        clock.stage_on(device.last(), "view", self.pixels(), 0);
        let mut facts = inputs.facts(scene, method);
        facts.no_back_faces = !settings.captured.field.back_faces;
        facts.no_sparse = !settings.sparse;
        facts.lens = settings.lens.is_on();
        let found = match method {
            Method::Mr360 | Method::Rt2ar => Some(carried.lights.frame(scene, inputs, settings, device)?),
            _ => None,
        };
        if let Some(found) = &found {
            facts.lights = Some(found.lights.len());
            clock.stage_on(device.last(), "lights", inputs.photo.data().len() as u64, 0);
        }
        let mut plan = EffectPlan::for_scene(&facts);
        for &(effect, on) in &self.options.forced {
            plan.force(effect, on);
        }
        let view = View { photo, lighting };
        let found = found.as_ref().map(|lighting| (lighting, &plan));
        let mut sampling = None;
        let filtered = match (method, found) {
            (Method::Iprt, _) => iprt::trace(self, view, &mut carried.past, device, &mut clock, &mut warnings, progress)?,
            (Method::Rt2ar, Some(found)) => rt2ar::trace(self, view, found, device, &mut clock, &mut warnings, progress)?,
            _ => {
                let traced = path_traced::trace(self, method, view, found, device, &mut clock, &mut warnings, progress)?;
                sampling = traced.1;
                traced.0
            }
        };
        let mut rendered = self.finish(filtered, method, plan, device, warnings, clock)?;
        if let Some(Sampling { samples, error }) = sampling {
            let mean = error.data().iter().map(|e| f64::from(*e)).sum::<f64>() / error.data().len() as f64;
            rendered.stats.sampling = Some(SamplingStats { samples, error: mean as f32 });
            rendered.error = Some(error);
        }
        Ok(rendered)
    }

    /// The last stage.
    fn finish(
        &self,
        Filtered { photo, layers, irradiance, shadows }: Filtered,
        method: Method,
        plan: EffectPlan,
        device: &mut Device,
        mut warnings: Vec<String>,
        mut clock: Clock,
    ) -> Result<Rendered> {
        let mut out = Composite::new(self.camera.width, self.camera.height);
        let clamped = device.composite(&photo, &layers, &mut out)?;
        if clamped.pixels > 0 {
            warnings.push(format!(
                "{} pixels of the composite were below 0 by {:.3e} in all and were set to 0",
                clamped.pixels, clamped.energy
            ));
        }
        clock.stage_on(device.last(), "composite", self.pixels(), 0);
        let lens = lens::Params { wrap: self.camera.projection == Projection::Panorama, ..self.options.settings.lens };
        if lens.is_on() {
            let report = device.lens(&lens, &photo, &mut out.color)?;
            if report.spread > 0.0 {
                let (spread, lost) = (report.spread / report.before, -report.change / report.before);
                warnings.push(format!(
                    "lens effects spread {:.2} % of the picture's light and carried {:.2} % out of the frame",
                    spread * 100.0,
                    lost * 100.0
                ));
            }
            clock.stage_on(device.last(), "lens", self.pixels(), 0);
        }
        warnings.extend(device.take_warnings());
        let stats = clock.finish(method.name(), device.adapter(), plan, warnings);
        let (camera, encoding) = (self.camera, self.inputs.view_encoding(self.scene));
        Ok(Rendered { camera, photo, encoding, layers, irradiance, shadows, error: None, composite: out, stats })
    }
}
