//! What a feature costs a scene that does not use it: instructions of a step, counted by callgrind,
//! bytes on the wire, and what the page makes.
//!
//! The programs that are counted are builds of `sim/examples/steps.rs`: one as it is shipped, and
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
    solver: &'static str,
    /// A name that `JOSTLE_LEAVE_OUT` knows.
    feature: &'static str,
    /// Boxes or circles; strangers are boxes that do not meet.
    scene: &'static str,
    /// Whether a plan can name it though no body has it.
    is_named: bool,
}

const fn row(solver: &'static str, feature: &'static str, scene: &'static str) -> Row {
    Row { solver, feature, scene, is_named: true }
}

/// Of what no plan can name: bodies have it or not.
const fn bare(solver: &'static str, feature: &'static str, scene: &'static str) -> Row {
    Row { solver, feature, scene, is_named: false }
}

const ROWS: [Row; 18] = [
    row("relaxation", "friction", "boxes"),
    row("relaxation", "restitution", "boxes"),
    row("relaxation", "circles", "boxes"),
    row("relaxation", "boxes", "circles"),
    row("relaxation", "particles", "boxes"),
    bare("relaxation", "forces", "boxes"),
    bare("relaxation", "kinematic", "boxes"),
    bare("relaxation", "touches", "strangers"),
    row("conjugate", "friction", "boxes"),
    row("conjugate", "restitution", "boxes"),
    row("conjugate", "circles", "boxes"),
    row("conjugate", "boxes", "circles"),
    row("conjugate", "particles", "boxes"),
    bare("conjugate", "forces", "boxes"),
    bare("conjugate", "sleeping", "boxes"),
    bare("conjugate", "kinematic", "boxes"),
    bare("conjugate", "continuous", "boxes"),
    bare("conjugate", "touches", "strangers"),
];

/// What a feature is called in the tables.
fn title(feature: &'static str) -> &'static str {
    match feature {
        "kinematic" => "kinematic bodies",
        "continuous" => "continuous collision",
        "touches" => "impact events",
        other => other,
    }
}

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
    /// As shipped, had the plan named it; `None` where no plan can.
    pub named: Option<f64>,
}

impl Steps {
    /// Share that the feature costs though it is not used.
    pub fn cost(&self) -> f64 {
        self.planned / self.without - 1.0
    }

    /// Share that it would cost without a plan; `None` where no plan can name it.
    pub fn cost_without_plan(&self) -> Option<f64> {
        self.named.map(|named| named / self.without - 1.0)
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
    /// Whether the page needs what draws particles.
    pub draws_particles: bool,
}

impl Bytes {
    /// What the page makes for it, beside what it makes for every scene.
    fn on_the_page(&self) -> &'static str {
        if self.draws_particles { PARTICLES_ON_THE_PAGE } else { "nothing" }
    }
}

const PARTICLES_ON_THE_PAGE: &str = "1 pipeline, 1 texture (16 KiB), 1 vertex buffer";

/// All that was measured.
#[derive(Clone, Debug, Default)]
pub struct Costs {
    /// Empty where valgrind is missing.
    pub steps: Vec<Steps>,
    /// By feature.
    pub bytes: Vec<Bytes>,
}

/// Measures with the programs in a directory: `shipped`, one by the name of each feature, and `bytes`.
pub fn measure(programs: &Path) -> Result<Costs> {
    let steps = if has_valgrind() { count_all(programs)? } else { Vec::new() };
    Ok(Costs { steps, bytes: bytes(&programs.join("bytes"))? })
}

fn has_valgrind() -> bool {
    Command::new("valgrind").arg("--version").output().is_ok_and(|said| said.status.success())
}

fn count_all(programs: &Path) -> Result<Vec<Steps>> {
    on_all_cores(&ROWS, |row| count_row(row, programs)).into_iter().collect()
}

fn count_row(row: &Row, programs: &Path) -> Result<Steps> {
    let Row { feature, solver, scene, is_named } = *row;
    let shipped = programs.join("shipped");
    let count = |program: &PathBuf, named: Option<&str>| -> Result<(f64, String)> {
        let [short, long] = STEPS;
        let whole = |steps| counted(program, [solver, scene], steps, named);
        let ((few, _), (many, hash)) = (whole(short)?, whole(long)?);
        Ok(((many - few) / f64::from(long - short), hash))
    };
    let (without, bare_hash) = count(&programs.join(feature), None)?;
    let (planned, hash) = count(&shipped, None)?;
    let named = is_named.then(|| count(&shipped, Some(feature))).transpose()?;
    let same = |(_, other): &(f64, String)| *other == hash;
    if bare_hash != hash || !named.iter().all(same) {
        bail!("{solver}, {scene}: the world is another one without {feature}");
    }
    let named = named.map(|(count, _)| count);
    Ok(Steps { feature: title(feature), solver, scene, without, planned, named })
}

/// Instructions of a whole run, as callgrind tells them, and the hash of its world.
fn counted(
    program: &Path,
    world: [&str; 2],
    steps: u32,
    named: Option<&str>,
) -> Result<(f64, String)> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
    command.args(world).arg(steps.to_string()).args(named);
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

fn bytes(program: &Path) -> Result<Vec<Bytes>> {
    let output = Command::new(program).output();
    let output = output.with_context(|| format!("cannot run {}", program.display()))?;
    let said = String::from_utf8(output.stdout).context("a table of bytes")?;
    said.lines().skip(1).map(bytes_of).collect()
}

