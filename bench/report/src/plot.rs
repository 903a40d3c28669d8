//! Plots as SVG: panels side by side, with one legend below them. Every element has a separate area, so text never
//! overlaps.

mod path;
mod scale;

use path::{Path, thinned};
pub(crate) use path::{Spot, pixels};
pub use scale::{Scale, Tick, superscript};
use std::fmt::Write;

/// The style of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    pub color: &'static str,
    /// The line's dash pattern; empty for a solid line.
    pub dash: &'static str,
    /// The marker used for points.
    pub marker: Marker,
}

/// The shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    None,
    Disc,
    Square,
    Triangle,
    /// A square that stands on a corner.
    Diamond,
}

/// A point of a curve.
#[derive(Clone, Debug)]
pub struct Dot {
    /// The x value in the data's unit.
    pub x: f64,
    /// The y value in the data's unit.
    pub y: f64,
    pub filled: bool,
    /// Whether to draw a ring around the dot.
    pub ringed: bool,
    /// Text of the tooltip. Dots with the same title in several panels represent the same point.
    pub title: String,
}

#[derive(Clone, Debug)]
pub struct Line {
    pub style: Style,
    /// The points, in drawing order.
    pub dots: Vec<Dot>,
}

/// An axis of a panel.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The label, with its unit.
    pub label: String,
    /// The scale for all values.
    pub scale: Scale,
}

/// One pair of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// The curves; later ones are drawn on top.
    pub lines: Vec<Line>,
    /// A dashed horizontal line, if any.
    pub floor: Option<f64>,
}

/// A set of panels with a common legend.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Description for screen readers.
    pub description: String,
    /// The panels, from left to right.
    pub panels: Vec<Panel>,
    /// Legend entries, shown in columns below the panels.
    pub legend: Vec<(Style, String)>,
    /// Height of a panel in pixels.
    pub height: f64,
}

const PANEL_WIDTH: f64 = 390.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 48.0;
const LEGEND_ROW: f64 = 19.0;
/// Width of a legend column, enough for about 85 letters.
const LEGEND_COLUMN: f64 = 585.0;

impl Figure {
    /// Returns the whole picture as SVG, to be embedded in a page or saved as a file.
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
        let mut marks = Marks::default();
        for (index, panel) in self.panels.iter().enumerate() {
            let frame = Frame::new(index as f64 * PANEL_WIDTH, self.height);
            frame.draw(panel, &mut marks, &mut svg);
        }
        marks.draw(&mut svg);
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
    let _ = write!(svg, "<g fill=\"{}\" stroke-width=\"1.5\">", style.color);
    stroke(style, &[(x, y), (x + 30.0, y)], svg);
    let mark = outline(style.marker, (x + 15.0, y));
    let _ = write!(svg, "<path d=\"{mark}\" stroke=\"{}\"/></g>", style.color);
    let (x, y) = (pixels(x + 38.0), pixels(y + 4.0));
    let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\">{}</text>", escape(text));
}

/// Position of a panel's axes, in pixels.
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
        self.left + panel.x.scale.fraction(value) * (self.right - self.left)
    }

    fn y(&self, panel: &Panel, value: f64) -> f64 {
        self.bottom - panel.y.scale.fraction(value) * (self.bottom - self.top)
    }

    fn draw<'a>(&self, panel: &'a Panel, marks: &mut Marks<'a>, svg: &mut String) {
        self.axes(panel, svg);
        svg.push_str("<g fill=\"none\" stroke-width=\"1.6\" stroke-linejoin=\"round\">\n");
        if let Some(floor) = panel.floor {
            let y = self.y(panel, floor);
            let style = Style { color: "#888", dash: "2 3", marker: Marker::None };
            stroke(&style, &[(self.left, y), (self.right, y)], svg);
        }
        for line in &panel.lines {
            let at = |dot: &Dot| (self.x(panel, dot.x), self.y(panel, dot.y));
            let points: Vec<Spot> = line.dots.iter().map(at).collect();
            stroke(&line.style, &thinned(&points), svg);
            if line.style.marker != Marker::None {
                line.dots.iter().zip(points).for_each(|(dot, at)| marks.add(line.style, dot, at));
            }
        }
        svg.push_str("</g>\n");
    }

    fn axes(&self, panel: &Panel, svg: &mut String) {
        let Frame { left, right, top, bottom } = *self;
        let (x_ticks, y_ticks) = (panel.x.scale.ticks(), panel.y.scale.ticks());
        for (labelled, gray) in [(false, "#f3f3f3"), (true, "#ddd")] {
            let drawn = |tick: &&Tick| tick.label.is_empty() != labelled;
            let mut rules = Path::default();
            for tick in x_ticks.iter().filter(drawn) {
                rules.move_to((self.x(panel, tick.value), top));
                rules.down(bottom - top);
            }
            for tick in y_ticks.iter().filter(drawn) {
                rules.move_to((left, self.y(panel, tick.value)));
                rules.across(right - left);
            }
            if !rules.data().is_empty() {
                let _ = writeln!(svg, "<path d=\"{}\" stroke=\"{gray}\"/>", rules.data());
            }
        }
        svg.push_str("<g text-anchor=\"middle\">");
        x_ticks.iter().for_each(|tick| {
            text(self.x(panel, tick.value), bottom + 17.0, &tick.label, svg);
        });
        text((left + right) / 2.0, bottom + 37.0, &panel.x.label, svg);
        svg.push_str("</g>\n<g text-anchor=\"end\">");
        y_ticks.iter().for_each(|tick| {
            text(left - 7.0, self.y(panel, tick.value) + 4.0, &tick.label, svg);
        });
        svg.push_str("</g>\n");
        self.frame_and_names(panel, svg);
    }

    fn frame_and_names(&self, panel: &Panel, svg: &mut String) {
        let Frame { left, right, top, bottom } = *self;
        let (width, height) = (right - left, bottom - top);
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" \
             stroke=\"#555\"/>"
        );
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

