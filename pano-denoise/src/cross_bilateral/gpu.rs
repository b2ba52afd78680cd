//! The filter on the GPU.
//!
//! Departures from the CPU: sums are `f32`, of values limited to ±[`pano_core::gpu::LARGEST`]. A pass takes the slopes of depth
//! and two kernels; pictures larger than a binding go in bands with a halo.

use super::{Energy, Params, Report};
use crate::surfaces::gpu::{ALBEDO, GpuSurfaces, SURFACES, inverse};
use glam::{Vec3, Vec4};
use pano_core::gpu::{
    Constant, Gpu, GpuImage, GpuLayers, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization, flag,
};
use pano_core::layers::TracedLayers;

pano_core::uniform! {
    /// `CrossBilateral` of the shader. A sigma is given as its inverse, 0 if it is infinite.
    pub(crate) struct CrossBilateral {
        rows: Rows,
        space: f32,
        depth: f32,
        normal: f32,
        albedo: f32,
        radiance: f32,
        ranged: u32,
    }
}

/// `cross_bilateral.wgsl`.
pub static SHADER: Shader = Shader {
    name: "cross_bilateral",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        SURFACES,
        ALBEDO,
        Piece {
            text: include_str!("cross_bilateral.wgsl"),
            constants: || vec![Constant::f32("OUTLIER", super::cpu::OUTLIER as f32)],
        },
    ],
    specializations: &[
        Specialization { entry: "local", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "local", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "local", constants: &[("WRAP", 1.0), ("REAL", 0.0)] },
        Specialization { entry: "local", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 1.0), ("REAL", 0.0)] },
        Specialization { entry: "average", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
    ],
};

/// Rows on either side of a pixel that one pass looks at: two to a tap, one to its neighbours and one to their slopes; or two
/// to a tap and two to see whether anything there is not black.
const HALO: usize = 4;

/// Which layer is filtered: what share of the pixel belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The objects': the coverage.
    Object,
    /// The real surfaces': the rest.
    Real,
}

/// One pass of [`super::filter_layer`] over a picture of the GPU; `coverage` is that of [`TracedLayers`].
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or a sigma is not > 0, or what has become of the device.
pub fn filter_layer(
    gpu: &Gpu,
    params: &Params,
    surfaces: &GpuSurfaces<'_>,
    albedo: &GpuImage<Vec3>,
    coverage: &GpuImage<f32>,
    which: Layer,
    layer: &GpuImage<Vec3>,
) -> GpuResult<GpuImage<Vec3>> {
    params.check()?;
    let rows = layer.rows();
    layer.check_like("slope", &surfaces.slope)?;
    layer.check_like("albedo", albedo)?;
    layer.check_like("coverage", coverage)?;
    let uniform = CrossBilateral {
        rows,
        space: inverse(params.sigma_space),
        depth: inverse(params.sigma_depth),
        normal: inverse(params.sigma_normal),
        albedo: inverse(params.sigma_albedo),
        radiance: if params.sigma_radiance.is_finite() { params.sigma_radiance } else { 0.0 },
        ranged: params.sigma_radiance.is_finite().into(),
    };
    let constants = [("WRAP", flag(surfaces.wrap)), ("REAL", flag(which == Layer::Real))];
    let (mean, residual, filtered) = (gpu.image::<Vec3>(rows)?, gpu.image::<Vec4>(rows)?, gpu.image(rows)?);
    let guides = [
        (1, layer.buffer()),
        (2, coverage.buffer()),
        (3, surfaces.slope.buffer()),
        (4, surfaces.normal.buffer()),
        (5, albedo.buffer()),
        (6, mean.buffer()),
        (7, residual.buffer()),
    ];
    let run = |entry, buffers: &[_]| {
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), buffers, rows.groups())
    };
    run("local", &guides)?;
    run("average", &[&guides[..], &[(8, filtered.buffer())]].concat())?;
    Ok(filtered)
}

/// [`super::filter`] on layers of the GPU: `object` and `delta` are replaced.
///
/// # Errors
/// As [`filter_layer`].
pub fn filter(gpu: &Gpu, params: &Params, layers: &mut GpuLayers) -> GpuResult<()> {
    let surfaces = GpuSurfaces::new(gpu, &layers.depth, &layers.normal, params.wrap)?;
    let pass =
        |which, layer: &GpuImage<Vec3>| filter_layer(gpu, params, &surfaces, &layers.albedo, &layers.coverage, which, layer);
    let object = pass(Layer::Object, &layers.object)?;
    let mut delta = pass(Layer::Real, &layers.delta)?;
    for _ in 1..params.delta_passes {
        delta = pass(Layer::Real, &delta)?;
    }
    (layers.object, layers.delta) = (object, delta);
    Ok(())
}

/// Rows on either side of a band that [`filter`] looks at.
pub(crate) fn halo(params: &Params) -> usize {
    HALO * params.delta_passes.max(1) as usize
}

/// [`super::filter`] of layers of any size, in bands. If it fails, the layers are as they were.
///
/// # Errors
/// As [`filter_layer`].
pub fn filter_layers(gpu: &Gpu, params: &Params, layers: &mut TracedLayers) -> GpuResult<Report> {
    params.check()?;
    let (mut object, mut delta) = (layers.object.clone(), layers.delta.clone());
    for band in gpu.bands(layers.size(), GpuLayers::PIXEL_BYTES, halo(params))? {
        let mut held = GpuLayers::upload(gpu, layers, &band.hold)?;
        filter(gpu, params, &mut held)?;
        gpu.read_rows(&held.object, &band.keep, &mut object)?;
        gpu.read_rows(&held.delta, &band.keep, &mut delta)?;
    }
    let report = Report { object: Energy::between(&layers.object, &object), delta: Energy::between(&layers.delta, &delta) };
    (layers.object, layers.delta) = (object, delta);
    Ok(report)
}
