//! A line of the newest values, as the path of an SVG.

use std::collections::VecDeque;
use std::fmt::Write;

/// The newest values, the oldest first.
#[derive(Debug)]
pub struct Plot {
    values: VecDeque<f64>,
    moments: usize,
}

impl Plot {
    /// A line of at most this many values, at least two.
    pub fn new(moments: usize) -> Plot {
        Plot { values: VecDeque::with_capacity(moments), moments: moments.max(2) }
    }

    /// Adds a value; the oldest goes when the line is full.
    pub fn push(&mut self, value: f64) {
        if self.values.len() == self.moments {
            self.values.pop_front();
        }
        self.values.push_back(value);
    }

    /// The largest value, 0 without any.
    pub fn highest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// The line in a box of this size, the newest value at its right, `highest` at its top.
    pub fn path(&self, [width, height]: [f64; 2], highest: f64) -> String {
        let mut path = String::new();
        let step = width / (self.moments - 1) as f64;
        for (age, value) in self.values.iter().rev().enumerate() {
            let (x, y) = (width - age as f64 * step, height - value / highest.max(1e-9) * height);
            let verb = if age == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{verb}{x:.1} {y:.1}");
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_value_is_at_the_right_and_old_ones_leave() {
        let mut plot = Plot::new(3);
        assert_eq!(plot.path([10.0, 10.0], 4.0), "");
        for value in [9.0, 4.0, 0.0, 2.0] {
            plot.push(value);
        }
        assert_eq!(plot.highest(), 4.0);
        assert_eq!(plot.path([10.0, 10.0], 4.0), "M10.0 5.0L5.0 10.0L0.0 0.0");
    }
}
