//! The clamp on the GPU.
//!
//! Departures from the CPU: luminances are `f32`, limited to [`pano_core::gpu::LARGEST`]; the report's sums are `f32` within a
//! workgroup of 8×8 pixels.

use super::{Clamped, Params};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::gpu::{COLOR, Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization, flag};
use pano_core::image::Image;

pano_core::uniform! {
    /// `Firefly` of the shader.
    pub(crate) struct Firefly {
        rows: Rows,
        factor: f32,
    }
}

/// `Clamped` of the shader: of one workgroup.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GroupClamped {
    pixels: u32,
    energy: f32,
    before: f32,
}

/// `firefly.wgsl`.
pub static SHADER: Shader = Shader {
    name: "firefly",
    pieces: &[NUMBER, SPHERE, IMAGE, COLOR, Piece::plain(include_str!("firefly.wgsl"))],
    specializations: &[
        Specialization { entry: "clamp_fireflies", constants: &[("WRAP", 0.0)] },
        Specialization { entry: "clamp_fireflies", constants: &[("WRAP", 1.0)] },
    ],
};

/// [`super::clamp`] of a picture on the GPU. The report counts all rows that are held.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or the factor is below 1, or what has become of the device.
pub fn clamp(gpu: &Gpu, params: &Params, share: &GpuImage<f32>, signal: &GpuImage<Vec3>) -> GpuResult<(GpuImage<Vec3>, Clamped)> {
    params.check()?;
    signal.check_like("share", share)?;
    let rows = signal.rows();
    let clamped = gpu.image(rows)?;
    let [x, y, z] = rows.groups();
    let report = gpu.buffer::<GroupClamped>((x * y) as usize)?;
    let constants = [("WRAP", flag(params.wrap))];
    let kernel = Kernel { shader: &SHADER, entry: "clamp_fireflies", constants: &constants };
    let uniform = Firefly { rows, factor: params.factor };
    let buffers = [(1, share.buffer()), (2, signal.buffer()), (3, clamped.buffer()), (4, &report)];
    gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, [x, y, z])?;
    let parts: Vec<GroupClamped> = gpu.read_slice(&report, (x * y) as usize)?;
    let sum = parts.iter().fold(Clamped::default(), |sum, part| Clamped {
        pixels: sum.pixels + part.pixels as usize,
        energy: sum.energy + f64::from(part.energy),
        before: sum.before + f64::from(part.before),
    });
    Ok((clamped, sum))
}

/// [`super::clamp`] of pictures of any size, in bands; their halo counts in the report. If it fails, the picture is as it was.
///
/// # Errors
/// As [`clamp`].
pub fn clamp_picture(gpu: &Gpu, params: &Params, share: &Image<f32>, signal: &mut Image<Vec3>) -> GpuResult<Clamped> {
    params.check()?;
    crate::check_sizes("firefly clamp", signal.size(), &[("share", share.size())])?;
    let mut out = signal.clone();
    let mut sum = Clamped::default();
    for band in gpu.bands(signal.size(), size_of::<Vec3>(), 1)? {
        let (share, source) = (gpu.upload_rows(share, &band.hold)?, gpu.upload_rows(signal, &band.hold)?);
        let (made, clamped) = clamp(gpu, params, &share, &source)?;
        gpu.read_rows(&made, &band.keep, &mut out)?;
        sum.pixels += clamped.pixels;
        sum.energy += clamped.energy;
        sum.before += clamped.before;
    }
    *signal = out;
    Ok(sum)
}
