//! The stages that run on either backend.
#![cfg_attr(
    not(feature = "gpu"),
    allow(unused_variables, unused_mut, reason = "only the GPU's part asks which stage it is, and may have to run twice")
)]

use super::Device;
#[cfg(feature = "gpu")]
use super::gpu::Installed;
use crate::composite::{self, Clamped, Composite};
use crate::lens;
use crate::pipeline::{Result, World};
use glam::{Quat, Vec3};
use pano_core::camera::Camera;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_core::light::RadianceMaps;
use pano_core::progress::Progress;
use pano_core::sphere::resample;
use pano_denoise::{atrous, cross_bilateral, firefly, mean, settle, temporal};
use pano_light::{WorkingMap, detect, expand, ibl};
use pano_trace::mr360;
use pano_trace::rt2ar;
use pano_trace::sparse;
use pano_trace::tracer::{self, TraceParams, Traced};
use pano_trace::world::RealWorld;

/// Why a tracer leaves several worlds in one to the CPU.
#[cfg(feature = "gpu")]
const NO_LAYERS: &str = "ghosts before a panorama's depth and depth cameras are not traced on the GPU";

/// Why rt2ar leaves what is no proxy to the CPU.
#[cfg(feature = "gpu")]
const ONLY_PROXIES: &str = "rt2ar over a panorama's depth, and with depth cameras, is not traced on the GPU";

/// [`rt2ar::render`] with the lights where they stand.
fn recursively<W: RealWorld>(
    frame: &tracer::Frame<'_>,
    world: &W,
    lighting: &mr360::Lighting,
    params: &rt2ar::Params<'_>,
    progress: &dyn Progress,
) -> Option<rt2ar::Rendered> {
    let lights = rt2ar::place_lights(world, lighting);
    rt2ar::render(frame, world, lighting, &lights, params, progress)
}

