//! The blur on the GPU. Its statistics are added up on the host, in `f64`: the blurred luminance is wanted there, as the
//! components of the mask are found breadth-first, one pixel after the other.

use super::cpu::{self, SIZE, Statistics};
use super::{Detection, Params};
use crate::WorkingMap;
use crate::expand::LUMA_WEIGHTS;
use pano_core::gpu::{Constant, Gpu, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization};
use pano_core::image::Image;

pano_core::uniform! {
    /// `Blur` of the shader.
    pub(crate) struct Blur {
        rows: Rows,
        radius: u32,
    }
}

/// `blur.wgsl`.
pub static SHADER: Shader = Shader {
    name: "blur",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        Piece { text: include_str!("blur.wgsl"), constants: || vec![Constant::vec3("LUMA_WEIGHTS", LUMA_WEIGHTS)] },
    ],
    specializations: &[Specialization { entry: "across", constants: &[] }, Specialization { entry: "down", constants: &[] }],
};

/// [`super::detect`] with the blur on the GPU.
///
/// # Errors
/// What has become of the device.
pub fn detect(gpu: &Gpu, map: &WorkingMap, params: &Params) -> GpuResult<Detection> {
    Ok(cpu::detect(map, params, Statistics::of_blurred(blurred(gpu, map, params)?)))
}

/// Luminance of the upper half, blurred.
///
/// # Errors
/// What has become of the device.
pub fn blurred(gpu: &Gpu, map: &WorkingMap, params: &Params) -> GpuResult<Image<f32>> {
    let rows = Rows::all(SIZE);
    let radiance = gpu.upload_slice(&map.radiance().data()[..rows.pixels()])?;
    let (halfway, blurred) = (gpu.image::<f32>(rows)?, gpu.image::<f32>(rows)?);
    let uniform = Blur { rows, radius: params.blur_radius.min(SIZE.0) as u32 };
    let run = |entry, buffers: &[_]| {
        let kernel = Kernel { shader: &SHADER, entry, constants: &[] };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), buffers, rows.groups())
    };
    run("across", &[(1, &radiance), (2, halfway.buffer())])?;
    run("down", &[(2, halfway.buffer()), (3, blurred.buffer())])?;
    gpu.read(&blurred)
}
