//! A frame's scene in the GPU's memory.

use super::super::{Frame, Lights, TraceParams};
use super::Trace;
use crate::bvh::gpu::GpuTlas;
use crate::world::ProxyWorld;
use glam::Vec3;
use pano_core::camera::Projection;
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Rows, Words};

/// Hierarchies, tables and pictures, and where to find what in them.
#[derive(Debug)]
pub(super) struct GpuScene {
    /// Of the whole frame, without samples.
    pub(super) uniform: Trace,
    tlas: GpuTlas,
    words: GpuBuffer,
    pictures: GpuBuffer,
}

impl GpuScene {
    /// Copies all that rays ask for.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`], or what has become of the device.
    pub(super) fn new(gpu: &Gpu, frame: &Frame<'_>, world: &ProxyWorld, params: &TraceParams) -> GpuResult<Self> {
        let tlas = GpuTlas::of(gpu, &[frame.objects.tlas(), world.tlas()])?;
        let (mut words, mut pictures) = (Words::default(), Vec::new());
        let packed = frame.objects.pack(&mut words);
        let lights = Lights::of(world, frame.camera.position, params.samples).pack(&mut words);
        let world = world.pack(&mut words, &mut pictures);
        let camera = frame.camera;
        let size = (camera.width, camera.height);
        let (focal, center) = camera.projection.intrinsics(size).unwrap_or_default();
        let [right, up, back] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| camera.world_from_camera * axis);
        let uniform = Trace {
            rows: Rows::all(size),
            position: camera.position,
            panorama: u32::from(camera.projection == Projection::Panorama),
            right,
            bounces: params.bounces,
            up,
            samples: params.samples,
            back,
            begin: 0,
            focal: focal.to_array(),
            center: center.to_array(),
            end: 0,
            frame: frame.stream.frame,
            seed: frame.stream.seed,
            objects: packed.objects,
            roots: [tlas.roots()[0], tlas.roots()[1]],
            emitters: packed.emitters,
            balls: packed.balls,
            clusters: packed.clusters,
            lights,
            boxes: packed.boxes,
            pad: 0,
            world,
        };
        Ok(Self { uniform, tlas, words: gpu.upload_slice(&words.finish())?, pictures: gpu.upload_slice(&pictures)? })
    }

    /// What kernels bind.
    pub(super) fn bindings(&self) -> impl Iterator<Item = (u32, &GpuBuffer)> {
        self.tlas.bindings().into_iter().chain([(4, &self.words), (5, &self.pictures)])
    }
}
