//! Whether this processor is one that this program was built for: without a word of this it would die of its first instruction
//! that is not.

/// What the program was built to use and the processor lacks. `is_x86_feature_detected` would not do: it trusts the build.
#[cfg(target_arch = "x86_64")]
pub(crate) fn missing() -> Option<&'static str> {
    let processor = raw_cpuid::CpuId::new();
    let avx2 = processor.get_extended_feature_info().is_some_and(|f| f.has_avx2());
    let fma = processor.get_feature_info().is_some_and(|f| f.has_fma());
    let used = [("AVX2", cfg!(target_feature = "avx2"), avx2), ("FMA", cfg!(target_feature = "fma"), fma)];
    used.into_iter().find_map(|(name, used, there)| (used && !there).then_some(name))
}

/// Elsewhere builds use what every processor has.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn missing() -> Option<&'static str> {
    None
}
