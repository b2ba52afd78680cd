//! The accumulation on the GPU.
//!
//! Departures from the CPU: sums are `f32`, of values limited to ±[`pano_core::gpu::LARGEST`]. Motion may point anywhere, so that
//! there are no bands: frames of more than eight million pixels stay on the CPU.

use super::{Guides, History, Params, cpu};
use glam::{UVec2, Vec3, Vec4};
use pano_core::gpu::{
    COLOR, Constant, Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization, flag,
};
use pano_core::image::Image;

/// Bit of a thing's number in [`GpuSurface::thing`] where there is no noise.
const SHARP: u32 = 1 << 31;
/// Bits of the number itself; the two between are the level of interpolation.
const THING: u32 = (1 << LEVEL) - 1;
/// The lower of these two.
const LEVEL: u32 = 29;

pano_core::uniform! {
    /// `Temporal` of the shader.
    pub(crate) struct Temporal {
        rows: Rows,
        blend: f32,
        still: f32,
        depth: f32,
        normal: f32,
        reach: f32,
    }
}

/// Constants of `accumulate`: whether the picture wraps, there is a past, it is corrected, and variances are measured.
const fn constants(wrap: bool, past: bool, clamped: bool, measured: bool) -> [(&'static str, f64); 4] {
    [("WRAP", flag(wrap)), ("HAS_PAST", flag(past)), ("CLAMPED", flag(clamped)), ("MEASURED", flag(measured))]
}

/// Every specialisation of an entry with these constants.
macro_rules! accumulate {
    ($($wrap:literal $past:literal $clamped:literal $measured:literal),*) => {
        [
            Specialization { entry: "recall", constants: &[("WRAP", 0.0)] },
            Specialization { entry: "recall", constants: &[("WRAP", 1.0)] },
            $(Specialization { entry: "accumulate", constants: &constants($wrap, $past, $clamped, $measured) }),*
        ]
    };
}

/// `temporal.wgsl`.
pub static SHADER: Shader = Shader {
    name: "temporal",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        COLOR,
        Piece {
            text: include_str!("temporal.wgsl"),
            constants: || {
                vec![
                    Constant::u32("SHARP", SHARP),
                    Constant::u32("THING", THING),
                    Constant::u32("RADIUS", cpu::RADIUS as u32),
                    Constant::u32("RANGE_RADIUS", cpu::RANGE_RADIUS as u32),
                    Constant::f32("LONELY", cpu::LONELY as f32),
                    Constant::f32("STILL", cpu::STILL as f32),
                ]
            },
        },
    ],
    specializations: &accumulate![
        false false false false, false false false true,
        false true false false, false true false true, false true true false, false true true true,
        true false false false, true false false true,
        true true false false, true true false true, true true true false, true true true true
    ],
};

/// Normal and depth in one picture.
fn upload_surface(gpu: &Gpu, normal: &Image<Vec3>, depth: &Image<f32>) -> GpuResult<GpuImage<Vec4>> {
    gpu.upload(&Image::par_from_fn(depth.width(), depth.height(), |x, y| normal.get(x, y).extend(depth.get(x, y))))
}

/// What a frame shows, on the GPU: a part of the next frame's history.
#[derive(Debug)]
pub struct GpuSurface {
    /// Normal and depth.
    pub surface: GpuImage<Vec4>,
    /// Which thing is seen (below 2²⁹), the level of interpolation in bits 29 and 30; bit 31 is set where there is no noise.
    pub thing: GpuImage<u32>,
}

impl GpuSurface {
    /// Copies what a frame shows to the GPU.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn upload(gpu: &Gpu, guides: &Guides<'_>) -> GpuResult<Self> {
        let (w, h) = guides.depth.size();
        let sharp = |x, y| if guides.is_sharp(x, y) { SHARP } else { 0 };
        let level = |x, y| u32::from(guides.level(x, y)) << LEVEL;
        let thing = Image::from_fn(w, h, |x, y| guides.thing.get(x, y) & THING | level(x, y) | sharp(x, y));
        Ok(Self { surface: upload_surface(gpu, guides.normal, guides.depth)?, thing: gpu.upload(&thing)? })
    }
}

/// The past of a signal, on the GPU.
#[derive(Debug)]
pub struct GpuPast {
    /// The accumulated value, and the variance of one frame's luminance.
    pub value: GpuImage<Vec4>,
    /// Normal and depth of what was seen.
    pub surface: GpuImage<Vec4>,
    /// Which thing was seen, without the other bits, and the bits of [`History::frames`].
    pub thing: GpuImage<UVec2>,
}

