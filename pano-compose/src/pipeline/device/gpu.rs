//! The GPU behind a [`Device`]: found when the first stage asks, set up again once.

use super::{Backend, Device};
use crate::pipeline::{Error, Result};
use pano_core::gpu::{Gpu, GpuError, GpuOptions, GpuResult};
use pano_trace::iprt;

/// What is known of the GPU.
#[derive(Debug)]
pub(super) enum State {
    /// No stage has asked yet.
    Unknown,
    /// It works.
    Ready(Box<Installed>),
    /// There is none, it is not wanted, or it has failed.
    None,
}

/// A GPU, and what lies in its memory for the next stage.
#[derive(Debug)]
pub(super) struct Installed {
    pub(super) gpu: Gpu,
    /// The scene of the frame, as the passes of iprt ask for it.
    pub(super) scene: Option<iprt::gpu::GpuFrame>,
    /// It has been lost before.
    again: bool,
}

impl Device {
    /// The adapter's name, if a stage has asked for it and it is in use.
    pub(in crate::pipeline) fn adapter(&self) -> Option<String> {
        match &self.state {
            State::Ready(installed) => Some(installed.gpu.adapter().to_string()),
            _ => None,
        }
    }

    /// Runs `work`, which changes nothing of the host's unless it succeeds, on the GPU. `None`: the CPU is to do it.
    ///
    /// # Errors
    /// Faults of the input only.
    pub(super) fn attempt<T>(&mut self, stage: &str, mut work: impl FnMut(&mut Installed) -> GpuResult<T>) -> Result<Option<T>> {
        self.on_gpu = false;
        if self.backend == Backend::Cpu || !self.settings.allows(stage) {
            return Ok(None);
        }
        if matches!(self.state, State::Unknown) {
            self.state = self.find();
        }
        let State::Ready(installed) = &mut self.state else { return Ok(None) };
        let mut result = work(installed);
        let mut lost = None;
        if let Err(GpuError::Lost { reason }) = &result
            && !installed.again
        {
            let reason = reason.clone();
            match Gpu::new(&options(&self.settings)) {
                Ok(gpu) => {
                    **installed = Installed { gpu, scene: None, again: true };
                    result = work(installed);
                }
                Err(error) => result = Err(GpuError::Lost { reason: format!("{reason}, and {error}") }),
            }
            lost = Some(reason);
        }
        match result {
            Ok(done) => {
                if let Some(reason) = lost {
                    self.warnings.push(format!("the GPU was lost during {stage} ({reason}); it was set up again"));
                }
                self.on_gpu = true;
                Ok(Some(done))
            }
            Err(GpuError::Input(error)) => Err(Error::Core(error)),
            Err(error @ GpuError::TooLarge { .. }) => {
                self.warnings.push(format!("{stage} runs on the CPU: {error}"));
                Ok(None)
            }
            Err(error) => {
                self.warnings.push(format!("{error} during {stage}; the CPU does the rest"));
                self.state = State::None;
                Ok(None)
            }
        }
    }

    /// Leaves a stage to the CPU, as its twin cannot do it for `reason`; where a GPU would have done it otherwise, the user is told
    /// once.
    pub(super) fn decline(&mut self, stage: &str, reason: impl std::fmt::Display) {
        self.on_gpu = false;
        if self.told || self.backend == Backend::Cpu || !self.settings.allows(stage) {
            return;
        }
        if matches!(self.state, State::Unknown) {
            self.state = self.find();
        }
        if matches!(self.state, State::Ready(_)) {
            self.told = true;
            self.warnings.push(format!("{stage} runs on the CPU: {reason}"));
        }
    }

    /// Looks for a GPU, and says why there is none if the user may expect one.
    fn find(&mut self) -> State {
        match Gpu::new(&options(&self.settings)) {
            Ok(gpu) if gpu.adapter().software && self.backend == Backend::Auto => {
                let adapter = gpu.adapter();
                self.warnings
                    .push(format!("{adapter} is slower than the CPU itself, which does the work; --backend gpu uses it"));
                State::None
            }
            Ok(gpu) => State::Ready(Box::new(Installed { gpu, scene: None, again: false })),
            Err(error) => {
                if self.backend == Backend::Gpu {
                    self.warnings.push(format!("{error}; the CPU does the work"));
                }
                State::None
            }
        }
    }
}

fn options(settings: &super::GpuSettings) -> GpuOptions {
    GpuOptions { max_binding: settings.max_binding, lose_after: settings.lose_after, ..GpuOptions::default() }
}
