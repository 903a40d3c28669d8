//! What a feature costs a scene that does not use it: instructions of a step, counted by callgrind,
//! bytes on the wire, and what the page makes.
//!
//! The programs that are counted are builds of `room/examples/costs.rs`: one as it is shipped, and
//! for each feature one that can not do it at all. A step's instructions are those of a long run less
//! those of a short one, over the steps between; they depend on no clock and no neighbour.

use crate::cores::on_all_cores;
use crate::page::Results;
use crate::plot::escape;
use anyhow::{Context, Result, bail};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Share of a step's instructions that a feature may cost where it is not used.
pub const ACCEPTED: f64 = 0.01;
/// Steps of the short run and of the long one: bodies fall, land and come to rest in between.
const STEPS: [u32; 2] = [20, 140];

/// A feature, and a bare scene that does not use it.
#[derive(Clone, Copy)]
struct Row {
    feature: &'static str,
    solver: &'static str,
    scene: &'static str,
}

/// The solver, a field of `jostle_sim::Features` that its step asks for, and bodies without it.
const ROWS: [Row; 8] = [
    Row { solver: "relaxation", feature: "friction", scene: "boxes" },
    Row { solver: "relaxation", feature: "restitution", scene: "boxes" },
    Row { solver: "relaxation", feature: "circles", scene: "boxes" },
    Row { solver: "relaxation", feature: "boxes", scene: "circles" },
    Row { solver: "relaxation", feature: "particles", scene: "boxes" },
    Row { solver: "conjugate", feature: "friction", scene: "boxes" },
    Row { solver: "conjugate", feature: "restitution", scene: "boxes" },
    Row { solver: "conjugate", feature: "particles", scene: "boxes" },
];

/// Instructions a step.
#[derive(Clone, Debug)]
pub struct Steps {
    /// What the scene does not use.
    pub feature: &'static str,
    /// Of the world.
    pub solver: &'static str,
    /// Boxes or circles.
    pub scene: &'static str,
    /// In a build that can not do it.
    pub without: f64,
    /// As shipped: the plan leaves it out.
    pub planned: f64,
    /// As shipped, had the plan named it.
    pub named: f64,
}

impl Steps {
    /// Share that the feature costs though it is not used.
    pub fn cost(&self) -> f64 {
        self.planned / self.without - 1.0
    }

    /// Share that it would cost without a plan.
    pub fn cost_without_plan(&self) -> f64 {
        self.named / self.without - 1.0
    }
}

/// Bytes a tick for one player.
#[derive(Clone, Debug)]
pub struct Bytes {
    /// What the scene has or not.
    pub feature: String,
    /// Where the scene lacks it.
    pub lacking: f64,
    /// Where it has it and nobody uses it; `None` where it works by itself.
    pub unused: Option<f64>,
    /// Where it is used.
    pub used: f64,
}

/// All that was measured.
#[derive(Clone, Debug, Default)]
pub struct Costs {
    /// Empty where valgrind is missing.
    pub steps: Vec<Steps>,
    /// By feature.
    pub bytes: Vec<Bytes>,
}

/// Measures with the programs in a directory: `shipped`, and one by the name of each feature.
pub fn measure(programs: &Path) -> Result<Costs> {
    let steps = if has_valgrind() { count_all(programs)? } else { Vec::new() };
    Ok(Costs { steps, bytes: bytes(&programs.join("shipped"))? })
}

fn has_valgrind() -> bool {
    Command::new("valgrind").arg("--version").output().is_ok_and(|said| said.status.success())
}

fn count_all(programs: &Path) -> Result<Vec<Steps>> {
    on_all_cores(&ROWS, |row| count_row(row, programs)).into_iter().collect()
}

fn count_row(row: &Row, programs: &Path) -> Result<Steps> {
    let Row { feature, solver, scene } = *row;
    let shipped = programs.join("shipped");
    let count = |program: &PathBuf, named: Option<&str>| -> Result<f64> {
        let [short, long] = STEPS;
        let whole = |steps| instructions(program, solver, scene, steps, named);
        Ok((whole(long)? - whole(short)?) / f64::from(long - short))
    };
    Ok(Steps {
        feature,
        solver,
        scene,
        without: count(&programs.join(feature), None)?,
        planned: count(&shipped, None)?,
        named: count(&shipped, Some(feature))?,
    })
}

