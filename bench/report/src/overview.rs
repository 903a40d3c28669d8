//! The head of the page: all problems in one table, Jostle's results against its peers, and the point on the curves
//! that corresponds to each shipped scene.

use crate::findings::{Tally, comparisons, listed, tally};
use crate::methods::{Family, SOLVERS};
use crate::number::short;
use crate::page::Results;
use crate::plot::escape;
use crate::study::{Curve, Point, Study};
use std::fmt::Write;

/// The meaning of "better", for the page and the summary.
pub const RULE: &str = "Any of Jostle's points may answer a peer's. Better means: against each of \
    the peer's settings, at most a tenth of its error in its time and at most a third of its time for \
    its error, with errors below the floor of f32 counted as the floor. Ahead means: less error in its \
    time and less time for its error, but short of these margins. Anything else is a loss. A problem \
    with parts (4a, 4b, 4c) counts as what the worst of its parts is.";

/// How the peers simulate features that they lack.
pub const PEERS: &str = "The peers run with rotation locked, sleeping off and speed caps raised, at 1 to \
    16 sub-steps; where gravity is 50 and bodies touch, also with a length unit of 5, and whatever \
    setting is better counts. Linear drag is their own linear damping, wind a constant force beside it (for \
    Box2D divided by 1 + k h, since it damps before it pushes). \
    Quadratic drag, and springs of no length as long as they turn by less than a radian in a sub-step, \
    are forces applied anew before every sub-step (sub-steps are then steps of their own): with their \
    joints the error is larger, since these are damped. Springs with a length, and stiffer ones, are \
    their joints: Box2D's distance joint with a spring, rapier2d's spring joint.";

/// Returns a sentence about each of a tally's three lists.
pub fn standing(tally: &Tally) -> String {
    let count = tally.won.len() + tally.ahead.len() + tally.lost.len();
    format!(
        "Better than every peer on {} of {count} problems ({}); ahead on {} more ({}); not on {} ({}).",
        tally.won.len(),
        listed(&tally.won),
        tally.ahead.len(),
        listed(&tally.ahead),
        tally.lost.len(),
        listed(&tally.lost)
    )
}

/// Writes the overview section of the page.
pub fn overview(results: &Results, page: &mut String) {
    page.push_str(
        "<h2 id=\"overview\">Overview</h2>\n<div class=\"wide\"><table>\n<thead><tr><th>Problem</th>\
         <th>Error norm</th><th>Relaxation: error</th><th>µs a tick</th><th>Conjugate: error</th>\
         <th>µs a tick</th><th>Best of Jostle: error</th><th>µs a tick</th><th>f32 floor</th>\
         <th>Against peers</th></tr></thead>\n<tbody>\n",
    );
    for study in &results.studies {
        row(study, page);
    }
    page.push_str("</tbody>\n</table></div>\n");
    against(results, page);
    scenes(results, page);
}

fn row(study: &Study, page: &mut String) {
    let problem = &study.problem;
    let norm = &problem.norms[0];
    let unit = if norm.unit.is_empty() { String::new() } else { format!(", {}", norm.unit) };
    let _ = write!(
        page,
        "<tr><td><a href=\"#p{id}\">{id} {}</a></td><td>{}{unit}</td>",
        escape(problem.title),
        norm.name,
        id = problem.id
    );
    let defaults = SOLVERS.map(|solver| study.default_of(solver));
    for point in defaults.into_iter().chain([study.best(Family::Jostle)]) {
        let (error, time) = match point {
            Some((_, point)) => (short(point.errors[0]), short(point.best_us)),
            None => ("n/a".into(), String::new()),
        };
        let _ = write!(page, "<td class=\"n\">{error}</td><td class=\"n\">{time}</td>");
    }
    let floor = short(problem.floor());
    let _ = writeln!(page, "<td class=\"n\">{floor}</td><td>{}</td></tr>", verdicts(study));
}

fn verdicts(study: &Study) -> String {
    let of = |c: &crate::findings::Comparison| {
        let class = match c.verdict() {
            "LOSS" => "fail",
            "better" => "pass",
            _ => "none",
        };
        format!("{}: <span class=\"{class}\">{}</span>", escape(c.peer), c.verdict())
    };
    let verdicts: Vec<String> = comparisons(study).iter().map(of).collect();
    if verdicts.is_empty() { "not measured".into() } else { verdicts.join("<br>") }
}

