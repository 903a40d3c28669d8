//! The page: one self-contained HTML file with all plots.

use crate::figures;
use crate::findings::{seen, seen_over_time};
use crate::glance;
use crate::methods::Method;
use crate::number::short;
use crate::overview::overview;
use crate::piles::{Bound, Heap};
use crate::plot::escape;
use crate::stability::{Check, Verdicts};
use crate::study::Study;
use crate::unneeded::{self, Costs};
use std::fmt::Write;

/// Where the measurements come from.
#[derive(Clone, Debug)]
pub struct Origin {
    /// Processor, number of cores, and operating system.
    pub machine: String,
    /// Commit of the source.
    pub commit: String,
    pub date: String,
    /// The compiler that built the measuring program.
    pub compiler: String,
    /// Whether this was a quick run.
    pub quick: bool,
}

pub struct Results {
    pub origin: Origin,
    /// The methods that took part.
    pub methods: Vec<Method>,
    pub studies: Vec<Study>,
    pub heaps: Vec<Heap>,
    pub cases: Vec<Verdicts>,
    /// Results for systems whose individual bodies move chaotically but whose means and variances are known.
    pub ensembles: Vec<Verdicts>,
    /// Cost of unused features, if it was measured.
    pub costs: Option<Costs>,
}

impl Results {
    /// Names of the solvers in the stability cases.
    pub fn solvers(&self) -> Vec<&'static str> {
        self.methods.iter().filter(|method| method.in_stability).map(|method| method.name).collect()
    }
}

const STYLE: &str = include_str!("page.css");

/// How times were taken and how to read the plots.
pub const READING: [&str; 7] = [
    "Times are processor time of one thread, so waiting for a busy core does not count. All points \
     of a problem are run once for their errors and then again and again in turns; a point's time \
     is its best run. The tables give the median beside it: the spread.",
    "They hold on the machine named above only. What carries over is the ratio of two points of one \
     plot, and the second plot of each row, whose work counts bodies moved and pairs solved (a pair \
     once a pass) and is the same on every machine. Peers do not tell their work and are not in it.",
    "Every curve is one method, every point one setting of its knob. A ring marks the setting that \
     scenes, or users of a peer, get by default. Filled points form the Pareto set of the engines: \
     nothing else is clearly (5 %) better in time or error and no worse in the other. Grey curves are textbook integrators of this \
     report, in f64 unless named otherwise: yardsticks, no part of Jostle and not in the Pareto set.",
    "The dotted line is half a unit in the last place of f32 at the problem's largest number: an \
     engine that keeps its state in f32 can be below it only by luck or because the answer is exact.",
    "Errors of 0 have no logarithm; they are drawn at the lower edge, where the axis says 0.",
    "The slope is that of log error against log step, by least squares over the points up to the most \
     precise one that are at least four floors high: 1 is a method of first order.",
    "Jostle's relaxation leaves its passes early when nothing is left to correct: the knob is a cap. \
     The conjugate solver sweeps until no relative speed changes by more than its tolerance, a share \
     of what gravity gives in a step.",
];

/// The text below the picture at the head of the page.
pub const GLANCE: &str = "Every point on the left is one setting of one engine: its error and its time on each problem, \
     relative to the most precise setting of the best peer there, and the medians of both over the problems. A curve \
     goes through the settings of one knob; filled points are defaults, and rings mark what the shipped scenes use. On the right the defaults of both \
     solvers and of the peers on each problem. Errors below the rounding floor of f32 count as the floor; what lies \
     beyond an axis is drawn at its edge.";

pub fn html(results: &Results) -> String {
    let mut page = String::new();
    let origin = &results.origin;
    let effort = if origin.quick { "quick run" } else { "full run" };
    let _ = write!(
        page,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>Jostle: error against run time, and stability</title>\n<style>\n{STYLE}</style>\n\
         </head>\n<body>\n<h1>Jostle: error against run time, and stability</h1>\n\
         <p class=\"origin\">{} · commit {} · {} · {} · {effort}</p>\n",
        escape(&origin.machine),
        escape(&origin.commit),
        escape(&origin.date),
        escape(&origin.compiler),
    );
    contents(results, &mut page);
    if let Some(svg) = glance::svg(&results.studies, &results.methods) {
        let _ = writeln!(page, "<figure id=\"glance\">\n{svg}</figure>\n<p>{}</p>", escape(GLANCE));
    }
    page.push_str("<h2 id=\"reading\">How to read this, and how times were taken</h2>\n<ul>\n");
    for line in READING {
        let _ = writeln!(page, "<li>{}</li>", escape(line));
    }
    page.push_str("</ul>\n");
    overview(results, &mut page);
    page.push_str("<h2 id=\"precision\">Error against time</h2>\n");
    for study in &results.studies {
        problem(study, &results.methods, &mut page);
    }
    piles(results, &mut page);
    stability(results, &mut page);
    ensembles(results, &mut page);
    unneeded::section(results, &mut page);
    page.push_str("</body>\n</html>\n");
    page
}

