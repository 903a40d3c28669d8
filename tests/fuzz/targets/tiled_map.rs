//! Maps of the Tiled editor: see `jostle_fuzz::tiled_map`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::tiled_map(bytes));
