//! Draws the picture's two panels: the medians of all methods on the left, and the default settings for each problem on
//! the right.

use super::{Ratio, Row, Trail};
use crate::methods::{Family, SOLVERS};
use crate::number::short;
use crate::overview::scenes_with;
use crate::plot::{Marker, Scale, Style, circle, escape, outline, pixels, stroke, superscript};
use std::fmt::Write;

const WIDTH: f64 = 1180.0;
/// Edges of the left panel, whose labels are on its right.
const LEFT: (f64, f64) = (62.0, 408.0);
const LABELS: f64 = 424.0;
/// Edges of the right panel, whose row names are on its left.
const RIGHT: (f64, f64) = (940.0, 1164.0);
const TOP: f64 = 54.0;
const BOTTOM_ROOM: f64 = 60.0;
const ROW: f64 = 19.0;
const LABEL_ROW: f64 = 14.0;
const LABEL_GAP: f64 = 6.0;
/// Width of the row names.
const NAMES: f64 = 266.0;
/// The decades to draw; values outside are drawn at the edge.
const TIMES: Scale = Scale::Log { low: -2, high: 2, zero: false };
const ERRORS: Scale = Scale::Log { low: -5, high: 2, zero: false };
const ROW_ERRORS: Scale = Scale::Log { low: -6, high: 3, zero: false };

pub(super) fn svg(trails: &[Trail], rows: &[Row]) -> String {
    let bottom = TOP + ROW * rows.len().max(20) as f64;
    let height = bottom + BOTTOM_ROOM;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" role=\"img\" aria-label=\"Error against time of every engine and setting over \
         {} problems, relative to the most precise setting of the best peer\" \
         font-family=\"system-ui, 'DejaVu Sans', sans-serif\" font-size=\"12\" fill=\"#222\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        rows.len()
    );
    let panel = Panel { left: LEFT.0, right: LEFT.1, bottom, y: ERRORS };
    panel.draw(trails, &mut svg);
    by_problem(rows, bottom, &mut svg);
    svg.push_str("</svg>\n");
    svg
}

fn text(x: f64, y: f64, look: &str, what: &str, svg: &mut String) {
    let (x, y) = (pixels(x), pixels(y));
    let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" {look}>{}</text>", escape(what));
}

/// Axes of error against time.
struct Panel {
    left: f64,
    right: f64,
    bottom: f64,
    y: Scale,
}

impl Panel {
    fn at(&self, ratio: Ratio) -> (f64, f64) {
        let x = self.left + TIMES.fraction(ratio.time) * (self.right - self.left);
        (x, self.bottom - self.y.fraction(ratio.error) * (self.bottom - TOP))
    }

