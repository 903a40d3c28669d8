//! A scene file: see `jostle_fuzz::scene`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::scene(bytes));
