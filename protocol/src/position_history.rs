//! The last few positions of a point, used to predict its next one.

use crate::limits::QUANTA_MAX;

/// A position in quanta.
pub type Position = [i32; 2];

/// A displacement of this many quanta or fewer is the jitter of a resting point, not a velocity.
const TREMBLING: i32 = 1;

/// A point's positions in the four newest snapshots, newest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PositionHistory([Position; 4]);

impl PositionHistory {
    /// The history of a new point, as if it had always been at this position.
    pub fn resting(position: Position) -> PositionHistory {
        PositionHistory([position; 4])
    }

    /// The newest position.
    pub fn position(&self) -> Position {
        self.0[0]
    }

    /// Adds the point's position in the next snapshot.
    pub fn push(&mut self, position: Position) {
        let [newest, second, third, _] = self.0;
        self.0 = [position, newest, second, third];
    }

    /// Returns true if the point moved within the four snapshots.
    pub fn is_moving(&self) -> bool {
        let [newest, older @ ..] = self.0;
        // This uses one branch instead of six, since it runs for every point and most points are at rest.
        let apart = |[x, y]: Position| x ^ newest[0] | y ^ newest[1];
        apart(older[0]) | apart(older[1]) | apart(older[2]) != 0
    }

    /// The last three displacements along an axis, newest first.
    pub fn displacements(&self, axis: usize) -> [i32; 3] {
        let at = |age: usize| self.0[age][axis];
        [at(0) - at(1), at(1) - at(2), at(2) - at(3)]
    }

    /// The next position if the displacement along each axis is `next`, applied to the last three displacements.
    pub fn extrapolated(&self, next: impl Fn([i32; 3]) -> i32) -> Position {
        [0, 1].map(|axis| {
            (self.0[0][axis] + next(self.displacements(axis))).clamp(-QUANTA_MAX, QUANTA_MAX)
        })
    }

    /// The expected next position, if the last displacement is repeated.
    pub fn expected(&self) -> Position {
        self.extrapolated(|[last, ..]| if last.abs() <= TREMBLING { 0 } else { last })
    }
}