    fn draw(&self, trails: &[Trail], svg: &mut String) {
        text(
            self.left,
            TOP - 28.0,
            HEAD,
            "All engines and settings, medians over the problems",
            svg,
        );
        text(self.left, TOP - 11.0, FAINT, "1 is the most precise setting of the best peer", svg);
        let (x, y) = self.at(Ratio { error: 1.0, time: 1.0 });
        let (width, height) = (pixels(x - self.left), pixels(self.bottom - y));
        let _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" fill=\"#e8f3ea\"/>",
            self.left,
            pixels(y)
        );
        self.axes(svg);
        let corner = "fill=\"#2b6b3a\" font-size=\"11.5\"";
        for (row, line) in ["faster and more precise", "than the best peer"].iter().enumerate() {
            text(self.left + 9.0, self.bottom - 25.0 + 15.0 * row as f64, corner, line, svg);
        }
        for trail in trails {
            self.trail(trail, svg);
        }
        self.labels(trails, svg);
    }

    fn axes(&self, svg: &mut String) {
        let Panel { left, right, bottom, .. } = *self;
        for tick in TIMES.ticks().iter().filter(|tick| !tick.label.is_empty()) {
            let (x, _) = self.at(Ratio { error: 1.0, time: tick.value });
            rule((x, TOP), (x, bottom), tick.value == 1.0, svg);
            text(x, bottom + 17.0, MIDDLE, &times(tick.value), svg);
        }
        for tick in self.y.ticks().iter().filter(|tick| !tick.label.is_empty()) {
            let (_, y) = self.at(Ratio { error: tick.value, time: 1.0 });
            rule((left, y), (right, y), tick.value == 1.0, svg);
            text(left - 7.0, y + 4.0, END, &times(tick.value), svg);
        }
        text(
            (left + right) / 2.0,
            bottom + 38.0,
            MIDDLE,
            "time, relative to the best peer's →",
            svg,
        );
        let (x, y) = (left - 46.0, (TOP + bottom) / 2.0);
        let turned = format!("transform=\"translate({x} {y}) rotate(-90)\" text-anchor=\"middle\"");
        let _ = writeln!(svg, "<text {turned}>error, relative to the best peer's →</text>");
    }

    fn trail(&self, trail: &Trail, svg: &mut String) {
        let spots: Vec<(f64, f64)> =
            trail.medians.iter().map(|(_, ratio)| self.at(*ratio)).collect();
        let main = is_main(trail);
        let width = if main { 2.4 } else { 1.2 };
        let _ = writeln!(
            svg,
            "<g fill=\"none\" stroke-width=\"{width}\" stroke-linejoin=\"round\" opacity=\"{}\">",
            if main { 1.0 } else { 0.75 }
        );
        stroke(&trail.style, &spots, svg);
        svg.push_str("</g>\n");
        let color = trail.style.color;
        for (index, &spot) in spots.iter().enumerate() {
            let (setting, ratio) = trail.medians[index];
            let title = format!(
                "{}, {} {setting}: error {}, time {} of the best peer's (medians over {} problems)",
                trail.name,
                trail.knob,
                short(ratio.error),
                short(ratio.time),
                trail.problems
            );
            let is_default = main && trail.default == Some(index);
            let fill = if is_default { color } else { "#fff" };
            let _ = writeln!(
                svg,
                "<path d=\"{}\" fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.5\"><title>{}</title></path>",
                outline(trail.style.marker, spot),
                escape(&title)
            );
            if is_default && SOLVERS.contains(&trail.name) {
                ring(spot, 10.0, svg);
            }
        }
    }

    /// Draws the names next to the panel in the order of the curves' last points, each with a thin line to that point.
    fn labels(&self, trails: &[Trail], svg: &mut String) {
        let end = |trail: &Trail| {
            let mut spots = trail.medians.iter().map(|(_, ratio)| self.at(*ratio));
            spots.next_back().unwrap_or((self.right, self.bottom))
        };
        let mut order: Vec<(&Trail, (f64, f64))> = trails.iter().map(|t| (t, end(t))).collect();
        order.sort_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = |trail: &Trail| {
            let lines = if scenes_of(trail).is_some() { 3.0 } else { 2.0 };
            lines * LABEL_ROW + LABEL_GAP
        };
        let mut below: f64 = order.iter().map(|(trail, _)| high(trail)).sum();
        let mut next = TOP + 8.0;
        for (trail, spot) in order {
            // As close to the end of the curve as the labels above and below allow.
            let y = (spot.1 + 4.0).max(next).min(self.bottom - below + LABEL_ROW);
            (next, below) = (y + high(trail), below - high(trail));
            let leader = Style { color: "#c4c4c4", dash: "", marker: Marker::None };
            svg.push_str("<g fill=\"none\" stroke-width=\"0.8\">");
            stroke(&leader, &[(spot.0 + 6.0, spot.1), (LABELS - 4.0, y - 4.0)], svg);
            svg.push_str("</g>\n");
            label(trail, y, svg);
        }
    }
}

/// Draws a method's name, its variant and knob, and the shipped scenes that use it.
fn label(trail: &Trail, y: f64, svg: &mut String) {
    let (name, rest) = trail.name.split_once(", ").unwrap_or((trail.name, ""));
    let look = format!("fill=\"{}\" font-weight=\"600\"", trail.style.color);
    text(LABELS, y, &look, name, svg);
    let (first, last) = (trail.medians[0].0, trail.medians[trail.medians.len() - 1].0);
    let knob = trail.knob.trim_end_matches(" at most");
    let colon = if rest.is_empty() { "" } else { ": " };
    let settings = format!("{rest}{colon}{knob} {first} to {last}");
    text(LABELS, y + LABEL_ROW, SMALL, &settings, svg);
    if let Some(scenes) = scenes_of(trail) {
        let spot = (LABELS + 5.0, y + 2.0 * LABEL_ROW - 4.0);
        ring(spot, 4.5, svg);
        text(LABELS + 15.0, y + 2.0 * LABEL_ROW, "font-size=\"11\"", &scenes, svg);
    }
}

/// Draws a ring around a point that shipped scenes use.
fn ring(spot: (f64, f64), radius: f64, svg: &mut String) {
    let look = "fill=\"none\" stroke=\"#222\" stroke-width=\"1.6\"";
    let _ = writeln!(svg, "<path d=\"{}\" {look}/>", circle(spot, radius));
}

