//! Cross-crate tests live in `tests/`, benchmarks in `benches/`; this library holds what they share.
