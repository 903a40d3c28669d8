//! Bytes of a peer before a session: see `jostle_fuzz::handshake`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| jostle_fuzz::handshake(bytes));
