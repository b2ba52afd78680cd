//! What a view has found goes over to the panorama.

use super::super::{Frame, GBuffer, Update};
use super::GpuFrame;
use super::layout::{Iprt, UPDATE, UPDATE_WORDS, VIEW_TEXELS, ViewTexel};
use crate::tracer::gpu::wave::follow::UPDATES;
use bytemuck::bytes_of;
use glam::{Vec2, Vec3};
use pano_core::gpu::{Gpu, GpuBuffer, GpuError, GpuResult, Rows};
use pano_core::image::Image;

/// A texel's numbers.
type Numbers = [f32; UPDATE_WORDS];

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
        let found = gpu.buffer::<Numbers>(size.0 * size.1)?;
        let rows = Rows::all(size);
        let kernels = self.kernels(gpu, rows, &[], [(UPDATES, &found), (VIEW_TEXELS, texels.buffer())]);
        kernels.run(UPDATE, bytes_of(&Iprt { rows, ..self.uniform }))?;
        let found = Image::from_vec(size.0, size.1, gpu.read_slice::<Numbers>(&found, size.0 * size.1)?)?;
        Ok(Update { ratio: found.map(|[x, y, z, ..]| Vec3::new(x, y, z)), gloss: found.map(|[.., x, y]| Vec2::new(x, y)) })
    }
}

/// Copies what is known to the GPU, with its size.
pub(super) fn upload(gpu: &Gpu, update: &Update) -> GpuResult<(GpuBuffer, [u32; 2])> {
    let numbers = |(ratio, gloss): (&Vec3, &Vec2)| -> Numbers { [ratio.x, ratio.y, ratio.z, gloss.x, gloss.y] };
    let texels: Vec<Numbers> = update.ratio.data().iter().zip(update.gloss.data()).map(numbers).collect();
    let (w, h) = update.ratio.size();
    Ok((gpu.upload_slice(&texels)?, [w as u32, h as u32]))
}
