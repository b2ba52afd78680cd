#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pano_fuzz::check("pfm", bytes));