fn against(results: &Results, page: &mut String) {
    let tally = tally(&results.studies);
    if tally == Tally::default() {
        page.push_str("<p>Peers were not measured in this run (<code>--peers</code>).</p>\n");
        return;
    }
    let _ = writeln!(page, "<p><b>{}</b> {RULE}</p>\n<p>{PEERS}</p>", standing(&tally));
    page.push_str("<p><b>Losses, and leads short of the margins.</b></p>\n<ul>");
    for short in &tally.short {
        let _ = writeln!(page, "<li>{}</li>", escape(short));
    }
    page.push_str("</ul>\n");
}

/// Lists the solver and setting of each shipped scene, and its point on the curves.
fn scenes(results: &Results, page: &mut String) {
    page.push_str("<h3 id=\"scenes\">What the shipped scenes use</h3>\n<ul>\n");
    for sentence in scene_sentences(&results.studies) {
        let _ = writeln!(page, "<li>{}</li>", escape(&sentence));
    }
    page.push_str("</ul>\n");
}

/// Names of the shipped scenes that use a solver of [`SOLVERS`] with its defaults.
pub fn scenes_with(solver: usize) -> Vec<String> {
    let uses = |scene: &jostle_game::Scene| match scene.world.solver {
        Some(jostle_sim::Solver::Relaxation(settings)) => {
            solver == 0 && settings == Default::default()
        }
        Some(jostle_sim::Solver::Conjugate(settings)) => {
            solver == 1 && settings == Default::default()
        }
        None => false,
    };
    jostle_game::Scene::built_in().into_iter().filter(uses).map(|scene| scene.name).collect()
}

/// Returns the same list as sentences, one per setting in use.
pub fn scene_sentences(studies: &[Study]) -> Vec<String> {
    let scenes = jostle_game::Scene::built_in();
    let mut sentences = Vec::new();
    for (solver, method) in SOLVERS.iter().enumerate() {
        let names = scenes_with(solver);
        let names = if names.is_empty() { "No scene".into() } else { names.join(", ") };
        let (on, of) = on_pareto(studies, method);
        let costs = beside_best(studies, method);
        sentences.push(format!(
            "{names}: {method}, 1 step a tick. On the Pareto set of all engines in {on} of the {of} \
             problems and parts that it plays; where it is not exact its error is {} times that of \
             Jostle's most precise point, in {} of that point's time (medians).",
            short(costs.0),
            short(costs.1)
        ));
    }
    for scene in &scenes {
        if let Some(other) = unusual(scene) {
            sentences.push(format!("{}: {other}.", scene.name));
        }
    }
    sentences
}

/// Describes a scene whose solver settings differ from those that were measured.
fn unusual(scene: &jostle_game::Scene) -> Option<String> {
    match scene.world.solver {
        None => Some("contacts are detected only, nothing is solved".into()),
        Some(jostle_sim::Solver::Relaxation(settings)) => {
            (settings != Default::default()).then(|| format!("{settings:?}"))
        }
        Some(jostle_sim::Solver::Conjugate(settings)) => {
            (settings != Default::default()).then(|| format!("{settings:?}"))
        }
    }
}

fn on_pareto(studies: &[Study], method: &str) -> (usize, usize) {
    let points = studies.iter().filter_map(|study| study.default_of(method));
    let all: Vec<(&Curve, &Point)> = points.collect();
    (all.iter().filter(|(_, point)| point.pareto).count(), all.len())
}

/// Median error and time of a method's default setting, relative to Jostle's most precise point.
fn beside_best(studies: &[Study], method: &str) -> (f64, f64) {
    let mut errors = Vec::new();
    let mut times = Vec::new();
    for study in studies {
        let (Some((_, point)), Some((_, best))) =
            (study.default_of(method), study.best(Family::Jostle))
        else {
            continue;
        };
        if point.errors[0] > study.problem.floor() {
            errors.push(point.errors[0] / best.errors[0].max(study.problem.floor()));
            times.push(point.best_us / best.best_us);
        }
    }
    (median(errors), median(times))
}

/// Returns the median, or the upper one if the number of values is even; NaN if there are no values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::scene_sentences;

    #[test]
    fn every_shipped_scene_is_mentioned() {
        let all = scene_sentences(&[]).join("\n");
        for scene in jostle_game::Scene::built_in() {
            assert!(all.contains(&scene.name), "{} is missing from {all}", scene.name);
        }
    }
}