fn contents(results: &Results, page: &mut String) {
    page.push_str("<nav><a href=\"#reading\">How to read</a> <a href=\"#overview\">Overview</a> ");
    for study in &results.studies {
        let id = study.problem.id;
        let _ =
            write!(page, "<a href=\"#p{id}\" title=\"{}\">{id}</a> ", escape(study.problem.title));
    }
    page.push_str(
        "<a href=\"#piles\">Piles</a> <a href=\"#stability\">Stability</a> \
         <a href=\"#ensembles\">Ensembles</a>",
    );
    if results.costs.is_some() {
        page.push_str(" <a href=\"#unneeded\">Nothing unneeded</a>");
    }
    page.push_str("</nav>\n");
}

fn problem(study: &Study, methods: &[Method], page: &mut String) {
    let problem = &study.problem;
    let _ = writeln!(
        page,
        "<section id=\"p{}\">\n<h3>{}. {}</h3>\n<p>{}</p>\n<p><b>Right answer:</b> {}.</p>",
        problem.id,
        problem.id,
        escape(problem.title),
        escape(problem.about),
        escape(problem.reference)
    );
    let _ = writeln!(page, "<figure>\n{}</figure>", figures::of_study(study, methods).svg());
    page.push_str("<p><b>What is seen.</b></p>\n<ul>\n");
    for sentence in seen(study) {
        let _ = writeln!(page, "<li>{}</li>", escape(&sentence));
    }
    page.push_str("</ul>\n");
    if !study.omissions.is_empty() {
        page.push_str("<p><b>Omissions.</b></p>\n<ul>\n");
        for omission in &study.omissions {
            let _ =
                writeln!(page, "<li>{}: {}.</li>", escape(&omission.what), escape(&omission.why));
        }
        page.push_str("</ul>\n");
    }
    numbers(study, page);
    page.push_str("</section>\n");
}

/// Writes a table. It has thousands of cells, so end tags and quotes that HTML does not need are omitted.
fn numbers(study: &Study, page: &mut String) {
    let _ = write!(
        page,
        "<details><summary>All numbers ({} timed runs of each point; problems.csv)</summary>\n\
         <table class=numbers><thead><tr><th>Setting",
        study.rounds
    );
    for norm in study.problem.norms {
        let unit = if norm.unit.is_empty() { String::new() } else { format!(", {}", norm.unit) };
        let _ = write!(page, "<th>{}{unit}", escape(norm.name));
    }
    page.push_str("<th>µs a tick, best<th>median<th>Work a tick<th>Pareto\n");
    let columns = study.problem.norms.len() + 5;
    for curve in &study.curves {
        let (name, knob) = (escape(curve.method.name), curve.method.knob);
        let _ = writeln!(page, "<tbody><tr><th colspan={columns}>{name}: {knob}");
        for point in &curve.points {
            let _ = write!(page, "<tr><td>{}", point.setting);
            for error in &point.errors {
                let _ = write!(page, "<td>{}", short(*error));
            }
            let work = point.work.map_or_else(|| "not told".into(), short);
            let pareto = if point.pareto { "yes" } else { "" };
            let (best, median) = (short(point.best_us), short(point.median_us));
            let _ = writeln!(page, "<td>{best}<td>{median}<td>{work}<td>{pareto}");
        }
    }
    page.push_str("</table></details>\n");
}

fn piles(results: &Results, page: &mut String) {
    page.push_str(
        "<h2 id=\"piles\">Piles</h2>\n<p>Large heaps, high stacks and heavy loads: gravity 50, boxes 2 high, friction 0.3, \
         60 steps a second, sleeping off unless said otherwise, each solver at its defaults. The solvers take turns of ten \
         steps; times are processor time of one thread. Where the worst step counts, the run is repeated, and each step counts with \
         the shorter of its times. Where chance \
         decides what happens, figures are those of three seeds: the largest of what happens once in a run, else the mean. What \
         is accepted is asked of Jostle's best solver; the others stand beside it.</p>\n<table class=\"cases piles\">\n<thead><tr><th>Pile</th><th>Accepted</th>",
    );
    for solver in results.solvers() {
        let _ = write!(page, "<th>{}</th>", escape(solver));
    }
    page.push_str("</tr></thead>\n");
    results.heaps.iter().for_each(|heap| heap_rows(heap, page));
    page.push_str("</table>\n");
}

fn heap_rows(heap: &Heap, page: &mut String) {
    let columns = heap.measured.len() + 2;
    let _ = writeln!(
        page,
        "<tbody>\n<tr class=case><th colspan={columns}>{}",
        escape(&heap.pile.title)
    );
    for (index, (figure, bound)) in heap.pile.bounds.iter().enumerate() {
        let _ = write!(page, "<tr><td>{}<td>{}", figure.name(), within(*bound));
        for solver in 0..heap.measured.len() {
            match heap.figure(solver, index) {
                Some((value, Some(passes))) => judged(passes, value, page),
                Some((value, None)) => {
                    let _ = write!(page, "<td>{}", short(value));
                }
                None => page.push_str("<td class=none>n/a"),
            }
        }
        page.push('\n');
    }
}

