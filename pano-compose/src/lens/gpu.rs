//! The effects on the GPU.
//!
//! Departures from the CPU: one kernel sums along lines for both effects. Pictures larger than a binding go in bands: bands of
//! the picture give the bloom's map, which is spread as a whole, and the glare has a halo as wide as it reaches. A bloom of less
//! than eight pixels has a map as large as the picture: such pictures of more than eleven million pixels stay on the CPU.

use super::shapes::{DIAGONALS, GLARE_THRESHOLD, NOTHING, RayPass, SUCCESSIVE, bloom_shape};
use super::{BRIGHTEST, Params, Report, total};
use glam::Vec3;
use pano_core::gpu::{
    COLOR, Constant, Gpu, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization, flag,
};
use pano_core::image::RadianceImage;
use std::ops::Range;

pano_core::uniform! {
    /// `Lens` of the shader.
    pub(crate) struct Lens {
        rows: Rows,
        threshold: f32,
        glare_threshold: f32,
        bloom: f32,
        glare: f32,
        nothing: f32,
        everything: u32,
        scale: u32,
        map_width: u32,
        map_height: u32,
        keep_first: u32,
        keep_count: u32,
    }
}

pano_core::uniform! {
    /// `Line` of the shader.
    pub(crate) struct Line {
        rows: Rows,
        step_x: i32,
        step_y: i32,
        reach: i32,
    }
}

/// Constants of `spread`.
const fn line(wrap: f64, both_ways: f64, added: f64) -> [(&'static str, f64); 3] {
    [("WRAP", wrap), ("BOTH_WAYS", both_ways), ("ADDED", added)]
}

/// Constants of `finish`.
const fn effects(wrap: f64, bloom: f64, glare: f64) -> [(&'static str, f64); 3] {
    [("WRAP", wrap), ("BLOOM", bloom), ("GLARE", glare)]
}

/// `lens.wgsl`.
pub static SHADER: Shader = Shader {
    name: "lens",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        COLOR,
        crate::RADIANCE,
        Piece { text: include_str!("lens.wgsl"), constants: || vec![Constant::f32("BRIGHTEST", BRIGHTEST)] },
    ],
    specializations: &[
        Specialization { entry: "reduce", constants: &[] },
        Specialization { entry: "take", constants: &[] },
        Specialization { entry: "spread", constants: &line(0.0, 1.0, 0.0) },
        Specialization { entry: "spread", constants: &line(1.0, 1.0, 0.0) },
        Specialization { entry: "spread", constants: &line(0.0, 0.0, 0.0) },
        Specialization { entry: "spread", constants: &line(1.0, 0.0, 0.0) },
        Specialization { entry: "spread", constants: &line(0.0, 0.0, 1.0) },
        Specialization { entry: "spread", constants: &line(1.0, 0.0, 1.0) },
        Specialization { entry: "finish", constants: &effects(0.0, 0.0, 1.0) },
        Specialization { entry: "finish", constants: &effects(0.0, 1.0, 0.0) },
        Specialization { entry: "finish", constants: &effects(0.0, 1.0, 1.0) },
        Specialization { entry: "finish", constants: &effects(1.0, 0.0, 1.0) },
        Specialization { entry: "finish", constants: &effects(1.0, 1.0, 0.0) },
        Specialization { entry: "finish", constants: &effects(1.0, 1.0, 1.0) },
    ],
};

/// Bytes of a pixel in the largest binding.
const PIXEL_BYTES: usize = size_of::<Vec3>();

/// Photo and picture, or a band of their rows, on the GPU.
struct Source {
    photo: GpuImage<Vec3>,
    picture: GpuImage<Vec3>,
}

impl Source {
    fn upload(gpu: &Gpu, photo: &RadianceImage, picture: &RadianceImage, rows: &Range<usize>) -> GpuResult<Self> {
        Ok(Self { photo: gpu.upload_rows(photo, rows)?, picture: gpu.upload_rows(picture, rows)? })
    }
}

/// What the kernels of one call share.
struct Call<'a> {
    gpu: &'a Gpu,
    params: &'a Params,
    /// By how much the bloom's map is reduced.
    scale: usize,
    /// Its size.
    map: (usize, usize),
    /// Weights of its filters.
    weights: Vec<f32>,
}

