//! The stages that run on either backend.
#![cfg_attr(
    not(feature = "gpu"),
    allow(unused_variables, unused_mut, reason = "only the GPU's part asks which stage it is, and may have to run twice")
)]

use super::Device;
use crate::composite::{self, Clamped, Composite};
use crate::pipeline::Result;
use glam::Vec3;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use pano_denoise::{atrous, cross_bilateral, firefly, temporal};

impl Device {
    /// [`cross_bilateral::filter`], stage `denoise`. Nothing may change the layers between this stage and
    /// [`Self::composite`].
    pub(in crate::pipeline) fn denoise(
        &mut self,
        params: &cross_bilateral::Params,
        layers: &mut TracedLayers,
    ) -> Result<cross_bilateral::Report> {
        #[cfg(feature = "gpu")]
        if let Some(report) = self.attempt("denoise", |installed| {
            let (report, held) = cross_bilateral::gpu::filter_layers(&installed.gpu, params, layers)?;
            installed.layers = held;
            Ok(report)
        })? {
            return Ok(report);
        }
        Ok(cross_bilateral::filter(params, layers)?)
    }

    /// [`composite::composite`], stage `composite`.
    pub(in crate::pipeline) fn composite(
        &mut self,
        photo: &RadianceImage,
        layers: &TracedLayers,
        out: &mut Composite,
    ) -> Result<Clamped> {
        #[cfg(feature = "gpu")]
        if let Some(clamped) = self.attempt("composite", |installed| {
            let held = installed.layers.take();
            composite::gpu::composite_pictures(&installed.gpu, photo, layers, held.as_ref(), out)
        })? {
            return Ok(clamped);
        }
        Ok(composite::composite(photo, layers, out)?)
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

    /// [`atrous::filter`], a part of `stage`; without a variance it comes from the neighbours ([`atrous::spatial_variance`]).
    pub(in crate::pipeline) fn spread(
        &mut self,
        stage: &'static str,
        params: &atrous::Params,
        guides: &atrous::Guides<'_>,
        share: &Image<f32>,
        mut variance: Option<&mut Image<f32>>,
        signal: &mut Image<Vec3>,
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self
            .attempt(stage, |installed| {
                atrous::gpu::filter_pictures(&installed.gpu, params, guides, share, variance.as_deref_mut(), signal)
            })?
            .is_some()
        {
            return Ok(());
        }
        match variance {
            Some(variance) => atrous::filter(params, guides, share, variance, signal)?,
            None => {
                let mut variance = atrous::spatial_variance(params, guides, share, signal)?;
                atrous::filter(params, guides, share, &mut variance, signal)?
            }
        };
        Ok(())
    }

    /// [`temporal::accumulate`], a part of `stage`.
    pub(in crate::pipeline) fn accumulate(
        &mut self,
        stage: &'static str,
        params: &temporal::Params,
        guides: &temporal::Guides<'_>,
        signal: &mut Image<Vec3>,
        history: &mut Option<temporal::History>,
    ) -> Result<()> {
        #[cfg(feature = "gpu")]
        if self
            .attempt(stage, |installed| temporal::gpu::accumulate_picture(&installed.gpu, params, guides, signal, history))?
            .is_some()
        {
            return Ok(());
        }
        Ok(temporal::accumulate(params, guides, signal, history)?)
    }
}
