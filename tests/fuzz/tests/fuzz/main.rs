//! What must hold for any bytes, tried with the corpus and thousands of mutations.

mod editor;
mod mutations;
mod properties;

/// All of them before a release, for which `JOSTLE_LONG` is set, and otherwise a quarter.
fn cases(all: u64) -> u64 {
    if std::env::var_os("JOSTLE_LONG").is_some_and(|value| value == "1") { all } else { all / 4 }
}
