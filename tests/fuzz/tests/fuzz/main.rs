//! Uses the corpus and thousands of mutations to check the properties that must hold for any bytes.

mod editor;
mod mutations;
mod properties;

/// Number of cases to run: all of them before a release, when `JOSTLE_LONG` is set, and a quarter otherwise.
fn cases(all: u64) -> u64 {
    if std::env::var_os("JOSTLE_LONG").is_some_and(|value| value == "1") { all } else { all / 4 }
}
