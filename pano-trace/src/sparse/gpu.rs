//! Sparse tracing's mask and interpolation on the GPU. Levels lie on a grid of the whole frame, so that there are no bands: frames
//! of more than eleven million pixels stay on the CPU.

use super::Params;
use glam::Vec3;
use pano_core::gpu::{Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization};
use pano_core::image::Image;

pano_core::uniform! {
    /// `Sparse` of the shader.
    pub(crate) struct Sparse {
        rows: Rows,
        delta1: f32,
        delta2: f32,
        sigma_position: f32,
    }
}

/// `sparse.wgsl`.
pub static SHADER: Shader = Shader {
    name: "sparse",
    pieces: &[NUMBER, SPHERE, IMAGE, Piece::plain(include_str!("sparse.wgsl"))],
    specializations: &[
        Specialization { entry: "levels", constants: &[] },
        Specialization { entry: "interpolate", constants: &[] },
    ],
};

fn run(gpu: &Gpu, entry: &'static str, uniform: &Sparse, buffers: &[(u32, &pano_core::gpu::GpuBuffer)]) -> GpuResult<()> {
    let kernel = Kernel { shader: &SHADER, entry, constants: &[] };
    gpu.dispatch(&kernel, bytemuck::bytes_of(uniform), buffers, uniform.rows.groups())
}

/// [`super::levels`] of pictures of one size.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size, or what has become of the device.
pub fn levels(
    gpu: &Gpu,
    params: &Params,
    position: &Image<Vec3>,
    normal: &Image<Vec3>,
    active: &Image<u32>,
) -> GpuResult<Image<u8>> {
    let (position, normal, active) = (gpu.upload(position)?, gpu.upload(normal)?, gpu.upload(active)?);
    position.check_like("normal layer", &normal)?;
    position.check_like("count of active frames", &active)?;
    let found: GpuImage<u32> = gpu.image(position.rows())?;
    let Params { delta1, delta2, sigma_position, .. } = *params;
    let uniform = Sparse { rows: position.rows(), delta1, delta2, sigma_position };
    let buffers = [(1, position.buffer()), (2, normal.buffer()), (3, active.buffer()), (4, found.buffer())];
    run(gpu, "levels", &uniform, &buffers)?;
    Ok(gpu.read(&found)?.map(|level| level as u8))
}

/// [`super::interpolate`]; `wanted` is 0 for pixels that stay as they are. If it fails, all are as they were.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size, or what has become of the device.
pub fn interpolate(
    gpu: &Gpu,
    levels: &Image<u8>,
    wanted: &Image<u32>,
    share: &mut Image<f32>,
    signals: &mut [&mut Image<Vec3>],
) -> GpuResult<()> {
    let (level, wanted, known) = (gpu.upload(&levels.map(u32::from))?, gpu.upload(wanted)?, gpu.upload(share)?);
    known.check_like("levels", &level)?;
    known.check_like("mask", &wanted)?;
    let rows = Rows::all(share.size());
    let uniform = Sparse { rows, delta1: 0.0, delta2: 0.0, sigma_position: 0.0 };
    let (filled, shares): (GpuImage<Vec3>, GpuImage<f32>) = (gpu.image(rows)?, gpu.image(rows)?);
    let mut results = Vec::with_capacity(signals.len());
    for signal in signals.iter() {
        let source = gpu.upload(signal)?;
        known.check_like("signal", &source)?;
        let buffers = [
            (5, level.buffer()),
            (6, wanted.buffer()),
            (7, known.buffer()),
            (8, source.buffer()),
            (9, filled.buffer()),
            (10, shares.buffer()),
        ];
        run(gpu, "interpolate", &uniform, &buffers)?;
        results.push(gpu.read(&filled)?);
    }
    if !results.is_empty() {
        *share = gpu.read(&shares)?;
    }
    signals.iter_mut().zip(results).for_each(|(signal, result)| **signal = result);
    Ok(())
}
