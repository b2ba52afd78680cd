//! Lists of rays on the GPU, a batch at a time.

use crate::bvh::Ray;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Kernel, Piece};

/// `Ray`, for shaders to include.
pub(crate) const RAY: Piece = Piece::plain(include_str!("ray.wgsl"));

/// `Ray` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GpuRay {
    origin: Vec3,
    t_max: f32,
    direction: Vec3,
    pad: u32,
}

/// A kernel of one invocation a ray, 64 to a workgroup, that writes one value a ray.
#[derive(Debug)]
pub(crate) struct RayKernel<'a> {
    pub(crate) kernel: Kernel<'a>,
    /// What stays the same for all rays.
    pub(crate) buffers: &'a [(u32, &'a GpuBuffer)],
    /// Where the rays are bound, and where what it writes.
    pub(crate) bindings: [u32; 2],
    /// Rays of one submission at most.
    pub(crate) batch: usize,
}

impl RayKernel<'_> {
    /// What it writes for each of the rays; `uniform` is that of a batch of so many.
    ///
    /// # Errors
    /// What has become of the device.
    pub(crate) fn run<T: Pod, U: Pod>(&self, gpu: &Gpu, uniform: impl Fn(u32) -> U, rays: &[Ray]) -> GpuResult<Vec<T>> {
        let most = usize::try_from(gpu.max_binding() / size_of::<GpuRay>() as u64).unwrap_or(self.batch).clamp(1, self.batch);
        let mut results = Vec::with_capacity(rays.len());
        for batch in rays.chunks(most) {
            // Infinity is no number a shader may count on.
            let plain = |r: &Ray| GpuRay { origin: r.origin, t_max: r.t_max.min(f32::MAX), direction: r.direction, pad: 0 };
            let source = gpu.upload_slice(&batch.iter().map(plain).collect::<Vec<_>>())?;
            let found = gpu.buffer::<T>(batch.len())?;
            let [rays_at, found_at] = self.bindings;
            let buffers = [self.buffers, &[(rays_at, &source), (found_at, &found)]].concat();
            let uniform = uniform(batch.len() as u32);
            gpu.dispatch(&self.kernel, bytemuck::bytes_of(&uniform), &buffers, [batch.len().div_ceil(64) as u32, 1, 1])?;
            results.extend(gpu.read_slice::<T>(&found, batch.len())?);
        }
        Ok(results)
    }
}
