//! Plots as SVG: panels side by side, one legend below them all. Everything has its own place, so
//! no text can meet another.

mod scale;

pub use scale::{Scale, superscript};
use std::fmt::Write;

/// How a curve looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// As in CSS.
    pub color: &'static str,
    /// Pattern of the line, empty for solid.
    pub dash: &'static str,
    /// Shape of the points.
    pub marker: Marker,
}

/// Shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A line alone.
    None,
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// Pointing upwards.
    Triangle,
    /// On its corner.
    Diamond,
}

/// A point of a curve.
#[derive(Clone, Debug)]
pub struct Dot {
    /// In the data's unit.
    pub x: f64,
    /// In the data's unit.
    pub y: f64,
    /// Filled, otherwise hollow.
    pub filled: bool,
    /// With a ring around it.
    pub ringed: bool,
    /// Shown while the pointer is over it.
    pub title: String,
}

/// A curve.
#[derive(Clone, Debug)]
pub struct Line {
    /// Its look.
    pub style: Style,
    /// In the order in which they are joined.
    pub dots: Vec<Dot>,
}

/// A direction of a panel.
#[derive(Clone, Debug)]
pub struct Axis {
    /// With its unit.
    pub label: String,
    /// Over all values.
    pub scale: Scale,
}

/// One pair of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// The later ones lie on top.
    pub lines: Vec<Line>,
    /// A dashed horizontal line, if any.
    pub floor: Option<f64>,
}

/// Panels with a common legend.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Read to those who cannot see it.
    pub description: String,
    /// From left to right.
    pub panels: Vec<Panel>,
    /// In columns below.
    pub legend: Vec<(Style, String)>,
    /// Height of a panel, pixels.
    pub height: f64,
}

const PANEL_WIDTH: f64 = 390.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 48.0;
const LEGEND_ROW: f64 = 19.0;
/// Legend columns have room for long names: about 85 letters.
const LEGEND_COLUMN: f64 = 585.0;

impl Figure {
    /// The whole picture, to stand in a page or in a file of its own.
    pub fn svg(&self) -> String {
        let width = PANEL_WIDTH * self.panels.len().max(1) as f64;
        let columns = ((width / LEGEND_COLUMN) as usize).max(1);
        let rows = self.legend.len().div_ceil(columns);
        let height = self.height + rows as f64 * LEGEND_ROW + 10.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{}\" \
             font-family=\"system-ui, 'DejaVu Sans', sans-serif\" font-size=\"12\" fill=\"#222\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            escape(&self.description)
        );
        for (place, panel) in self.panels.iter().enumerate() {
            let frame = Frame::new(place as f64 * PANEL_WIDTH, self.height);
            frame.draw(panel, &mut svg);
        }
        for (index, (style, text)) in self.legend.iter().enumerate() {
            let (column, row) = (index / rows, index % rows);
            let x = column as f64 * LEGEND_COLUMN + 20.0;
            let y = self.height + row as f64 * LEGEND_ROW + 8.0;
            legend_entry(style, text, x, y, &mut svg);
        }
        svg.push_str("</svg>\n");
        svg
    }
}

fn legend_entry(style: &Style, text: &str, x: f64, y: f64, svg: &mut String) {
    stroke(style, &[(x, y), (x + 30.0, y)], svg);
    mark(style, x + 15.0, y, true, svg);
    let _ = writeln!(svg, "<text x=\"{}\" y=\"{}\">{}</text>", x + 38.0, y + 4.0, escape(text));
}