/// Instructions of a whole run, as callgrind tells them.
fn instructions(
    program: &Path,
    solver: &str,
    scene: &str,
    steps: u32,
    named: Option<&str>,
) -> Result<f64> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
    command.args(["step", solver, scene, &steps.to_string()]).args(named);
    let output = command.output().context("cannot run valgrind")?;
    let said = String::from_utf8_lossy(&output.stderr);
    let collected = said.lines().find_map(|line| line.split_once("Collected : "));
    match collected.and_then(|(_, count)| count.trim().parse().ok()) {
        Some(count) if output.status.success() => Ok(count),
        _ => bail!("callgrind counted nothing of {}: {said}", program.display()),
    }
}

fn bytes(program: &Path) -> Result<Vec<Bytes>> {
    let output = Command::new(program).arg("bytes").output();
    let output = output.with_context(|| format!("cannot run {}", program.display()))?;
    let said = String::from_utf8(output.stdout).context("a table of bytes")?;
    said.lines().skip(1).map(bytes_of).collect()
}

/// One line: a quoted name and three numbers, the second of which may be missing.
fn bytes_of(line: &str) -> Result<Bytes> {
    let (feature, numbers) =
        line.trim_start_matches('"').split_once("\",").context("a quoted name")?;
    let mut numbers = numbers.split(',').map(|number| number.parse::<f64>().ok());
    let mut next = || numbers.next().with_context(|| format!("three columns in {line:?}"));
    let (lacking, unused, used) = (next()?, next()?, next()?);
    let need = |number: Option<f64>| number.with_context(|| format!("numbers in {line:?}"));
    Ok(Bytes { feature: feature.to_owned(), lacking: need(lacking)?, unused, used: need(used)? })
}

/// The numbers behind the section.
pub fn csv(costs: &Costs) -> String {
    let mut text =
        "feature,solver,scene,instructions without,planned,named,cost,cost without plan\n"
            .to_owned();
    for steps in &costs.steps {
        let Steps { feature, solver, scene, without, planned, named } = steps;
        let (cost, unplanned) = (steps.cost(), steps.cost_without_plan());
        let _ = writeln!(
            text,
            "{feature},{solver},{scene},{without:.0},{planned:.0},{named:.0},{cost:.5},{unplanned:.5}"
        );
    }
    text
}

/// What stands above the tables.
pub const ABOUT: &str = "A scene is compiled to a plan when it loads, and what the plan leaves out \
    is skipped: loops of a step, sections of a message, pipelines of the page. Instructions a step are \
    counted by callgrind, on a bare world of 80 bodies that rains, lands and rests, in a build that can not do \
    the thing at all, in the shipped one, and in the shipped one with a plan that names it though no \
    body has it. Features without a row (kinematic bodies, emitters, events, forces) have no loop of \
    their own that runs while nothing has them. The conjugate solver asks for a pair's shapes once a \
    step, which costs nothing that could be measured, and was left as it is; outside of its sweeps the \
    tangents of rows without friction are still reckoned, about 2 % of a step of these boxes, and no \
    build leaves that out. A part that builds differently moves a few instructions of its neighbours: a \
    cost may be negative.";

/// Percent with a sign.
fn percent(share: f64) -> String {
    format!("{:+.2} %", share * 100.0)
}

