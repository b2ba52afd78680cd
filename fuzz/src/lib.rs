//! What the targets share: the counting allocator, and the way to the bodies that the property tests run as well.

use pano_tests::fuzz::Target;
use peak_alloc::PeakAlloc;
use std::panic;
use std::sync::Once;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Reads `bytes` as the target of that name does.
///
/// # Panics
/// If the reader does not keep its bargain: see [`Target::check`].
pub fn check(name: &str, bytes: &[u8]) {
    // The fuzzer's hook ends the process at any panic. Readers are allowed those of a decoder that they turn into errors: only
    // what leaves the target is a finding.
    static HOOK: Once = Once::new();
    HOOK.call_once(|| drop(panic::take_hook()));
    Target::find(name).expect("a target of that name").check(bytes, &MEMORY);
}
