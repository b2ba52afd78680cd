//! The maps on the GPU.
//!
//! Departures from the CPU: where lookups fall in a row's first column, and how far rows are averaged, is a table made on the
//! host, the same for every panorama. Negative values of the panorama count as 0.

use super::cpu::LOOKUPS;
use super::kernel::Lookups;
use super::pyramid::{self, LEVELS, ROWS};
use super::{DIFFUSE_SIZE, GLOSSY_SIZES, cpu};
use glam::{Vec3, Vec4};
use pano_core::gpu::{Gpu, GpuBuffer, GpuImage, GpuResult, Kernel, NUMBER, Piece, Rows, Shader, Specialization};
use pano_core::image::RadianceImage;
use pano_core::light::RadianceMaps;
use pano_core::sphere::resample;

pano_core::uniform! {
    /// `Ibl` of the shader.
    #[derive(Default)]
    pub(crate) struct Ibl {
        width: u32,
        height: u32,
        begin: u32,
        finer: u32,
        reaches: u32,
        lookups: u32,
    }
}

/// `ibl.wgsl`.
pub static SHADER: Shader = Shader {
    name: "ibl",
    pieces: &[NUMBER, Piece::plain(include_str!("ibl.wgsl"))],
    specializations: &[
        Specialization { entry: "halve", constants: &[] },
        Specialization { entry: "widen", constants: &[] },
        Specialization { entry: "convolve", constants: &[] },
    ],
};

fn run(gpu: &Gpu, entry: &'static str, uniform: Ibl, buffers: &[(u32, &GpuBuffer)]) -> GpuResult<()> {
    let groups = [uniform.width.div_ceil(8), uniform.height.div_ceil(8), 1];
    gpu.dispatch(&Kernel { shader: &SHADER, entry, constants: &[] }, bytemuck::bytes_of(&uniform), buffers, groups)
}

/// Rows of a level of the pyramid.
fn rows(level: usize) -> usize {
    ROWS >> level
}

/// Where a level begins in the buffer, in pixels.
fn begin(level: usize) -> usize {
    (0..level).map(|l| 2 * rows(l) * rows(l)).sum()
}

/// All levels, one after the other, averaged along their rows.
fn pyramid_of(gpu: &Gpu, finest: &GpuImage<Vec3>) -> GpuResult<GpuBuffer> {
    let pixels = begin(LEVELS);
    let (plain, wide) = (gpu.buffer::<Vec3>(pixels)?, gpu.buffer::<Vec3>(pixels)?);
    gpu.copy(finest.buffer(), &plain)?;
    let reaches: Vec<u32> =
        (0..LEVELS).flat_map(|l| (0..rows(l)).map(move |y| pyramid::reach(2 * rows(l), rows(l), y) as u32)).collect();
    let reaches = gpu.upload_slice(&reaches)?;
    for level in 0..LEVELS {
        let (width, height) = (2 * rows(level) as u32, rows(level) as u32);
        let here = Ibl { width, height, begin: begin(level) as u32, ..Ibl::default() };
        if level > 0 {
            run(gpu, "halve", Ibl { finer: begin(level - 1) as u32, ..here }, &[(1, &plain)])?;
        }
        let row = (0..level).map(rows).sum::<usize>() as u32;
        run(gpu, "widen", Ibl { reaches: row, ..here }, &[(1, &plain), (2, &wide), (3, &reaches)])?;
    }
    Ok(wide)
}

fn convolved(gpu: &Gpu, pyramid: &GpuBuffer, lookups: &Lookups, (width, height): (usize, usize)) -> GpuResult<RadianceImage> {
    let table: Vec<Vec4> = (0..height)
        .flat_map(|y| cpu::row_lookups(lookups, (width, height), y))
        .map(|(uv, level)| Vec4::new(uv.x, uv.y, 2.0 * rows(level) as f32, begin(level) as f32))
        .collect();
    let table = gpu.upload_slice(&table)?;
    let map = gpu.image(Rows::all((width, height)))?;
    let uniform = Ibl { width: width as u32, height: height as u32, lookups: lookups.len() as u32, ..Ibl::default() };
    run(gpu, "convolve", uniform, &[(2, pyramid), (4, &table), (5, map.buffer())])?;
    gpu.read(&map)
}

/// [`super::radiance_maps`].
///
/// # Errors
/// What has become of the device.
pub fn radiance_maps(gpu: &Gpu, panorama: &RadianceImage) -> GpuResult<RadianceMaps> {
    let finest = resample::gpu::resize(gpu, panorama, Ok, (2 * ROWS, ROWS))?;
    let pyramid = pyramid_of(gpu, &finest)?;
    let (diffuse, glossy) = &*LOOKUPS;
    let mut maps = RadianceMaps {
        diffuse: convolved(gpu, &pyramid, diffuse, DIFFUSE_SIZE)?,
        glossy: std::array::from_fn(|_| RadianceImage::filled(1, 1, Vec3::ZERO)),
        mirror: panorama.clone(),
    };
    for (map, (lookups, size)) in maps.glossy.iter_mut().zip(glossy.iter().zip(GLOSSY_SIZES)) {
        *map = convolved(gpu, &pyramid, lookups, size)?;
    }
    Ok(maps)
}
