//! Scenes that guests send: see `jostle_fuzz::guest_scene`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::guest_scene(bytes));
