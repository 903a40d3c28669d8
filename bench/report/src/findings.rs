//! Puts the findings for a problem into words: how well the default does, how much additional work gains, and which
//! engine is better.

use crate::methods::{Family, Method, SOLVERS};
use crate::number::short;
use crate::problems::FORCE_ERROR;
use crate::stability::{Outcome, Verdicts};
use crate::study::{Curve, Point, Study};

/// To claim a win against a peer, Jostle needs at most this share of its error at equal time ...
pub const ERROR_SHARE: f64 = 0.1;
/// ... and at most this share of its time at equal error.
pub const TIME_SHARE: f64 = 1.0 / 3.0;

/// A comparison of Jostle with one peer on one problem.
pub struct Comparison {
    /// Name of the peer.
    pub peer: &'static str,
    /// Jostle's error relative to the peer's in the same time, as the worst ratio over the peer's settings. Infinite if
    /// none of Jostle's points is as fast.
    pub error_share: f64,
    /// Jostle's time relative to the peer's at the same error, also as the worst ratio.
    pub time_share: f64,
}

impl Comparison {
    /// Whether Jostle is better by both margins.
    pub fn is_won(&self) -> bool {
        self.error_share <= ERROR_SHARE && self.time_share <= TIME_SHARE
    }

    /// Whether Jostle is better at all, with less error in the same time and less time for the same error.
    pub fn is_ahead(&self) -> bool {
        self.error_share < 1.0 && self.time_share < 1.0
    }

    /// The result in one word: a win by both margins, a lead without reaching them, or a loss.
    pub fn verdict(&self) -> &'static str {
        match (self.is_won(), self.is_ahead()) {
            (true, _) => "better",
            (false, true) => "ahead",
            (false, false) => "LOSS",
        }
    }
}

/// The engine that a method belongs to: the part of its name before the comma.
fn engine_of(method: &Method) -> &'static str {
    method.name.split(", ").next().unwrap_or(method.name)
}

/// Returns one comparison per participating peer, over all of the peer's settings.
pub fn comparisons(study: &Study) -> Vec<Comparison> {
    let of = |family| move |curve: &&Curve| curve.method.family == family;
    let ours: Vec<&Point> =
        study.curves.iter().filter(of(Family::Jostle)).flat_map(|curve| &curve.points).collect();
    // Errors below the floor count as equal.
    let error = |point: &Point| point.errors[0].max(study.problem.floor());
    let mut found: Vec<Comparison> = Vec::new();
    for curve in study.curves.iter().filter(of(Family::Peer)) {
        let peer = engine_of(&curve.method);
        if found.iter().all(|comparison| comparison.peer != peer) {
            found.push(Comparison { peer, error_share: 0.0, time_share: 0.0 });
        }
        let Some(compared) = found.iter_mut().find(|other| other.peer == peer) else { continue };
        for point in &curve.points {
            let fast = ours.iter().filter(|p| p.best_us <= point.best_us).map(|p| error(p));
            let good = ours.iter().filter(|p| error(p) <= error(point)).map(|p| p.best_us);
            let error_share = fast.fold(f64::INFINITY, f64::min) / error(point);
            let time_share = good.fold(f64::INFINITY, f64::min) / point.best_us;
            compared.error_share = compared.error_share.max(error_share);
            compared.time_share = compared.time_share.max(time_share);
        }
    }
    found
}

/// Jostle's results against the peers, counted in problems.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Numbers of the problems in which Jostle beats every peer by both margins in every part.
    pub won: Vec<u32>,
    /// Numbers of the problems in which Jostle is at least ahead of every peer in every part.
    pub ahead: Vec<u32>,
    /// Numbers of the problems in which Jostle is behind a peer in some part.
    pub lost: Vec<u32>,
    /// A sentence about each part that was not won.
    pub short: Vec<String>,
}

/// Counts problems by number. A problem with parts counts only if all its parts do.
pub fn tally(studies: &[Study]) -> Tally {
    let mut tally = Tally::default();
    let compared = studies.iter().filter(|study| !comparisons(study).is_empty());
    let mut numbers: Vec<u32> = compared.map(|study| number_of(study.problem.id)).collect();
    numbers.dedup();
    for number in numbers {
        let parts = studies.iter().filter(|study| number_of(study.problem.id) == number);
        let all: Vec<(&Study, Comparison)> =
            parts.flat_map(|s| comparisons(s).into_iter().map(move |c| (s, c))).collect();
        let list = match () {
            () if all.iter().all(|(_, c)| c.is_won()) => &mut tally.won,
            () if all.iter().all(|(_, c)| c.is_ahead()) => &mut tally.ahead,
            () => &mut tally.lost,
        };
        list.push(number);
        for (study, comparison) in all.iter().filter(|(_, c)| !c.is_won()) {
            let (id, title) = (study.problem.id, study.problem.title);
            tally.short.push(format!("{id} {title}. {}", on_peer(comparison)));
        }
    }
    tally
}

/// The number of a problem, from its id: "9b" is a part of problem 9.
pub fn number_of(id: &str) -> u32 {
    id.trim_end_matches(|c: char| c.is_ascii_alphabetic()).parse().unwrap_or(u32::MAX)
}

pub fn listed(numbers: &[u32]) -> String {
    let words: Vec<String> = numbers.iter().map(u32::to_string).collect();
    if words.is_empty() { "none".into() } else { words.join(", ") }
}

