//! The summary in Markdown: the page's tables without its plots.

use crate::findings::{Tally, comparisons, tally};
use crate::methods::{Family, SOLVERS};
use crate::number::short;
use crate::overview::{PEERS, RULE, scene_sentences, standing};
use crate::page::{ENSEMBLES, GLANCE, Results, within};
use crate::unneeded;
use std::fmt::Write;

pub fn markdown(results: &Results) -> String {
    let origin = &results.origin;
    let effort = if origin.quick { "quick run" } else { "full run" };
    let has_peers = results.studies.iter().any(|study| study.best(Family::Peer).is_some());
    let picture = match has_peers {
        true => {
            format!("![Error against time of all engines]({})\n\n{}\n\n", crate::GLANCE, GLANCE)
        }
        false => String::new(),
    };
    let mut text = format!(
        "# Error against run time, and stability\n\n{}; commit {}; {}; {}; {effort}.\n\n{picture}\
         ## Error against time\n\n\
         Times are microseconds of processor time a tick, best of interleaved runs.\n\n\
         | problem | error | relaxation: error | time | conjugate: error | time | best of Jostle: error | time | f32 floor | peers |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        origin.machine, origin.commit, origin.date, origin.compiler
    );
    for study in &results.studies {
        let norm = &study.problem.norms[0];
        let unit = if norm.unit.is_empty() { String::new() } else { format!(", {}", norm.unit) };
        let cells = |point: Option<(&crate::study::Curve, &crate::study::Point)>| match point {
            Some((_, point)) => format!("{} | {}", short(point.errors[0]), short(point.best_us)),
            None => "n/a | n/a".into(),
        };
        let peers: Vec<String> =
            comparisons(study).iter().map(|c| format!("{}: {}", c.peer, c.verdict())).collect();
        let _ = writeln!(
            text,
            "| {} {} | {}{unit} | {} | {} | {} | {} | {} |",
            study.problem.id,
            study.problem.title,
            norm.name,
            cells(study.default_of(SOLVERS[0])),
            cells(study.default_of(SOLVERS[1])),
            cells(study.best(Family::Jostle)),
            short(study.problem.floor()),
            if peers.is_empty() { "not measured".into() } else { peers.join("; ") }
        );
    }
    let tally = tally(&results.studies);
    if tally != Tally::default() {
        let _ = writeln!(text, "\n{} {RULE}\n\n{PEERS}\n", standing(&tally));
        text.push_str("Losses, and leads short of the margins:\n\n");
        tally.short.iter().for_each(|short| text.push_str(&format!("- {short}\n")));
    }
    text.push_str("\n## What the shipped scenes use\n\n");
    for sentence in scene_sentences(&results.studies) {
        let _ = writeln!(text, "- {sentence}");
    }
    piles(results, &mut text);
    stability(results, &mut text);
    ensembles(results, &mut text);
    unneeded::markdown(results, &mut text);
    omissions(results, &mut text);
    text
}

fn piles(results: &Results, text: &mut String) {
    let solvers = results.solvers();
    text.push_str("\n## Piles\n\nBold: beyond what is accepted of Jostle's best solver.\n\n| pile | figure | accepted |");
    solvers.iter().for_each(|solver| text.push_str(&format!(" {solver} |")));
    let _ = writeln!(text, "\n| --- | --- | --- |{}", " --- |".repeat(solvers.len()));
    for heap in &results.heaps {
        for (place, (figure, bound)) in heap.pile.bounds.iter().enumerate() {
            let title = if place == 0 { heap.pile.title.as_str() } else { "" };
            let _ = write!(text, "| {title} | {} | {} |", figure.name(), within(*bound));
            for solver in 0..solvers.len() {
                let cell = match heap.figure(solver, place) {
                    None => "n/a".into(),
                    Some((value, Some(false))) => format!("**{}**", short(value)),
                    Some((value, _)) => short(value),
                };
                let _ = write!(text, " {cell} |");
            }
            text.push('\n');
        }
    }
}

fn stability(results: &Results, text: &mut String) {
    let solvers = results.solvers();
    let _ = write!(
        text,
        "\n## Stability\n\nFailed figures are listed with what was accepted.\n\n| case |"
    );
    for solver in &solvers {
        let _ = write!(text, " {solver} |");
    }
    let _ = writeln!(text, "\n| --- |{}", " --- |".repeat(solvers.len()));
    for case in &results.cases {
        let _ = write!(text, "| {} {} |", case.case.id, case.case.title);
        for outcome in &case.outcomes {
            let cell = match outcome.verdict() {
                None => {
                    format!("not applicable: {}", outcome.not_applicable.as_deref().unwrap_or(""))
                }
                Some(true) => "green".into(),
                Some(false) => {
                    let failed = outcome.checks.iter().filter(|check| !check.passes());
                    let figure = |check: &crate::stability::Check| {
                        let (found, most) = (short(check.measured), short(check.accepted));
                        format!("{} {} {found} (≤ {most})", check.variant, check.metric)
                    };
                    let listed: Vec<String> = failed.map(figure).collect();
                    format!("red: {}", listed.join("; "))
                }
            };
            let _ = write!(text, " {cell} |");
        }
        text.push('\n');
    }
}

fn ensembles(results: &Results, text: &mut String) {
    let solvers = results.solvers();
    let _ = write!(
        text,
        "\n## Ensembles\n\n{ENSEMBLES} Bold: beyond what is accepted.\n\n| ensemble | variant | metric | accepted |"
    );
    solvers.iter().for_each(|solver| text.push_str(&format!(" {solver} |")));
    let _ = writeln!(text, "\n| --- | --- | --- | --- |{}", " --- |".repeat(solvers.len()));
    for case in &results.ensembles {
        let Some(rows) = case.outcomes.iter().map(|out| &out.checks).max_by_key(|c| c.len()) else {
            continue;
        };
        for (place, row) in rows.iter().enumerate() {
            let title = if place == 0 { case.case.title } else { "" };
            let accepted = short(row.accepted);
            let _ = write!(text, "| {title} | {} | {} | {accepted} |", row.variant, row.metric);
            for outcome in &case.outcomes {
                let cell = match outcome.checks.get(place) {
                    None => "n/a".into(),
                    Some(check) if check.passes() => short(check.measured),
                    Some(check) => format!("**{}**", short(check.measured)),
                };
                let _ = write!(text, " {cell} |");
            }
            text.push('\n');
        }
    }
}

fn omissions(results: &Results, text: &mut String) {
    text.push_str("\n## Omissions\n\n");
    for study in &results.studies {
        for omission in &study.omissions {
            let _ = writeln!(
                text,
                "- {} {}: {}: {}.",
                study.problem.id, study.problem.title, omission.what, omission.why
            );
        }
    }
}
