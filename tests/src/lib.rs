//! Cross-crate tests live in `tests/`, benchmarks in `benches/`; this library holds what they share.

pub mod random;
pub mod rooms;
pub mod scenes;
pub mod statistics;
