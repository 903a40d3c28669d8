//! The conjugate solver: velocities that satisfy all contacts at once, found by accelerated sweeps
//! that stop when they have converged.
//!
//! One file a stage, in the order of a step:
//! 1. `impacts`: bounces, pair by pair, each at its time;
//! 2. `rows`: pairs that may touch within the step (`gap` says when and along which normal);
//! 3. `travel`: gravity, and what other forces do (see `forces`);
//! 4. `islands`: rows that share no movable body are solved apart, each with
//!    - `warm`: the last step's impulses, as far as they cannot add energy,
//!    - `sweep`: Gauss-Seidel with conjugate directions, until the residual is small, over
//!      `trees`: what carries the load, solved exactly if nothing begins to slide or to part,
//!      `lines`: chains along an axis, solved exactly in any case by pooling (`pools`), and the rest,
//!    - `guard`: what f32 cannot solve so is solved plainly, or stands still,
//!    - `doubts`: rows of fast pairs, looked at again with the speeds that were found,
//!    - `squeezes`: bodies that bounced and are held all the same;
//!
//!    and `strays`: pairs that only these speeds bring together;
//! 5. `travel`: the bodies move;
//! 6. `places`: overlap beyond the slop is moved away;
//! 7. `walls`: nobody ends in one.

mod doubts;
mod gap;
mod guard;
mod impacts;
mod islands;
mod lines;
mod places;
mod pools;
mod rows;
mod squeezes;
mod strays;
mod sweep;
mod travel;
mod trees;
mod walls;
mod warm;

use crate::bodies::{Bodies, REACH_MIN};
use crate::features::{CAN, Features};
use crate::forces::Move;
use crate::math::{clamp, clamp_length, max, min};
use crate::pairs::{Pair, shapes};
use glam::Vec2;
use guard::Guard;
pub(crate) use impacts::Bounces;
use impacts::Impacts;
use islands::Islands;
use lines::Lines;
use places::Places;
use rows::Step;
pub(crate) use rows::{Facts, Row};
pub(crate) use strays::ROUNDS_MAX as STRAYS_MAX;
use strays::Strays;
use travel::Travel;
use trees::Trees;
use walls::Walls;

/// Settings of the conjugate solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conjugate {
    /// Sweeps end when none changes a relative speed by more than this share of what gravity gives
    /// in a step, in (0, 1]. Default 0.005.
    pub tolerance: f32,
    /// Sweeps over an island a step, 1..=1000. Default 400.
    pub sweeps_max: u32,
    /// Visits of rows a step, over all islands, 1000..=1e9: bounds the time of the worst step.
    /// Every island has [`SWEEPS_MIN`] sweeps all the same. Default 2e6: with less a pile of
    /// 20,000 comes to rest late or never, and then takes more time than one that does.
    pub work_max: u32,
    /// Closing speed below which nothing bounces, units/s, 0..=100. Default 2.
    pub bounce_threshold: f32,
    /// Overlap left alone, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Share of the overlap beyond the slop that a pass moves away, in (0, 1]. Default 0.4.
    pub correction: f32,
    /// Most that a pass moves a pair apart, or a body, world units, above 0 and at most 100. Default 0.3.
    pub correction_max: f32,
    /// Passes over the positions a step, 0..=60. Default 4.
    pub position_passes: u32,
}

impl Default for Conjugate {
    fn default() -> Conjugate {
        Conjugate {
            tolerance: 0.005,
            sweeps_max: 400,
            work_max: 2_000_000,
            bounce_threshold: 2.0,
            slop: 0.005,
            correction: 0.4,
            correction_max: 0.3,
            position_passes: 4,
        }
    }
}

impl Conjugate {
    /// Panics unless every setting is in its documented range.
    pub(crate) fn check(&self) {
        assert!(self.tolerance > 0.0 && self.tolerance <= 1.0, "tolerance {}", self.tolerance);
        assert!((1..=1000).contains(&self.sweeps_max), "sweeps_max {}", self.sweeps_max);
        assert!((1000..=1_000_000_000).contains(&self.work_max), "work_max {}", self.work_max);
        let threshold = self.bounce_threshold;
        assert!((0.0..=100.0).contains(&threshold), "bounce threshold {threshold}");
        assert!((0.0..=1.0).contains(&self.slop), "slop {}", self.slop);
        assert!(self.correction > 0.0 && self.correction <= 1.0, "correction {}", self.correction);
        let most = self.correction_max;
        assert!(most > 0.0 && most <= 100.0, "correction_max {most}");
        assert!(self.position_passes <= 60, "position_passes {}", self.position_passes);
    }
}

