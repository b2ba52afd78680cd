//! Resampling on the GPU.
//!
//! Departures from the CPU: sums are `f32`. A panorama larger than a binding goes in bands, each of which adds what its rows
//! contribute. Resizing counts negative values and what is no number as 0, as lighting wants it. Putting a view back onto the
//! sphere is left to the CPU: no method of a frame does it.

use super::{check_size, columns_to_roll, cpu};
use crate::camera::Camera;
use crate::gpu::{Gpu, GpuBuffer, GpuImage, GpuResult, IMAGE, Kernel, NUMBER, Piece, Rows, SPHERE, Shader, Specialization};
use crate::image::RadianceImage;
use glam::{Quat, Vec2, Vec3};

crate::uniform! {
    /// `Resample` of the shader.
    pub(crate) struct Resample {
        view: Rows,
        panorama: Rows,
        turn: [f32; 4],
        focal: [f32; 2],
        center: [f32; 2],
        band: u32,
        keep_first: u32,
        keep_count: u32,
        unused: u32,
    }
}

/// `resample.wgsl`.
pub static SHADER: Shader = Shader {
    name: "resample",
    pieces: &[NUMBER, SPHERE, IMAGE, Piece::plain(include_str!("resample.wgsl"))],
    specializations: &[
        Specialization { entry: "look_up", constants: &[("PROJECTION", 0.0)] },
        Specialization { entry: "look_up", constants: &[("PROJECTION", 1.0)] },
        Specialization { entry: "look_up", constants: &[("PROJECTION", 2.0)] },
        Specialization { entry: "shrink", constants: &[] },
    ],
};

/// What a panorama has.
const NO_INTRINSICS: (Vec2, Vec2) = (Vec2::ONE, Vec2::ZERO);

/// A step of [`SHADER`], for each band of the panorama.
struct Step<'a> {
    entry: &'static str,
    constants: &'a [(&'static str, f64)],
    turn: Quat,
    /// Of a perspective view: focal lengths and optical axis in pixels.
    intrinsics: (Vec2, Vec2),
    /// The lists of shrinking.
    lists: Option<(&'a GpuBuffer, &'a GpuBuffer)>,
}

impl Step<'_> {
    /// Adds what a band of the panorama contributes to `out`; `first`: it is the first one.
    fn add(&self, gpu: &Gpu, band: &GpuImage<Vec3>, first: bool, out: &GpuImage<Vec3>) -> GpuResult<()> {
        let (view, panorama) = (out.rows(), band.rows());
        let uniform = Resample {
            view,
            panorama,
            turn: self.turn.to_array(),
            focal: self.intrinsics.0.to_array(),
            center: self.intrinsics.1.to_array(),
            band: u32::from(!first),
            keep_first: panorama.first,
            keep_count: panorama.count,
            unused: 0,
        };
        let mut buffers = vec![(1, band.buffer()), (2, out.buffer())];
        buffers.extend(self.lists.into_iter().flat_map(|(slices, starts)| [(3, slices), (4, starts)]));
        let kernel = Kernel { shader: &SHADER, entry: self.entry, constants: self.constants };
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, view.groups())
    }

    /// Does all of it, `map` applied to each band first.
    fn run(
        &self,
        gpu: &Gpu,
        panorama: &RadianceImage,
        map: impl Fn(GpuImage<Vec3>) -> GpuResult<GpuImage<Vec3>>,
        size: (usize, usize),
    ) -> GpuResult<GpuImage<Vec3>> {
        let out = gpu.image(Rows::all(size))?;
        for (i, band) in gpu.bands(panorama.size(), size_of::<Vec3>(), 0)?.iter().enumerate() {
            self.add(gpu, &map(gpu.upload_rows(panorama, &band.hold)?)?, i == 0, &out)?;
        }
        Ok(out)
    }
}

/// [`super::view_from_panorama`]; the view stays on the GPU.
///
/// # Errors
/// What has become of the device.
pub fn look_up(gpu: &Gpu, panorama: &RadianceImage, world_from_pano: Quat, camera: &Camera) -> GpuResult<GpuImage<Vec3>> {
    let (projection, intrinsics) = match camera.intrinsics() {
        Some(intrinsics) => (0.0, intrinsics),
        None => (1.0, NO_INTRINSICS),
    };
    let turn = world_from_pano.inverse() * camera.world_from_camera;
    let step = Step { entry: "look_up", constants: &[("PROJECTION", projection)], turn, intrinsics, lists: None };
    step.run(gpu, panorama, Ok, (camera.width, camera.height))
}

/// [`super::view_from_panorama`] into a picture of the host. Where nothing has to be resampled it is copied there.
///
/// # Errors
/// [`crate::gpu::GpuError::Input`] if `view` is not of the camera's size, or what has become of the device.
pub fn view_from_panorama(
    gpu: &Gpu,
    panorama: &RadianceImage,
    world_from_pano: Quat,
    camera: &Camera,
    view: &mut RadianceImage,
) -> GpuResult<()> {
    check_size("view", view, camera)?;
    match columns_to_roll(panorama, world_from_pano, camera) {
        Some(columns) => cpu::roll(panorama, columns, view),
        None => *view = gpu.read(&look_up(gpu, panorama, world_from_pano, camera)?)?,
    }
    Ok(())
}

/// [`super::resize_panorama`], with `map` applied to each band of the panorama first; the result stays on the GPU. Negative
/// values and what is no number count as 0, and [`crate::gpu::LARGEST`] is the largest value.
///
/// # Errors
/// What has become of the device.
pub fn resize(
    gpu: &Gpu,
    panorama: &RadianceImage,
    map: impl Fn(GpuImage<Vec3>) -> GpuResult<GpuImage<Vec3>>,
    size: (usize, usize),
) -> GpuResult<GpuImage<Vec3>> {
    let smaller = (panorama.width().min(size.0), panorama.height().min(size.1));
    let enlarge = Step {
        entry: "look_up",
        constants: &[("PROJECTION", 2.0)],
        turn: Quat::IDENTITY,
        intrinsics: NO_INTRINSICS,
        lists: None,
    };
    if smaller == panorama.size() {
        return enlarge.run(gpu, panorama, map, size);
    }
    let (mut slices, mut starts) = (Vec::new(), vec![0u32]);
    for row in 0..smaller.1 {
        slices.extend(cpu::row_shares(row, smaller.1, panorama.height()).iter().map(|&(_, share)| share as f32));
        starts.push(slices.len() as u32);
    }
    let (slices, starts) = (gpu.upload_slice(&slices)?, gpu.upload_slice(&starts)?);
    let lists = Some((&slices, &starts));
    let shrink = Step { entry: "shrink", constants: &[], turn: Quat::IDENTITY, intrinsics: NO_INTRINSICS, lists };
    let small = shrink.run(gpu, panorama, map, smaller)?;
    if smaller == size {
        return Ok(small);
    }
    let out = gpu.image(Rows::all(size))?;
    enlarge.add(gpu, &small, true, &out)?;
    Ok(out)
}
