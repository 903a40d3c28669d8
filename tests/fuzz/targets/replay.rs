//! A replay, raw or with correct checksums: see `jostle_fuzz::replay`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::replay(bytes));
