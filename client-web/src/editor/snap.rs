//! Snapping to the world's unit and to the edges and centres of nearby pieces.

use jostle_sim::Vec2;

/// Worlds whose height is below this have a snapping unit smaller than 1.
const UNITS_MIN: f32 = 20.0;

/// The snapping unit of a world: 1, or less in a small world.
pub fn unit_of(world: Vec2) -> f32 {
    let mut unit = 1.0;
    while world.y < UNITS_MIN * unit && unit > 0.001 {
        unit *= 0.1;
    }
    unit
}

/// A rectangle to which others align.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extents {
    pub low: Vec2,
    pub high: Vec2,
}

impl Extents {
    pub fn around(center: Vec2, half: Vec2) -> Extents {
        Extents { low: center - half, high: center + half }
    }

    pub fn center(&self) -> Vec2 {
        (self.low + self.high) * 0.5
    }

    fn marks(&self, axis: usize) -> [f32; 3] {
        [self.low, self.center(), self.high].map(|corner| corner.to_array()[axis])
    }
}

/// The lines to which something was aligned: the x of a vertical line and the y of a horizontal one.
pub type Guides = [Option<f32>; 2];

/// The settings and neighbours that snapping uses.
#[derive(Clone, Debug, Default)]
pub struct Snapping {
    /// Coordinates snap to multiples of this; 0 disables snapping.
    pub unit: f32,
    /// Maximum distance at which the edges of other pieces attract, world units.
    pub reach: f32,
    pub others: Vec<Extents>,
}

impl Snapping {
    pub fn off() -> Snapping {
        Snapping::default()
    }

    /// The displacement of a rectangle moved by `by`, adjusted so that an edge or its centre aligns with another piece,
    /// or its anchor with the unit.
    pub fn moved(&self, moving: Extents, anchor: Vec2, by: Vec2) -> (Vec2, Guides) {
        let mut guides = Guides::default();
        let way = std::array::from_fn(|axis| {
            let by = by.to_array()[axis];
            let marks = moving.marks(axis);
            match self.nearest(axis, &marks.map(|mark| mark + by)) {
                Some((shift, line)) => {
                    guides[axis] = Some(line);
                    by + shift
                }
                None => self.on_unit(anchor.to_array()[axis] + by) - anchor.to_array()[axis],
            }
        });
        (Vec2::from_array(way), guides)
    }

    /// Snaps a single coordinate.
    pub fn line(&self, axis: usize, at: f32) -> (f32, Option<f32>) {
        match self.nearest(axis, &[at]) {
            Some((shift, line)) => (at + shift, Some(line)),
            None => (self.on_unit(at), None),
        }
    }

    /// The multiple of the unit nearest to a coordinate.
    pub fn on_unit(&self, at: f32) -> f32 {
        if self.unit > 0.0 { (at / self.unit).round() * self.unit } else { at }
    }

    /// The smallest shift that aligns one of the marks with a line of another piece, and that line.
    fn nearest(&self, axis: usize, marks: &[f32]) -> Option<(f32, f32)> {
        if self.unit <= 0.0 {
            return None;
        }
        let lines = self.others.iter().flat_map(|other| other.marks(axis));
        let shifts = lines.flat_map(|line| marks.iter().map(move |mark| (line - mark, line)));
        let near = shifts.filter(|(shift, _)| shift.abs() <= self.reach);
        near.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    }
}
