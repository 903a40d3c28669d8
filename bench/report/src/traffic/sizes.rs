//! Measures the sizes of recorded scenes with the current codec, as a text table. The table in `tests/goldens` holds
//! the accepted sizes; none may differ from it by more than [`GROWTH_MAX`].

use super::measure::{Scale, Traffic};
use super::recording::Recording;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

/// Relative amount by which a size may differ from the golden one in either direction.
pub const GROWTH_MAX: f64 = 0.02;
/// The command that updates the golden table.
pub const RENEW: &str = "in bench: cargo run --release --bin traffic -- sizes --renew";

/// Directory of the recordings and the golden table, relative to the root of the workspace.
pub const GOLDENS: &str = "tests/goldens/traffic";
/// File name of the table.
pub const TABLE: &str = "sizes.txt";
/// Extension of the recordings.
pub const ENDING: &str = "recording";

const HEAD: &str = "\
# Sizes of recorded traffic. A test compares; after a wanted change
# (in bench) cargo run --release --bin traffic -- sizes --renew
# writes them anew, and the commit says why.
# scene-engine Hz | payload B/s | bits a moved body | message B: p50 | p99 | max
";

/// Measures all recordings; returns a table sorted by name, with three rates each.
pub fn measure(dir: &Path) -> Result<String> {
    let entries = fs::read_dir(dir).with_context(|| format!("no {}", dir.display()))?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<std::io::Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == ENDING));
    paths.sort();
    let mut table = HEAD.to_owned();
    for path in paths {
        let bytes = fs::read(&path).with_context(|| format!("no {}", path.display()))?;
        let recording = Recording::unpack(&bytes).with_context(|| path.display().to_string())?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for traffic in weigh(&recording) {
            table += &row(&name, &traffic);
        }
    }
    Ok(table)
}

/// Measures the traffic of clients at 60, 20 and 5 Hz.
pub fn weigh(recording: &Recording) -> Vec<Traffic> {
    let mut scale = Scale::new(&[60, 20, 5]);
    recording.snapshots().for_each(|snapshot| scale.weigh(&snapshot));
    scale.finish()
}

fn row(name: &str, traffic: &Traffic) -> String {
    let [payload, _] = traffic.bytes_per_s();
    let [p50, p99, max] = [0.5, 0.99, 1.0].map(|share| traffic.percentile(share));
    let (rate, bits) = (traffic.rate, traffic.bits_per_moved());
    format!("{name:14} {rate:2} {payload:9.1} {bits:7.2} {p50:5} {p99:5} {max:5}\n")
}

/// A row of the table.
struct Row {
    /// Name of the row: scene, engine and rate.
    name: String,
    /// Sizes in the order of [`COLUMNS`].
    sizes: Vec<f64>,
}

const COLUMNS: [&str; 5] = ["payload", "bits a moved body", "p50", "p99", "longest message"];

/// Returns a sentence for every number that differs too much from the golden table, or an error if the tables have
/// different rows. Reductions are reported too, so that the golden table records them.
pub fn differences(golden: &str, now: &str) -> Result<Vec<String>> {
    let (golden, now) = (rows(golden)?, rows(now)?);
    let names = |rows: &[Row]| rows.iter().map(|row| row.name.clone()).collect::<Vec<_>>();
    ensure!(!golden.is_empty(), "the golden table is empty");
    ensure!(
        names(&golden) == names(&now),
        "recorded {:?}, golden {:?}",
        names(&now),
        names(&golden)
    );
    let mut found = Vec::new();
    for (old, new) in golden.iter().zip(&now) {
        let sizes = old.sizes.iter().zip(&new.sizes).zip(COLUMNS);
        let far = sizes.filter(|((old, new), _)| (*new - *old).abs() > *old * GROWTH_MAX);
        found.extend(
            far.map(|((was, is), column)| format!("{}: {column} {was}, now {is}", old.name)),
        );
    }
    Ok(found)
}

fn rows(table: &str) -> Result<Vec<Row>> {
    let lines = table.lines().filter(|line| !line.starts_with('#'));
    lines.map(row_of).collect()
}

fn row_of(line: &str) -> Result<Row> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (name, sizes) = words.split_at_checked(2).with_context(|| format!("no row: {line}"))?;
    let sizes: Vec<f64> = sizes.iter().map(|size| size.parse()).collect::<Result<_, _>>()?;
    ensure!(sizes.len() == COLUMNS.len(), "{} sizes in a row: {line}", sizes.len());
    Ok(Row { name: name.join(" at Hz "), sizes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn goldens() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(GOLDENS)
    }

    #[test]
    fn recorded_traffic_costs_what_it_did() {
        let golden = fs::read_to_string(goldens().join(TABLE)).unwrap();
        let found = differences(&golden, &measure(&goldens()).unwrap()).unwrap();
        assert!(
            found.is_empty(),
            "sizes are more than 2 % from {GOLDENS}/{TABLE}:\n{}\n\
             if that is wanted, `{RENEW}` writes them anew; the commit says why",
            found.join("\n")
        );
    }

    #[test]
    fn two_percent_are_accepted_and_more_is_reported() {
        let table = |payload: f64| format!("# head\nK901-jostle 60 {payload} 6.0 50 100 200\n");
        let found = |payload: f64| differences(&table(1000.0), &table(payload)).unwrap();
        assert!(found(1019.0).is_empty() && found(981.0).is_empty());
        assert_eq!(found(1021.0), ["K901-jostle at Hz 60: payload 1000, now 1021"]);
        assert_eq!(found(979.0).len(), 1);
        assert!(differences(&table(1.0), "").is_err());
        assert!(differences("", "").is_err());
        assert!(differences(&table(1.0), "P901-jostle 60 1.0 6.0 50 100 200").is_err());
        assert!(differences(&table(1.0), "K901-jostle 60 1.0 6.0 50 100").is_err());
    }
}