impl GpuPast {
    /// Copies a history to the GPU.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn upload(gpu: &Gpu, past: &History) -> GpuResult<Self> {
        let (w, h) = past.signal.size();
        let value = Image::from_fn(w, h, |x, y| past.signal.get(x, y).extend(past.variance.get(x, y)));
        let thing = Image::from_fn(w, h, |x, y| UVec2::new(past.thing.get(x, y) & THING, past.frames.get(x, y).to_bits()));
        let surface = upload_surface(gpu, &past.normal, &past.depth)?;
        Ok(Self { value: gpu.upload(&value)?, surface, thing: gpu.upload(&thing)? })
    }
}

/// [`super::accumulate`] of pictures on the GPU: the accumulated value with the variance of one frame's luminance, as
/// [`GpuPast::value`], and [`History::frames`]. `previous` has each point's place in the previous frame and its distance from
/// the previous camera.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if the pictures differ in size or a parameter is out of range, or what has become of the
/// device.
pub fn accumulate(
    gpu: &Gpu,
    params: &Params,
    surface: &GpuSurface,
    previous: &GpuImage<Vec3>,
    measured: Option<&GpuImage<f32>>,
    signal: &GpuImage<Vec3>,
    past: Option<&GpuPast>,
) -> GpuResult<(GpuImage<Vec4>, GpuImage<f32>)> {
    params.check()?;
    let rows = signal.rows();
    signal.check_like("surface", &surface.surface)?;
    signal.check_like("place in the previous frame", previous)?;
    let clamped = past.is_some() && params.clamp.is_finite();
    let reach = if clamped { params.clamp } else { 0.0 };
    let (blend, still) = (params.blend_of(false) as f32, params.blend_of(true) as f32);
    let uniform = Temporal { rows, blend, still, depth: params.depth, normal: params.normal, reach };
    let run = |entry, constants: &[_], buffers: &[_]| {
        gpu.dispatch(&Kernel { shader: &SHADER, entry, constants }, bytemuck::bytes_of(&uniform), buffers, rows.groups())
    };
    let (known, known_frames) = (gpu.image::<Vec4>(rows)?, gpu.image::<f32>(rows)?);
    let constants = constants(params.wrap, past.is_some(), clamped, measured.is_some());
    let shown = [(2, surface.surface.buffer()), (3, surface.thing.buffer())];
    if let Some(past) = past {
        signal.check_like("history", &past.value)?;
        let asked = [
            (4, previous.buffer()),
            (5, past.value.buffer()),
            (6, past.surface.buffer()),
            (7, past.thing.buffer()),
            (8, known.buffer()),
            (9, known_frames.buffer()),
        ];
        run("recall", &constants[..1], &[&shown[..], &asked[..]].concat())?;
    }
    let (accumulated, frames) = (gpu.image(rows)?, gpu.image(rows)?);
    // Without measured variances their binding is declared still: anything stands in for it.
    let unread;
    let measured = match measured {
        Some(measured) => {
            signal.check_like("variance", measured)?;
            measured
        }
        None => {
            unread = gpu.image(rows)?;
            &unread
        }
    };
    let blended = [
        (1, signal.buffer()),
        (10, known.buffer()),
        (11, known_frames.buffer()),
        (12, measured.buffer()),
        (13, accumulated.buffer()),
        (14, frames.buffer()),
    ];
    run("accumulate", &constants, &[&shown[..], &blended[..]].concat())?;
    Ok((accumulated, frames))
}

/// [`super::accumulate`] of pictures of the host. If it fails, signal and history are as they were.
///
/// # Errors
/// As [`accumulate`].
pub fn accumulate_picture(
    gpu: &Gpu,
    params: &Params,
    guides: &Guides<'_>,
    measured: Option<&Image<f32>>,
    signal: &mut Image<Vec3>,
    history: &mut Option<History>,
) -> GpuResult<Image<f32>> {
    params.check()?;
    guides.check(signal.size(), measured)?;
    let (w, h) = signal.size();
    let surface = GpuSurface::upload(gpu, guides)?;
    let previous =
        gpu.upload(&Image::par_from_fn(w, h, |x, y| guides.previous.get(x, y).extend(guides.previous_depth.get(x, y))))?;
    let source = gpu.upload(signal)?;
    let measured = measured.map(|variance| gpu.upload(variance)).transpose()?;
    let past = history.as_ref().filter(|past| past.signal.size() == signal.size());
    let past = past.map(|past| GpuPast::upload(gpu, past)).transpose()?;
    let (accumulated, frames) = accumulate(gpu, params, &surface, &previous, measured.as_ref(), &source, past.as_ref())?;
    let (values, frames) = (gpu.read(&accumulated)?, gpu.read(&frames)?);
    *signal = values.map(Vec4::truncate);
    let variance = values.map(|v| v.w);
    let now = Image::par_from_fn(w, h, |x, y| variance.get(x, y) / frames.get(x, y).max(1.0));
    *history = Some(History {
        signal: signal.clone(),
        variance,
        depth: guides.depth.clone(),
        normal: guides.normal.clone(),
        thing: guides.thing.clone(),
        frames,
    });
    Ok(now)
}
