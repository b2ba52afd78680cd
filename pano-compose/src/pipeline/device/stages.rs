//! The stages that run on either backend.

use super::Device;
use crate::composite::{self, Clamped, Composite};
use crate::pipeline::Result;
use pano_core::image::RadianceImage;
use pano_core::layers::TracedLayers;
use pano_denoise::cross_bilateral;

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
        #[cfg(not(feature = "gpu"))]
        self.refuse();
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
        #[cfg(not(feature = "gpu"))]
        self.refuse();
        Ok(composite::composite(photo, layers, out)?)
    }
}