impl<'a> Call<'a> {
    fn new(gpu: &'a Gpu, params: &'a Params, (w, h): (usize, usize)) -> Self {
        let (scale, weights) = bloom_shape(params, (w, h));
        Self { gpu, params, scale, map: (w.div_ceil(scale), h.div_ceil(scale)), weights }
    }

    fn uniform(&self, rows: Rows, keep: &Range<usize>) -> Lens {
        Lens {
            rows,
            threshold: self.params.threshold,
            glare_threshold: self.params.threshold * GLARE_THRESHOLD,
            bloom: self.params.bloom,
            glare: self.params.glare,
            nothing: if self.scale > 1 { NOTHING } else { 0.0 },
            everything: self.params.everything.into(),
            scale: self.scale as u32,
            map_width: self.map.0 as u32,
            map_height: self.map.1 as u32,
            keep_first: keep.start as u32,
            keep_count: keep.len() as u32,
        }
    }

    /// Runs `spread` once, from one picture to another.
    fn spread(
        &self,
        constants: &[(&'static str, f64)],
        step: (i32, i32),
        weights: &[f32],
        from: &GpuImage<Vec3>,
        to: &GpuImage<Vec3>,
    ) -> GpuResult<()> {
        let rows = from.rows();
        let uniform = Line { rows, step_x: step.0, step_y: step.1, reach: weights.len() as i32 - 1 };
        let weights = self.gpu.upload_slice(weights)?;
        let buffers = [(4, from.buffer()), (5, &weights), (6, to.buffer())];
        let kernel = Kernel { shader: &SHADER, entry: "spread", constants };
        self.gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())
    }

    /// The bloom's map of the whole picture; `source` gives rows of it.
    fn bloom(
        &self,
        (width, height): (usize, usize),
        whole: Option<&Source>,
        source: &impl Fn(&Range<usize>) -> GpuResult<Source>,
    ) -> GpuResult<GpuImage<Vec3>> {
        let gpu = self.gpu;
        let map = gpu.image(Rows::all(self.map))?;
        let reduce = |source: &Source| {
            let rows = source.picture.rows();
            let uniform = self.uniform(rows, &(0..height));
            let buffers = [(1, source.picture.buffer()), (2, source.photo.buffer()), (3, map.buffer())];
            let kernel = Kernel { shader: &SHADER, entry: "reduce", constants: &[] };
            let groups = [(self.map.0 as u32).div_ceil(8), rows.count.div_ceil(self.scale as u32).div_ceil(8), 1];
            gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, groups)
        };
        match whole {
            Some(source) => reduce(source)?,
            None => {
                // Bands of whole rows of the map.
                for band in gpu.bands((width, self.map.1), PIXEL_BYTES * self.scale, 0)? {
                    reduce(&source(&(band.hold.start * self.scale..(band.hold.end * self.scale).min(height)))?)?;
                }
            }
        }
        let other = gpu.image(map.rows())?;
        let constants = line(flag(self.params.wrap), 1.0, 0.0);
        for _ in 0..SUCCESSIVE {
            self.spread(&constants, (1, 0), &self.weights, &map, &other)?;
            self.spread(&constants, (0, 1), &self.weights, &other, &map)?;
        }
        Ok(map)
    }