/// The page's section.
pub fn section(results: &Results, page: &mut String) {
    let Some(costs) = &results.costs else { return };
    let _ = writeln!(page, "<h2 id=\"unneeded\">Nothing unneeded</h2>\n<p>{}</p>", escape(ABOUT));
    if costs.steps.is_empty() {
        page.push_str("<p>Instructions were not counted: there is no valgrind here.</p>\n");
    } else {
        page.push_str(
            "<table>\n<thead><tr><th>Not used</th><th>Solver</th><th>Bodies</th><th>Instructions \
             a step without it</th><th>With it, planned</th><th>Cost</th><th>Had the plan named \
             it</th></tr></thead>\n<tbody>\n",
        );
        for steps in &costs.steps {
            let class = if steps.cost() <= ACCEPTED { "pass" } else { "fail" };
            let _ = writeln!(
                page,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.0}</td>\
                 <td class=\"n\">{:.0}</td><td class=\"n {class}\">{}</td><td class=\"n\">{}</td></tr>",
                steps.feature,
                steps.solver,
                steps.scene,
                steps.without,
                steps.planned,
                percent(steps.cost()),
                percent(steps.cost_without_plan()),
            );
        }
        page.push_str("</tbody>\n</table>\n");
    }
    page.push_str(
        "<p>Bytes of a snapshot, mean of 600 ticks, one player with a hero at rest:</p>\n<table>\n\
         <thead><tr><th>Feature</th><th>Lacking</th><th>There, not used</th><th>Used</th></tr></thead>\n<tbody>\n",
    );
    for bytes in &costs.bytes {
        let unused = bytes.unused.map_or("works by itself".to_owned(), |n| format!("{n:.2}"));
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td class=\"n\">{:.2}</td><td class=\"n\">{unused}</td>\
             <td class=\"n\">{:.2}</td></tr>",
            escape(&bytes.feature),
            bytes.lacking,
            bytes.used
        );
    }
    let _ = writeln!(page, "</tbody>\n</table>\n<p>{}</p>", escape(PAGE));
}

/// What the page makes, as the browser test `needs.rs` finds it.
const PAGE: &str = "The page makes 2 pipelines (ground, solids) and one texture (light, 16 KiB) for \
    every scene; particles add one pipeline, one texture (16 KiB) and one vertex buffer, as soon as a scene \
    that can make particles is shown and not before. A browser test counts programs and textures at \
    the WebGL context. The download is the same for all scenes; the sprite is 4 KiB of it.";

/// The summary's section.
pub fn markdown(results: &Results, text: &mut String) {
    let Some(costs) = &results.costs else { return };
    let _ = writeln!(text, "\n## Nothing unneeded\n\n{ABOUT}\n");
    if !costs.steps.is_empty() {
        text.push_str(
            "| not used | solver | bodies | instructions a step without it | planned | cost | had the plan named it |\n\
             | --- | --- | --- | --- | --- | --- | --- |\n",
        );
        for steps in &costs.steps {
            let Steps { feature, solver, scene, without, planned, .. } = steps;
            let (cost, unplanned) = (percent(steps.cost()), percent(steps.cost_without_plan()));
            let _ = writeln!(
                text,
                "| {feature} | {solver} | {scene} | {without:.0} | {planned:.0} | {cost} | {unplanned} |"
            );
        }
    }
    text.push_str(
        "\n| feature | bytes a tick, lacking | there, not used | used |\n| --- | --- | --- | --- |\n",
    );
    for Bytes { feature, lacking, unused, used } in &costs.bytes {
        let unused = unused.map_or("works by itself".to_owned(), |n| format!("{n:.2}"));
        let _ = writeln!(text, "| {feature} | {lacking:.2} | {unused} | {used:.2} |");
    }
    let _ = writeln!(text, "\n{PAGE}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_bytes_is_read_or_refused() {
        let bytes = bytes_of("\"made bodies, impacts\",6.150,,425.743").expect("a good line");
        assert_eq!((bytes.feature.as_str(), bytes.unused), ("made bodies, impacts", None));
        assert_eq!((bytes.lacking, bytes.used), (6.15, 425.743));
        assert!(bytes_of("\"particles\",6.1,6.1").is_err());
        assert!(bytes_of("\"particles\",6.1,6.1,much").is_err());
    }

    #[test]
    fn a_cost_is_a_share_of_the_build_without() {
        let steps = Steps {
            feature: "friction",
            solver: "relaxation",
            scene: "boxes",
            without: 1000.0,
            planned: 1005.0,
            named: 1100.0,
        };
        assert!((steps.cost() - 0.005).abs() < 1e-12 && steps.cost() < ACCEPTED);
        assert!((steps.cost_without_plan() - 0.1).abs() < 1e-12);
    }
}
