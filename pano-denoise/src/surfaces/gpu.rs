//! The surfaces of a frame on the GPU.

use super::{MAX_DEPTH, MIN_DEPTH};
use glam::Vec3;
use pano_core::gpu::{Constant, Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, SPHERE, Shader, Specialization, flag};

/// Comparing pixels with their taps, for filters to include; it needs [`NUMBER`]. Slopes are bound at 3 and normals at 4.
pub(crate) const SURFACES: Piece = Piece::plain(include_str!("surfaces.wgsl"));
/// The same with base colours, which are bound at 5; it needs [`SURFACES`].
pub(crate) const ALBEDO: Piece = Piece::plain(include_str!("albedo.wgsl"));

/// `slopes.wgsl`.
pub(crate) static SHADER: Shader = Shader {
    name: "slopes",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        Piece {
            text: include_str!("slopes.wgsl"),
            constants: || vec![Constant::f32("MIN_DEPTH", MIN_DEPTH), Constant::f32("MAX_DEPTH", MAX_DEPTH)],
        },
    ],
    specializations: &[
        Specialization { entry: "slopes", constants: &[("WRAP", 0.0)] },
        Specialization { entry: "slopes", constants: &[("WRAP", 1.0)] },
    ],
};

/// What is seen at each pixel, for filters on the GPU.
#[derive(Debug)]
pub struct GpuSurfaces<'a> {
    pub(crate) slope: GpuImage<Vec3>,
    pub(crate) normal: &'a GpuImage<Vec3>,
    pub(crate) wrap: bool,
}

impl<'a> GpuSurfaces<'a> {
    /// From pictures of the same rows; `wrap`: a whole panorama. Depth and normal are those of the filters' guides.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size, or what has become of the device.
    pub fn new(gpu: &Gpu, depth: &GpuImage<f32>, normal: &'a GpuImage<Vec3>, wrap: bool) -> GpuResult<Self> {
        depth.check_like("normal layer", normal)?;
        let rows = depth.rows();
        let slope = gpu.image(rows)?;
        let kernel = Kernel { shader: &SHADER, entry: "slopes", constants: &[("WRAP", flag(wrap))] };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&rows), &[(1, depth.buffer()), (2, slope.buffer())], rows.groups())?;
        Ok(Self { slope, normal, wrap })
    }
}

/// A sigma as shaders take it: its inverse, 0 for one that switches its term off.
pub(crate) fn inverse(sigma: f32) -> f32 {
    if sigma.is_finite() { (1.0 / sigma).min(f32::MAX) } else { 0.0 }
}
