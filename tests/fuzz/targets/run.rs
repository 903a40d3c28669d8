//! Replays that are sent as runs: see `jostle_fuzz::run`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::run(bytes));
