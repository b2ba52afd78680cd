//! A bar on the terminal, and Ctrl-C.

use indicatif::{ProgressBar, ProgressStyle};
use pano_core::progress::Progress;
use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Shows progress on stderr if that is a terminal, and cancels on Ctrl-C.
pub(crate) struct Console {
    bar: ProgressBar,
    cancelled: Arc<AtomicBool>,
}

impl Console {
    /// Starts to listen for Ctrl-C. To be called once a process.
    pub(crate) fn new() -> Self {
        let cancelled = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&cancelled);
        if let Err(e) = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)) {
            crate::output::message(&format!("warning: Ctrl-C will not stop cleanly: {e}"));
        }
        // indicatif draws nothing where stderr is no terminal.
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{prefix}{msg:10} [{bar:40}] {percent:>3} % {elapsed} (left: {eta})");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        Self { bar, cancelled }
    }

    /// Says which frame of a sequence is being made.
    pub(crate) fn frame(&self, frame: u32) {
        self.bar.set_prefix(format!("frame {frame}: "));
    }

    /// Prints a line to stderr without tearing the bar.
    pub(crate) fn message(&self, text: &str) {
        self.bar.suspend(|| crate::output::message(text));
    }
}

impl Progress for Console {
    fn begin(&self, stage: &str, total: u64) {
        self.bar.reset();
        self.bar.set_length(total);
        self.bar.set_message(stage.to_owned());
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
