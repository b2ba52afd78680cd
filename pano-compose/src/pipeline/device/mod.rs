//! Where stages run: the one schedule of both backends.
//!
//! Each stage that has a twin is called through a method of [`Device`] (`stages.rs`; those of iprt in `iprt.rs`), which tries the GPU
//! if the stage is to run there and the CPU otherwise. After each stage its result is on the host, so that whatever happens to a GPU
//! in mid-run, the next stage goes on from what is done; the scene stays there between the stages of iprt.
//!
//! A device that is lost is set up again once; the second time, or if it refuses its work, the CPU does the rest.

mod choice;
#[cfg(feature = "gpu")]
mod gpu;
pub(super) mod iprt;
mod stages;

pub use choice::{Backend, GPU_STAGES, GpuSettings};

use super::RenderOptions;

/// Where the stages of a render run.
#[derive(Debug)]
pub(super) struct Device {
    #[cfg(feature = "gpu")]
    backend: Backend,
    #[cfg(feature = "gpu")]
    settings: GpuSettings,
    #[cfg(feature = "gpu")]
    state: gpu::State,
    /// What is to be told with the next frame.
    warnings: Vec<String>,
    /// Whether the last stage ran on the GPU.
    on_gpu: bool,
    /// Why a stage was left to the CPU has been told.
    #[cfg(feature = "gpu")]
    told: bool,
    /// Something of the frame does not fit the GPU, for a pass of iprt at least; it has been told, and the CPU does the others.
    #[cfg(feature = "gpu")]
    scene_is_too_large: bool,
}

impl Device {
    /// As the options want it. Nothing is set up before the first stage asks.
    pub(super) fn new(options: &RenderOptions) -> Self {
        let refused = cfg!(not(feature = "gpu")) && options.backend == Backend::Gpu;
        Self {
            #[cfg(feature = "gpu")]
            backend: options.backend,
            #[cfg(feature = "gpu")]
            settings: options.settings.gpu,
            #[cfg(feature = "gpu")]
            state: gpu::State::Unknown,
            warnings: refused.then(|| "this build cannot use a GPU; the CPU does the work".into()).into_iter().collect(),
            on_gpu: false,
            #[cfg(feature = "gpu")]
            told: false,
            #[cfg(feature = "gpu")]
            scene_is_too_large: false,
        }
    }

    /// Forgets what belongs to the frame before.
    pub(super) fn begin_frame(&mut self) {
        #[cfg(feature = "gpu")]
        {
            self.scene_is_too_large = false;
            if let gpu::State::Ready(installed) = &mut self.state {
                installed.scene = None;
            }
        }
    }

    /// What there is to tell since the last call.
    pub(super) fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Where the last stage ran since the last call, as `--stats` says it; one of several parts, where its last part did.
    pub(super) fn last(&mut self) -> &'static str {
        if std::mem::take(&mut self.on_gpu) { "gpu" } else { "cpu" }
    }

    /// There is none.
    #[cfg(not(feature = "gpu"))]
    pub(super) fn adapter(&self) -> Option<String> {
        None
    }
}