/// Sweeps that every island has, whatever the budget.
pub const SWEEPS_MIN: u32 = 4;
/// Islands of fewer rows are solved more precisely by the square of that, down to [`PRECISE`] of the
/// tolerance: it costs nothing.
const FEW_ROWS: f32 = 30.0;
const PRECISE: f32 = 0.001;
/// Islands of more rows are solved more precisely by the ratio: what the rows of a high pile each
/// leave of their speeds adds up, and it creeps. At a four times coarser tolerance a pile of 20,000
/// goes on sliding down for half a minute.
const MANY_ROWS: f32 = 10_000.0;
/// Share of the largest speed that is rounding.
const ROUNDING: f32 = 1e-6;
/// What counts as gravity's gain in a step where there is none, units/s.
const GAIN_MIN: f32 = 0.001;

/// What a step works on; nothing of it is state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Workspace {
    /// In (a, b) order.
    pub rows: Vec<Row>,
    /// Of each row.
    pub facts: Vec<Facts>,
    /// By slot: rows in which it is too deep in another body to have a side.
    crowd: Vec<u8>,
    impacts: Impacts,
    islands: Islands,
    lines: Lines,
    trees: Trees,
    strays: Strays,
    guard: Guard,
    budget: Budget,
    /// Whether somebody may move by more than the thinnest body's half-size in this step, and whether
    /// a row is of such a pair.
    quick: bool,
    doubtful: bool,
    travel: Travel,
    places: Places,
    walls: Walls,
    /// Sweeps of the island that took most.
    pub sweeps: u32,
    /// Visits of rows.
    pub work: u64,
}

/// What a step is given beside the bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a> {
    pub settings: &'a Conjugate,
    pub gravity: Vec2,
    pub dt: f32,
    pub speed_max: f32,
    pub features: Features,
}

impl Frame<'_> {
    /// How far gravity takes a body in a step.
    fn fall(&self) -> f32 {
        self.gravity.length() * self.dt * self.dt
    }
}

impl Workspace {
    /// Forgets the bounces of the last step.
    pub fn begin(&mut self, bodies: &Bodies) {
        self.impacts.begin(bodies.alive.len());
        if CAN.continuous {
            self.walls.remember(bodies);
        }
    }

    /// How far each moving body looks for others; before bounces also for whom it may yet meet.
    /// Whether there may be any.
    pub fn reach(&mut self, bodies: &mut Bodies, frame: &Frame, bounces: bool) -> bool {
        let (fall, mut fastest) = (frame.fall(), 0.0);
        let thinnest = bodies.thinnest();
        let Bodies { moving, motion, velocity, reach, .. } = bodies;
        for &slot in moving.iter() {
            let slot = slot as usize;
            if Bodies::is_pushed(motion[slot]) {
                velocity[slot] = clamp_length(velocity[slot], frame.speed_max);
            }
            let squared = velocity[slot].length_squared();
            reach[slot] = REACH_MIN + fall + squared.sqrt() * frame.dt;
            fastest = max(fastest, squared);
        }
        self.quick = CAN.continuous && fastest.sqrt() * frame.dt > thinnest;
        let may = frame.features.restitution || self.quick;
        bounces && may && self.impacts.reach_further(bodies, frame)
    }

    /// Stage 1. Bounces change speeds, and with them who may touch whom: unless there were none, the
    /// caller mends the pair list. If some are ahead it asks again; the `last` time all are taken.
    pub fn bounce(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        frame: &Frame,
        last: bool,
    ) -> Bounces {
        self.impacts.take(bodies, pairs, frame, last)
    }

    /// Stage 2.
    pub fn meet(&mut self, bodies: &Bodies, pairs: &[Pair], frame: &Frame) {
        let step = Step { dt: frame.dt, fall: frame.fall(), quick: self.quick };
        let paths = &self.impacts.paths;
        let rows = (&mut self.rows, &mut self.facts, &mut self.crowd);
        let gather = match (frame.features.circles, frame.features.boxes) {
            (true, false) => rows::gather::<{ shapes::CIRCLES }>,
            (false, true) => rows::gather::<{ shapes::BOXES }>,
            _ => rows::gather::<{ shapes::BOTH }>,
        };
        self.doubtful = gather(bodies, pairs, paths, step, rows);
    }

    /// Who bounced, and who has rows.
    pub fn met(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let strikes = self.impacts.strikes.iter().map(|strike| [strike.a, strike.b]);
        strikes.chain(self.rows.iter().map(|row| [row.a, row.b]))
    }

