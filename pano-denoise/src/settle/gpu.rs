//! Settling on the GPU, and the filter in between: the layers stay there.
//!
//! Departures from the CPU: what pixels give to those around them is gathered by the receivers, in the order in which the CPU scatters it,
//! so that results differ by rounding. What is not a normal number counts as 0.

use super::strays::{ALIKE, AT_RIMS, DARK, ENOUGH, FEW, INVISIBLE, LEAST_SHOWN, SPREAD, STANDS_OUT};
use crate::Energy;
use crate::cross_bilateral::gpu::{self as cross_bilateral, Layer};
use crate::cross_bilateral::{Params, Report};
use glam::{Vec3, Vec4};
use pano_core::gpu::{
    Band, COLOR, Constant, Gpu, GpuBuffer, GpuImage, GpuLayers, GpuResult, IMAGE, Kernel, NUMBER, Piece, SPHERE, Shader,
    Specialization, flag,
};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;

/// `settle.wgsl`.
pub static SHADER: Shader = Shader {
    name: "settle",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        COLOR,
        Piece {
            text: include_str!("settle.wgsl"),
            constants: || {
                vec![
                    Constant::f32("STANDS_OUT", STANDS_OUT),
                    Constant::f32("INVISIBLE", INVISIBLE),
                    Constant::u32("SPREAD", SPREAD as u32),
                    Constant::f32("ALIKE", ALIKE),
                    Constant::f32("LEAST_SHOWN", LEAST_SHOWN),
                    Constant::u32("FEW", FEW as u32),
                    Constant::u32("ENOUGH", ENOUGH as u32),
                    Constant::f32("AT_RIMS", AT_RIMS),
                    Constant::f32("DARK", DARK),
                ]
            },
        },
    ],
    specializations: &[
        Specialization { entry: "limit", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "limit", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
        Specialization { entry: "exceed", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "exceed", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
        Specialization { entry: "spread", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "spread", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
        Specialization { entry: "lighten", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "stray", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "stray", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "stray", constants: &[("WRAP", 1.0), ("REAL", 0.0)] },
        Specialization { entry: "stray", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
        Specialization { entry: "settle", constants: &[("WRAP", 0.0), ("REAL", 0.0)] },
        Specialization { entry: "settle", constants: &[("WRAP", 0.0), ("REAL", 1.0)] },
        Specialization { entry: "settle", constants: &[("WRAP", 1.0), ("REAL", 0.0)] },
        Specialization { entry: "settle", constants: &[("WRAP", 1.0), ("REAL", 1.0)] },
    ],
};

/// Rows on either side of a pixel that [`before`] looks at: to what is spread over it, and to what else that is spread over.
const HALO_BEFORE: usize = 2 * SPREAD;
/// The same of [`after`]: to its neighbours, and to theirs.
const HALO_AFTER: usize = 2;

/// A kernel, and the numbers of what it binds.
type Entry = (&'static str, &'static [u32]);

const LAYER: u32 = 1;
const COVERAGE: u32 = 2;
const PHOTO: u32 = 3;
const DEPTH: u32 = 4;
const NORMAL: u32 = 5;
const EXCESS: u32 = 6;
const LIGHTER: u32 = 7;

const LIMIT: Entry = ("limit", &[LAYER, COVERAGE, PHOTO]);
const EXCEED: Entry = ("exceed", &[LAYER, COVERAGE, PHOTO, DEPTH, NORMAL, EXCESS]);
const SPREAD_OUT: Entry = ("spread", &[LAYER, COVERAGE, PHOTO, DEPTH, NORMAL, EXCESS]);
const LIGHTEN: Entry = ("lighten", &[LAYER, COVERAGE, LIGHTER]);
const STRAY: Entry = ("stray", &[LAYER, COVERAGE, PHOTO, DEPTH, NORMAL, EXCESS]);
const SETTLE: Entry = ("settle", &[LAYER, COVERAGE, PHOTO, EXCESS]);

/// Runs kernels on one of the layers; `made` is what they write beside it.
fn run(
    gpu: &Gpu,
    entries: &[Entry],
    (which, wrap): (Layer, bool),
    photo: &GpuImage<Vec3>,
    layers: &GpuLayers,
    made: (u32, &GpuBuffer),
) -> GpuResult<()> {
    let layer = if which == Layer::Real { &layers.delta } else { &layers.object };
    layer.check_like("photo", photo)?;
    let pictures = [
        (LAYER, layer.buffer()),
        (COVERAGE, layers.coverage.buffer()),
        (PHOTO, photo.buffer()),
        (DEPTH, layers.depth.buffer()),
        (NORMAL, layers.normal.buffer()),
        made,
    ];
    let rows = layer.rows();
    let constants = [("WRAP", flag(wrap)), ("REAL", flag(which == Layer::Real))];
    for &(entry, bound) in entries {
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        let buffers: Vec<(u32, &GpuBuffer)> = pictures.into_iter().filter(|(number, _)| bound.contains(number)).collect();
        gpu.dispatch(&kernel, bytemuck::bytes_of(&rows), &buffers, rows.groups())?;
    }
    Ok(())
}

/// [`super::before`] on layers of the GPU: `object` and `delta` change.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the photo is of another size, or what has become of the device.
pub fn before(gpu: &Gpu, wrap: bool, photo: &GpuImage<Vec3>, layers: &mut GpuLayers) -> GpuResult<()> {
    let rows = layers.object.rows();
    let excess = gpu.image::<Vec4>(rows)?;
    run(gpu, &[LIMIT, EXCEED, SPREAD_OUT], (Layer::Real, wrap), photo, layers, (EXCESS, excess.buffer()))?;
    let lighter = gpu.image(rows)?;
    run(gpu, &[LIGHTEN], (Layer::Object, false), photo, layers, (LIGHTER, lighter.buffer()))?;
    layers.object = lighter;
    Ok(())
}

/// [`super::after`] on layers of the GPU: `object` and `delta` change.
///
/// # Errors
/// As [`before`].
pub fn after(gpu: &Gpu, wrap: bool, photo: &GpuImage<Vec3>, layers: &mut GpuLayers) -> GpuResult<()> {
    let excess = gpu.image::<Vec4>(layers.object.rows())?;
    for which in [Layer::Real, Layer::Object] {
        run(gpu, &[STRAY, SETTLE], (which, wrap), photo, layers, (EXCESS, excess.buffer()))?;
    }
    Ok(())
}

/// [`super::filter`] of layers of any size, in bands. If it fails, the layers are as they were.
///
/// # Errors
/// As [`cross_bilateral::filter`], and as [`before`].
pub fn filter_layers(gpu: &Gpu, params: &Params, photo: &RadianceImage, layers: &mut TracedLayers) -> GpuResult<Report> {
    super::check_sizes(photo, layers)?;
    let [mut settled, mut filtered] = std::array::from_fn(|_| (layers.object.clone(), layers.delta.clone()));
    let mut report = Report::default();
    let halo = HALO_BEFORE + cross_bilateral::halo(params) + HALO_AFTER;
    for Band { keep, hold } in gpu.bands(layers.size(), GpuLayers::PIXEL_BYTES, halo)? {
        let mut held = GpuLayers::upload(gpu, layers, &hold)?;
        let photo = gpu.upload_rows(photo, &hold)?;
        let read = |held: &GpuLayers, (object, delta): &mut (Image<Vec3>, Image<Vec3>)| {
            gpu.read_rows(&held.object, &keep, object)?;
            gpu.read_rows(&held.delta, &keep, delta)
        };
        before(gpu, params.wrap, &photo, &mut held)?;
        read(&held, &mut settled)?;
        cross_bilateral::filter(gpu, params, &mut held)?;
        read(&held, &mut filtered)?;
        report.object += Energy::in_rows(&settled.0, &filtered.0, &keep);
        report.delta += Energy::in_rows(&settled.1, &filtered.1, &keep);
        after(gpu, params.wrap, &photo, &mut held)?;
        read(&held, &mut settled)?;
    }
    (layers.object, layers.delta) = settled;
    Ok(report)
}