/// Draws one row per problem with the default settings of the scene solvers and of the peers.
fn by_problem(rows: &[Row], bottom: f64, svg: &mut String) {
    let (left, right) = RIGHT;
    text(left - NAMES, TOP - 28.0, HEAD, "Defaults, problem by problem", svg);
    let x = |error: f64| left + ROW_ERRORS.fraction(error) * (right - left);
    let _ = writeln!(
        svg,
        "<rect x=\"{left}\" y=\"{TOP}\" width=\"{}\" height=\"{}\" fill=\"#e8f3ea\"/>",
        pixels(x(1.0) - left),
        pixels(bottom - TOP)
    );
    for tick in ROW_ERRORS.ticks().iter().filter(|tick| !tick.label.is_empty()) {
        rule((x(tick.value), TOP), (x(tick.value), bottom), tick.value == 1.0, svg);
        text(x(tick.value), bottom + 17.0, MIDDLE, &times(tick.value), svg);
    }
    text((left + right) / 2.0, bottom + 38.0, MIDDLE, "error, relative to the best peer's →", svg);
    legend(rows, left, svg);
    let high = (bottom - TOP) / rows.len() as f64;
    for (index, row) in rows.iter().enumerate() {
        let y = TOP + (index as f64 + 0.5) * high;
        let _ = writeln!(
            svg,
            "<path d=\"M{} {}H{}\" stroke=\"#eee\"/>",
            left - NAMES,
            pixels(y + high / 2.0),
            pixels(right)
        );
        text(
            left - NAMES,
            y + 4.0,
            "font-size=\"11.5\"",
            &format!("{} {}", row.id, row.title),
            svg,
        );
        for (style, name, ratio) in row.marks.iter().rev() {
            let color = style.color;
            let fill = if SOLVERS.contains(name) { color } else { "#fff" };
            let title = format!(
                "{} {}: {name}: error {}, time {} of the best peer's",
                row.id,
                row.title,
                short(ratio.error),
                short(ratio.time)
            );
            let _ = writeln!(
                svg,
                "<path d=\"{}\" fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.5\"><title>{}</title></path>",
                outline(style.marker, (x(ratio.error), y)),
                escape(&title)
            );
        }
    }
}

/// Draws the legend of the markers above the rows.
fn legend(rows: &[Row], left: f64, svg: &mut String) {
    let Some(full) = rows.iter().max_by_key(|row| row.marks.len()) else { return };
    let mut x = left - NAMES + 6.0;
    for (style, name, _) in &full.marks {
        let name = short_name(name);
        let fill = if name.starts_with("Jostle") { style.color } else { "#fff" };
        let _ = writeln!(
            svg,
            "<path d=\"{}\" fill=\"{fill}\" stroke=\"{}\" stroke-width=\"1.5\"/>",
            outline(style.marker, (x, TOP - 15.0)),
            style.color
        );
        text(x + 9.0, TOP - 11.0, "font-size=\"11.5\"", name, svg);
        x += 26.0 + 6.3 * name.chars().count() as f64;
    }
}

fn short_name(name: &'static str) -> &'static str {
    let end = name.find([',']).unwrap_or(name.len());
    &name[..end]
}

const HEAD: &str = "font-weight=\"600\" font-size=\"14\"";
const SMALL: &str = "fill=\"#555\" font-size=\"11\"";
const FAINT: &str = "fill=\"#666\"";
const MIDDLE: &str = "text-anchor=\"middle\"";
const END: &str = "text-anchor=\"end\"";

fn rule(from: (f64, f64), to: (f64, f64), strong: bool, svg: &mut String) {
    let color = if strong { "#777" } else { "#e4e4e4" };
    let style = Style { color, dash: "", marker: Marker::None };
    stroke(&style, &[from, to], svg);
}

/// Formats a power of ten as a factor.
fn times(value: f64) -> String {
    match value.log10().round() as i32 {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        2 => "100".to_owned(),
        -1 => "0.1".to_owned(),
        -2 => "0.01".to_owned(),
        exponent => format!("10{}", superscript(exponent)),
    }
}

/// Whether a trail belongs to a scene solver with its step knob, or to a peer in its usual configuration.
fn is_main(trail: &Trail) -> bool {
    SOLVERS.contains(&trail.name) || trail.family == Family::Peer && !trail.name.contains("unit")
}

/// Names the shipped scenes that use a scene solver with its defaults.
fn scenes_of(trail: &Trail) -> Option<String> {
    let solver = SOLVERS.iter().position(|name| *name == trail.name)?;
    let names = scenes_with(solver);
    Some(match names.len() {
        0..=5 => format!("shipped: {}", names.join(", ")),
        count => format!("{count} shipped scenes"),
    })
}