    /// Stages 3 and 4: the velocities at the end of the step.
    pub fn solve(&mut self, bodies: &mut Bodies, pairs: &[Pair], moves: &[Move], frame: &Frame) {
        impacts::mark(&mut self.impacts.strikes, &self.rows, &mut self.facts);
        let gain = frame.gravity * frame.dt;
        if !travel::accelerate(bodies, gain, frame.speed_max, &mut self.travel) {
            self.leave_out_unsound(bodies);
        }
        travel::force(bodies, moves, frame.dt, &mut self.travel);
        // Forces may swing a body out and back within the step.
        self.quick |= CAN.continuous && !moves.is_empty();
        self.lines.reserve(bodies.alive.len());
        self.trees.reserve(bodies.alive.len());
        self.islands.find(bodies.alive.len(), &self.rows);
        self.budget = Budget { work: frame.settings.work_max, rows: self.rows.len() as u32 };
        self.sweeps = 0;
        self.work = 0;
        for island in 0..self.islands.count() {
            let places = &self.islands.rows[self.islands.range(island)];
            match *places {
                [place] if self.is_alone(place) => self.solve_alone(place, bodies, frame),
                _ => {
                    let (rows, velocity) = (&mut self.rows, &mut bodies.velocity);
                    match frame.features.friction {
                        true => warm::start::<true>(rows, places, velocity),
                        false => warm::start::<false>(rows, places, velocity),
                    }
                    self.solve_island(island, bodies, pairs, frame);
                }
            }
        }
    }

    /// Whether nothing can come of a row that is an island but its own impulses.
    fn is_alone(&self, place: u32) -> bool {
        !self.facts[place as usize].fast && self.impacts.is_empty()
    }

    /// A row that shares its movable bodies with no other is solved by one visit, since both impulses
    /// act on the same masses; a second one solves what rounding left of the first.
    fn solve_alone(&mut self, place: u32, bodies: &mut Bodies, frame: &Frame) {
        const VISITS: u32 = 2;
        let (row, velocity) = (&mut self.rows[place as usize], &mut bodies.velocity);
        match frame.features.friction {
            true => sweep::alone::<true>(row, velocity, VISITS),
            false => sweep::alone::<false>(row, velocity, VISITS),
        }
        self.work += self.budget.spend(VISITS, 1);
        self.budget.rows -= 1;
        self.sweeps = self.sweeps.max(VISITS);
    }

    /// Drops the rows of bodies whose place or speed is no number: they touch nobody any more, and
    /// leave the world at the end of the step.
    #[cold]
    fn leave_out_unsound(&mut self, bodies: &Bodies) {
        let sound = |row: &Row| bodies.is_sound(row.a as usize) && bodies.is_sound(row.b as usize);
        let mut kept = self.rows.iter().map(sound);
        self.facts.retain(|_| kept.next().is_some_and(|kept| kept));
        self.rows.retain(sound);
    }

    /// Looks for bodies that are faster than their reach; the caller mends the pair list for them.
    pub fn reach_out(&mut self, bodies: &mut Bodies, frame: &Frame) -> bool {
        let strays = self.strays.reach_out(bodies, frame.dt);
        self.quick |= strays;
        strays
    }

    /// Finds the pairs of the rows in a list that was made anew.
    pub fn find_again(&mut self, pairs: &[Pair]) {
        strays::find_again(&mut self.rows, pairs);
    }

    /// Solves for pairs that these bodies would touch; whether there were any.
    pub fn catch_strays(&mut self, bodies: &mut Bodies, pairs: &[Pair], frame: &Frame) -> bool {
        let rows = (&mut self.rows, &mut self.facts);
        if !self.strays.gather(bodies, pairs, &self.impacts.paths, frame.dt, rows) {
            return false;
        }
        self.doubtful = true;
        self.islands.find(bodies.alive.len(), &self.rows);
        self.budget.rows = self.rows.len() as u32;
        for island in 0..self.islands.count() {
            let places = &self.islands.rows[self.islands.range(island)];
            if places.iter().any(|&place| self.strays.is_new[place as usize]) {
                self.solve_island(island, bodies, pairs, frame);
            }
        }
        true
    }

