//! The layers of a frame on the GPU.

use super::{Gpu, GpuImage, GpuResult};
use crate::layers::TracedLayers;
use glam::{Vec3, Vec4};
use std::ops::Range;

/// [`TracedLayers`], or a band of their rows, in the GPU's memory: what filters and compositing hand on.
#[derive(Debug)]
pub struct GpuLayers {
    /// As [`TracedLayers::object`].
    pub object: GpuImage<Vec3>,
    /// As [`TracedLayers::coverage`].
    pub coverage: GpuImage<f32>,
    /// As [`TracedLayers::delta`].
    pub delta: GpuImage<Vec3>,
    /// As [`TracedLayers::depth`].
    pub depth: GpuImage<f32>,
    /// As [`TracedLayers::normal`].
    pub normal: GpuImage<Vec3>,
    /// As [`TracedLayers::albedo`].
    pub albedo: GpuImage<Vec3>,
}

impl GpuLayers {
    /// Bytes that a pixel takes in the largest binding of the stages that work on layers, for [`Gpu::bands`]: four numbers.
    pub const PIXEL_BYTES: usize = size_of::<Vec4>();

    /// Copies rows of layers to the GPU.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn upload(gpu: &Gpu, layers: &TracedLayers, rows: &Range<usize>) -> GpuResult<Self> {
        Ok(Self {
            object: gpu.upload_rows(&layers.object, rows)?,
            coverage: gpu.upload_rows(&layers.coverage, rows)?,
            delta: gpu.upload_rows(&layers.delta, rows)?,
            depth: gpu.upload_rows(&layers.depth, rows)?,
            normal: gpu.upload_rows(&layers.normal, rows)?,
            albedo: gpu.upload_rows(&layers.albedo, rows)?,
        })
    }
}
