//! A room and several clients: see `jostle_fuzz::room`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::room(bytes));
