//! What a render did and how long it took.

use crate::plan::EffectPlan;
use serde::Serialize;
use std::time::Instant;

/// One stage that ran.
#[derive(Clone, Debug, Serialize)]
pub struct StageStats {
    /// Its name.
    pub name: &'static str,
    /// Where it ran.
    pub backend: &'static str,
    /// Milliseconds of wall time.
    pub ms: f64,
    /// Pixels it worked on.
    pub pixels: u64,
    /// Rays it traced.
    pub rays: u64,
}

/// A whole render, as `--stats` writes it.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// The method that ran.
    pub method: String,
    /// Where it ran.
    pub backend: &'static str,
    /// Name of the GPU; `None` on the CPU.
    pub adapter: Option<String>,
    /// Milliseconds of wall time, reading included, writing not.
    pub total_ms: f64,
    /// Stages in the order they ran; what did not run is not there.
    pub stages: Vec<StageStats>,
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
        let now = Instant::now();
        let ms = (now - self.last).as_secs_f64() * 1e3;
        self.last = now;
        self.stages.push(StageStats { name, backend: "cpu", ms, pixels, rays });
    }

    pub(crate) fn finish(self, method: &str, plan: EffectPlan, warnings: Vec<String>) -> Stats {
        let total_ms = (self.last - self.begin).as_secs_f64() * 1e3;
        Stats { method: method.to_owned(), backend: "cpu", adapter: None, total_ms, stages: self.stages, plan, warnings }
    }
}
