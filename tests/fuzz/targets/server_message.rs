//! A server's message: see `jostle_fuzz::server_message`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::server_message(bytes));
