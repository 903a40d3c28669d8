//! Particles as they are told to who joins: see `jostle_fuzz::particles`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::particles(bytes));
