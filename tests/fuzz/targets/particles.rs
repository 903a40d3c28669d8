//! Particles in the keyframe of a new client: see `jostle_fuzz::particles`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::particles(bytes));
