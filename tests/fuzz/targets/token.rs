//! A token as a client presents it: see `jostle_fuzz::token`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::token(bytes));
