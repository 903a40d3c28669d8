//! Encodes lines as short SVG path data: points that make no visible difference are omitted, and the others are written
//! relative to their predecessor, in tenths of a pixel.
//!
//! The points are chosen by the algorithm of Douglas and Peucker 1973, "Algorithms for the reduction of the number of
//! points required to represent a digitized line or its caricature".

use std::fmt::Write;

/// Largest distance between an omitted point and the drawn line, in pixels. Including the rounding to tenths, the line
/// stays within half a pixel.
pub const TOLERANCE: f64 = 0.4;

/// A point in pixels.
pub type Spot = (f64, f64);

/// Selects points such that the line through them stays within [`TOLERANCE`] of all points. Both ends are included.
pub fn thinned(points: &[Spot]) -> Vec<Spot> {
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let between = from + 1..to;
        let distance = |at: &usize| from_segment(points[*at], points[from], points[to]);
        let furthest = between.max_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(at) = furthest.filter(|at| distance(at) > TOLERANCE) {
            kept[at] = true;
            spans.extend([(from, at), (at, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// The distance between a point and a segment.
fn from_segment(point: Spot, start: Spot, end: Spot) -> f64 {
    let (along, to) = ((end.0 - start.0, end.1 - start.1), (point.0 - start.0, point.1 - start.1));
    let square = along.0 * along.0 + along.1 * along.1;
    let share = if square > 0.0 { (to.0 * along.0 + to.1 * along.1) / square } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (to.0 - share * along.0).hypot(to.1 - share * along.1)
}

/// Path data under construction.
#[derive(Debug, Default)]
pub struct Path {
    data: String,
    /// Position of the pen, rounded to tenths, so that errors do not accumulate along the line.
    pen: (i64, i64),
}

impl Path {
    /// Creates a path that begins at a point.
    pub fn from(point: Spot) -> Path {
        let mut path = Path::default();
        path.move_to(point);
        path
    }

    /// Creates a line through the given points.
    pub fn through(points: &[Spot]) -> Path {
        let Some((first, later)) = points.split_first() else { return Path::default() };
        let mut path = Path::from(*first);
        for (index, point) in later.iter().enumerate() {
            let (to, pen) = ((tenths(point.0), tenths(point.1)), path.pen);
            // A single letter applies to all points that follow.
            path.data.push_str(if index == 0 { "l" } else { "" });
            path.number(to.0 - pen.0, index == 0);
            path.number(to.1 - pen.1, false);
            path.pen = to;
        }
        path
    }

    pub fn move_to(&mut self, point: Spot) {
        self.pen = (tenths(point.0), tenths(point.1));
        self.data.push('M');
        self.number(self.pen.0, true);
        self.number(self.pen.1, false);
    }

    /// Appends a horizontal line to the right.
    pub fn across(&mut self, length: f64) {
        self.data.push('h');
        self.number(tenths(length), true);
    }

    /// Appends a vertical line downwards.
    pub fn down(&mut self, length: f64) {
        self.data.push('v');
        self.number(tenths(length), true);
    }

    /// Writes a number, preceded by a space if it would otherwise merge with the previous one.
    fn number(&mut self, tenths: i64, first: bool) {
        if !first && tenths >= 0 {
            self.data.push(' ');
        }
        self.data.push_str(&decimal(tenths));
    }

    /// Returns the value of the attribute `d`.
    pub fn data(&self) -> &str {
        &self.data
    }
}

/// Formats a length to a tenth of a pixel.
pub fn pixels(length: f64) -> String {
    decimal(tenths(length))
}

fn tenths(length: f64) -> i64 {
    (length * 10.0).round() as i64
}

/// Formats a number with as few digits as possible: `-.5`, `12`, `7.3`.
fn decimal(tenths: i64) -> String {
    let mut text = if tenths < 0 { "-".to_owned() } else { String::new() };
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    if whole > 0 || rest == 0 {
        let _ = write!(text, "{whole}");
    }
    if rest > 0 {
        let _ = write!(text, ".{rest}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{Path, Spot, decimal, from_segment, thinned};
    use jostle_sim::Rng;

    /// A wave with noise, a peak one point wide, and a level part.
    fn curve() -> Vec<Spot> {
        let mut rng = Rng::new(11, 3);
        let height = |i: usize| match i {
            137 => 5.0,
            200..300 => 100.0,
            _ => 120.0 + 40.0 * (i as f64 * 0.03).sin(),
        };
        (0..400).map(|i| (i as f64, height(i) + 0.5 * f64::from(rng.unit()))).collect()
    }

    /// Parses path data that consists of one `M` and one `l`.
    fn read(data: &str) -> Vec<Spot> {
        let spaced = data.replace(['M', 'l'], " ").replace('-', " -");
        let numbers: Vec<f64> =
            spaced.split_whitespace().map(|number| number.parse().expect("a number")).collect();
        let mut points: Vec<Spot> = vec![(numbers[0], numbers[1])];
        for step in numbers[2..].chunks(2) {
            let last = points[points.len() - 1];
            points.push((last.0 + step[0], last.1 + step[1]));
        }
        points
    }

    fn distance(point: Spot, line: &[Spot]) -> f64 {
        let distances = line.windows(2).map(|pair| from_segment(point, pair[0], pair[1]));
        distances.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_thinned_line_stays_within_half_a_pixel_of_every_point() {
        let points = curve();
        let kept = thinned(&points);
        assert!(kept.len() < points.len() / 3, "{} of {} are kept", kept.len(), points.len());
        let drawn = read(Path::through(&kept).data());
        assert_eq!(drawn.len(), kept.len());
        for point in &points {
            let distance = distance(*point, &drawn);
            assert!(distance <= 0.5, "{point:?} is {distance} pixels from the line");
        }
    }

    #[test]
    fn ends_and_extremes_are_kept() {
        let (points, kept) = (curve(), thinned(&curve()));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[399]));
        let top = |line: &[Spot]| line.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
        let bottom = |line: &[Spot]| line.iter().map(|point| point.1).fold(0.0, f64::max);
        assert_eq!(top(&kept), points[137].1, "the peak of one point");
        assert!((bottom(&kept) - bottom(&points)).abs() <= 0.5);
    }

    #[test]
    fn few_points_stay_as_they_are() {
        assert_eq!(thinned(&[]), []);
        assert_eq!(thinned(&[(1.0, 2.0)]), [(1.0, 2.0)]);
        let closed = [(0.0, 0.0), (10.0, 0.0), (0.0, 0.0)];
        assert_eq!(thinned(&closed), closed, "a line that comes back on itself");
        assert_eq!(thinned(&[(0.0, 0.0), (5.0, 0.1), (10.0, 0.0)]), [(0.0, 0.0), (10.0, 0.0)]);
    }

    #[test]
    fn path_data_is_short_and_no_error_adds_up() {
        let path = Path::through(&[(10.0, 20.0), (10.26, 19.5), (11.0, 19.5), (9.0, 30.0)]);
        assert_eq!(path.data(), "M10 20l.3-.5.7 0-2 10.5".replace(".5.7", ".5 .7"));
        let thirds: Vec<Spot> = (0..300).map(|i| (f64::from(i) / 3.0, 0.0)).collect();
        let end = read(Path::through(&thirds).data())[299].0;
        assert!((end - 299.0 / 3.0).abs() <= 0.051, "the end is at {end}");
        assert_eq!([-5, 0, 120, 73, -10].map(decimal), ["-.5", "0", "12", "7.3", "-1"]);
    }
}
