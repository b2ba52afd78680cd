//! The passes of iprt on either backend. They share the frame's scene, which is copied to the GPU once.
#![cfg_attr(
    not(feature = "gpu"),
    allow(unused_variables, clippy::unnecessary_wraps, reason = "only the GPU's part asks for all of it, and may fail")
)]

use super::Device;
use crate::pipeline::Result;
use glam::{Vec2, Vec3};
#[cfg(feature = "gpu")]
use pano_core::gpu::{Gpu, GpuError, GpuResult};
use pano_core::image::Image;
use pano_core::progress::Progress;
#[cfg(feature = "gpu")]
use pano_trace::iprt::gpu::GpuFrame;
use pano_trace::iprt::{self, Earlier, Frame, GBuffer, Motion, Params, RealEstimate, Update, UpdatedWorld, VirtualEstimate};
use pano_trace::world::CapturedWorld;

/// A frame of iprt: what its passes share.
#[derive(Clone, Copy, Debug)]
pub(in crate::pipeline) struct Scene<'a> {
    /// What is traced.
    pub(in crate::pipeline) frame: iprt::Frame<'a>,
    /// The panorama.
    pub(in crate::pipeline) world: &'a CapturedWorld,
    /// The frame before, if there is one.
    pub(in crate::pipeline) earlier: Option<&'a Earlier>,
}

/// What the pixels show: G-buffer, motion since the frame before, and coverage, if that is measured apart.
pub(in crate::pipeline) struct Shown {
    pub(in crate::pipeline) buffer: GBuffer,
    pub(in crate::pipeline) motion: Option<Motion>,
    pub(in crate::pipeline) coverage: Option<Image<f32>>,
}

impl Device {
    /// [`GBuffer::new`], [`iprt::motion`] and, if it is `covered`, [`GBuffer::coverage`]: stage `g-buffer`.
    pub(in crate::pipeline) fn gbuffer(&mut self, scene: &Scene<'_>, covered: bool) -> Result<Shown> {
        let Scene { frame, world, earlier } = *scene;
        #[cfg(feature = "gpu")]
        if let Some(shown) = self.attempt_pass("g-buffer", scene, |gpu, held| {
            let (buffer, motion) = held.gbuffer(gpu, &frame)?;
            let coverage = if covered { Some(held.coverage(gpu, &frame, &buffer)?) } else { None };
            Ok(Shown { buffer, motion, coverage })
        })? {
            return Ok(shown);
        }
        let buffer = GBuffer::new(&frame, world);
        let motion = earlier.map(|earlier| iprt::motion(&buffer, frame.camera, frame.objects, earlier));
        let coverage = covered.then(|| buffer.coverage(&frame, world));
        Ok(Shown { buffer, motion, coverage })
    }

    /// [`iprt::trace_real`] of `frame`, a look at the `scene`, as far as it is `known`: stage `real pixels`. `None` if `progress`
    /// cancels.
    pub(in crate::pipeline) fn trace_real(
        &mut self,
        scene: &Scene<'_>,
        frame: &Frame<'_>,
        known: &Update,
        params: &Params,
        wanted: impl Fn(usize, usize) -> bool + Sync,
        progress: &dyn Progress,
    ) -> Result<Option<RealEstimate>> {
        #[cfg(feature = "gpu")]
        if let Some(found) = self.attempt_pass("real pixels", scene, |gpu, held| {
            held.trace_real(gpu, frame, scene.world, known, params, &wanted, progress)
        })? {
            return Ok(found);
        }
        let world = UpdatedWorld::new(scene.world, frame.capture, known);
        Ok(iprt::trace_real(frame, &world, params, None, wanted, progress))
    }

    /// [`iprt::panorama_update`], stage `update`.
    pub(in crate::pipeline) fn panorama_update(
        &mut self,
        scene: &Scene<'_>,
        buffer: &GBuffer,
        ratio: &Image<Vec3>,
        gloss: &Image<Vec2>,
        size: (usize, usize),
    ) -> Result<Update> {
        #[cfg(feature = "gpu")]
        if let Some(update) =
            self.attempt_pass("update", scene, |gpu, held| held.panorama_update(gpu, &scene.frame, buffer, ratio, gloss, size))?
        {
            return Ok(update);
        }
        Ok(iprt::panorama_update(&scene.frame, scene.world, buffer, ratio, gloss, size))
    }

    /// [`iprt::trace_virtual`], as far as the scene is `known`: stage `virtual pixels`. `None` if `progress` cancels.
    pub(in crate::pipeline) fn trace_virtual(
        &mut self,
        scene: &Scene<'_>,
        known: &Update,
        params: &Params,
        progress: &dyn Progress,
    ) -> Result<Option<VirtualEstimate>> {
        let frame = &scene.frame;
        #[cfg(feature = "gpu")]
        if let Some(found) =
            self.attempt_pass("virtual pixels", scene, |gpu, held| held.trace_virtual(gpu, frame, known, params, progress))?
        {
            return Ok(found);
        }
        Ok(iprt::trace_virtual(frame, &UpdatedWorld::new(scene.world, frame.capture, known), params, progress))
    }

    /// [`Self::attempt`] with the frame's scene in the GPU's memory.
    #[cfg(feature = "gpu")]
    fn attempt_pass<T>(
        &mut self,
        stage: &str,
        scene: &Scene<'_>,
        mut work: impl FnMut(&Gpu, &GpuFrame) -> GpuResult<T>,
    ) -> Result<Option<T>> {
        if self.scene_is_too_large {
            self.on_gpu = false;
            return Ok(None);
        }
        let mut too_large = false;
        let done = self.attempt(stage, |installed| {
            let result = match &mut installed.scene {
                Some(held) => work(&installed.gpu, held),
                none => GpuFrame::new(&installed.gpu, &scene.frame, scene.world, scene.earlier)
                    .and_then(|held| work(&installed.gpu, none.insert(held))),
            };
            too_large = matches!(result, Err(GpuError::TooLarge { .. }));
            result
        });
        self.scene_is_too_large = too_large;
        done
    }
}
