//! Measures what features cost scenes that do not use them: instructions per step, counted by callgrind, bytes on the
//! wire, and resources created by the page.
//!
//! Instructions are counted in the program `steps`, which plays a bare world. The count per step is the difference
//! between a long run and a short one, divided by the difference in steps, and does not depend on timing or other load.

mod bytes;

use crate::cores::on_all_cores;
use crate::csv::Csv;
use crate::page::Results;
use crate::plot::escape;
use anyhow::{Context, Result, bail};
use bytes::Bytes;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// Relative amount by which a step of a bare world may exceed the baseline.
pub const ACCEPTED: f64 = 0.01;
/// Number of steps in the short run and in the long run. Between the two, bodies fall, land and come to rest.
const STEPS: [u32; 2] = [20, 140];
/// The accepted number of instructions per step of the bare worlds.
const BASELINE: &str = include_str!("../baseline.csv");

/// A world without any features, as its solver and its kind of bodies: boxes, circles, or strangers, which are boxes
/// that do not collide.
type Bare = [&'static str; 2];

const BARE: [Bare; 6] = [
    ["relaxation", "boxes"],
    ["relaxation", "circles"],
    ["relaxation", "strangers"],
    ["conjugate", "boxes"],
    ["conjugate", "circles"],
    ["conjugate", "strangers"],
];

/// A feature and the bare world that it is added to.
#[derive(Clone, Copy)]
struct Row {
    /// The feature's name, as passed to `steps`.
    feature: &'static str,
    bare: Bare,
    /// Whether a plan can name the feature even though no body has it.
    is_named: bool,
}

const fn row(solver: &'static str, feature: &'static str, scene: &'static str) -> Row {
    Row { feature, bare: [solver, scene], is_named: true }
}

/// A feature that no plan can name.
const fn unnamed(solver: &'static str, feature: &'static str, scene: &'static str) -> Row {
    Row { feature, bare: [solver, scene], is_named: false }
}

const ROWS: [Row; 18] = [
    row("relaxation", "friction", "boxes"),
    row("relaxation", "restitution", "boxes"),
    row("relaxation", "circles", "boxes"),
    row("relaxation", "boxes", "circles"),
    row("relaxation", "particles", "boxes"),
    unnamed("relaxation", "forces", "boxes"),
    unnamed("relaxation", "kinematic", "boxes"),
    unnamed("relaxation", "touches", "strangers"),
    row("conjugate", "friction", "boxes"),
    row("conjugate", "restitution", "boxes"),
    row("conjugate", "circles", "boxes"),
    row("conjugate", "boxes", "circles"),
    row("conjugate", "particles", "boxes"),
    unnamed("conjugate", "forces", "boxes"),
    unnamed("conjugate", "sleeping", "boxes"),
    unnamed("conjugate", "kinematic", "boxes"),
    unnamed("conjugate", "continuous", "boxes"),
    unnamed("conjugate", "touches", "strangers"),
];

/// A feature's title in the tables.
fn title(feature: &'static str) -> &'static str {
    match feature {
        "kinematic" => "kinematic bodies",
        "continuous" => "continuous collision",
        "touches" => "impact events",
        other => other,
    }
}

/// Number of instructions per step of a bare world.
#[derive(Clone, Debug)]
pub struct Absent {
    bare: Bare,
    now: f64,
    /// The number of instructions in the baseline.
    before: f64,
}

impl Absent {
    /// Relative growth since the baseline.
    fn growth(&self) -> f64 {
        self.now / self.before - 1.0
    }
}

/// Relative cost of a feature in instructions per step of a bare world.
#[derive(Clone, Debug)]
pub struct Cost {
    feature: &'static str,
    bare: Bare,
    /// Cost if the plan names the feature but no body has it; `None` if a plan cannot name it.
    named: Option<f64>,
    /// Cost if one body has the feature.
    one: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Costs {
    /// Instructions of the bare worlds. Empty without valgrind, as is `features`.
    absent: Vec<Absent>,
    features: Vec<Cost>,
    bytes: Vec<Bytes>,
}

/// Measures all costs with the program `steps`.
pub fn measure(steps: &Path) -> Result<Costs> {
    let bytes = bytes::measure()?;
    if !has_valgrind() {
        return Ok(Costs { bytes, ..Costs::default() });
    }
    let counts: Vec<Count> =
        on_all_cores(&BARE, |bare| count(steps, *bare, None)).into_iter().collect::<Result<_>>()?;
    let of = |bare: Bare| {
        let found = BARE.iter().position(|known| *known == bare);
        &counts[found.expect("every row is of a bare world that is counted")]
    };
    let absent = BARE.iter().map(|bare| {
        Ok(Absent { bare: *bare, now: of(*bare).instructions, before: baseline(*bare)? })
    });
    let absent = absent.collect::<Result<_>>()?;
    let features = on_all_cores(&ROWS, |row| cost(steps, row, of(row.bare)));
    Ok(Costs { absent, features: features.into_iter().collect::<Result<_>>()?, bytes })
}

/// Looks up a bare world in the baseline.
fn baseline(bare: Bare) -> Result<f64> {
    let start = format!("{},", bare.join(","));
    let found = BASELINE.lines().find_map(|line| line.strip_prefix(&start));
    found.with_context(|| format!("no {bare:?} in the baseline"))?.parse().context("the baseline")
}

fn has_valgrind() -> bool {
    Command::new("valgrind").arg("--version").output().is_ok_and(|said| said.status.success())
}

fn cost(steps: &Path, row: &Row, absent: &Count) -> Result<Cost> {
    let Row { feature, bare, is_named } = *row;
    let share = |count: &Count| count.instructions / absent.instructions - 1.0;
    let named = is_named.then(|| count(steps, bare, Some(["named", feature]))).transpose()?;
    if named.as_ref().is_some_and(|named| named.hash != absent.hash) {
        bail!("{bare:?}: the world is another one where a plan names {feature}");
    }
    let one = count(steps, bare, Some(["one", feature]))?;
    if one.hash == absent.hash {
        bail!("{bare:?}: the world is the same one though a body has {feature}");
    }
    Ok(Cost { feature: title(feature), bare, named: named.as_ref().map(share), one: share(&one) })
}

struct Count {
    /// Number of instructions in one step.
    instructions: f64,
    /// Hash of the final world.
    hash: String,
}

fn count(steps: &Path, bare: Bare, feature: Option<[&str; 2]>) -> Result<Count> {
    let [short, long] = STEPS;
    let whole = |steps_to_play| counted(steps, bare, steps_to_play, feature);
    let ((few, _), (many, hash)) = (whole(short)?, whole(long)?);
    Ok(Count { instructions: (many - few) / f64::from(long - short), hash })
}

/// Returns the number of instructions in a whole run, as reported by callgrind, and the hash of its world.
fn counted(
    program: &Path,
    bare: Bare,
    steps: u32,
    feature: Option<[&str; 2]>,
) -> Result<(f64, String)> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
    command.args(bare).arg(steps.to_string()).args(feature.iter().flatten());
    let output = command.output().context("cannot run valgrind")?;
    let said = String::from_utf8_lossy(&output.stderr);
    let collected = said.lines().find_map(|line| line.split_once("Collected : "));
    match collected.and_then(|(_, count)| count.trim().parse().ok()) {
        Some(count) if output.status.success() => {
            Ok((count, String::from_utf8_lossy(&output.stdout).into_owned()))
        }
        _ => bail!("callgrind counted nothing of {}: {said}", program.display()),
    }
}

/// The current figures of the bare worlds, to replace the baseline with if growth is intended.
pub fn baseline_csv(costs: &Costs) -> String {
    let mut csv = Csv::new(&["solver", "bodies", "instructions a step"]);
    for Absent { bare: [solver, bodies], now, .. } in &costs.absent {
        csv.row(&[(*solver).to_owned(), (*bodies).to_owned(), format!("{now:.0}")]);
    }
    csv.finish()
}

/// The numbers in this section of the report, as CSV.
pub fn csv(costs: &Costs) -> String {
    let mut csv =
        Csv::new(&["feature", "solver", "bodies", "named by the plan", "one body has it"]);
    for Cost { feature, bare: [solver, bodies], named, one } in &costs.features {
        let named = named.map_or_else(String::new, |share| format!("{share:.5}"));
        csv.row(&[
            (*feature).to_owned(),
            (*solver).to_owned(),
            (*bodies).to_owned(),
            named,
            format!("{one:.5}"),
        ]);
    }
    csv.finish()
}

/// The text above the tables.
pub const ABOUT: &str = "A scene is compiled to a plan when it loads, and what the plan leaves out \
    is skipped: loops of a step, sections of a message, pipelines of the page. Instructions a step are \
    counted by callgrind, on bare worlds of 80 bodies that rain, land and rest, without friction, bounces, particles \
    or anything else; strangers are boxes of groups that do not meet. The first table compares them with a table kept \
    in the repository (bench/report/baseline.csv): a feature that begins to cost worlds without it shows as \
    growth. When that table began, builds that could not do a feature at all needed at most 2 % fewer. The second says what the \
    presence of a feature adds: with a plan that names it though no body has it (the world then ends with the \
    same hash, or the count fails), and with one body of 80 that has it. Such a world moves otherwise from there on, so its \
    figure holds what the feature does as well as what looking for it costs, and may be negative. Forces, \
    sleeping, kinematic bodies and continuous collision cannot be named; for sleeping, the whole world \
    may sleep.";

/// Shown if no plan can name the feature.
const NO_PLAN: &str = "nothing to name";

fn percent(share: f64) -> String {
    format!("{:+.2} %", share * 100.0)
}

/// The rows of a table, with any verdicts.
struct Table {
    head: Vec<&'static str>,
    rows: Vec<(Vec<String>, Option<bool>)>,
}

fn tables(costs: &Costs) -> Vec<Table> {
    let absent = costs.absent.iter().map(|absent| {
        let Absent { bare: [solver, bodies], now, before } = absent;
        let figures = [format!("{before:.0}"), format!("{now:.0}"), percent(absent.growth())];
        let cells = [(*solver).to_owned(), (*bodies).to_owned()].into_iter().chain(figures);
        (cells.collect(), Some(absent.growth() <= ACCEPTED))
    });
    let features = costs.features.iter().map(|cost| {
        let Cost { feature, bare: [solver, bodies], named, one } = cost;
        let words = [*feature, *solver, *bodies].map(str::to_owned);
        let named = named.map_or_else(|| NO_PLAN.to_owned(), percent);
        (words.into_iter().chain([named, percent(*one)]).collect(), None)
    });
    let bytes = costs.bytes.iter().map(|bytes| {
        let unused = bytes.unused.map_or("works by itself".to_owned(), |n| format!("{n:.2}"));
        let [lacking, used] = [bytes.lacking, bytes.used].map(|n| format!("{n:.2}"));
        let page = bytes.on_the_page().to_owned();
        (vec![bytes.feature.to_owned(), lacking, unused, used, page], None)
    });
    let counted = [
        Table {
            head: vec!["solver", "bodies", "kept: instructions a step", "now", "growth"],
            rows: absent.collect(),
        },
        Table {
            head: vec!["feature", "solver", "bodies", "named by the plan", "one body has it"],
            rows: features.collect(),
        },
    ];
    let sent = Table {
        head: vec![
            "feature",
            "bytes a tick, lacking",
            "there, not used",
            "used",
            "makes on the page",
        ],
        rows: bytes.collect(),
    };
    counted.into_iter().filter(|table| !table.rows.is_empty()).chain([sent]).collect()
}

impl Table {
    fn html(&self, page: &mut String) {
        page.push_str("<table>\n<thead><tr>");
        self.head.iter().for_each(|cell| page.push_str(&format!("<th>{cell}</th>")));
        page.push_str("</tr></thead>\n<tbody>\n");
        for (cells, verdict) in &self.rows {
            page.push_str("<tr>");
            for (index, cell) in cells.iter().enumerate() {
                let class = match verdict {
                    Some(passed) if index + 1 == cells.len() => {
                        if *passed {
                            "n pass"
                        } else {
                            "n fail"
                        }
                    }
                    _ => "n",
                };
                let is_number = cell.starts_with(|first: char| "+-0123456789".contains(first));
                let class = if is_number && !cell.contains("pipeline") {
                    format!(" class=\"{class}\"")
                } else {
                    String::new()
                };
                let _ = write!(page, "<td{class}>{}</td>", escape(cell));
            }
            page.push_str("</tr>\n");
        }
        page.push_str("</tbody>\n</table>\n");
    }

    fn markdown(&self, text: &mut String) {
        let _ =
            writeln!(text, "| {} |\n|{}", self.head.join(" | "), " --- |".repeat(self.head.len()));
        for (cells, _) in &self.rows {
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text.push('\n');
    }
}

pub fn section(results: &Results, page: &mut String) {
    let Some(costs) = &results.costs else { return };
    let _ = writeln!(page, "<h2 id=\"unneeded\">Nothing unneeded</h2>\n<p>{}</p>", escape(ABOUT));
    if costs.absent.is_empty() {
        page.push_str("<p>Instructions were not counted: there is no valgrind here.</p>\n");
    }
    tables(costs).iter().for_each(|table| table.html(page));
    let _ = writeln!(page, "<p>{}</p>\n<p>{}</p>", escape(BYTES), escape(PAGE));
}

pub fn markdown(results: &Results, text: &mut String) {
    let Some(costs) = &results.costs else { return };
    let _ = writeln!(text, "\n## Nothing unneeded\n\n{ABOUT}\n");
    tables(costs).iter().for_each(|table| table.markdown(text));
    let _ = writeln!(text, "{BYTES}\n\n{PAGE}");
}

const BYTES: &str =
    "Bytes are those of a snapshot, mean of 600 ticks, for one player with a hero at rest.";

/// The resources that the page creates, as checked by the browser test `needs.rs`.
const PAGE: &str = "The page makes 2 pipelines (ground, solids) and one texture (light, 16 KiB) for \
    every scene, and what draws particles as soon as a scene that can make some is shown, not before. A \
    browser test counts programs and textures at the WebGL context. The download is the same for all \
    scenes; the sprite of particles is 4 KiB of it. Friction, restitution, forces, sleeping and continuous \
    collision are nothing that a message or the page knows of.";

impl Bytes {
    /// The resources that the page creates for the feature, in addition to those that every scene needs.
    fn on_the_page(&self) -> &'static str {
        if self.draws_particles { PARTICLES_ON_THE_PAGE } else { "nothing" }
    }
}

const PARTICLES_ON_THE_PAGE: &str = "1 pipeline, 1 texture (16 KiB), 1 vertex buffer";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bare_world_is_in_the_kept_table_and_every_row_is_of_one() {
        for bare in BARE {
            assert!(baseline(bare).expect("a figure") > 1e4, "{bare:?}");
        }
        assert!(ROWS.iter().all(|row| BARE.contains(&row.bare)));
        assert!(baseline(["none", "boxes"]).is_err());
    }

    #[test]
    fn growth_beyond_the_accepted_share_is_marked() {
        let absent = |now| Absent { bare: BARE[0], now, before: 1000.0 };
        let costs = Costs { absent: vec![absent(1005.0), absent(1020.0)], ..Costs::default() };
        let mut page = String::new();
        tables(&costs)[0].html(&mut page);
        assert!(page.contains("n pass\">+0.50 %") && page.contains("n fail\">+2.00 %"));
    }
}