/// One line: a quoted name and four numbers, the second of which may be missing.
fn bytes_of(line: &str) -> Result<Bytes> {
    let (feature, numbers) =
        line.trim_start_matches('"').split_once("\",").context("a quoted name")?;
    let mut numbers = numbers.split(',').map(|number| number.parse::<f64>().ok());
    let mut next = || numbers.next().with_context(|| format!("four columns in {line:?}"));
    let (lacking, unused, used, particles) = (next()?, next()?, next()?, next()?);
    let need = |number: Option<f64>| number.with_context(|| format!("numbers in {line:?}"));
    let (feature, draws_particles) = (feature.to_owned(), need(particles)? > 0.0);
    Ok(Bytes { feature, lacking: need(lacking)?, unused, used: need(used)?, draws_particles })
}

/// The numbers behind the section.
pub fn csv(costs: &Costs) -> String {
    let mut text =
        "feature,solver,scene,instructions without,planned,named,cost,cost without plan\n"
            .to_owned();
    for steps in &costs.steps {
        let Steps { feature, solver, scene, without, planned, named } = steps;
        let cost = steps.cost();
        let named = named.map_or_else(String::new, |named| format!("{named:.0}"));
        let unplanned = steps.cost_without_plan().map_or_else(String::new, |c| format!("{c:.5}"));
        let _ = writeln!(
            text,
            "{feature},{solver},{scene},{without:.0},{planned:.0},{named},{cost:.5},{unplanned}"
        );
    }
    text
}

/// What stands above the tables.
pub const ABOUT: &str = "A scene is compiled to a plan when it loads, and what the plan leaves out \
    is skipped: loops of a step, sections of a message, pipelines of the page. Instructions a step are \
    counted by callgrind, on a bare world of 80 bodies that rains, lands and rests, in a build that can not do \
    the thing at all, in the shipped one, and in the shipped one with a plan that names it though no \
    body has it. Forces, sleeping, kinematic bodies and continuous collision are not named: a step asks the \
    settings for the first two, each body whether it is pushed, and itself whether anybody is fast; the column \
    of costs says what asking costs. Impact events come from the list of who touches whom, which is there \
    for every scene in which two groups meet; strangers are boxes of groups that do not. All builds of a row \
    end with the same hash, or the count fails. A part that builds differently moves a few instructions of \
    its neighbours: a cost may be negative.";

/// Where there is nothing that a plan could name.
const NO_PLAN: &str = "nothing to name";

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
                steps.cost_without_plan().map_or_else(|| NO_PLAN.into(), percent),
            );
        }
        page.push_str("</tbody>\n</table>\n");
    }
    page.push_str(
        "<p>Bytes of a snapshot, mean of 600 ticks, one player with a hero at rest:</p>\n<table>\n\
         <thead><tr><th>Feature</th><th>Lacking</th><th>There, not used</th><th>Used</th><th>Makes on the page</th></tr></thead>\n<tbody>\n",
    );
    for bytes in &costs.bytes {
        let unused = bytes.unused.map_or("works by itself".to_owned(), |n| format!("{n:.2}"));
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td class=\"n\">{:.2}</td><td class=\"n\">{unused}</td>\
             <td class=\"n\">{:.2}</td><td>{}</td></tr>",
            escape(&bytes.feature),
            bytes.lacking,
            bytes.used,
            bytes.on_the_page()
        );
    }
    let _ = writeln!(page, "</tbody>\n</table>\n<p>{}</p>", escape(PAGE));
}

/// What the page makes, as the browser test `needs.rs` finds it.
const PAGE: &str = "The page makes 2 pipelines (ground, solids) and one texture (light, 16 KiB) for \
    every scene, and what draws particles as soon as a scene that can make some is shown, not before. A \
    browser test counts programs and textures at the WebGL context. The download is the same for all \
    scenes; the sprite of particles is 4 KiB of it. Friction, restitution, forces, sleeping and continuous \
    collision are nothing that a message or the page knows of.";

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
            let cost = percent(steps.cost());
            let unplanned = steps.cost_without_plan().map_or_else(|| NO_PLAN.into(), percent);
            let _ = writeln!(
                text,
                "| {feature} | {solver} | {scene} | {without:.0} | {planned:.0} | {cost} | {unplanned} |"
            );
        }
    }
    text.push_str(
        "\n| feature | bytes a tick, lacking | there, not used | used | makes on the page |\n\
         | --- | --- | --- | --- | --- |\n",
    );
    for bytes in &costs.bytes {
        let Bytes { feature, lacking, unused, used, .. } = bytes;
        let unused = unused.map_or("works by itself".to_owned(), |n| format!("{n:.2}"));
        let page = bytes.on_the_page();
        let _ = writeln!(text, "| {feature} | {lacking:.2} | {unused} | {used:.2} | {page} |");
    }
    let _ = writeln!(text, "\n{PAGE}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_bytes_is_read_or_refused() {
        let bytes = bytes_of("\"made bodies, impacts\",6.150,,425.743,0").expect("a good line");
        assert_eq!((bytes.feature.as_str(), bytes.unused), ("made bodies, impacts", None));
        assert_eq!((bytes.lacking, bytes.used), (6.15, 425.743));
        assert!(!bytes.draws_particles);
        assert!(bytes_of("\"particles\",6.1,6.1,7,1").expect("a good line").draws_particles);
        assert!(bytes_of("\"particles\",6.1,6.1,7").is_err());
        assert!(bytes_of("\"particles\",6.1,6.1,much,1").is_err());
    }

    #[test]
    fn a_cost_is_a_share_of_the_build_without() {
        let steps = Steps {
            feature: "friction",
            solver: "relaxation",
            scene: "boxes",
            without: 1000.0,
            planned: 1005.0,
            named: Some(1100.0),
        };
        assert!((steps.cost() - 0.005).abs() < 1e-12 && steps.cost() < ACCEPTED);
        assert!((steps.cost_without_plan().expect("named") - 0.1).abs() < 1e-12);
    }
}