impl Device {
    /// [`expand::expand`], a part of stage `load`.
    pub(in crate::pipeline) fn expand(&mut self, ldr: &RadianceImage, hdr: &mut RadianceImage) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self.attempt("expand", |installed| expand::gpu::expand_picture(&installed.gpu, ldr, hdr))?.is_some() {
            return Ok(());
        }
        Ok(expand::expand(ldr, hdr)?)
    }

    /// [`resample::view_from_panorama`], stage `view`.
    pub(in crate::pipeline) fn view(
        &mut self,
        panorama: &RadianceImage,
        world_from_pano: Quat,
        camera: &Camera,
        view: &mut RadianceImage,
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self
            .attempt("view", |installed| {
                resample::gpu::view_from_panorama(&installed.gpu, panorama, world_from_pano, camera, view)
            })?
            .is_some()
        {
            return Ok(());
        }
        Ok(resample::view_from_panorama(panorama, world_from_pano, camera, view)?)
    }

    /// [`WorkingMap::from_ldr`] or [`WorkingMap::from_hdr`], a part of stage `lights`.
    pub(in crate::pipeline) fn working_map(&mut self, panorama: &RadianceImage, from_ldr: bool) -> Result<WorkingMap> {
        #[cfg(feature = "gpu")]
        if let Some(map) = self.attempt("lights", |installed| WorkingMap::on_gpu(&installed.gpu, panorama, from_ldr))? {
            return Ok(map);
        }
        Ok(if from_ldr { WorkingMap::from_ldr(panorama) } else { WorkingMap::from_hdr(panorama) })
    }

    /// [`detect::detect`], a part of stage `lights`.
    pub(in crate::pipeline) fn detect(&mut self, map: &WorkingMap, params: &detect::Params) -> Result<detect::Detection> {
        #[cfg(feature = "gpu")]
        if let Some(found) = self.attempt("lights", |installed| detect::gpu::detect(&installed.gpu, map, params))? {
            return Ok(found);
        }
        Ok(detect::detect(map, params))
    }

    /// [`ibl::radiance_maps`], a part of stage `lights`.
    pub(in crate::pipeline) fn radiance_maps(&mut self, panorama: &RadianceImage) -> Result<RadianceMaps> {
        #[cfg(feature = "gpu")]
        if let Some(maps) = self.attempt("lights", |installed| ibl::gpu::radiance_maps(&installed.gpu, panorama))? {
            return Ok(maps);
        }
        Ok(ibl::radiance_maps(panorama))
    }

    /// [`tracer::render`], stage `trace` of the path tracers. `None` if `progress` cancels.
    pub(in crate::pipeline) fn trace(
        &mut self,
        frame: &tracer::Frame<'_>,
        world: &World,
        params: &TraceParams,
        progress: &dyn Progress,
    ) -> Result<Option<Traced>> {
        #[cfg(feature = "gpu")]
        match world {
            World::Layered(_) => self.decline("trace", NO_LAYERS),
            World::Proxies(world) => {
                let trace = |installed: &mut Installed| tracer::gpu::render(&installed.gpu, frame, world, params, progress);
                if let Some(traced) = self.attempt("trace", trace)? {
                    return Ok(traced);
                }
            }
            World::Captured(world) => {
                let trace =
                    |installed: &mut Installed| tracer::gpu::render_captured(&installed.gpu, frame, world, params, progress);
                if let Some(traced) = self.attempt("trace", trace)? {
                    return Ok(traced);
                }
            }
        }
        Ok(match world {
            World::Proxies(world) => tracer::render(frame, world.as_ref(), params, progress),
            World::Captured(world) => tracer::render(frame, world.as_ref(), params, progress),
            World::Layered(world) => tracer::render(frame, world.as_ref(), params, progress),
        })
    }

    /// [`mr360::render`], stage `trace` of mr360. `None` if `progress` cancels.
    pub(in crate::pipeline) fn trace_lit(
        &mut self,
        frame: &tracer::Frame<'_>,
        world: &World,
        lighting: &mr360::Lighting,
        params: &mr360::Params<'_>,
        progress: &dyn Progress,
    ) -> Result<Option<mr360::Lit>> {
        #[cfg(feature = "gpu")]
        let traced = match world {
            World::Proxies(world) => {
                self.attempt("trace", |installed| mr360::gpu::render(&installed.gpu, frame, world, lighting, params, progress))?
            }
            World::Captured(world) => self.attempt("trace", |installed| {
                mr360::gpu::render_captured(&installed.gpu, frame, world, lighting, params, progress)
            })?,
            World::Layered(_) => {
                self.decline("trace", NO_LAYERS);
                None
            }
        };
        #[cfg(feature = "gpu")]
        if let Some(lit) = traced {
            return Ok(lit);
        }
        Ok(match world {
            World::Proxies(world) => mr360::render(frame, world.as_ref(), lighting, params, progress),
            World::Captured(world) => mr360::render(frame, world.as_ref(), lighting, params, progress),
            World::Layered(world) => mr360::render(frame, world.as_ref(), lighting, params, progress),
        })
    }

    /// [`rt2ar::render`] with the lights where they stand, stage `trace` of rt2ar. `None` if `progress` cancels.
    pub(in crate::pipeline) fn trace_recursively(
        &mut self,
        frame: &tracer::Frame<'_>,
        world: &World,
        lighting: &mr360::Lighting,
        params: &rt2ar::Params<'_>,
        progress: &dyn Progress,
    ) -> Result<Option<rt2ar::Rendered>> {
        #[cfg(feature = "gpu")]
        match world {
            World::Proxies(world) => {
                let lights = rt2ar::place_lights(world.as_ref(), lighting);
                let trace = |installed: &mut Installed| {
                    rt2ar::gpu::render(&installed.gpu, frame, world, lighting, &lights, params, progress)
                };
                if let Some(rendered) = self.attempt("trace", trace)? {
                    return Ok(rendered);
                }
            }
            World::Captured(_) | World::Layered(_) => self.decline("trace", ONLY_PROXIES),
        }
        Ok(match world {
            World::Proxies(world) => recursively(frame, world.as_ref(), lighting, params, progress),
            World::Captured(world) => recursively(frame, world.as_ref(), lighting, params, progress),
            World::Layered(world) => recursively(frame, world.as_ref(), lighting, params, progress),
        })
    }

    /// [`settle::filter`], stage `denoise`.
    pub(in crate::pipeline) fn denoise(
        &mut self,
        params: &cross_bilateral::Params,
        photo: &RadianceImage,
        layers: &mut TracedLayers,
    ) -> Result<cross_bilateral::Report> {
        #[cfg(feature = "gpu")]
        if let Some(report) =
            self.attempt("denoise", |installed| settle::gpu::filter_layers(&installed.gpu, params, photo, layers))?
        {
            return Ok(report);
        }
        Ok(settle::filter(params, photo, layers)?)
    }

    /// [`mean::filter`], stage `mean`.
    pub(in crate::pipeline) fn mean(
        &mut self,
        params: &mean::Params,
        penumbra: &Image<bool>,
        photo: &RadianceImage,
        layers: &mut TracedLayers,
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self.attempt("mean", |installed| mean::gpu::filter_layers(&installed.gpu, params, penumbra, photo, layers))?.is_some()
        {
            return Ok(());
        }
        mean::filter(params, penumbra, photo, layers)?;
        Ok(())
    }

    /// [`composite::composite`], stage `composite`.
    pub(in crate::pipeline) fn composite(
        &mut self,
        photo: &RadianceImage,
        layers: &TracedLayers,
        out: &mut Composite,
    ) -> Result<Clamped> {
        #[cfg(feature = "gpu")]
        if let Some(clamped) =
            self.attempt("composite", |installed| composite::gpu::composite_pictures(&installed.gpu, photo, layers, out))?
        {
            return Ok(clamped);
        }
        Ok(composite::composite(photo, layers, out)?)
    }

    /// [`lens::apply`], stage `lens`.
    pub(in crate::pipeline) fn lens(
        &mut self,
        params: &lens::Params,
        photo: &RadianceImage,
        picture: &mut RadianceImage,
    ) -> Result<lens::Report> {
        #[cfg(feature = "gpu")]
        if let Some(report) =
            self.attempt("lens", |installed| lens::gpu::apply_picture(&installed.gpu, params, photo, picture))?
        {
            return Ok(report);
        }
        Ok(lens::apply(params, photo, picture)?)
    }

    /// [`sparse::levels`], stage `sparse mask`.
    pub(in crate::pipeline) fn sparse_levels(
        &mut self,
        params: &sparse::Params,
        position: &Image<Vec3>,
        normal: &Image<Vec3>,
        active: &Image<u32>,
    ) -> Result<Image<u8>> {
        #[cfg(feature = "gpu")]
        if let Some(levels) =
            self.attempt("sparse mask", |installed| sparse::gpu::levels(&installed.gpu, params, position, normal, active))?
        {
            return Ok(levels);
        }
        Ok(sparse::levels(params, position, normal, active))
    }

    /// [`sparse::interpolate`], stage `interpolation`.
    pub(in crate::pipeline) fn interpolate(
        &mut self,
        levels: &Image<u8>,
        wanted: impl Fn(usize, usize) -> bool,
        share: &mut Image<f32>,
        signals: &mut [&mut Image<Vec3>],
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self
            .attempt("interpolation", |installed| {
                let mask = Image::from_fn(levels.width(), levels.height(), |x, y| u32::from(wanted(x, y)));
                sparse::gpu::interpolate(&installed.gpu, levels, &mask, share, signals)
            })?
            .is_some()
        {
            return Ok(());
        }
        sparse::interpolate(levels, wanted, share, signals);
        Ok(())
    }

    /// [`firefly::clamp`], a part of `stage`.
    pub(in crate::pipeline) fn clamp_fireflies(
        &mut self,
        stage: &'static str,
        params: &firefly::Params,
        share: &Image<f32>,
        signal: &mut Image<Vec3>,
    ) -> Result<firefly::Clamped> {
        #[cfg(feature = "gpu")]
        if let Some(clamped) =
            self.attempt(stage, |installed| firefly::gpu::clamp_picture(&installed.gpu, params, share, signal))?
        {
            return Ok(clamped);
        }
        Ok(firefly::clamp(params, share, signal)?)
    }

    /// [`atrous::filter`], a part of `stage`.
    pub(in crate::pipeline) fn spread(
        &mut self,
        stage: &'static str,
        params: &atrous::Params,
        guides: &atrous::Guides<'_>,
        share: &Image<f32>,
        variance: &mut Image<f32>,
        signal: &mut Image<Vec3>,
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self
            .attempt(stage, |installed| atrous::gpu::filter_pictures(&installed.gpu, params, guides, share, variance, signal))?
            .is_some()
        {
            return Ok(());
        }
        atrous::filter(params, guides, share, variance, signal)?;
        Ok(())
    }

    /// [`temporal::accumulate`], a part of `stage`.
    pub(in crate::pipeline) fn accumulate(
        &mut self,
        stage: &'static str,
        params: &temporal::Params,
        guides: &temporal::Guides<'_>,
        measured: Option<&Image<f32>>,
        signal: &mut Image<Vec3>,
        history: &mut Option<temporal::History>,
    ) -> Result<Image<f32>> {
        #[cfg(feature = "gpu")]
        if let Some(variance) = self.attempt(stage, |installed| {
            temporal::gpu::accumulate_picture(&installed.gpu, params, guides, measured, signal, history)
        })? {
            return Ok(variance);
        }
        Ok(temporal::accumulate(params, guides, measured, signal, history)?)
    }
}
