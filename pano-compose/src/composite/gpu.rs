//! Compositing on the GPU.
//!
//! Departures from the CPU: sums are `f32`. Untouched pixels are copied as bits here as well.

use super::{Clamped, Composite, MULTIPLIER_FLOOR, cpu};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::gpu::{COLOR, Gpu, GpuImage, GpuLayers, GpuResult, IMAGE, Kernel, NUMBER, Piece, SPHERE, Shader, Specialization};
use pano_core::image::RadianceImage;
use pano_core::layers::TracedLayers;

mod uniform {
    use pano_core::gpu::Rows;

    pano_core::uniform! {
        /// `Composite` of the shader.
        pub(crate) struct Composite {
            pub(super) rows: Rows,
            pub(super) floor: f32,
        }
    }
}
pub(crate) use uniform::Composite as Uniform;

/// `Clamped` of the shader: of one workgroup.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GroupClamped {
    pixels: u32,
    energy: f32,
}

/// `composite.wgsl`.
pub static SHADER: Shader = Shader {
    name: "composite",
    pieces: &[NUMBER, SPHERE, IMAGE, COLOR, crate::RADIANCE, Piece::plain(include_str!("composite.wgsl"))],
    specializations: &[Specialization { entry: "composite", constants: &[] }],
};

/// A composite in the GPU's memory.
#[derive(Debug)]
pub struct GpuComposite {
    /// As [`Composite::color`].
    pub color: GpuImage<Vec3>,
    /// As [`Composite::multiplier`].
    pub multiplier: GpuImage<Vec3>,
    clamped: pano_core::gpu::GpuBuffer,
    groups: usize,
}

/// What the multiplier divides by at least: [`MULTIPLIER_FLOOR`] times the photo's mean luminance. The photo comes from the host,
/// which adds it up in `f64`.
pub fn floor(photo: &RadianceImage) -> f32 {
    (f64::from(MULTIPLIER_FLOOR) * cpu::mean_luminance(photo)) as f32
}

/// [`super::composite`] of pictures on the GPU; `floor` is that of the whole photo ([`floor`]).
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size, or what has become of the device.
pub fn composite(gpu: &Gpu, photo: &GpuImage<Vec3>, floor: f32, layers: &GpuLayers) -> GpuResult<GpuComposite> {
    let rows = photo.rows();
    photo.check_like("object layer", &layers.object)?;
    photo.check_like("coverage", &layers.coverage)?;
    photo.check_like("delta layer", &layers.delta)?;
    let (color, multiplier) = (gpu.image(rows)?, gpu.image(rows)?);
    let [x, y, z] = rows.groups();
    let groups = (x * y) as usize;
    let clamped = gpu.buffer::<GroupClamped>(groups)?;
    let kernel = Kernel { shader: &SHADER, entry: "composite", constants: &[] };
    let buffers = [
        (1, photo.buffer()),
        (2, layers.object.buffer()),
        (3, layers.coverage.buffer()),
        (4, layers.delta.buffer()),
        (5, color.buffer()),
        (6, multiplier.buffer()),
        (7, &clamped),
    ];
    gpu.dispatch(&kernel, bytemuck::bytes_of(&Uniform { rows, floor }), &buffers, [x, y, z])?;
    Ok(GpuComposite { color, multiplier, clamped, groups })
}

impl GpuComposite {
    /// What had to be clamped, added up on the host. A band counts its halo, too.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn clamped(&self, gpu: &Gpu) -> GpuResult<Clamped> {
        let parts: Vec<GroupClamped> = gpu.read_slice(&self.clamped, self.groups)?;
        Ok(parts.iter().fold(Clamped::default(), |sum, part| Clamped {
            pixels: sum.pixels + part.pixels as usize,
            energy: sum.energy + f64::from(part.energy),
        }))
    }
}

/// [`super::composite`] of pictures of any size, in bands.
///
/// # Errors
/// As [`composite`].
pub fn composite_pictures(gpu: &Gpu, photo: &RadianceImage, layers: &TracedLayers, out: &mut Composite) -> GpuResult<Clamped> {
    super::check_sizes(photo, layers, out)?;
    let floor = floor(photo);
    let mut sum = Clamped::default();
    for band in gpu.bands(photo.size(), GpuLayers::PIXEL_BYTES, 0)? {
        let photo = gpu.upload_rows(photo, &band.hold)?;
        let made = composite(gpu, &photo, floor, &GpuLayers::upload(gpu, layers, &band.hold)?)?;
        gpu.read_rows(&made.color, &band.keep, &mut out.color)?;
        gpu.read_rows(&made.multiplier, &band.keep, &mut out.multiplier)?;
        let clamped = made.clamped(gpu)?;
        sum = Clamped { pixels: sum.pixels + clamped.pixels, energy: sum.energy + clamped.energy };
    }
    Ok(sum)
}
