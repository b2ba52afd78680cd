//! What a render did and how long it took.

use crate::plan::EffectPlan;
use serde::Serialize;
use std::time::Instant;

/// One stage that ran.
#[derive(Clone, Debug, Serialize)]
pub struct StageStats {
    /// Its name.
    pub name: &'static str,
    /// Where it ran: `cpu` or `gpu`.
    pub backend: &'static str,
    /// Milliseconds of wall time; on the GPU with copies to and from it.
    pub ms: f64,
    /// Pixels it worked on.
    pub pixels: u64,
    /// Rays it traced.
    pub rays: u64,
}

/// What adaptive sampling did.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SamplingStats {
    /// Samples a pixel, on average.
    pub samples: f32,
    /// Mean over the frame of the standard error of a pixel's luminance, before any filter.
    pub error: f32,
}

/// A whole render, as `--stats` writes it.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// The method that ran.
    pub method: String,
    /// `gpu` if any stage ran there, otherwise `cpu`.
    pub backend: &'static str,
    /// Name of the GPU; `None` if no stage ran there.
    pub adapter: Option<String>,
    /// Milliseconds of wall time, reading included, writing not.
    pub total_ms: f64,
    /// Stages in the order they ran; what did not run is not there.
    pub stages: Vec<StageStats>,
    /// What adaptive sampling did, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling: Option<SamplingStats>,
    /// Which effects were on, and why.
    pub plan: EffectPlan,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Times stages as they end.
pub(crate) struct Clock {
    begin: Instant,
    last: Instant,
    stages: Vec<StageStats>,
}

impl Clock {
    pub(crate) fn new() -> Self {
        let now = Instant::now();
        Self { begin: now, last: now, stages: Vec::new() }
    }

    /// The stage `name`, which began when the last one ended, has ended.
    pub(crate) fn stage(&mut self, name: &'static str, pixels: u64, rays: u64) {
        self.stage_on("cpu", name, pixels, rays);
    }

    /// [`Self::stage`] of one that ran on `backend`.
    pub(crate) fn stage_on(&mut self, backend: &'static str, name: &'static str, pixels: u64, rays: u64) {
        let now = Instant::now();
        let ms = (now - self.last).as_secs_f64() * 1e3;
        self.last = now;
        self.stages.push(StageStats { name, backend, ms, pixels, rays });
    }

    /// The statistics; `adapter` is the GPU that was in use, if any.
    pub(crate) fn finish(self, method: &str, adapter: Option<String>, plan: EffectPlan, warnings: Vec<String>) -> Stats {
        let total_ms = (self.last - self.begin).as_secs_f64() * 1e3;
        let on_gpu = self.stages.iter().any(|s| s.backend == "gpu");
        let backend = if on_gpu { "gpu" } else { "cpu" };
        let adapter = adapter.filter(|_| on_gpu);
        Stats { method: method.to_owned(), backend, adapter, total_ms, stages: self.stages, sampling: None, plan, warnings }
    }
}
