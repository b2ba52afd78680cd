//! Cross-crate tests live in `tests/`, benchmarks in `benches/`; this library holds what they share.

pub mod agreement;
pub mod fuzz;
pub mod nasty;
pub mod random;
pub mod rooms;
pub mod scenes;
#[cfg(feature = "gpu")]
pub mod shaders;
pub mod statistics;
