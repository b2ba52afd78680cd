//! The accumulation on the GPU.
//!
//! Departures from the CPU: sums are `f32`, of values limited to ±[`pano_core::gpu::LARGEST`]. Motion may point anywhere, so that
//! there are no bands: frames of more than eight million pixels stay on the CPU. Frames are counted up to 2²⁴.

use super::{Guides, History, Params};
use glam::{Vec3, Vec4};
use pano_core::gpu::{Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization};
use pano_core::image::Image;

pano_core::uniform! {
    /// `Temporal` of the shader.
    pub(crate) struct Temporal {
        rows: Rows,
        blend: f32,
        depth: f32,
        normal: f32,
        reach: f32,
    }
}

/// `temporal.wgsl`.
pub static SHADER: Shader = Shader {
    name: "temporal",
    pieces: &[NUMBER, SPHERE, IMAGE, Piece::plain(include_str!("temporal.wgsl"))],
    specializations: &[
        Specialization { entry: "accumulate", constants: &[("WRAP", 0.0), ("HAS_PAST", 0.0), ("CLAMPED", 0.0)] },
        Specialization { entry: "accumulate", constants: &[("WRAP", 0.0), ("HAS_PAST", 1.0), ("CLAMPED", 0.0)] },
        Specialization { entry: "accumulate", constants: &[("WRAP", 0.0), ("HAS_PAST", 1.0), ("CLAMPED", 1.0)] },
        Specialization { entry: "accumulate", constants: &[("WRAP", 1.0), ("HAS_PAST", 0.0), ("CLAMPED", 0.0)] },
        Specialization { entry: "accumulate", constants: &[("WRAP", 1.0), ("HAS_PAST", 1.0), ("CLAMPED", 0.0)] },
        Specialization { entry: "accumulate", constants: &[("WRAP", 1.0), ("HAS_PAST", 1.0), ("CLAMPED", 1.0)] },
    ],
};

/// What a frame shows, on the GPU: a part of the next frame's history.
#[derive(Debug)]
pub struct GpuSurface {
    /// Normal and depth.
    pub surface: GpuImage<Vec4>,
    /// Which thing is seen.
    pub thing: GpuImage<u32>,
}

impl GpuSurface {
    /// Copies what a frame shows to the GPU.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn upload(gpu: &Gpu, depth: &Image<f32>, normal: &Image<Vec3>, thing: &Image<u32>) -> GpuResult<Self> {
        let (w, h) = depth.size();
        let surface = Image::par_from_fn(w, h, |x, y| normal.get(x, y).extend(depth.get(x, y)));
        Ok(Self { surface: gpu.upload(&surface)?, thing: gpu.upload(thing)? })
    }
}

/// The past of a signal, on the GPU.
#[derive(Debug)]
pub struct GpuPast<'a> {
    /// The accumulated value, and of how many frames it is.
    pub value: &'a GpuImage<Vec4>,
    /// What the frame showed.
    pub surface: &'a GpuSurface,
}

/// [`super::accumulate`] of pictures on the GPU: the accumulated value with the number of its frames, as [`GpuPast::value`].
/// `previous` has each point's place in the previous frame and its distance from the previous camera.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or a parameter is out of range, or what has become of the
/// device.
pub fn accumulate(
    gpu: &Gpu,
    params: &Params,
    surface: &GpuSurface,
    previous: &GpuImage<Vec3>,
    signal: &GpuImage<Vec3>,
    past: Option<&GpuPast<'_>>,
) -> GpuResult<GpuImage<Vec4>> {
    params.check()?;
    let rows = signal.rows();
    signal.check_like("surface", &surface.surface)?;
    signal.check_like("place in the previous frame", previous)?;
    let accumulated = gpu.image(rows)?;
    let flag = |on: bool| f64::from(u8::from(on));
    let clamped = past.is_some() && params.clamp.is_finite();
    let constants = [("WRAP", flag(params.wrap)), ("HAS_PAST", flag(past.is_some())), ("CLAMPED", flag(clamped))];
    // Without a past its bindings are declared still: anything stands in for it.
    let (value, old) = match past {
        Some(past) => {
            signal.check_like("history", past.value)?;
            (past.value, past.surface)
        }
        None => (&gpu.image(rows)?, surface),
    };
    let buffers = [
        (1, signal.buffer()),
        (2, surface.surface.buffer()),
        (3, surface.thing.buffer()),
        (4, previous.buffer()),
        (5, value.buffer()),
        (6, old.surface.buffer()),
        (7, old.thing.buffer()),
        (8, accumulated.buffer()),
    ];
    let reach = if clamped { params.clamp } else { 0.0 };
    let uniform = Temporal { rows, blend: params.blend, depth: params.depth, normal: params.normal, reach };
    let kernel = Kernel { shader: &SHADER, entry: "accumulate", constants: &constants };
    gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())?;
    Ok(accumulated)
}

/// [`super::accumulate`] of pictures of the host. If it fails, signal and history are as they were.
///
/// # Errors
/// As [`accumulate`].
pub fn accumulate_picture(
    gpu: &Gpu,
    params: &Params,
    guides: &Guides<'_>,
    signal: &mut Image<Vec3>,
    history: &mut Option<History>,
) -> GpuResult<()> {
    params.check()?;
    guides.check(signal.size())?;
    let (w, h) = signal.size();
    let surface = GpuSurface::upload(gpu, guides.depth, guides.normal, guides.thing)?;
    let previous =
        gpu.upload(&Image::par_from_fn(w, h, |x, y| guides.previous.get(x, y).extend(guides.previous_depth.get(x, y))))?;
    let source = gpu.upload(signal)?;
    let accumulated = match history.as_ref().filter(|past| past.signal.size() == signal.size()) {
        None => accumulate(gpu, params, &surface, &previous, &source, None)?,
        Some(past) => {
            let frames = |x, y| past.length.get(x, y) as f32;
            let value = gpu.upload(&Image::from_fn(w, h, |x, y| past.signal.get(x, y).extend(frames(x, y))))?;
            let old = GpuSurface::upload(gpu, &past.depth, &past.normal, &past.thing)?;
            accumulate(gpu, params, &surface, &previous, &source, Some(&GpuPast { value: &value, surface: &old }))?
        }
    };
    let values = gpu.read(&accumulated)?;
    *signal = values.map(Vec4::truncate);
    *history = Some(History {
        signal: signal.clone(),
        depth: guides.depth.clone(),
        normal: guides.normal.clone(),
        thing: guides.thing.clone(),
        length: values.map(|v| v.w as u32),
    });
    Ok(())
}
