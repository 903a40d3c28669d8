//! Obstacles for particles, and a grid that finds the obstacles near a point.

use crate::math::max;
use crate::narrow_phase::overlap::nearest_exit;
use crate::shape::{Aabb, Shape};
use glam::Vec2;

/// A shape at a position, out of which particles are pushed. Its centre is the quantised one that clients see, so
/// that server and clients agree bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Shape, centred on `center`.
    pub shape: Shape,
    /// Centre in world units, a multiple of the scene's quantum.
    pub center: Vec2,
}

/// Rounds a position to whole quanta, with halves away from zero. Saturates far outside any world.
pub fn quantise(position: Vec2, quantum: f32) -> [i32; 2] {
    let quanta = position / quantum;
    [quanta.x.round() as i32, quanta.y.round() as i32]
}

/// Returns the position given by whole quanta. This is exact if the quantum is a power of two and the quanta are below
/// 2^24.
pub fn dequantise(quanta: [i32; 2], quantum: f32) -> Vec2 {
    Vec2::new(quanta[0] as f32, quanta[1] as f32) * quantum
}

impl Obstacle {
    /// Creates the obstacle for a body at the position seen by clients.
    pub fn new(shape: Shape, quanta: [i32; 2], quantum: f32) -> Obstacle {
        Obstacle { shape, center: dequantise(quanta, quantum) }
    }

    fn bounds(&self) -> Aabb {
        Aabb::around(self.center, self.shape.half_extent())
    }

    /// Moves a point that lies strictly inside to the border, and removes the inward part of its
    /// velocity so that it slides (C24k).
    #[inline]
    pub(super) fn push_out(&self, position: &mut Vec2, velocity: &mut Vec2) {
        let offset = *position - self.center;
        if !self.shape.contains(offset) {
            return;
        }
        let (normal, depth) = match self.shape {
            Shape::Circle { radius } => circle_exit(offset, radius),
            Shape::Box { half } => {
                let exit = nearest_exit(offset, half);
                (exit.normal, -exit.separation)
            }
        };
        *position += normal * depth;
        let inward = velocity.dot(normal);
        if inward < 0.0 {
            *velocity -= normal * inward;
        }
    }
}

/// The exit from a circle, which is along the radius, or straight up from the exact centre (C17).
fn circle_exit(offset: Vec2, radius: f32) -> (Vec2, f32) {
    let squared = offset.length_squared();
    if squared <= f32::MIN_POSITIVE {
        return (Vec2::Y, radius);
    }
    let distance = squared.sqrt();
    (offset / distance, radius - distance)
}

/// Number of cells along the longer side of the grid.
const CELLS: f32 = 64.0;
/// Maximum number of comparisons between obstacles and particles in a tick, per entry of a limited grid.
const LOOKS_PER_ENTRY: usize = 16;

/// A uniform grid of the obstacles, rebuilt every tick. A single array contains the obstacle lists of all cells. A
/// particle is tested against the obstacles in the cell into which it moved. If it is then pushed into another
/// obstacle, that one is handled in the next tick.
#[derive(Clone, Debug, Default)]
pub(super) struct ObstacleGrid {
    low: Vec2,
    cell: f32,
    columns: usize,
    rows: usize,
    /// Index of each cell's first entry in `entries`, with one more index at the end.
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// Maximum number of entries that the grid may have, if limited.
    entries_max: Option<usize>,
    /// Whether there were more entries, or too many comparisons with particles. The grid then finds no more
    /// obstacles.
    is_over: bool,
}

impl ObstacleGrid {
    /// Creates an empty grid with this limit on entries.
    pub fn limited(entries_max: usize) -> ObstacleGrid {
        ObstacleGrid { entries_max: Some(entries_max), ..ObstacleGrid::default() }
    }

    /// Whether the limit on entries or on comparisons was exceeded.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Maximum number of comparisons between obstacles and particles in a tick.
    pub fn looks_max(&self) -> usize {
        self.entries_max.map_or(usize::MAX, |most| most.saturating_mul(LOOKS_PER_ENTRY))
    }

    /// Records that the limit on comparisons was exceeded.
    pub fn exceed(&mut self) {
        self.is_over = true;
    }

    /// Sorts the obstacles into all cells that their boxes touch, using a counting sort.
    pub fn fill(&mut self, obstacles: &[Obstacle]) {
        self.choose_cells(obstacles);
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        for obstacle in obstacles {
            self.each_cell(obstacle, |starts, cell| starts[cell + 1] += 1);
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let total = self.starts[self.starts.len() - 1] as usize;
        self.entries.clear();
        if self.entries_max.is_some_and(|most| total > most) {
            self.is_over = true;
            (self.columns, self.rows) = (0, 0);
            return;
        }
        self.entries.resize(total, 0);
        let mut entries = std::mem::take(&mut self.entries);
        for (index, obstacle) in (0u32..).zip(obstacles) {
            self.each_cell(obstacle, |starts, cell| {
                entries[starts[cell] as usize] = index;
                starts[cell] += 1;
            });
        }
        self.entries = entries;
        // Filling advanced each start to that of the next cell, so shift them back.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// Computes the bounds of all obstacles and the cell size.
    fn choose_cells(&mut self, obstacles: &[Obstacle]) {
        let mut region = obstacles[0].bounds();
        for obstacle in obstacles {
            let bounds = obstacle.bounds();
            region = region.union(&bounds);
        }
        let extent = region.high - region.low;
        self.low = region.low;
        self.cell = max(max(extent.x, extent.y) / CELLS, f32::MIN_POSITIVE);
        self.columns = (extent.x / self.cell) as usize + 1;
        self.rows = (extent.y / self.cell) as usize + 1;
    }

    /// Calls `visit` with every cell that the obstacle's box touches.
    fn each_cell(&mut self, obstacle: &Obstacle, mut visit: impl FnMut(&mut [u32], usize)) {
        let bounds = obstacle.bounds();
        let (left, bottom) = self.clamped_cell(bounds.low);
        let (right, top) = self.clamped_cell(bounds.high);
        for row in bottom..=top {
            for column in left..=right {
                visit(&mut self.starts, row * self.columns + column);
            }
        }
    }

    /// Column and row of a point inside the region.
    fn clamped_cell(&self, point: Vec2) -> (usize, usize) {
        let at = (point - self.low) / self.cell;
        let column = (at.x as usize).min(self.columns - 1);
        let row = (at.y as usize).min(self.rows - 1);
        (column, row)
    }

    /// Obstacles that may contain the point, in their original order.
    #[inline]
    pub fn candidates(&self, point: Vec2) -> &[u32] {
        let at = (point - self.low) / self.cell;
        // Comparing before converting, and converting to 32 bits, costs a fraction of a saturating conversion to 64.
        let is_inside = at.x >= 0.0 && at.y >= 0.0;
        if !is_inside || at.x >= self.columns as f32 || at.y >= self.rows as f32 {
            return &[];
        }
        let (column, row) = (at.x as i32 as usize, at.y as i32 as usize);
        let cell = row * self.columns + column;
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}
