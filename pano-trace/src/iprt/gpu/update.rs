//! What a view has found goes over to the panorama.

use super::super::{Frame, GBuffer, Update};
use super::GpuFrame;
use super::layout::{Iprt, UPDATE, VIEW_TEXELS, ViewTexel};
use crate::tracer::gpu::wave::follow::{GLOSSES, UPDATES};
use bytemuck::bytes_of;
use glam::{Vec2, Vec3};
use pano_core::gpu::{Gpu, GpuBuffer, GpuError, GpuImage, GpuResult, Rows};
use pano_core::image::Image;

/// An [`Update`] in the GPU's memory: two pictures, as one of five numbers a texel would not fit a binding at 4096 columns.
#[derive(Debug)]
pub(super) struct GpuUpdate {
    ratio: GpuImage<Vec3>,
    gloss: GpuImage<Vec2>,
}

impl GpuUpdate {
    /// Copies what is known to the GPU.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    pub(super) fn of(gpu: &Gpu, update: &Update) -> GpuResult<Self> {
        Ok(Self { ratio: gpu.upload(&update.ratio)?, gloss: gpu.upload(&update.gloss)? })
    }

    /// Its columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        let rows = self.ratio.rows();
        [rows.width, rows.height]
    }

    /// What shaders that know it bind.
    pub(super) fn bindings(&self) -> [(u32, &GpuBuffer); 2] {
        [(UPDATES, self.ratio.buffer()), (GLOSSES, self.gloss.buffer())]
    }
}

impl GpuFrame {
    /// [`super::super::panorama_update`].
    ///
    /// # Errors
    /// [`GpuError::Input`] if the pictures are not of the view's size; [`GpuError::TooLarge`] if the view or the updated panorama does
    /// not fit a binding, or what has become of the device.
    pub fn panorama_update(
        &self,
        gpu: &Gpu,
        frame: &Frame<'_>,
        buffer: &GBuffer,
        ratio: &Image<Vec3>,
        gloss: &Image<Vec2>,
        size: (usize, usize),
    ) -> GpuResult<Update> {
        let (w, h) = (frame.camera.width, frame.camera.height);
        if [buffer.size(), ratio.size(), gloss.size()] != [(w, h); 3] {
            return Err(GpuError::Input(pano_core::Error::argument("the view's pictures differ in size")));
        }
        let texel = |x, y| ViewTexel {
            ratio: ratio.get(x, y),
            depth: buffer.depth.get(x, y),
            gloss: gloss.get(x, y).to_array(),
            real: u32::from(buffer.shows_real(x, y)),
            pad: 0,
        };
        let texels = gpu.upload(&Image::from_fn(w, h, texel))?;
        let rows = Rows::all(size);
        let found = GpuUpdate { ratio: gpu.image(rows)?, gloss: gpu.image(rows)? };
        let own = found.bindings().into_iter().chain([(VIEW_TEXELS, texels.buffer())]);
        let kernels = self.kernels(gpu, rows, &[], own);
        kernels.run(UPDATE, bytes_of(&Iprt { rows, ..self.uniform }))?;
        Ok(Update { ratio: gpu.read(&found.ratio)?, gloss: gpu.read(&found.gloss)? })
    }
}