/// Writes a cell with a figure, marked as accepted or rejected.
fn judged(passes: bool, value: f64, page: &mut String) {
    let class = if passes { "pass" } else { "fail" };
    let _ = write!(page, "<td class={class}>{}", short(value));
}

/// Describes the accepted range of a pile's figure.
pub fn within(bound: Bound) -> String {
    match bound {
        Bound::None => String::new(),
        Bound::Value(most) => format!("≤ {}", short(most)),
        Bound::OfPeer(factor) => format!("≤ {} of Box2D's", short(factor)),
    }
}

fn stability(results: &Results, page: &mut String) {
    let solvers = results.solvers();
    page.push_str("<h2 id=\"stability\">Stability</h2>\n");
    page.push_str(
        "<p>Boxes of 1 unit, gravity 10, 60 steps a second, sleeping off, unless said otherwise. \
         Overlap is judged by this report's own geometry in f64, after every tick. A figure in red \
         is beyond what is accepted; nothing was tuned to pass. Each solver runs at its defaults.</p>\n",
    );
    page.push_str("<p>");
    for (index, solver) in solvers.iter().enumerate() {
        let verdicts = results.cases.iter().filter_map(|case| case.outcomes[index].verdict());
        let green = verdicts.clone().filter(|verdict| *verdict).count();
        let _ = write!(
            page,
            "<b>{}</b>: {green} of {} cases green. ",
            escape(solver),
            verdicts.count()
        );
    }
    page.push_str("</p>\n");
    case_table(&results.cases, &solvers, page);
    page.push_str("<h3>Over time</h3>\n");
    for case in &results.cases {
        let Some(figure) = figures::of_stability(case, &results.methods) else { continue };
        let variant = case.outcomes.iter().find_map(|o| o.series.as_ref()).map_or("", |s| &s.0);
        let comma = if variant.is_empty() { "" } else { ", " };
        let _ = writeln!(
            page,
            "<h4>{} {}{comma}{}</h4>\n<figure>\n{}</figure>",
            case.case.id,
            escape(case.case.title),
            escape(variant),
            figure.svg()
        );
        let sentences = seen_over_time(case, &solvers);
        let _ = writeln!(page, "<p>{}</p>", escape(&sentences.join(" ")));
    }
}

fn ensembles(results: &Results, page: &mut String) {
    page.push_str("<h2 id=\"ensembles\">Ensembles</h2>\n");
    let _ = writeln!(page, "<p>{}</p>", escape(ENSEMBLES));
    case_table(&results.ensembles, &results.solvers(), page);
}

/// The text above the ensembles.
pub const ENSEMBLES: &str = "What is chaos body by body has means and variances that are known. The gas: 100 \
    discs of radius 0.5 in a box of 120 by 120, speeds to about 75, without friction and gravity; the \
    pressure on the walls against that of the law of gases at the energy of the start, with the second \
    virial coefficient of the discs (1 %; walls are told from other discs by where a speed turns round, \
    to about 1 %), and the speeds against Maxwell's law. Emitters: how many, how \
    fast and how long, in standard errors of as many independent draws.";

fn case_table(cases: &[Verdicts], solvers: &[&str], page: &mut String) {
    page.push_str(
        "<table class=\"cases\">\n<thead><tr><th>Variant</th><th>Metric</th><th>Accepted</th>",
    );
    for solver in solvers {
        let _ = write!(page, "<th>{}</th>", escape(solver));
    }
    page.push_str("</tr></thead>\n");
    cases.iter().for_each(|case| case_rows(case, page));
    page.push_str("</table>\n");
}

fn case_rows(case: &Verdicts, page: &mut String) {
    let title = escape(case.case.title);
    let _ = write!(page, "<tbody>\n<tr class=case><th colspan=3>{} {title}", case.case.id);
    for outcome in &case.outcomes {
        let (class, word) = match outcome.verdict() {
            Some(true) => ("pass", "green"),
            Some(false) => ("fail", "red"),
            None => ("none", "not applicable"),
        };
        let why = outcome
            .not_applicable
            .as_deref()
            .map_or_else(String::new, |why| format!(": {}", escape(why)));
        let _ = write!(page, "<td class={class}>{word}{why}");
    }
    page.push('\n');
    let Some(rows) = case.outcomes.iter().map(|outcome| &outcome.checks).max_by_key(|c| c.len())
    else {
        return;
    };
    for (index, row) in rows.iter().enumerate() {
        let variant = escape(&row.variant);
        let _ = write!(page, "<tr><td>{variant}<td>{}<td>{}", row.metric, accepted(row));
        for outcome in &case.outcomes {
            match outcome.checks.get(index) {
                Some(check) => judged(check.passes(), check.measured, page),
                None => page.push_str("<td>"),
            }
        }
        page.push('\n');
    }
}

fn accepted(check: &Check) -> String {
    if check.accepted == 0.0 { "0".into() } else { format!("≤ {}", short(check.accepted)) }
}
