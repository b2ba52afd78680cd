//! What the pixels see, and where that was.

use super::super::gbuffer::{self, COVER_POINTS};
use super::super::{Frame, GBuffer, Motion};
use super::layout::{COVER, COVERS, GBUFFER, Iprt, TEXELS, Texel};
use super::{GpuFrame, rays_of};
use crate::tracer::gpu::wave::follow::SIGHT;
use bytemuck::{Zeroable, bytes_of};
use glam::Vec2;
use pano_core::gpu::{Gpu, GpuResult};
use pano_core::image::Image;
use pano_core::progress::Silent;

impl GpuFrame {
    /// [`GBuffer::new`], and the motion since the earlier frame that this one was made with.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn gbuffer(&self, gpu: &Gpu, frame: &Frame<'_>) -> GpuResult<(GBuffer, Option<Motion>)> {
        let (w, h) = (frame.camera.width, frame.camera.height);
        let mut texels = Image::filled(w, h, Texel::zeroed());
        Self::over_view(gpu, frame, texels.data_mut(), |rows, held| {
            let rays = rays_of(gpu, rows)?;
            let kernels = self.kernels(gpu, rows, &rays, self.unchanged.bindings().into_iter().chain([(TEXELS, held)]));
            let uniform = |turn| Iprt { rows, turn, ..self.uniform };
            kernels.run(SIGHT, bytes_of(&uniform(0)))?;
            kernels.follow(&[], uniform, &Silent)?;
            kernels.run(GBUFFER, bytes_of(&uniform(0)))?;
            Ok(true)
        })?;
        let buffer = GBuffer::from_texels(&texels.map(|t| gbuffer::Texel {
            depth: if t.depth < 0.0 { f32::INFINITY } else { t.depth },
            normal: t.normal,
            position: t.position,
            albedo: t.albedo,
            smooth: t.mirrors == 1,
            thing: t.thing,
        }));
        let previous = |t: Texel| if t.known == 1 { Vec2::from_array(t.previous) } else { Vec2::NAN };
        let distance = |t: Texel| if t.depth < 0.0 { f32::INFINITY } else { t.previous_depth };
        let motion = (self.uniform.has_earlier == 1).then(|| (texels.map(previous), texels.map(distance)));
        Ok((buffer, motion))
    }

    /// [`GBuffer::coverage`].
    ///
    /// # Errors
    /// What has become of the device.
    pub fn coverage(&self, gpu: &Gpu, frame: &Frame<'_>, buffer: &GBuffer) -> GpuResult<Image<f32>> {
        let (w, h) = buffer.size();
        let whole = Image::from_fn(w, h, |x, y| buffer.whole(x, y));
        // The points that were asked for, and those that show an object.
        let mut covers = whole.map(|known| [known.map_or(0, |_| COVER_POINTS + 1), 0]);
        Self::over_view(gpu, frame, covers.data_mut(), |rows, held| {
            let rays = rays_of(gpu, rows)?;
            let kernels = self.kernels(gpu, rows, &rays, self.unchanged.bindings().into_iter().chain([(COVERS, held)]));
            let uniform = |turn| Iprt { rows, turn, ..self.uniform };
            kernels.run(COVER, bytes_of(&uniform(0)))?;
            kernels.follow(&[COVER], uniform, &Silent)
        })?;
        Ok(Image::from_fn(w, h, |x, y| whole.get(x, y).unwrap_or_else(|| covers.get(x, y)[1] as f32 / COVER_POINTS as f32)))
    }
}
