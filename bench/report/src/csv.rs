//! Writes the numbers behind the plots as comma-separated files (RFC 4180).

use crate::piles::Heap;
use crate::stability::Verdicts;
use crate::study::Study;

/// A table under construction.
pub struct Csv {
    text: String,
    columns: usize,
}

impl Csv {
    /// Creates a table with a header line.
    pub fn new(columns: &[&str]) -> Csv {
        let mut csv = Csv { text: String::new(), columns: columns.len() };
        csv.row(&columns.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        csv
    }

    /// Adds a line; fields with a comma, a quote or a line break are quoted.
    pub fn row(&mut self, fields: &[String]) {
        debug_assert_eq!(fields.len(), self.columns, "{fields:?}");
        let quoted: Vec<String> = fields.iter().map(|field| quote(field)).collect();
        self.text.push_str(&quoted.join(","));
        self.text.push('\n');
    }

    pub fn finish(self) -> String {
        self.text
    }
}

fn quote(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

/// Writes all points of all problems, one line per norm.
pub fn of_studies(studies: &[Study]) -> String {
    let columns = [
        "problem",
        "method",
        "knob",
        "setting",
        "norm",
        "unit",
        "error",
        "best_us_a_tick",
        "median_us_a_tick",
        "work_a_tick",
        "pareto",
        "f32_floor",
    ];
    let mut csv = Csv::new(&columns);
    studies.iter().for_each(|study| study_rows(study, &mut csv));
    csv.finish()
}

fn study_rows(study: &Study, csv: &mut Csv) {
    for curve in &study.curves {
        for point in &curve.points {
            for (index, (norm, error)) in study.problem.norms.iter().zip(&point.errors).enumerate()
            {
                csv.row(&[
                    study.problem.id.into(),
                    curve.method.name.into(),
                    curve.method.knob.into(),
                    point.setting.to_string(),
                    norm.name.into(),
                    norm.unit.into(),
                    format!("{error:e}"),
                    format!("{:.4}", point.best_us),
                    format!("{:.4}", point.median_us),
                    point.work.map_or_else(String::new, |work| format!("{work:.2}")),
                    (index == 0 && point.pareto).to_string(),
                    if index == 0 { format!("{:e}", study.problem.floor()) } else { String::new() },
                ]);
            }
        }
    }
}

/// Writes all figures of the stability cases.
pub fn of_stability(cases: &[Verdicts], solvers: &[&str]) -> String {
    let columns =
        ["case", "title", "solver", "variant", "metric", "accepted", "measured", "verdict"];
    let mut csv = Csv::new(&columns);
    for verdicts in cases {
        for (solver, outcome) in solvers.iter().zip(&verdicts.outcomes) {
            for check in &outcome.checks {
                csv.row(&[
                    verdicts.case.id.into(),
                    verdicts.case.title.into(),
                    (*solver).into(),
                    check.variant.clone(),
                    check.metric.into(),
                    format!("{:e}", check.accepted),
                    format!("{:e}", check.measured),
                    if check.passes() { "pass" } else { "fail" }.into(),
                ]);
            }
        }
    }
    csv.finish()
}

/// Writes all figures of all piles.
pub fn of_heaps(heaps: &[Heap], solvers: &[&str]) -> String {
    let mut csv = Csv::new(&["pile", "title", "solver", "figure", "measured", "verdict"]);
    for heap in heaps {
        for (solver, name) in solvers.iter().enumerate() {
            for (index, (figure, _)) in heap.pile.bounds.iter().enumerate() {
                let Some((value, accepted)) = heap.figure(solver, index) else { continue };
                let verdict = accepted.map_or("", |pass| if pass { "pass" } else { "fail" });
                csv.row(&[
                    heap.pile.id.clone(),
                    heap.pile.title.clone(),
                    (*name).into(),
                    figure.name().into(),
                    format!("{value:e}"),
                    verdict.into(),
                ]);
            }
        }
    }
    csv.finish()
}

/// Writes the plotted runs of all cases.
pub fn of_series(cases: &[Verdicts], solvers: &[&str]) -> String {
    let columns = ["case", "solver", "variant", "time_s", "overlap", "energy", "rms_speed"];
    let mut csv = Csv::new(&columns);
    for verdicts in cases {
        for (solver, outcome) in solvers.iter().zip(&verdicts.outcomes) {
            let Some((variant, samples)) = &outcome.series else { continue };
            for sample in samples {
                csv.row(&[
                    verdicts.case.id.into(),
                    (*solver).into(),
                    variant.clone(),
                    format!("{:.4}", sample.time_s),
                    format!("{:e}", sample.overlap),
                    format!("{:e}", sample.energy),
                    format!("{:e}", sample.rms),
                ]);
            }
        }
    }
    csv.finish()
}

#[cfg(test)]
mod tests {
    use super::Csv;

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        let mut csv = Csv::new(&["a", "b"]);
        csv.row(&["1,5".into(), "say \"no\"".into()]);
        csv.row(&["plain".into(), String::new()]);
        assert_eq!(csv.finish(), "a,b\n\"1,5\",\"say \"\"no\"\"\"\nplain,\n");
    }
}
