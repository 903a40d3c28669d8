//! Events of a snapshot: see `jostle_fuzz::events`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::events(bytes));
