//! The filter on the GPU.
//!
//! Departures from the CPU: sums are `f32`, of values and ratios limited to ±[`pano_core::gpu::LARGEST`]. Pictures larger than a
//! binding go in bands with a halo.

use super::{Params, Report};
use crate::Energy;
use crate::surfaces::gpu::{ALBEDO, GpuSurfaces, SURFACES, inverse};
use glam::Vec3;
use pano_core::gpu::{
    Constant, Gpu, GpuImage, GpuLayers, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization, flag,
};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;

pano_core::uniform! {
    /// `Mean` of the shader. A sigma is given as its inverse, 0 if it is infinite.
    pub(crate) struct Mean {
        rows: Rows,
        depth: f32,
        normal: f32,
        albedo: f32,
        radius: i32,
    }
}

/// `mean.wgsl`.
pub static SHADER: Shader = Shader {
    name: "mean",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        SURFACES,
        ALBEDO,
        Piece { text: include_str!("mean.wgsl"), constants: || vec![Constant::f32("SMALLEST", f32::MIN_POSITIVE)] },
    ],
    specializations: &[
        Specialization { entry: "average", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 1.0), ("REAL", 0.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
    ],
};

/// [`super::filter`] on layers of the GPU: `object` and `delta` are replaced. `penumbra` is 1 where one is seen, 0 elsewhere.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or a parameter is out of range, or what has become of the
/// device.
pub fn filter(
    gpu: &Gpu,
    params: &Params,
    penumbra: &GpuImage<u32>,
    photo: &GpuImage<Vec3>,
    layers: &mut GpuLayers,
) -> GpuResult<()> {
    params.check()?;
    let rows = layers.object.rows();
    layers.object.check_like("penumbra", penumbra)?;
    layers.object.check_like("photo", photo)?;
    let surfaces = GpuSurfaces::new(gpu, &layers.depth, &layers.normal, params.wrap)?;
    let uniform = Mean {
        rows,
        depth: inverse(params.sigma_depth),
        normal: inverse(params.sigma_normal),
        albedo: inverse(params.sigma_albedo),
        radius: params.radius as i32,
    };
    let pass = |real: bool, layer: &GpuImage<Vec3>| -> GpuResult<GpuImage<Vec3>> {
        let filtered = gpu.image(rows)?;
        let constants = [("WRAP", flag(params.wrap)), ("REAL", flag(real))];
        let buffers = [
            (1, layer.buffer()),
            (2, layers.coverage.buffer()),
            (3, surfaces.slope.buffer()),
            (4, surfaces.normal.buffer()),
            (5, layers.albedo.buffer()),
            (6, photo.buffer()),
            (7, penumbra.buffer()),
            (8, filtered.buffer()),
        ];
        let kernel = Kernel { shader: &SHADER, entry: "average", constants: &constants };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())?;
        Ok(filtered)
    };
    let (object, delta) = (pass(false, &layers.object)?, pass(true, &layers.delta)?);
    (layers.object, layers.delta) = (object, delta);
    Ok(())
}

/// [`super::filter`] of layers of any size, in bands. If it fails, the layers are as they were.
///
/// # Errors
/// As [`filter`].
pub fn filter_layers(
    gpu: &Gpu,
    params: &Params,
    penumbra: &Image<bool>,
    photo: &RadianceImage,
    layers: &mut TracedLayers,
) -> GpuResult<Report> {
    params.check()?;
    super::check_sizes(penumbra, photo, layers)?;
    let (mut object, mut delta) = (layers.object.clone(), layers.delta.clone());
    let penumbra = penumbra.map(u32::from);
    // A row more than the taps: their slopes.
    for band in gpu.bands(layers.size(), GpuLayers::PIXEL_BYTES, params.radius + 1)? {
        let mut held = GpuLayers::upload(gpu, layers, &band.hold)?;
        let (penumbra, photo) = (gpu.upload_rows(&penumbra, &band.hold)?, gpu.upload_rows(photo, &band.hold)?);
        filter(gpu, params, &penumbra, &photo, &mut held)?;
        gpu.read_rows(&held.object, &band.keep, &mut object)?;
        gpu.read_rows(&held.delta, &band.keep, &mut delta)?;
    }
    let report = Report { object: Energy::between(&layers.object, &object), delta: Energy::between(&layers.delta, &delta) };
    (layers.object, layers.delta) = (object, delta);
    Ok(report)
}
