//! The report in one picture: every engine at every setting over all problems, error against time, both relative
//! to the most precise point of the peers.

mod draw;

use crate::figures::styles;
use crate::methods::{Family, Method, SOLVERS};
use crate::plot::Style;
use crate::study::{Point, Study};

/// Share of the measured problems that a method must cover for its medians to be representative.
const PLAYED_MIN: f64 = 0.4;

/// An error and a time, relative to those of the peers' most precise point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ratio {
    error: f64,
    time: f64,
}

/// The results of a method across all problems.
struct Trail {
    name: &'static str,
    knob: &'static str,
    family: Family,
    style: Style,
    /// Medians over the problems, by setting.
    medians: Vec<(f64, Ratio)>,
    /// Index of the default setting in `medians`.
    default: Option<usize>,
    problems: usize,
}

/// A problem with the default point of each scene solver and each peer.
struct Row {
    id: &'static str,
    title: &'static str,
    marks: Vec<(Style, &'static str, Ratio)>,
}

/// The picture as SVG; `None` if no peer was measured.
pub fn svg(studies: &[Study], methods: &[Method]) -> Option<String> {
    let measured: Vec<&Study> =
        studies.iter().filter(|study| study.best(Family::Peer).is_some()).collect();
    if measured.is_empty() {
        return None;
    }
    let styles = styles(methods);
    let least = (PLAYED_MIN * measured.len() as f64).ceil() as usize;
    let trails: Vec<Trail> = methods
        .iter()
        .zip(&styles)
        .filter(|(method, _)| method.family != Family::Yardstick)
        .filter_map(|(method, style)| trail(method, *style, &measured))
        .filter(|trail| trail.problems >= least)
        .collect();
    let shown = |method: &&Method| SOLVERS.contains(&method.name) || is_peer(method);
    let shown: Vec<(&Method, Style)> =
        methods.iter().zip(styles.iter().copied()).filter(|(method, _)| shown(method)).collect();
    let rows: Vec<Row> = measured.iter().map(|study| row(study, &shown)).collect();
    Some(draw::svg(&trails, &rows))
}

/// Whether a method is a peer in its usual configuration.
fn is_peer(method: &Method) -> bool {
    method.family == Family::Peer && method.in_stability
}

/// Returns a point relative to the peers' most precise point. Errors below the floor of f32 count as the floor.
fn ratio(study: &Study, point: &Point) -> Ratio {
    let floor = study.problem.floor();
    let (_, best) = study.best(Family::Peer).expect("only studies with peers take part");
    let error = point.errors[0].max(floor) / best.errors[0].max(floor);
    Ratio { error, time: point.best_us / best.best_us }
}

fn trail(method: &Method, style: Style, studies: &[&Study]) -> Option<Trail> {
    let curves: Vec<_> = studies
        .iter()
        .filter_map(|study| {
            let mut curves = study.curves.iter();
            Some((*study, curves.find(|curve| curve.method.name == method.name)?))
        })
        .collect();
    let medians: Vec<(f64, Ratio)> = method
        .settings
        .iter()
        .filter_map(|&setting| {
            let points = curves.iter().filter_map(|(study, curve)| {
                Some(ratio(study, curve.points.iter().find(|p| p.setting == setting)?))
            });
            let ratios: Vec<Ratio> = points.collect();
            // A setting at which half of the problems blow up gets no median.
            let counts = !ratios.is_empty() && 2 * ratios.len() > curves.len();
            counts.then(|| (setting, median(&ratios)))
        })
        .collect();
    let default = medians.iter().position(|(setting, _)| Some(*setting) == method.default);
    let Method { name, knob, family, .. } = *method;
    let problems = curves.len();
    (!medians.is_empty()).then_some(Trail { name, knob, family, style, medians, default, problems })
}

fn median(ratios: &[Ratio]) -> Ratio {
    let of = |value: fn(&Ratio) -> f64| {
        let mut values: Vec<f64> = ratios.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        match values.len() % 2 {
            0 => (values[middle - 1] * values[middle]).sqrt(),
            _ => values[middle],
        }
    };
    Ratio { error: of(|ratio| ratio.error), time: of(|ratio| ratio.time) }
}

fn row(study: &Study, shown: &[(&Method, Style)]) -> Row {
    let mark = |(method, style): &(&Method, Style)| {
        let (_, point) = study.default_of(method.name)?;
        Some((*style, method.name, ratio(study, point)))
    };
    let marks = shown.iter().filter_map(mark).collect();
    Row { id: study.problem.id, title: study.problem.title, marks }
}

#[cfg(test)]
mod tests;