    /// The glare of the rows that are held, right where all that reaches a row is held as well.
    fn glare(&self, source: &Source) -> GpuResult<GpuImage<Vec3>> {
        let (gpu, rows, wrap) = (self.gpu, source.picture.rows(), flag(self.params.wrap));
        let (light, sum) = (gpu.image(rows)?, gpu.image(rows)?);
        let (mut now, mut next) = (gpu.image(rows)?, gpu.image(rows)?);
        let uniform = self.uniform(rows, &(0..0));
        let buffers = [(1, source.picture.buffer()), (2, source.photo.buffer()), (3, light.buffer())];
        let kernel = Kernel { shader: &SHADER, entry: "take", constants: &[] };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())?;
        for (i, (x, y)) in DIAGONALS.into_iter().enumerate() {
            for (n, RayPass { step, weights }) in RayPass::all(self.params).enumerate() {
                let from = if n == 0 { &light } else { &now };
                let step = (x * step, y * step);
                if n + 1 == self.params.passes as usize {
                    let weights = weights.map(|w| w / DIAGONALS.len() as f32);
                    self.spread(&line(wrap, 0.0, flag(i > 0)), step, &weights, from, &sum)?;
                } else {
                    self.spread(&line(wrap, 0.0, 0.0), step, &weights, from, &next)?;
                    std::mem::swap(&mut now, &mut next);
                }
            }
        }
        Ok(sum)
    }

    /// The picture with what was spread, and how much that was over the rows `keep`.
    fn finish(
        &self,
        source: &Source,
        map: Option<&GpuImage<Vec3>>,
        rays: Option<&GpuImage<Vec3>>,
        keep: &Range<usize>,
    ) -> GpuResult<(GpuImage<Vec3>, f64)> {
        let (gpu, rows) = (self.gpu, source.picture.rows());
        let made = gpu.image(rows)?;
        let [x, y, z] = rows.groups();
        let report = gpu.buffer::<f32>((x * y) as usize)?;
        let constants = effects(flag(self.params.wrap), flag(map.is_some()), flag(rays.is_some()));
        // Bindings of what is off are declared still: anything stands in for them.
        let buffers = [
            (1, source.picture.buffer()),
            (2, source.photo.buffer()),
            (7, map.unwrap_or(&source.photo).buffer()),
            (8, rays.unwrap_or(&source.photo).buffer()),
            (9, made.buffer()),
            (10, &report),
        ];
        let kernel = Kernel { shader: &SHADER, entry: "finish", constants: &constants };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&self.uniform(rows, keep)), &buffers, [x, y, z])?;
        let parts: Vec<f32> = gpu.read_slice(&report, (x * y) as usize)?;
        Ok((made, parts.iter().map(|part| f64::from(*part)).sum()))
    }
}

/// [`super::apply`] to a picture of any size, in bands. If it fails, the picture is as it was.
///
/// # Errors
/// [`pano_core::gpu::GpuError::Input`] if a parameter is out of range or the pictures differ in size, or what has become of the
/// device.
pub fn apply_picture(gpu: &Gpu, params: &Params, photo: &RadianceImage, picture: &mut RadianceImage) -> GpuResult<Report> {
    params.check(photo.size(), picture.size())?;
    let before = total(picture);
    if !params.is_on() {
        return Ok(Report { before, spread: 0.0, change: 0.0 });
    }
    let (size, mut out) = (picture.size(), picture.clone());
    let source = |rows: &Range<usize>| Source::upload(gpu, photo, picture, rows);
    let halo = if params.glare > 0.0 { RayPass::reach(params) } else { 0 };
    let bands = gpu.bands(size, PIXEL_BYTES, halo)?;
    // What goes in one piece is copied once.
    let whole = if bands.len() == 1 { Some(source(&bands[0].hold)?) } else { None };
    let call = Call::new(gpu, params, size);
    let map = if params.bloom > 0.0 { Some(call.bloom(size, whole.as_ref(), &source)?) } else { None };
    let mut spread = 0.0;
    for band in bands {
        let part;
        let held = match &whole {
            Some(whole) => whole,
            None => {
                part = source(&band.hold)?;
                &part
            }
        };
        let rays = if params.glare > 0.0 { Some(call.glare(held)?) } else { None };
        let (made, taken) = call.finish(held, map.as_ref(), rays.as_ref(), &band.keep)?;
        gpu.read_rows(&made, &band.keep, &mut out)?;
        spread += taken;
    }
    *picture = out;
    Ok(Report { before, spread, change: total(picture) - before })
}
