//! The two passes.

use super::super::trace::{Moments, RealPixel};
use super::super::{Frame, Params, RealEstimate, Update, VirtualEstimate};
use super::layout::{ADVANCE, BEGIN, CENTERS, ESTIMATES, Estimate, EstimateLane, Iprt, LANES};
use super::update::GpuUpdate;
use super::{GpuFrame, rays_of};
use crate::world::CapturedWorld;
use bytemuck::bytes_of;
use pano_core::gpu::{Gpu, GpuResult};
use pano_core::image::Image;
use pano_core::progress::Progress;

impl GpuFrame {
    /// [`super::super::trace_real`] through the BVH, in a world as known by `update`. `None` if `progress` cancels.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if the updated panorama does not fit a binding, or what has become of the device.
    #[expect(clippy::too_many_arguments, reason = "those of the CPU's, and the device")]
    pub fn trace_real(
        &self,
        gpu: &Gpu,
        frame: &Frame<'_>,
        world: &CapturedWorld,
        update: &Update,
        params: &Params,
        wanted: impl Fn(usize, usize) -> bool,
        progress: &dyn Progress,
    ) -> GpuResult<Option<RealEstimate>> {
        let (w, h) = (frame.camera.width, frame.camera.height);
        let uniform = Iprt { lights: self.lights(frame, world, params.samples), ..self.pass(frame, params) };
        let before = Image::from_fn(w, h, |x, y| Estimate::before(wanted(x, y)));
        progress.begin("real pixels", h as u64);
        let estimates = self.estimate(gpu, frame, uniform, update, before, progress)?;
        Ok(estimates.map(|estimates| RealEstimate::of(&estimates.map(real_pixel), rays(&estimates))))
    }

    /// [`super::super::trace_virtual`], in a world as known by `update`. `None` if `progress` cancels.
    ///
    /// # Errors
    /// As [`Self::trace_real`].
    pub fn trace_virtual(
        &self,
        gpu: &Gpu,
        frame: &Frame<'_>,
        update: &Update,
        params: &Params,
        progress: &dyn Progress,
    ) -> GpuResult<Option<VirtualEstimate>> {
        let (w, h) = (frame.camera.width, frame.camera.height);
        let uniform = Iprt { virtual_pass: 1, ..self.pass(frame, params) };
        progress.begin("virtual pixels", h as u64);
        let estimates = self.estimate(gpu, frame, uniform, update, Image::filled(w, h, Estimate::before(true)), progress)?;
        let of = |estimates: Image<Estimate>| VirtualEstimate::of(&estimates.map(real), params.samples, rays(&estimates));
        Ok(estimates.map(of))
    }

    /// The settings of a pass.
    fn pass(&self, frame: &Frame<'_>, params: &Params) -> Iprt {
        let Params { samples, attempts, bounces, .. } = *params;
        let mut uniform = Iprt { samples, attempts, bounces, ..self.uniform };
        uniform.view.stream = [frame.stream.frame, frame.stream.seed];
        uniform
    }

    /// Takes all samples. `None` if `progress` cancels.
    fn estimate(
        &self,
        gpu: &Gpu,
        frame: &Frame<'_>,
        pass: Iprt,
        update: &Update,
        mut estimates: Image<Estimate>,
        progress: &dyn Progress,
    ) -> GpuResult<Option<Image<Estimate>>> {
        let known = GpuUpdate::of(gpu, update)?;
        let update_size = known.size();
        let done = Self::over_view(gpu, frame, estimates.data_mut(), |rows, held| {
            let (rays, lanes) = (rays_of(gpu, rows)?, gpu.buffer::<EstimateLane>(rows.pixels())?);
            let own = known.bindings().into_iter().chain([(LANES, &lanes), (ESTIMATES, held)]);
            let kernels = self.kernels(gpu, rows, &rays, own);
            let uniform = |turn| Iprt { rows, turn, update_size, ..pass };
            if pass.virtual_pass == 0 {
                kernels.run(CENTERS, bytes_of(&uniform(0)))?;
                kernels.follow(&[], uniform, progress)?;
            }
            kernels.run(BEGIN, bytes_of(&uniform(0)))?;
            let done = kernels.follow(&[ADVANCE], uniform, progress)?;
            progress.advance(u64::from(rows.count));
            Ok(done)
        })?;
        Ok(done.then_some(estimates))
    }
}

/// Of E_R, or of the objects' radiance.
fn real(estimate: Estimate) -> Moments {
    Moments { sum: estimate.real, squares: estimate.real_squares, count: estimate.count }
}

fn real_pixel(estimate: Estimate) -> RealPixel {
    RealPixel {
        real: real(estimate),
        change: Moments { sum: estimate.change, squares: estimate.change_squares, count: estimate.count },
        mirror: estimate.mirror,
        mirror_rays: estimate.mirror_rays,
        mirrored: estimate.mirrored,
        mirrored_mixed: estimate.mirrored_mixed,
        touched: estimate.touched == 1,
        samples: estimate.samples,
    }
}

fn rays(estimates: &Image<Estimate>) -> u64 {
    estimates.data().iter().map(|e| u64::from(e.rays)).sum()
}
