//! The filter on the GPU.
//!
//! Departures from the CPU: sums are `f32`, of values limited to ±[`pano_core::gpu::LARGEST`]. Pictures larger than a binding go
//! in bands with a halo of all levels.

use super::{Guides, Params, cpu};
use crate::Energy;
use crate::surfaces::gpu::{GpuSurfaces, SURFACES, inverse};
use glam::{Vec3, Vec4};
use pano_core::gpu::{
    Band, COLOR, Constant, Gpu, GpuBuffer, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader,
    Specialization, flag,
};
use pano_core::image::Image;

pano_core::uniform! {
    /// `Atrous` of the shader. A sigma of a surface is given as its inverse, 0 if it is infinite.
    pub(crate) struct Atrous {
        rows: Rows,
        depth: f32,
        normal: f32,
        luminance: f32,
        step: i32,
    }
}

/// `atrous.wgsl`.
pub static SHADER: Shader = Shader {
    name: "atrous",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        COLOR,
        SURFACES,
        Piece {
            text: include_str!("atrous.wgsl"),
            constants: || {
                // By distance from the middle.
                let spline = Vec3::from_array(std::array::from_fn(|i| cpu::SPLINE[2 + i] as f32));
                vec![Constant::vec3("SPLINE", spline), Constant::f32("ROUNDING", cpu::ROUNDING as f32)]
            },
        },
    ],
    specializations: &[
        Specialization { entry: "prepare", constants: &[] },
        Specialization { entry: "finish", constants: &[] },
        Specialization { entry: "level", constants: &[("WRAP", 0.0)] },
        Specialization { entry: "level", constants: &[("WRAP", 1.0)] },
    ],
};

/// Bytes of a pixel in the largest binding.
const PIXEL_BYTES: usize = size_of::<Vec4>();

/// What the kernels of one call share.
struct Call<'a> {
    gpu: &'a Gpu,
    uniform: Atrous,
    wrap: bool,
}

impl<'a> Call<'a> {
    fn new(gpu: &'a Gpu, params: &Params, surfaces: &GpuSurfaces<'_>, rows: Rows) -> Self {
        let uniform = Atrous {
            rows,
            depth: inverse(params.sigma_depth),
            normal: inverse(params.sigma_normal),
            // Beyond this all luminances are alike.
            luminance: params.sigma_luminance.min(1e15),
            step: 1,
        };
        Self { gpu, uniform, wrap: surfaces.wrap }
    }

    fn run(&self, entry: &'static str, step: i32, buffers: &[(u32, &GpuBuffer)]) -> GpuResult<()> {
        let wrap = [("WRAP", flag(self.wrap))];
        // Kernels that look at no neighbour have nothing to wrap.
        let constants: &[_] = if matches!(entry, "prepare" | "finish") { &[] } else { &wrap };
        let uniform = Atrous { step, ..self.uniform };
        let kernel = Kernel { shader: &SHADER, entry, constants };
        self.gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), buffers, self.uniform.rows.groups())
    }
}

/// [`super::filter`] of pictures on the GPU: the filtered signal and its variance.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or a parameter is out of range, or what has become of the
/// device.
pub fn filter(
    gpu: &Gpu,
    params: &Params,
    surfaces: &GpuSurfaces<'_>,
    share: &GpuImage<f32>,
    variance: &GpuImage<f32>,
    signal: &GpuImage<Vec3>,
) -> GpuResult<(GpuImage<Vec3>, GpuImage<f32>)> {
    params.check()?;
    signal.check_like("share", share)?;
    signal.check_like("variance", variance)?;
    signal.check_like("slope", &surfaces.slope)?;
    let rows = signal.rows();
    let call = Call::new(gpu, params, surfaces, rows);
    let pair = || Ok::<_, pano_core::gpu::GpuError>((gpu.image::<Vec4>(rows)?, gpu.image::<f32>(rows)?));
    let (mut now, mut next) = (pair()?, pair()?);
    let source = [(1, signal.buffer()), (2, share.buffer()), (5, variance.buffer())];
    call.run("prepare", 1, &[&source[..], &[(8, now.0.buffer()), (9, now.1.buffer())]].concat())?;
    let guides = [(3, surfaces.slope.buffer()), (4, surfaces.normal.buffer())];
    for level in 0..params.levels {
        let pixels = [(6, now.0.buffer()), (7, now.1.buffer()), (8, next.0.buffer()), (9, next.1.buffer())];
        call.run("level", 1 << level, &[&guides[..], &pixels[..]].concat())?;
        std::mem::swap(&mut now, &mut next);
    }
    let filtered = gpu.image(rows)?;
    let pixels = [(6, now.0.buffer()), (7, now.1.buffer()), (9, next.1.buffer()), (10, filtered.buffer())];
    call.run("finish", 1, &[&[source[0], source[2]][..], &pixels[..]].concat())?;
    Ok((filtered, next.1))
}

/// Rows on either side of a pixel that all levels look at, and one for the slopes there.
fn halo(levels: u32) -> usize {
    2 * ((1usize << levels) - 1) + 1
}

/// [`super::filter`] of pictures of any size, in bands. If it fails, pictures are as they were.
///
/// # Errors
/// As [`filter`].
pub fn filter_pictures(
    gpu: &Gpu,
    params: &Params,
    guides: &Guides<'_>,
    share: &Image<f32>,
    variance: &mut Image<f32>,
    signal: &mut Image<Vec3>,
) -> GpuResult<Energy> {
    params.check()?;
    guides.check(signal.size(), share, variance)?;
    let (mut filtered, mut variances) = (signal.clone(), variance.clone());
    for Band { keep, hold } in gpu.bands(signal.size(), PIXEL_BYTES, halo(params.levels))? {
        let (depth, normal) = (gpu.upload_rows(guides.depth, &hold)?, gpu.upload_rows(guides.normal, &hold)?);
        let surfaces = GpuSurfaces::new(gpu, &depth, &normal, params.wrap)?;
        let (share, source) = (gpu.upload_rows(share, &hold)?, gpu.upload_rows(signal, &hold)?);
        let known = gpu.upload_rows(variance, &hold)?;
        let (value, spread) = filter(gpu, params, &surfaces, &share, &known, &source)?;
        gpu.read_rows(&value, &keep, &mut filtered)?;
        gpu.read_rows(&spread, &keep, &mut variances)?;
    }
    let energy = Energy::between(signal, &filtered);
    (*signal, *variance) = (filtered, variances);
    Ok(energy)
}
