//! A frame's scene in the GPU's memory, and what its pixels come to there: of every tracer.

use super::super::{Frame, Pixel};
use crate::bvh::Tlas;
use crate::bvh::gpu::GpuTlas;
use crate::objects::WIDEST;
use crate::objects::gpu::{NONE, PackedObjects};
use crate::world::gpu::GpuWorld;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::camera::{Camera, Projection};
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Piece, Rows, Words};
use std::ops::Range;

pano_core::uniform! {
    /// `View` of the shader.
    pub(crate) struct View {
        position: Vec3,
        panorama: u32,
        right: Vec3,
        objects: u32,
        up: Vec3,
        boxes: u32,
        back: Vec3,
        pad: u32,
        focal: [f32; 2],
        center: [f32; 2],
        pub(crate) stream: [u32; 2],
        roots: [u32; 2],
        emitters: [u32; 2],
        balls: [u32; 2],
    }
}

impl View {
    /// A camera, without a scene.
    pub(crate) fn of(camera: &Camera) -> Self {
        let (focal, center) = camera.intrinsics().unwrap_or_default();
        let [right, up, back] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| camera.world_from_camera * axis);
        Self {
            position: camera.position,
            panorama: u32::from(camera.projection == Projection::Panorama),
            right,
            up,
            back,
            focal: focal.to_array(),
            center: center.to_array(),
            ..Self::zeroed()
        }
    }
}

/// `Pixel` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuPixel {
    object: Vec3,
    covered: u32,
    delta: Vec3,
    pub(crate) discarded: u32,
    normal: Vec3,
    depth: f32,
    albedo: Vec3,
    pub(crate) rays: u32,
}

impl GpuPixel {
    /// The same before its first sample.
    pub(crate) fn anew(self) -> Self {
        Self { object: Vec3::ZERO, delta: Vec3::ZERO, covered: 0, discarded: 0, rays: 0, ..self }
    }

    /// What `samples` samples come to.
    pub(crate) fn finish(&self, samples: u32) -> Pixel {
        let share = 1.0 / samples.max(1) as f32;
        Pixel {
            object: self.object * share,
            coverage: self.covered as f32 * share,
            delta: self.delta * share,
            depth: if self.depth < 0.0 { f32::INFINITY } else { self.depth },
            normal: self.normal,
            albedo: self.albedo,
        }
    }
}

/// The camera, bounds, guides and sums of pixels, for shaders to include after [`crate::world::gpu::PROXIES`].
pub(crate) const VIEW: Piece =
    Piece { text: include_str!("view.wgsl"), constants: || vec![Constant::f32("WIDEST_BEAM", WIDEST)] };

/// Hierarchies, tables and pictures, and where to find what in them.
#[derive(Debug)]
pub(crate) struct GpuScene<U> {
    pub(crate) view: View,
    pub(crate) world: U,
    tlas: GpuTlas,
    words: GpuBuffer,
    pictures: GpuBuffer,
}

impl<U> GpuScene<U> {
    /// Copies all that rays ask for, and the tables and pictures that `more` adds; also what that says.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`], or what has become of the device.
    pub(crate) fn new<T>(
        gpu: &Gpu,
        frame: &Frame<'_>,
        world: &impl GpuWorld<Uniform = U>,
        more: impl FnOnce(&PackedObjects, &mut Words, &mut Vec<f32>) -> T,
    ) -> GpuResult<(Self, T)> {
        Self::with_pyramids(gpu, frame, world, false, more)
    }

    /// The same; with `pyramids`, textures can be averaged over footprints.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_pyramids<T>(
        gpu: &Gpu,
        frame: &Frame<'_>,
        world: &impl GpuWorld<Uniform = U>,
        pyramids: bool,
        more: impl FnOnce(&PackedObjects, &mut Words, &mut Vec<f32>) -> T,
    ) -> GpuResult<(Self, T)> {
        let hierarchies: Vec<&Tlas> = [Some(frame.objects.tlas()), world.tlas()].into_iter().flatten().collect();
        let tlas = GpuTlas::new_of_kinds(gpu, &hierarchies, |i| frame.objects.lets_through(i))?;
        let (mut words, mut pictures) = (Words::default(), Vec::new());
        let packed = frame.objects.pack(&mut words, pyramids);
        let world = world.pack(&mut words, &mut pictures);
        let more = more(&packed, &mut words, &mut pictures);
        let view = View {
            objects: packed.objects,
            boxes: packed.boxes,
            stream: [frame.stream.frame, frame.stream.seed],
            roots: [tlas.roots()[0], tlas.roots().get(1).copied().unwrap_or(NONE)],
            emitters: packed.emitters,
            balls: packed.balls,
            ..View::of(frame.camera)
        };
        let (words, pictures) = (gpu.upload_slice(&words.finish())?, gpu.upload_slice(&pictures)?);
        Ok((Self { view, world, tlas, words, pictures }, more))
    }

    /// What kernels bind.
    pub(crate) fn bindings(&self) -> impl Iterator<Item = (u32, &GpuBuffer)> {
        self.tlas.bindings().into_iter().chain([(4, &self.words), (5, &self.pictures)])
    }
}

/// Scattering events of one submission, over all pixels and samples: a million rays or so, some ten milliseconds of a slow GPU.
const BATCH: usize = 1 << 18;
/// The same of one pixel, however small the frame. Mesa's lavapipe leaves a kernel's loops after 65 535 rounds, those through the trees
/// counted, upon which samples are lost: 96 events of a pixel were too many.
const BATCH_OF_PIXEL: usize = 16;

/// How a frame is cut into submissions: rows whose pixels fit a binding, and samples of theirs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Submissions {
    size: (usize, usize),
    rows: usize,
    /// Samples of one submission, over all its pixels, and of one of them.
    batch: usize,
    of_pixel: usize,
}

impl Submissions {
    /// Of a frame whose pixels take `bytes` each in a buffer, and `events` scattering events a sample.
    pub(crate) fn new(gpu: &Gpu, frame: &Frame<'_>, bytes: usize, events: usize) -> Self {
        let [batch, of_pixel] = [BATCH, BATCH_OF_PIXEL].map(|most| most / events.max(1));
        let size = (frame.camera.width, frame.camera.height);
        let fitting = usize::try_from(gpu.max_binding()).unwrap_or(usize::MAX) / bytes;
        Self { size, rows: (batch.min(fitting) / size.0).clamp(1, size.1), batch, of_pixel }
    }

    /// The frame's bands, from the top.
    pub(crate) fn bands(self) -> impl Iterator<Item = Range<usize>> {
        let height = self.size.1;
        (0..height).step_by(self.rows).map(move |first| first..(first + self.rows).min(height))
    }

    /// The rows of a band.
    pub(crate) fn rows(self, band: &Range<usize>) -> Rows {
        Rows::of(self.size, band)
    }

    /// `samples` samples of a band, in parts.
    pub(crate) fn samples(self, rows: Rows, samples: u32) -> impl Iterator<Item = Range<u32>> {
        let at_once = (self.batch / rows.pixels()).min(self.of_pixel).max(1);
        (0..samples).step_by(at_once).map(move |begin| begin..(begin + at_once as u32).min(samples))
    }
}
