//! What a caller decides about the GPU.

/// Where the stages run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// On the GPU if there is one, unless it is a program on the CPU, which the CPU's own stages outrun.
    #[default]
    Auto,
    /// On the CPU.
    Cpu,
    /// On the GPU, even if it is a program; on the CPU, with a warning, if there is none. Stages without a twin run on the CPU.
    Gpu,
}

/// Stages that can run on a GPU, in the order in which a frame passes them. `expand` is a part of what `--stats` calls `load`;
/// `trace` is that of the path tracers and of mr360.
pub const GPU_STAGES: [&str; 18] = [
    "expand",
    "view",
    "lights",
    "trace",
    "g-buffer",
    "sparse mask",
    "real pixels",
    "interpolation",
    "history real",
    "filter real",
    "update",
    "virtual pixels",
    "history virtual",
    "filter virtual",
    "mean",
    "denoise",
    "composite",
    "lens",
];

/// Knobs of the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuSettings {
    /// `gpu_from`: the first of [`GPU_STAGES`] that runs on the GPU, by index; earlier ones run on the CPU.
    pub from: Option<usize>,
    /// `gpu_until`: the last one that does; later ones run on the CPU.
    pub until: Option<usize>,
    /// `gpu_binding`: largest binding in bytes.
    pub max_binding: Option<u64>,
    /// `gpu_lose_after`: the device is destroyed after so many submissions.
    pub lose_after: Option<u32>,
}

impl GpuSettings {
    /// Whether a stage may run on the GPU.
    #[cfg(feature = "gpu")]
    pub(super) fn allows(&self, stage: &str) -> bool {
        let at = GPU_STAGES.iter().position(|s| *s == stage);
        at.is_some_and(|at| self.from.is_none_or(|from| from <= at) && self.until.is_none_or(|until| at <= until))
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;

    #[test]
    fn an_interval_of_stages_is_allowed() {
        let last = GPU_STAGES.len() - 1;
        let allowed = |from, until| {
            let settings = GpuSettings { from, until, ..GpuSettings::default() };
            GPU_STAGES.iter().filter(|s| settings.allows(s)).count()
        };
        assert_eq!(allowed(None, None), GPU_STAGES.len());
        assert_eq!((allowed(Some(last), None), allowed(None, Some(0)), allowed(Some(1), Some(1))), (1, 1, 1));
        assert_eq!(allowed(Some(1), Some(0)), 0);
        assert!(!GpuSettings::default().allows("world"));
    }
}
