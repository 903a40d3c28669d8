//! Random numbers that cannot be foreseen.

/// An unpredictable random number.
pub fn random() -> u64 {
    getrandom::u64().expect("the system's random source worked when the server started")
}
