//! Every reader of files against damaged ones: the bodies that the fuzzer's targets (`fuzz/`) and the property tests
//! (`tests/tests/fuzz.rs`) share.
//!
//! A reader given any bytes at all returns in time, without a panic, with something usable or an error that names the file and
//! the remedy, and takes no more memory than what it reads is worth: see [`Target::check`].

mod mutate;
mod seeds;
mod targets;

pub use mutate::{Damage, damaged};
pub use targets::TARGETS;

use pano_core::Error;
use peak_alloc::PeakAlloc;

/// Memory that no input has to account for: thread pools, tables and decoders' fixed buffers. DWA's tables of half floats take
/// a quarter of it.
const OVERHEAD: usize = 4 << 20;

/// A reader and what it may cost.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The format, as the fuzzer's target is called.
    pub name: &'static str,
    /// Small valid files of every kind the reader takes.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads the bytes in every way there is, and checks what comes out. Gives the memory that it takes, in bytes.
    pub read: fn(&[u8]) -> Result<usize, Error>,
    /// Bytes of working memory that a byte of any file may cost: what a parser makes of a list of the shortest statements.
    pub parsing: usize,
    /// Bytes of result that a byte of a valid file can stand for at most. A file that turns out to be damaged after its size
    /// was believed may have cost that much.
    pub declarable: usize,
}

impl Target {
    /// The target of that name.
    pub fn find(name: &str) -> Option<&'static Target> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads `bytes` and checks the bargain; whether they were taken for a valid file.
    ///
    /// # Panics
    /// If the reader panics, gives something unusable or an error without file or remedy, or takes more than four times the
    /// memory of its result. `memory` must be the program's allocator, and nothing else may run meanwhile.
    pub fn check(&self, bytes: &[u8], memory: &PeakAlloc) -> bool {
        let before = memory.current_usage();
        memory.reset_peak_usage();
        let result = (self.read)(bytes);
        let taken = memory.peak_usage().saturating_sub(before);
        let needed = match &result {
            Ok(size) => *size,
            Err(_) => self.declarable * bytes.len(),
        };
        let most = OVERHEAD + self.parsing * bytes.len() + 4 * needed;
        assert!(taken <= most, "{}: {taken} bytes for {needed}, from {} bytes; at most {most}", self.name, bytes.len());
        if let Err(error) = &result {
            assert!(error.remedy().is_some_and(|remedy| !remedy.is_empty()), "no remedy: {error}");
            assert!(error.to_string().contains(targets::FILE), "the file is not named: {error}");
        }
        result.is_ok()
    }
}
