//! A line plot of recent values, as an SVG path.

use std::collections::VecDeque;
use std::fmt::Write;

/// Recent values, oldest first.
#[derive(Debug)]
pub struct Plot {
    values: VecDeque<f64>,
    moments: usize,
}

impl Plot {
    /// Creates a plot of at most this many values, and at least two.
    pub fn new(moments: usize) -> Plot {
        Plot { values: VecDeque::with_capacity(moments), moments: moments.max(2) }
    }

    /// Adds a value, dropping the oldest when the plot is full.
    pub fn push(&mut self, value: f64) {
        if self.values.len() == self.moments {
            self.values.pop_front();
        }
        self.values.push_back(value);
    }

    /// The largest value; 0 if empty.
    pub fn highest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// The path in a box of this size, with the newest value at its right edge and `highest` at its top.
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
