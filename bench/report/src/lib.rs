//! Measures every solver: error against time and work on problems with known answers, and stability in stiff and
//! extreme cases. Writes the results as one page, with the underlying numbers.
//!
//! Peers are added by a program in a separate workspace, which passes them to [`run`].

mod cores;
pub mod csv;
pub mod engine;
pub mod ensembles;
pub mod figures;
pub mod findings;
pub mod glance;
pub mod integrators;
pub mod jostle;
pub mod methods;
pub mod motion;
pub mod number;
pub mod overview;
pub mod page;
pub mod piles;
pub mod plot;
pub mod problems;
mod progress;
pub mod reference;
pub mod scene;
pub mod shape;
pub mod stability;
pub mod study;
pub mod summary;
pub mod traffic;
pub mod trials;
pub mod unneeded;

use anyhow::{Context, Result};
use clap::Parser;
use cores::on_all_cores;
use methods::{METHODS, Method};
use page::{Origin, Results};
use progress::Progress;
use stability::{Case, Verdicts};
use std::fs;
use std::path::{Path, PathBuf};
use study::{Effort, Study};

/// Measures Jostle and writes the report.
#[derive(Clone, Debug, Parser)]
pub struct Arguments {
    /// Take a few minutes instead of an hour, with fewer runs and without the largest variants
    #[arg(long)]
    pub quick: bool,
    /// Output directory for the page, the summary and the tables
    #[arg(long, value_name = "DIR", default_value = "target/report")]
    pub out: PathBuf,
    /// Commit of the source, shown in the report
    #[arg(long, default_value = "unknown")]
    pub commit: String,
    /// Date of the run
    #[arg(long, default_value = "unknown")]
    pub date: String,
    /// Name and version of the compiler
    #[arg(long, default_value = "an unknown compiler")]
    pub compiler: String,
    /// Path of the program `steps`; if given, the cost of unused features is measured too
    #[arg(long, value_name = "PROGRAM")]
    pub costs: Option<PathBuf>,
    /// Run only problems, cases and piles with these ids, such as 9a, S2 or rain-4000
    #[arg(long, value_name = "ID", num_args = 1..)]
    pub only: Vec<String>,
}

/// Measures everything, including the peers, and writes the report.
pub fn run(arguments: &Arguments, peers: &[Method]) -> Result<()> {
    let methods: Vec<Method> = METHODS.iter().chain(peers).copied().collect();
    let wanted = |id: &str| {
        arguments.only.is_empty() || arguments.only.iter().any(|only| only.eq_ignore_ascii_case(id))
    };
    let cases: Vec<Case> = stability::all().into_iter().filter(|case| wanted(case.id)).collect();
    let problems: Vec<_> = problems::all().into_iter().filter(|p| wanted(p.id)).collect();
    let piles: Vec<_> = piles::all()
        .into_iter()
        .filter(|pile| wanted(&pile.id) && !(arguments.quick && pile.full_only))
        .collect();
    let ensembles: Vec<Case> =
        ensembles::ENSEMBLES.into_iter().filter(|case| wanted(case.id)).collect();
    let progress = Progress::new(cases.len() + ensembles.len() + problems.len() + piles.len());
    let costs = arguments.costs.as_deref().map(unneeded::measure).transpose()?;
    let cases = judge_all(&cases, &methods, arguments.quick, &progress);
    let ensembles = judge_all(&ensembles, &methods, arguments.quick, &progress);
    let effort = Effort::of(arguments.quick);
    let mut studies: Vec<Study> = Vec::new();
    for problem in problems {
        progress.begin(&format!("{} {}", problem.id, problem.title));
        studies.push(study::measure(problem, &methods, effort));
        progress.done();
    }
    let mut heaps = Vec::new();
    for pile in piles {
        progress.begin(&pile.title);
        heaps.push(piles::measure(pile, &methods));
        progress.done();
    }
    let origin = Origin {
        machine: machine(),
        commit: arguments.commit.clone(),
        date: arguments.date.clone(),
        compiler: arguments.compiler.clone(),
        quick: arguments.quick,
    };
    write(&Results { origin, methods, studies, heaps, cases, ensembles, costs }, &arguments.out)
}

/// File name of the picture at the head of the report.
pub const GLANCE: &str = "glance.svg";
/// Problems whose pictures README.md shows. The page shows all of them.
const IN_README: [&str; 2] = ["9b", "13"];

/// Runs the stability cases on all cores, since they are not timed.
fn judge_all(
    cases: &[Case],
    methods: &[Method],
    quick: bool,
    progress: &Progress,
) -> Vec<Verdicts> {
    on_all_cores(cases, |&case| {
        progress.begin(&format!("{} {}", case.id, case.title));
        let verdicts = stability::judge(case, methods, quick);
        progress.done();
        verdicts
    })
}

fn write(results: &Results, out: &Path) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("cannot create {}", out.display()))?;
    let put = |name: &str, text: String| {
        let path = out.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    let solvers = results.solvers();
    put("problems.csv", csv::of_studies(&results.studies))?;
    for study in results.studies.iter().filter(|study| IN_README.contains(&study.problem.id)) {
        let figure = figures::of_study(study, &results.methods);
        put(&format!("problem-{}.svg", study.problem.id), figure.svg())?;
    }
    put("piles.csv", csv::of_heaps(&results.heaps, &solvers))?;
    if let Some(costs) = &results.costs {
        put("unneeded.csv", unneeded::csv(costs))?;
        put("baseline.csv", unneeded::baseline_csv(costs))?;
    }
    put("stability.csv", csv::of_stability(&results.cases, &solvers))?;
    put("ensembles.csv", csv::of_stability(&results.ensembles, &solvers))?;
    put("stability-over-time.csv", csv::of_series(&results.cases, &solvers))?;
    if let Some(svg) = glance::svg(&results.studies, &results.methods) {
        put(GLANCE, svg)?;
    }
    put("summary.md", summary::markdown(results))?;
    put("index.html", page::html(results))?;
    println!("report: {}", out.join("index.html").display());
    Ok(())
}

/// The name of the processor, if the system reports it, and the number of cores.
fn machine() -> String {
    let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = cpuinfo.lines().find(|line| line.starts_with("model name"));
    let name = name.and_then(|line| line.split(": ").nth(1)).unwrap_or(std::env::consts::ARCH);
    let cores = std::thread::available_parallelism().map_or(1, |count| count.get());
    format!("{name}, {cores} cores, {}", std::env::consts::OS)
}
