//! How long work tells that it goes on, and learns that it should stop.

/// Told of progress by stages that take long. All methods may be called from any thread.
pub trait Progress: Sync {
    /// A stage begins that will report `total` units of work.
    fn begin(&self, stage: &str, total: u64) {
        let _ = (stage, total);
    }
    /// `units` of work are done.
    fn advance(&self, units: u64) {
        let _ = units;
    }
    /// Whether the work should stop as soon as possible; its result will be thrown away.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Tells nobody and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