/// Describes the plotted runs of a case, with one sentence per solver.
pub fn seen_over_time(verdicts: &Verdicts, solvers: &[&str]) -> Vec<String> {
    let of = |(solver, outcome): (&&str, &Outcome)| {
        let (_, samples) = outcome.series.as_ref()?;
        let (start, last) = (samples.first()?, samples.last()?);
        let deepest = samples[1..].iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap))?;
        let gain = samples.iter().map(|sample| sample.energy - start.energy).fold(0.0, f64::max);
        let share = gain / start.energy.abs().max(f64::MIN_POSITIVE);
        // If everything starts at rest and at zero height, a share of the energy is meaningless.
        let gained = match start.energy == 0.0 {
            true => String::new(),
            false => format!("largest energy gain {} of the start; ", short(share)),
        };
        Some(format!(
            "{solver}: deepest overlap {} at {} s; {gained}rms speed {} at the end.",
            short(deepest.overlap),
            short(deepest.time_s),
            short(last.rms)
        ))
    };
    solvers.iter().zip(&verdicts.outcomes).filter_map(of).collect()
}

/// Returns the findings for a problem.
pub fn seen(study: &Study) -> Vec<String> {
    let mut sentences = Vec::new();
    sentences.extend(on_defaults(study));
    sentences.extend(on_best(study));
    sentences.extend(on_slopes(study));
    sentences.extend(on_stalled(study));
    sentences.extend(on_sweeps(study));
    for comparison in comparisons(study) {
        sentences.push(on_peer(&comparison));
    }
    sentences
}

fn named(study: &Study, curve: &Curve, point: &Point) -> String {
    let unit = study.problem.norms[0].unit;
    let (method, space) = (&curve.method, if unit.is_empty() { "" } else { " " });
    format!(
        "{}, {} {}: {}{space}{unit} at {} µs a tick",
        method.name,
        method.knob,
        point.setting,
        short(point.errors[0]),
        short(point.best_us)
    )
}

/// States the results of the scene solvers with default settings.
fn on_defaults(study: &Study) -> Vec<String> {
    let of = |method: &&str| {
        let (curve, point) = study.default_of(method)?;
        let place = if point.pareto { "on the Pareto set" } else { "not on the Pareto set" };
        Some(format!("{} is {place}.", named(study, curve, point)))
    };
    SOLVERS.iter().filter_map(of).collect()
}

fn on_best(study: &Study) -> Option<String> {
    let (curve, point) = study.best(Family::Jostle)?;
    let floor =
        if point.errors[0] <= study.problem.floor() { ", below the floor of f32" } else { "" };
    Some(format!("Most precise of Jostle's: {}{floor}.", named(study, curve, point)))
}

fn on_slopes(study: &Study) -> Option<String> {
    let slope = |curve: &Curve| Some(format!("{} {:.2}", curve.method.name, curve.slope?));
    let slopes: Vec<String> = study.curves.iter().filter_map(slope).collect();
    (!slopes.is_empty()).then(|| format!("Order in the step: {}.", slopes.join("; ")))
}

/// Names those of Jostle's curves on which more work gains nothing.
fn on_stalled(study: &Study) -> Option<String> {
    let stalls = |curve: &&Curve| {
        let (Some(first), Some(last)) = (curve.points.first(), curve.points.last()) else {
            return false;
        };
        curve.method.family == Family::Jostle
            && curve.points.len() > 1
            && last.errors[0] > 0.5 * first.errors[0].max(study.problem.floor() * 4.0)
    };
    let names: Vec<String> = study
        .curves
        .iter()
        .filter(stalls)
        .map(|curve| format!("{} ({})", curve.method.name, curve.method.knob))
        .collect();
    (!names.is_empty())
        .then(|| format!("Turning the knob up does not halve the error: {}.", names.join("; ")))
}

/// If contact forces are known, states the lowest setting of each knob at which they become correct to a thousandth and
/// to a millionth.
fn on_sweeps(study: &Study) -> Option<String> {
    let norm = study.problem.norms.iter().position(|norm| norm.name == FORCE_ERROR)?;
    let least = |curve: &Curve, most: f64| {
        let wrong = |point: &Point| point.errors[norm].is_nan() || point.errors[norm] > most;
        let first = curve.points.iter().rposition(wrong).map_or(0, |last| last + 1);
        curve.points.get(first).map_or("none of them".to_owned(), |p| p.setting.to_string())
    };
    let of = |curve: &Curve| {
        let (name, knob) = (curve.method.name, curve.method.knob);
        format!("{name}, {knob}: {} and {}", least(curve, 1e-3), least(curve, 1e-6))
    };
    let counted = |curve: &&Curve| curve.points.windows(2).all(|p| p[0].setting < p[1].setting);
    let all: Vec<String> = study.curves.iter().filter(counted).map(of).collect();
    Some(format!(
        "Least setting that gets every contact force right to 10⁻³, and to 10⁻⁶: {}.",
        all.join("; ")
    ))
}

fn on_peer(comparison: &Comparison) -> String {
    let share = |share: f64, of: &str| match share.is_finite() {
        true => format!("{} of its {of}", short(share)),
        false => format!("nothing that matches its {of}"),
    };
    let verdict = comparison.verdict();
    format!(
        "Against {}: at equal time {}, at equal error {} (worst of its settings): {verdict}.",
        comparison.peer,
        share(comparison.error_share, "error"),
        share(comparison.time_share, "time"),
    )
}

#[cfg(test)]
mod tests {
    use super::{Tally, listed, number_of, tally};

    #[test]
    fn parts_belong_to_their_number() {
        assert_eq!(["9", "9b", "11c"].map(number_of), [9, 9, 11]);
        assert_eq!(listed(&[1, 2]), "1, 2");
        assert_eq!(listed(&[]), "none");
        assert_eq!(tally(&[]), Tally::default());
    }
}