/// Where a panel's axes lie, in pixels.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    fn new(x: f64, height: f64) -> Frame {
        Frame { left: x + LEFT, right: x + PANEL_WIDTH - RIGHT, top: TOP, bottom: height - BOTTOM }
    }

    fn x(&self, panel: &Panel, value: f64) -> f64 {
        self.left + panel.x.scale.place(value) * (self.right - self.left)
    }

    fn y(&self, panel: &Panel, value: f64) -> f64 {
        self.bottom - panel.y.scale.place(value) * (self.bottom - self.top)
    }

    fn draw(&self, panel: &Panel, svg: &mut String) {
        self.axes(panel, svg);
        if let Some(floor) = panel.floor {
            let y = self.y(panel, floor);
            let style = Style { color: "#888", dash: "2 3", marker: Marker::None };
            stroke(&style, &[(self.left, y), (self.right, y)], svg);
        }
        for line in &panel.lines {
            let at = |dot: &Dot| (self.x(panel, dot.x), self.y(panel, dot.y));
            let points: Vec<(f64, f64)> = line.dots.iter().map(at).collect();
            stroke(&line.style, &points, svg);
            if line.style.marker == Marker::None {
                continue;
            }
            for (dot, &(x, y)) in line.dots.iter().zip(&points) {
                let _ = write!(svg, "<g><title>{}</title>", escape(&dot.title));
                if dot.ringed {
                    let ring = "r=\"9\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.3\"";
                    let _ = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" {ring}/>");
                }
                mark(&line.style, x, y, dot.filled, svg);
                svg.push_str("</g>\n");
            }
        }
    }

    fn axes(&self, panel: &Panel, svg: &mut String) {
        let Frame { left, right, top, bottom } = *self;
        for tick in panel.x.scale.ticks() {
            let x = self.x(panel, tick.value);
            let gray = if tick.label.is_empty() { "#f3f3f3" } else { "#ddd" };
            rule((x, top), (x, bottom), gray, svg);
            text(x, bottom + 17.0, "middle", &tick.label, svg);
        }
        for tick in panel.y.scale.ticks() {
            let y = self.y(panel, tick.value);
            let gray = if tick.label.is_empty() { "#f3f3f3" } else { "#ddd" };
            rule((left, y), (right, y), gray, svg);
            text(left - 7.0, y + 4.0, "end", &tick.label, svg);
        }
        let (width, height) = (right - left, bottom - top);
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" \
             stroke=\"#555\"/>"
        );
        text((left + right) / 2.0, bottom + 37.0, "middle", &panel.x.label, svg);
        let (x, y) = (left - 59.0, (top + bottom) / 2.0);
        let _ = writeln!(
            svg,
            "<text transform=\"translate({x} {y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            escape(&panel.y.label)
        );
        let _ = writeln!(
            svg,
            "<text x=\"{left}\" y=\"{}\" font-weight=\"600\">{}</text>",
            top - 9.0,
            escape(&panel.title)
        );
    }
}

fn rule(from: (f64, f64), to: (f64, f64), color: &str, svg: &mut String) {
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{color}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn text(x: f64, y: f64, anchor: &str, what: &str, svg: &mut String) {
    if !what.is_empty() {
        let what = escape(what);
        let _ =
            writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{what}</text>");
    }
}

fn stroke(style: &Style, points: &[(f64, f64)], svg: &mut String) {
    let joined: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" \
         stroke-linejoin=\"round\" stroke-dasharray=\"{}\"/>",
        joined.join(" "),
        style.color,
        if style.dash.is_empty() { "none" } else { style.dash },
    );
}

fn mark(style: &Style, x: f64, y: f64, filled: bool, svg: &mut String) {
    let fill = if filled { style.color } else { "#fff" };
    let look = format!("fill=\"{fill}\" stroke=\"{}\" stroke-width=\"1.5\"", style.color);
    let corners: &[(f64, f64)] = match style.marker {
        Marker::None => return,
        Marker::Disc => {
            let _ = write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" {look}/>");
            return;
        }
        Marker::Square => &[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)],
        Marker::Triangle => &[(0.0, -5.0), (4.6, 3.2), (-4.6, 3.2)],
        Marker::Diamond => &[(0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)],
    };
    let points: Vec<String> =
        corners.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
    let _ = write!(svg, "<polygon points=\"{}\" {look}/>", points.join(" "));
}

/// For text between tags and in attributes.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::{Axis, Dot, Figure, Line, Marker, Panel, Scale, Style, escape};

    #[test]
    fn a_figure_has_every_point_and_its_labels() {
        let style = Style { color: "#06c", dash: "", marker: Marker::Disc };
        let dot =
            |x: f64, y: f64| Dot { x, y, filled: true, ringed: x == 1.0, title: "a<b".into() };
        let dots = vec![dot(1.0, 0.1), dot(10.0, 0.01), dot(100.0, 0.0)];
        let axis = |label: &str, values: [f64; 3]| Axis {
            label: label.into(),
            scale: Scale::log(values.into_iter()),
        };
        let panel = Panel {
            title: "error against time".into(),
            x: axis("time, us", [1.0, 10.0, 100.0]),
            y: axis("error, units", [0.1, 0.01, 0.0]),
            lines: vec![Line { style, dots }],
            floor: Some(1e-3),
        };
        let legend = vec![(style, "one method".to_owned())];
        let description = "a figure".to_owned();
        let svg = Figure { description, panels: vec![panel], legend, height: 300.0 }.svg();
        // Three points, one of them ringed, and one mark in the legend.
        assert_eq!(svg.matches("<circle").count(), 5);
        assert!(svg.contains("time, us") && svg.contains("one method") && svg.contains("a&lt;b"));
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn markup_in_text_is_escaped() {
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }
}
