//! Turns measurements into figures: curve styles, axes and descriptions.

use crate::methods::{Family, Method};
use crate::number::short;
use crate::plot::{Axis, Dot, Figure, Line, Marker, Panel, Scale, Style};
use crate::stability::{Sample, Verdicts};
use crate::study::{Curve, Point, Study};

const OURS: [&str; 8] =
    ["#0072b2", "#56b4e9", "#009e73", "#cc79a7", "#d55e00", "#e69f00", "#7b3294", "#2f9e9e"];
const PEERS: [&str; 2] = ["#222222", "#8c4a2f"];
const YARDSTICKS: [&str; 2] = ["#999999", "#b8a070"];
const MARKERS: [Marker; 4] = [Marker::Disc, Marker::Square, Marker::Triangle, Marker::Diamond];
const HEIGHT: f64 = 320.0;
/// A floor that is below all errors by at least this factor is mentioned but not drawn.
const FLOOR_NEAR: f64 = 1e3;
/// Maximum number of points of a curve over time.
const SAMPLES_MAX: usize = 300;

/// The style of each method, chosen by its index within its family, so that it stays the same in every figure.
pub fn styles(methods: &[Method]) -> Vec<Style> {
    let mut counts = [0usize; 3];
    let mut style = |method: &Method| {
        let (family, colors, dash): (usize, &[&'static str], &str) = match method.family {
            Family::Jostle => (0, &OURS, ""),
            Family::Yardstick => (1, &YARDSTICKS, "3 3"),
            Family::Peer => (2, &PEERS, "7 3"),
        };
        let index = counts[family];
        counts[family] += 1;
        let marker = MARKERS[index % MARKERS.len()];
        Style { color: colors[index % colors.len()], dash, marker }
    };
    methods.iter().map(&mut style).collect()
}

/// Plots the error against time, work and step size.
pub fn of_study(study: &Study, methods: &[Method]) -> Figure {
    let styles = styles(methods);
    let style_of = |curve: &Curve| {
        let index = methods.iter().position(|method| method.name == curve.method.name);
        styles[index.unwrap_or(0)]
    };
    let floor = study.problem.floor();
    let errors = study.curves.iter().flat_map(|curve| &curve.points).map(|point| point.errors[0]);
    let least = errors.clone().filter(|error| *error > 0.0).fold(f64::INFINITY, f64::min);
    let floor_is_near = least < floor * FLOOR_NEAR;
    let scale = Scale::log(errors.chain(floor_is_near.then_some(floor)));
    let norm = &study.problem.norms[0];
    let unit = if norm.unit.is_empty() { String::new() } else { format!(", {}", norm.unit) };
    let y = Axis { label: format!("{}{unit}", norm.name), scale };
    let panel = |title: &str, label: &str, x_of: &dyn Fn(&Curve, &Point) -> Option<f64>| {
        let all = study.curves.iter().flat_map(|c| c.points.iter().filter_map(move |p| x_of(c, p)));
        let lines = study.curves.iter().map(|curve| Line {
            style: style_of(curve),
            dots: curve
                .points
                .iter()
                .filter_map(|p| Some(dot(curve, p, x_of(curve, p)?)))
                .collect(),
        });
        Panel {
            title: title.into(),
            x: Axis { label: label.into(), scale: Scale::log(all) },
            y: y.clone(),
            lines: lines.filter(|line| !line.dots.is_empty()).collect(),
            floor: floor_is_near.then_some(floor),
        }
    };
    let tick_s = (study.problem.scene)().tick_s;
    let panels = vec![
        panel("against time", "processor time, µs a tick", &|_, p| Some(p.best_us)),
        panel("against work", "body steps + pair solves a tick", &|_, p| p.work),
        panel("against the step", "step, s", &|curve, p| {
            curve.method.divides_step.then_some(tick_s / p.setting)
        }),
    ];
    let mut legend: Vec<(Style, String)> =
        study.curves.iter().map(|curve| (style_of(curve), legend_text(curve))).collect();
    let floor_style = Style { color: "#888", dash: "2 3", marker: Marker::None };
    let where_to = if floor_is_near { "" } else { ", below the plot" };
    legend.push((floor_style, format!("rounding floor of f32: {}{where_to}", short(floor))));
    let description = format!("{}: {} against time, work and step", study.problem.title, norm.name);
    Figure { description, panels, legend, height: HEIGHT }
}

fn legend_text(curve: &Curve) -> String {
    let method = &curve.method;
    let (first, last) = (method.settings[0], method.settings[method.settings.len() - 1]);
    let slope = curve.slope.map_or_else(String::new, |slope| format!(" (slope {slope:.2})"));
    format!("{}: {} {first} to {last}{slope}", method.name, method.knob)
}

fn dot(curve: &Curve, point: &Point, x: f64) -> Dot {
    let method = &curve.method;
    Dot {
        x,
        y: point.errors[0],
        filled: point.pareto,
        ringed: method.family != Family::Yardstick && Some(point.setting) == method.default,
        title: format!(
            "{}, {} {}: error {}, {} µs",
            method.name,
            method.knob,
            point.setting,
            short(point.errors[0]),
            short(point.best_us)
        ),
    }
}

/// Plots overlap, energy and speed over time, one curve per solver; `None` if nothing was recorded.
pub fn of_stability(verdicts: &Verdicts, methods: &[Method]) -> Option<Figure> {
    let looks = styles(methods);
    let solvers = methods.iter().zip(looks).filter(|(method, _)| method.in_stability);
    let drawn: Vec<(&Method, Style, &Vec<Sample>, &str)> = solvers
        .zip(&verdicts.outcomes)
        .filter_map(|((method, style), outcome)| {
            let (variant, samples) = outcome.series.as_ref()?;
            Some((method, Style { marker: Marker::None, ..style }, samples, variant.as_str()))
        })
        .collect();
    let variant = drawn.first()?.3;
    let panel = |title: &str, label: &str, log: bool, of: fn(&Sample, &Sample) -> f64| {
        let thinned: Vec<Vec<(f64, f64)>> =
            drawn.iter().map(|(.., samples, _)| thin(samples, of)).collect();
        let values = || thinned.iter().flatten().map(|point| point.1);
        let y = if log { Scale::log(values()) } else { Scale::linear(values()) };
        let times = thinned.iter().flatten().map(|point| point.0);
        let lines = drawn.iter().zip(&thinned).map(|((_, style, ..), points)| Line {
            style: *style,
            dots: points.iter().map(|&(x, y)| bare(x, y)).collect(),
        });
        Panel {
            title: title.into(),
            x: Axis { label: "time, s".into(), scale: Scale::linear(times) },
            y: Axis { label: label.into(), scale: y },
            lines: lines.collect(),
            floor: None,
        }
    };
    let panels = vec![
        panel("overlap", "deepest overlap, units", true, |s, _| s.overlap),
        panel("energy", "energy gained, share of start", false, |s, start| {
            (s.energy - start.energy) / start.energy.abs().max(1e-30)
        }),
        panel("speed", "rms speed, units/s", true, |s, _| s.rms),
    ];
    let legend = drawn.iter().map(|(method, style, ..)| (*style, method.name.to_owned())).collect();
    let description = format!("{}, {variant}: over time", verdicts.case.title);
    Some(Figure { description, panels, legend, height: 240.0 })
}

fn bare(x: f64, y: f64) -> Dot {
    Dot { x, y, filled: true, ringed: false, title: String::new() }
}

/// Thins out a curve to the largest value in each of at most [`SAMPLES_MAX`] spans, so that no peak is lost.
fn thin(samples: &[Sample], of: fn(&Sample, &Sample) -> f64) -> Vec<(f64, f64)> {
    // No step precedes the start.
    let Some((start, later)) = samples.split_first() else { return Vec::new() };
    let span = later.len().div_ceil(SAMPLES_MAX).max(1);
    let largest = |chunk: &[Sample]| {
        let values = chunk.iter().map(|sample| of(sample, start));
        (chunk[0].time_s, values.fold(f64::NEG_INFINITY, f64::max))
    };
    let points = later.chunks(span).map(largest);
    points.filter(|point| point.1.is_finite()).collect()
}
