//! The operator on the GPU.

use super::{BASE, GAIN, LUMA_WEIGHTS};
use glam::Vec3;
use pano_core::gpu::{Constant, Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, SPHERE, Shader, Specialization};
use pano_core::image::RadianceImage;

/// `expand.wgsl`.
pub static SHADER: Shader = Shader {
    name: "expand",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        Piece {
            text: include_str!("expand.wgsl"),
            constants: || {
                let weights = Constant::vec3("LUMA_WEIGHTS", LUMA_WEIGHTS);
                vec![weights, Constant::f32("GAIN", GAIN), Constant::f32("BASE", BASE)]
            },
        },
    ],
    specializations: &[Specialization { entry: "expand", constants: &[] }],
};

/// [`super::expand`] of a picture on the GPU.
///
/// # Errors
/// What has become of the device.
pub fn expand(gpu: &Gpu, ldr: &GpuImage<Vec3>) -> GpuResult<GpuImage<Vec3>> {
    let rows = ldr.rows();
    let hdr = gpu.image(rows)?;
    let kernel = Kernel { shader: &SHADER, entry: "expand", constants: &[] };
    gpu.dispatch(&kernel, bytemuck::bytes_of(&rows), &[(1, ldr.buffer()), (2, hdr.buffer())], rows.groups())?;
    Ok(hdr)
}

/// [`super::expand`] of a picture of any size, in bands.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size, or what has become of the device.
pub fn expand_picture(gpu: &Gpu, ldr: &RadianceImage, hdr: &mut RadianceImage) -> GpuResult<()> {
    super::check_sizes(ldr, hdr)?;
    for band in gpu.bands(ldr.size(), size_of::<Vec3>(), 0)? {
        let expanded = expand(gpu, &gpu.upload_rows(ldr, &band.hold)?)?;
        gpu.read_rows(&expanded, &band.keep, hdr)?;
    }
    Ok(())
}