fn text(x: f64, y: f64, what: &str, svg: &mut String) {
    if !what.is_empty() {
        let (x, y) = (pixels(x), pixels(y));
        let _ = write!(svg, "<text x=\"{x}\" y=\"{y}\">{}</text>", escape(what));
    }
}

pub(crate) fn stroke(style: &Style, points: &[Spot], svg: &mut String) {
    let dash = match style.dash {
        "" => String::new(),
        dash => format!(" stroke-dasharray=\"{dash}\""),
    };
    let path = Path::through(points);
    let _ = writeln!(svg, "<path d=\"{}\" stroke=\"{}\"{dash}/>", path.data(), style.color);
}

/// The points of all panels, drawn on top of all lines. Dots in several panels that represent the same point share one
/// element and one title.
#[derive(Default)]
struct Marks<'a> {
    points: Vec<Mark<'a>>,
}

struct Mark<'a> {
    style: Style,
    dot: &'a Dot,
    positions: Vec<Spot>,
}

impl<'a> Marks<'a> {
    fn add(&mut self, style: Style, dot: &'a Dot, position: Spot) {
        let same = |mark: &&mut Mark| mark.style == style && mark.dot.title == dot.title;
        match self.points.iter_mut().find(same) {
            Some(mark) => mark.positions.push(position),
            None => self.points.push(Mark { style, dot, positions: vec![position] }),
        }
    }

    /// Draws all points. Hollow ones inherit their fill from the group; filled ones set a colour.
    fn draw(&self, svg: &mut String) {
        for curve in self.points.chunk_by(|one, next| one.style == next.style) {
            let color = curve[0].style.color;
            let _ = write!(svg, "<g fill=\"#fff\" stroke=\"{color}\" stroke-width=\"1.5\">");
            curve.iter().for_each(|mark| mark.draw(svg));
            svg.push_str("</g>\n");
        }
    }
}

impl Mark<'_> {
    fn draw(&self, svg: &mut String) {
        let all = |of: &dyn Fn(Spot) -> String| self.positions.iter().map(|&at| of(at)).collect();
        if self.dot.ringed {
            let rings: String = all(&|at| circle(at, 9.0));
            let look = "fill=\"none\" stroke=\"#222\" stroke-width=\"1.3\"";
            let _ = write!(svg, "<path d=\"{rings}\" {look}/>");
        }
        let outlines: String = all(&|at| outline(self.style.marker, at));
        let color = self.style.color;
        let fill = if self.dot.filled { format!(" fill=\"{color}\"") } else { String::new() };
        let title = escape(&self.dot.title);
        let _ = write!(svg, "<path d=\"{outlines}\"{fill}><title>{title}</title></path>");
    }
}

/// Returns the path data of a marker around a point, relative to the marker's first corner.
pub(crate) fn outline(marker: Marker, (x, y): Spot) -> String {
    let (corner, rest) = match marker {
        Marker::None => return String::new(),
        Marker::Disc => return circle((x, y), 4.0),
        Marker::Square => ((x - 3.5, y - 3.5), "h7v7h-7z"),
        Marker::Triangle => ((x, y - 5.0), "l4.6 8.2h-9.2z"),
        Marker::Diamond => ((x, y - 5.2), "l5.2 5.2-5.2 5.2-5.2-5.2z"),
    };
    format!("{}{rest}", Path::from(corner).data())
}

/// Returns a circle as an arc that almost returns to its start, because SVG draws nothing for a full one.
pub(crate) fn circle((x, y): Spot, radius: f64) -> String {
    format!("{}a{radius} {radius} 0 1 1 0 .1z", Path::from((x - radius, y)).data())
}

/// Escapes text for elements and attributes.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::{Axis, Dot, Figure, Line, Marker, Panel, Scale, Style, escape};

    #[test]
    fn a_figure_has_every_point_and_its_labels() {
        let style = Style { color: "#06c", dash: "", marker: Marker::Disc };
        let dot = |x: f64, y: f64| {
            let title = format!("a<b {x}");
            Dot { x, y, filled: true, ringed: x == 1.0, title }
        };
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
        let panels = vec![panel.clone(), panel];
        let svg = Figure { description, panels, legend, height: 300.0 }.svg();
        // Three points in both panels, one of them ringed, and one marker in the legend. Each point has one title.
        assert_eq!(svg.matches("a4 4").count(), 2 * 3 + 1);
        assert_eq!((svg.matches("a9 9").count(), svg.matches("<title>").count()), (2, 3));
        assert!(svg.contains("time, us") && svg.contains("one method") && svg.contains("a&lt;b"));
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn markup_in_text_is_escaped() {
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }
}
