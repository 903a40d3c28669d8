//! A client's message: see `jostle_fuzz::client_message`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::client_message(bytes));
