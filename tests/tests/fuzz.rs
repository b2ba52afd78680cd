//! Every reader of files against damaged ones: the bodies of the fuzzer's targets, on valid files that are damaged at random. A
//! binary of its own, whose allocator counts.

use pano_tests::fuzz::{Damage, TARGETS, Target, damaged};
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use std::sync::{LazyLock, Mutex, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// [`Target::check`] while no other test allocates.
fn check(target: &Target, bytes: &[u8]) -> bool {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    target.check(bytes, &MEMORY)
}

#[test]
fn seeds_are_valid_and_small() {
    let mut total = 0;
    for (target, seeds) in TARGETS.iter().zip(SEEDS.iter()) {
        for (i, seed) in seeds.iter().enumerate() {
            assert!(check(target, seed), "{} {i}", target.name);
            total += seed.len();
        }
    }
    assert!(total < 50_000, "{total} bytes");
}

/// The seeds of every target.
static SEEDS: LazyLock<Vec<Vec<Vec<u8>>>> = LazyLock::new(|| TARGETS.iter().map(|target| (target.seeds)()).collect());

fn damage() -> impl Strategy<Value = Vec<Damage>> {
    let one = prop_oneof![
        (any::<u16>(), any::<u8>()).prop_map(|(at, value)| Damage::Byte(at, value)),
        (any::<u16>(), any::<u8>(), any::<bool>()).prop_map(|(at, number, big)| Damage::Number(at, number, big)),
        (any::<u16>(), any::<u8>()).prop_map(|(at, number)| Damage::Decimal(at, number)),
        any::<u16>().prop_map(Damage::Cut),
        (any::<u16>(), any::<u8>(), any::<u16>()).prop_map(|(from, count, to)| Damage::Copy(from, count, to)),
        (any::<u16>(), any::<u8>()).prop_map(|(at, count)| Damage::Remove(at, count)),
    ];
    prop::collection::vec(one, 1..5)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]
    #[test]
    fn damaged_files_are_read_or_refused(target in 0..TARGETS.len(), seed in any::<prop::sample::Index>(), damage in damage()) {
        let seeds = &SEEDS[target];
        check(&TARGETS[target], &damaged(&seeds[seed.index(seeds.len())], &damage));
    }
}