    /// The rows of one island, from the impulses and velocities that they have.
    fn solve_island(&mut self, island: usize, bodies: &mut Bodies, pairs: &[Pair], frame: &Frame) {
        let places = &self.islands.rows[self.islands.range(island)];
        let (tolerance, stiff) = tolerance(&self.rows, places, &bodies.velocity, frame);
        let mut sum = 0;
        for round in 1..=doubts::ROUNDS_MAX {
            self.lines.find(&self.rows, places);
            let sweeps_max = self.budget.sweeps(frame.settings.sweeps_max);
            let end = sweep::End { tolerance, sweeps_max };
            let blocks = (&mut self.lines, &mut self.trees);
            let (rows, velocity) = (&mut self.rows, &mut bodies.velocity);
            if stiff {
                self.guard.remember(rows, places, velocity);
            }
            let sweeps = if frame.features.friction {
                sweep::solve::<true>(rows, places, blocks, velocity, end)
            } else {
                sweep::solve::<false>(rows, places, blocks, velocity, end)
            };
            if stiff {
                self.guard.check(rows, places, velocity);
            }
            if stiff || sweeps == sweeps_max {
                sweep::walls(rows, places, velocity);
            }
            self.work += self.budget.spend(sweeps, places.len());
            sum += sweeps;
            let (rows, facts) = (&mut self.rows, &mut self.facts);
            let state = (&mut self.impacts, &mut self.travel);
            let held = squeezes::settle(bodies, (rows, facts), places, pairs, state, frame);
            let paths = &self.impacts.paths;
            if round == doubts::ROUNDS_MAX {
                break;
            }
            let doubted = self.doubtful
                && doubts::settle(bodies, rows, facts, places, pairs, paths, frame.dt);
            if !(doubted || held) {
                break;
            }
        }
        self.budget.rows -= places.len() as u32;
        self.sweeps = self.sweeps.max(sum);
    }

    /// Keeps the impulses for the next step.
    pub fn store(&self, bodies: &Bodies, pairs: &mut [Pair], frame: &Frame) {
        let store = match (frame.features.circles, frame.features.boxes) {
            (true, false) => rows::store::<{ shapes::CIRCLES }>,
            (false, true) => rows::store::<{ shapes::BOXES }>,
            _ => rows::store::<{ shapes::BOTH }>,
        };
        store(bodies, &self.rows, pairs);
    }

    /// Stages 5 to 7: the places at the end of the step.
    pub fn go(&mut self, bodies: &mut Bodies, pairs: &[Pair], frame: &Frame) {
        let gone = travel::go(bodies, &self.rows, &mut self.facts, &mut self.travel, frame.dt);
        if !gone.sound {
            self.leave_out_unsound(bodies);
        }
        let rows = (self.rows.as_mut_slice(), self.facts.as_mut_slice());
        let scratch = (&mut self.lines, &mut self.trees, &mut self.places);
        let slop = frame.settings.slop;
        let quick = self.quick || !self.impacts.is_empty();
        let far = CAN.continuous && self.walls.may_be_passed(bodies, gone.least, slop, quick);
        let overlaps = gone.least < -slop;
        if overlaps {
            places::part(bodies, rows, pairs, frame.settings, scratch);
        }
        if CAN.continuous && (overlaps || far) {
            self.walls.keep(bodies, pairs, &self.impacts.paths, slop);
        }
    }
}

/// Change of a relative speed at which the sweeps over an island end, units/s, and whether its masses
/// are so different that the result has to be guarded.
fn tolerance(rows: &[Row], island: &[u32], velocity: &[Vec2], frame: &Frame) -> (f32, bool) {
    let (mut fastest, mut lightest, mut heaviest) = (0.0, 0.0, f32::INFINITY);
    for &place in island {
        let row = &rows[place as usize];
        for (body, weight) in [(row.a, row.weight_a), (row.b, row.weight_b)] {
            let speed = velocity[body as usize].abs();
            fastest = max(fastest, max(speed.x, speed.y));
            lightest = max(lightest, weight);
            heaviest = if weight > 0.0 { min(heaviest, weight) } else { heaviest };
        }
    }
    let gain = max(frame.gravity.length() * frame.dt, GAIN_MIN);
    let count = island.len() as f32;
    let (few, many) = (count / FEW_ROWS, MANY_ROWS / count);
    let share = frame.settings.tolerance * clamp(few * few, PRECISE, 1.0) * min(many, 1.0);
    (max(gain * share, fastest * ROUNDING), lightest > guard::RATIO * heaviest)
}

/// Visits of rows that are left for the islands to come; what one leaves the others may use.
#[derive(Clone, Copy, Debug, Default)]
struct Budget {
    work: u32,
    rows: u32,
}

impl Budget {
    /// Sweeps that the next island may take.
    fn sweeps(&self, sweeps_max: u32) -> u32 {
        (self.work / self.rows.max(1)).max(SWEEPS_MIN).min(sweeps_max)
    }

    fn spend(&mut self, sweeps: u32, rows: usize) -> u64 {
        let work = u64::from(sweeps) * rows as u64;
        self.work = self.work.saturating_sub(work.min(u64::from(u32::MAX)) as u32);
        work
    }
}

#[cfg(test)]
mod tests;
