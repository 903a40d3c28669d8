//! Paths around fixed obstacles, on a coarse grid.

use jostle_game::Game;
use jostle_sim::math::max;
use jostle_sim::{Motion, Vec2};
use std::collections::VecDeque;

/// Maximum number of columns and rows.
const CELLS_MAX: f32 = 64.0;
/// Maximum number of cells that a bot looks ahead on its path.
const AHEAD: usize = 16;
/// Depth in an obstacle up to which a hero only touches it, world units.
const TOUCHES: f32 = 1.0;
const FAR: u16 = u16::MAX;

/// A grid over the world that marks where a hero's centre cannot be.
pub struct Terrain {
    cell: Vec2,
    columns: usize,
    rows: usize,
    /// A hero's half extent.
    half: Vec2,
    blocked: Vec<bool>,
    /// Where obstacles are: centre, and distance on each axis within which a hero's centre cannot be.
    obstacles: Vec<(Vec2, Vec2)>,
    /// Number of steps to the goal of the latest search.
    steps: Vec<u16>,
    queue: VecDeque<usize>,
}

impl Terrain {
    /// Creates a grid for an empty world of this size, and for heroes with this half extent.
    pub fn new(size: Vec2, half: Vec2) -> Terrain {
        let side = max(max(half.x, half.y), max(size.x, size.y) / CELLS_MAX);
        let columns = ((size.x / side).ceil() as usize).max(1);
        let rows = ((size.y / side).ceil() as usize).max(1);
        let count = columns * rows;
        Terrain {
            cell: Vec2::splat(side),
            columns,
            rows,
            half,
            blocked: vec![false; count],
            obstacles: Vec::new(),
            steps: vec![FAR; count],
            queue: VecDeque::new(),
        }
    }

    /// Marks the cells that heroes cannot be in.
    pub fn survey(&mut self, game: &Game) {
        self.blocked.fill(false);
        self.obstacles.clear();
        let (scene, world) = (game.scene(), game.world());
        let Some(hero) = &scene.hero else { return };
        for body in game.bodies() {
            let meets = scene.groups_meet(hero.body.group, body.group);
            if !meets || world.motion(body.id) == Motion::Dynamic {
                continue;
            }
            let (center, reach) = (world.position(body.id), body.shape.half_extent() + self.half);
            self.obstacles.push((center, reach));
            let [left, bottom] = self.clamped(center - reach + self.cell * 0.5);
            let [right, top] = self.clamped(center + reach - self.cell * 0.5);
            for row in bottom..=top {
                for column in left..=right {
                    let middle = self.middle(row * self.columns + column);
                    let off = (middle - center).abs();
                    self.blocked[row * self.columns + column] |= off.x < reach.x && off.y < reach.y;
                }
            }
        }
    }

    /// Returns whether a hero has room at a point, exactly, so that it may touch obstacles.
    pub fn has_room(&self, point: Vec2) -> bool {
        self.obstacles.iter().all(|(center, reach)| {
            let into = *reach - (point - *center).abs();
            into.x < TOUCHES || into.y < TOUCHES
        })
    }

    /// Returns whether no obstacle lies between two points.
    pub fn is_open(&self, from: Vec2, to: Vec2) -> bool {
        let steps = (from.distance(to) / self.cell.x) as u32 + 1;
        (1..steps).all(|step| {
            let at = from.lerp(to, step as f32 / steps as f32);
            !self.blocked[self.index(at)]
        })
    }

    /// The next waypoint on the way to a destination: the furthest point of the path to which nothing is in the way.
    pub fn next(&mut self, from: Vec2, to: Vec2) -> Vec2 {
        if self.is_open(from, to) {
            return to;
        }
        let (start, goal) = (self.index(from), self.index(to));
        self.search(goal, start);
        let mut at = start;
        for step in 0..AHEAD {
            let Some(next) = self.around(at).min_by_key(|&cell| self.steps[cell]) else { break };
            if self.steps[next] >= self.steps[at] {
                // Either the goal is reached, or the grid has no path.
                return if step == 0 { to } else { self.middle(at) };
            }
            if step > 0 && !self.is_open(from, self.middle(next)) {
                break;
            }
            at = next;
        }
        if at == goal { to } else { self.middle(at) }
    }

    /// Counts the steps to `goal` from every cell that is no further away than `start`.
    fn search(&mut self, goal: usize, start: usize) {
        self.steps.fill(FAR);
        self.queue.clear();
        self.steps[goal] = 0;
        self.queue.push_back(goal);
        while let Some(cell) = self.queue.pop_front() {
            if cell == start {
                return;
            }
            let next = self.steps[cell] + 1;
            for other in self.around(cell) {
                if self.steps[other] == FAR && (!self.blocked[other] || other == start) {
                    self.steps[other] = next;
                    self.queue.push_back(other);
                }
            }
        }
    }

    /// The four adjacent cells.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (column, columns, rows) = (cell % self.columns, self.columns, self.rows);
        let row = cell / columns;
        let sides = [
            (column > 0).then(|| cell - 1),
            (column + 1 < columns).then_some(cell + 1),
            (row > 0).then(|| cell - columns),
            (row + 1 < rows).then_some(cell + columns),
        ];
        sides.into_iter().flatten()
    }

    fn clamped(&self, point: Vec2) -> [usize; 2] {
        // The cast saturates, so points to the left of or below the world fall into the first cell.
        let column = ((point.x / self.cell.x) as usize).min(self.columns - 1);
        let row = ((point.y / self.cell.y) as usize).min(self.rows - 1);
        [column, row]
    }

    fn index(&self, point: Vec2) -> usize {
        let [column, row] = self.clamped(point);
        row * self.columns + column
    }

    fn middle(&self, cell: usize) -> Vec2 {
        let (column, row) = (cell % self.columns, cell / self.columns);
        (Vec2::new(column as f32, row as f32) + 0.5) * self.cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_game::Scene;
    use std::sync::Arc;

    /// A world with a wall across it, open at the top.
    fn walled() -> (Game, Terrain) {
        let text = "title = \"Wall\"\nsize = [200, 100]\ngroups = [\"hero\", \"platform\"]\n\
                    pairs = [[\"hero\", \"platform\"]]\n[hero]\nsize = [10, 10]\nspawns = [[20, 20]]\n\
                    [[bodies]]\nkind = \"wall\"\nposition = [100, 35]\nsize = [10, 70]\n";
        let scene = Scene::parse("wall.toml", text).unwrap_or_else(|error| panic!("{error}"));
        let game = Game::new(Arc::new(scene), 1);
        let mut terrain = Terrain::new(Vec2::new(200.0, 100.0), Vec2::splat(5.0));
        terrain.survey(&game);
        (game, terrain)
    }

    #[test]
    fn a_way_leads_around_a_wall() {
        let (_, mut terrain) = walled();
        let (mut at, to) = (Vec2::new(20.0, 20.0), Vec2::new(180.0, 20.0));
        let mut highest = 0.0f32;
        for _ in 0..60 {
            at = terrain.next(at, to);
            assert!((at.x - 100.0).abs() > 9.0 || at.y > 74.0, "{at} is in the wall");
            highest = max(highest, at.y);
        }
        assert_eq!((at, highest > 74.0), (to, true));
    }

    #[test]
    fn a_place_that_nobody_reaches_is_gone_towards() {
        let (_, mut terrain) = walled();
        let inside = Vec2::new(100.0, 20.0);
        assert_eq!(terrain.next(inside, inside), inside);
        let outside = Vec2::new(f32::NAN, -1e30);
        assert!(terrain.next(outside, inside).is_finite());
    }
}
