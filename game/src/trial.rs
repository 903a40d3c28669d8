//! In a trial, a scene is played for up to some minutes, and the work in each tick is counted. The counts
//! determine how long a busy tick takes, without a clock, so a trial has the same result on every machine and
//! under any load.
//!
//! Players press all keys. First they play the scene undisturbed. Then all its bodies are stirred repeatedly, which
//! is harder on the solver than anything players do: first in new games, where a layout is as dense as it ever gets,
//! then in the game that was played. Each part ends early once its counts add up to [`PART_US`].

use crate::scene::{WorstTick, made_max};
use crate::{Buttons, Game, Input, Kind, Phase, Scene, Seat, Tools};
use glam::Vec2;
use jostle_sim::math::{max, min};
use jostle_sim::{Motion, Rng, StepBudget, StepCounts, World};
use std::sync::Arc;

/// Seed for the game, its players' keys and the stirring.
const SEED: u64 = 7;
/// Number of ticks between two stirs. The worst tick in each such period counts.
pub const STIR_TICKS: u32 = 40;
/// Maximum number of periods in which the scene is left to its players, and in which it is stirred. The first number
/// is reduced if players cannot do anything.
const PERIODS: [u32; 2] = [160, 400];
const IDLE_PERIODS: u32 = 10;
/// Number of games that are stirred from their start, and the number of periods in each.
const NEW_GAMES: u64 = 3;
const NEW_PERIODS: u32 = 2;
/// Maximum time that the counts of one of these games may add up to, microseconds.
const NEW_US: f32 = 300_000.0;
/// Maximum time that the counts of each part may add up to, microseconds.
const PART_US: [f32; 2] = [1_000_000.0, 2_500_000.0];
/// Largest change that a stir makes to each velocity component, units/s.
const STIR_SPEED: f32 = 60.0;
/// Budget for a step in a trial. A scene that needs more is not tried any further.
const STEP: StepBudget = StepBudget { pairs: 50_000, work: 4_000_000, obstacle_cells: 1_000_000 };

/// A count taken in a step, and its cost in microseconds.
type Counted = (fn(&StepCounts) -> u64, f32);
/// Number of listed pairs per moving body up to which each pair takes longer; longer lists are accessed in memory
/// order.
const LISTED_FEW: u64 = 80;
/// The cost of each count, per solver. The costs were fitted to the slowest ticks of several hundred stirred random
/// scenes with 10 to 800 bodies and up to 500 springs, in release builds on one virtual core of a shared Intel Xeon
/// server. For nine in ten such ticks, the counts give the time to within 30 %.
const CONJUGATE_US: [Counted; 10] = [
    (|done| done.moving, 0.49),
    (|done| done.listed, 0.05),
    (|done| done.listed.min(LISTED_FEW * done.moving), 0.04),
    (|done| done.visits, 0.014),
    (|done| done.wide, 0.016),
    (|done| done.links, 0.027),
    (|done| done.nodes, 0.0255),
    (|done| done.eliminated, 0.0047),
    (|done| done.predictions, 0.03),
    (|done| done.corrected, 0.27),
];
const RELAXATION_US: [Counted; 6] = [
    (|done| done.moving, 0.023),
    (|done| done.pairs, 0.024),
    (|done| done.listed, 0.02),
    (|done| done.visits, 0.0107),
    (|done| done.touching, 0.0345),
    (|done| done.particles, 0.018),
];
/// Microseconds per spring visit, with either solver.
const SPRING_US: f32 = 0.036;
/// Microseconds per body for each player and zone, since tools and rules check all bodies.
const LOOK_US: f32 = 0.004;
/// Microseconds per body for each position tried for a hero, and per body in the tick that places the bodies for
/// a round.
const TRY_US: f32 = 0.003;
const PLACED_US: f32 = 0.4;
/// Microseconds per tick for the rules of a round.
const ROUND_US: f32 = 3.0;

/// Time added to every estimate to allow for uncounted work and for memory that is not in the cache, microseconds.
const ANY_TICK_US: f32 = 2.0;
/// Factor from the two worst ticks of the trial by their counts, however rare, to the worst tick that is promised.
/// Games have worse moments than a trial, and ticks with the same counts may take different times. The conjugate
/// solver's sweeps vary more.
const RELAXATION_MARGIN: f32 = 2.0;
const CONJUGATE_MARGIN: f32 = 2.15;
/// The same factor for the part without stirring if players cannot do anything, in which case all other games run
/// much like it.
const IDLE_MARGIN: f32 = 1.5;

/// Results of a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trial {
    /// Number of ticks played.
    pub ticks: u32,
    /// Whether all steps stayed within the trial's budget. Otherwise the trial ended at the step that did not.
    pub is_complete: bool,
    /// Time that the counts of all ticks add up to, microseconds.
    pub total_us: f32,
    /// Time of the worst tick in each period of a part, derived from its counts, microseconds.
    peaks_us: [Vec<f32>; 2],
    /// Whether players can do anything.
    has_actors: bool,
    is_conjugate: bool,
    /// Largest number of bodies at any time, and of bodies made by tools and launchers.
    bodies: u32,
    made: u32,
    /// Maximum number of bodies that tools and launchers may make, and of all bodies.
    made_max: u32,
    bodies_max: u32,
}

/// Estimates the worst tick of a busy game of this scene with a [`Trial`].
pub fn worst_tick(scene: &Scene) -> WorstTick {
    Trial::of(scene).worst_tick(scene)
}

impl Trial {
    /// Plays a scene with players who press buttons at random.
    pub fn of(scene: &Scene) -> Trial {
        Trial::played(scene, &mut RandomGame::tick)
    }

    /// Plays a scene, using `tick` for each tick.
    pub fn played<'a>(scene: &Scene, tick: &'a mut TickFn<'a>) -> Trial {
        let mut trier = Trier::new(scene, tick);
        let idle = if trier.found.has_actors { PERIODS[0] } else { IDLE_PERIODS };
        trier.found.is_complete = trier.play_part(0, idle, PART_US[0])
            && (0..NEW_GAMES).all(|number| trier.play_anew(number))
            && trier.play_part(1, PERIODS[1], PART_US[1]);
        trier.found
    }

    /// Estimates the worst tick of a busy game of the scene that was played. If a step exceeded its budget and
    /// ended the trial, the estimate is at least the worst tick that the scene's limits allow.
    pub fn worst_tick(&self, scene: &Scene) -> WorstTick {
        let (limits, ms) = (WorstTick::of(scene), self.worst_ms());
        WorstTick { ms: if self.is_complete { ms } else { max(ms, limits.ms) }, ..limits }
    }

    /// Duration of the worst tick in a busy game, milliseconds.
    pub fn worst_ms(&self) -> f32 {
        let [played, stirred] = &self.peaks_us;
        let margin = if self.is_conjugate { CONJUGATE_MARGIN } else { RELAXATION_MARGIN };
        let played_margin = if self.has_actors { margin } else { IDLE_MARGIN };
        let us = max(played_margin * worst(played), margin * worst(stirred));
        (ANY_TICK_US + us * self.growth()) / 1000.0
    }

    /// Ratio of the largest possible number of bodies to the number in the trial, where tools and launchers may
    /// not have made as many as they can.
    fn growth(&self) -> f32 {
        let missing = self.made_max.saturating_sub(self.made);
        (self.bodies + missing).min(self.bodies_max) as f32 / self.bodies.max(1) as f32
    }
}

/// The weighted geometric mean of the two highest peaks, so that a single chance event does not decide.
fn worst(peaks: &[f32]) -> f32 {
    let [mut first, mut second] = [0.0; 2];
    for &peak in peaks {
        (first, second) = (max(first, peak), max(second, min(peak, first)));
    }
    if peaks.len() < 2 { first } else { (first * (first * second).sqrt()).sqrt() }
}

/// A game whose players press random keys, except those that clear the world and change the team, and whose bodies
/// can be stirred.
#[derive(Clone)]
pub struct RandomGame {
    game: Game,
    hands: Vec<TrialPlayer>,
    inputs: Vec<(Seat, Input)>,
    rng: Rng,
}

impl RandomGame {
    /// Creates a game with as many players as the scene allows.
    pub fn new(scene: Arc<Scene>, seed: u64) -> RandomGame {
        let players = scene.players_max;
        let mut game = Game::new(scene, seed);
        (0..players).for_each(|seat| game.join(Seat(seat)));
        let hands =
            (0..players).map(|seat| TrialPlayer::new(Rng::new(seed, u64::from(seat)))).collect();
        RandomGame { game, hands, inputs: Vec::new(), rng: Rng::new(seed, u64::MAX) }
    }

    /// The game in its current state.
    pub fn game(&self) -> &Game {
        &self.game
    }

    /// Plays a tick. If `is_stirred`, all bodies are stirred after the keys have taken effect.
    pub fn tick(&mut self, is_stirred: bool) {
        let size = self.game.scene().size;
        self.inputs.clear();
        for (seat, hand) in (0u16..).zip(&mut self.hands) {
            self.inputs.push((Seat(seat), hand.next(size)));
        }
        if !is_stirred {
            self.game.tick(&self.inputs);
            return;
        }
        let rng = &mut self.rng;
        self.game.tick_watched(&self.inputs, &mut |phase, world| {
            if phase == Phase::Inputs {
                stir(world, rng);
            }
        });
    }
}

/// Plays a tick of a game, stirring its bodies if the flag is true.
pub type TickFn<'a> = dyn FnMut(&mut RandomGame, bool) + 'a;

/// A trial in progress, with the game being played.
struct Trier<'a> {
    played: RandomGame,
    tick: &'a mut TickFn<'a>,
    found: Trial,
}

impl<'a> Trier<'a> {
    fn new(scene: &Scene, tick: &'a mut TickFn<'a>) -> Trier<'a> {
        let has_actors =
            scene.hero.is_some() || scene.sling.is_some() || scene.tools != Tools::default();
        let is_conjugate = scene.world.is_conjugate();
        let (made_max, bodies_max) = (made_max(scene), scene.world.bodies_max as u32);
        let found = Trial { has_actors, is_conjugate, made_max, bodies_max, ..Trial::default() };
        let mut scene = without_waits(scene);
        scene.world.budget = STEP;
        Trier { played: RandomGame::new(Arc::new(scene), SEED), tick, found }
    }

    /// Stirs a new game with another seed, and then returns to the current one.
    fn play_anew(&mut self, number: u64) -> bool {
        let scene = Arc::clone(self.played.game.scene());
        let new = RandomGame::new(scene, SEED + 1 + number);
        let played = std::mem::replace(&mut self.played, new);
        let is_within = self.play_part(1, NEW_PERIODS, NEW_US);
        self.played = played;
        is_within
    }

    /// Plays periods of a part until their counts add up to this many microseconds. Returns whether its steps stayed
    /// within the budget.
    fn play_part(&mut self, part: usize, periods: u32, most_us: f32) -> bool {
        let end_us = self.found.total_us + most_us;
        for _ in 0..periods {
            let mut peak_us = 0.0;
            for tick in 0..STIR_TICKS {
                if self.found.total_us > end_us {
                    break;
                }
                (self.tick)(&mut self.played, part > 0 && tick == 0);
                if self.played.game.is_over_budget() {
                    return false;
                }
                let us = tick_us(&self.played.game);
                peak_us = max(peak_us, us);
                self.found.total_us += us;
                self.found.ticks += 1;
            }
            self.found.peaks_us[part].push(peak_us);
            self.count_bodies();
            if self.found.total_us > end_us {
                break;
            }
        }
        true
    }

    fn count_bodies(&mut self) {
        let is_made = |kind: Kind, owner: Option<Seat>| {
            kind == Kind::Marble || kind == Kind::Pack && owner.is_none()
        };
        let game = &self.played.game;
        let made = game.bodies().filter(|body| is_made(body.kind, body.owner)).count() as u32;
        let bodies = game.world().body_count() as u32;
        self.found.made = self.found.made.max(made);
        self.found.bodies = self.found.bodies.max(bodies);
    }
}

/// Time of a game's latest tick, derived from its counts, in microseconds on the machine for which the costs were
/// fitted, without [`ANY_TICK_US`].
pub fn tick_us(game: &Game) -> f32 {
    let (scene, world) = (game.scene(), game.world());
    let us: &[Counted] = if scene.world.is_conjugate() { &CONJUGATE_US } else { &RELAXATION_US };
    let done = world.step_counts();
    let step_us: f32 = us.iter().map(|(count, us)| count(&done) as f32 * us).sum();
    let bodies = world.body_count() as f32;
    let lookers = usize::from(scene.players_max) + scene.rules.zones.len();
    let placed_us = if game.begins_round() { PLACED_US } else { 0.0 };
    let body_us =
        LOOK_US * lookers as f32 + TRY_US * game.roster.positions_tried as f32 + placed_us;
    let round_us = if scene.rules.round.is_some() { ROUND_US } else { 0.0 };
    step_us + SPRING_US * done.springs as f32 + body_us * bodies + round_us
}

/// Returns the scene with rounds that begin immediately, since nothing moves before a round begins.
fn without_waits(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let Some(round) = &mut scene.rules.round {
        (round.countdown, round.players_min) = (0, 1);
    }
    scene
}

/// Changes the velocities of all dynamic bodies, each by up to 60 units/s in x and in y.
fn stir(world: &mut World, rng: &mut Rng) {
    let movable = |&id: &_| world.motion(id) == Motion::Dynamic;
    let bodies: Vec<_> = world.ids().filter(movable).collect();
    world.wake(&bodies);
    for id in bodies {
        let mut draw = || rng.range(-STIR_SPEED, STIR_SPEED);
        let change = Vec2::new(draw(), draw());
        world.set_velocity(id, world.velocity(id) + change);
    }
}

/// A player who holds down some keys and keeps the pointer at a position for some ticks, then changes both.
#[derive(Clone)]
struct TrialPlayer {
    rng: Rng,
    input: Input,
    ticks: u32,
}

impl TrialPlayer {
    fn new(rng: Rng) -> TrialPlayer {
        TrialPlayer { rng, input: Input::default(), ticks: 0 }
    }

    /// Returns the input for the next tick, chosen from all keys except those that clear the world and change the team.
    fn next(&mut self, size: Vec2) -> Input {
        if self.ticks == 0 {
            let rng = &mut self.rng;
            let without = Buttons::TEAM.0 | Buttons::CLEAR.0;
            let buttons = Buttons(rng.next_u32() as u16 & Buttons::ALL.0 & !without);
            let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
            self.input = Input::new(buttons, Some(pointer));
            self.ticks = 2 + rng.below(30);
        }
        self.ticks -= 1;
        self.input
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene with blocks in a closed square, without gravity.
    fn blocks(side: u32, count: u32, block: &str) -> Scene {
        let (middle, far, long) = (side / 2, side + 5, side + 40);
        let wall = |x: u32, y: u32, w: u32, h: u32| {
            format!("[[bodies]]\nkind = \"wall\"\nposition = [{x}, {y}]\nsize = [{w}, {h}]\n")
        };
        let text = format!(
            "title = \"Blocks\"\nsize = [{side}, {side}]\nsolver = \"conjugate\"\ngravity = [0, 0]\n\
             groups = [\"platform\", \"block\"]\n\
             pairs = [[\"block\", \"platform\"], [\"block\", \"block\"]]\n{}{}{}{}\
             [[layouts]]\nkind = \"block\"\ncount = {count}\n{block}\n",
            wall(middle, 0, long, 10),
            wall(middle, far, long, 10),
            wall(0, middle, 10, long),
            wall(far, middle, 10, long),
        );
        Scene::parse("blocks.toml", &text).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn a_trial_is_repeatable() {
        let scene = blocks(40, 30, "area = [[8, 8], [36, 36]]\nradius = 1");
        let trial = Trial::of(&scene);
        assert!(trial.is_complete);
        assert_eq!(
            trial.ticks,
            STIR_TICKS * (IDLE_PERIODS + NEW_GAMES as u32 * NEW_PERIODS + PERIODS[1])
        );
        assert_eq!(trial, Trial::of(&scene));
    }

    #[test]
    fn a_sparse_scene_takes_less_than_a_dense_one() {
        let dense = blocks(30, 60, "area = [[8, 8], [26, 26]]\nradius = 1");
        let sparse = blocks(300, 60, "area = [[8, 8], [290, 290]]\nradius = 1");
        let ms = [&dense, &sparse].map(|scene| worst_tick(scene).ms);
        assert!(ms[1] < 0.7 * ms[0], "{ms:?}");
        assert_eq!(WorstTick::of(&dense), WorstTick::of(&sparse), "by their limits");
    }

    #[test]
    fn a_trial_of_a_hostile_scene_ends_in_time() {
        let exact = "area = [[14, 14], [16, 16]]\nexact = true\ngrid = [40, 10]";
        let heap = blocks(30, 400, &format!("{exact}\nradius = 3"));
        let trial = Trial::of(&heap);
        assert!(!trial.is_complete && trial.ticks == 0, "{} pairs", 400 * 399 / 2);
        assert!(worst_tick(&heap).ms >= WorstTick::of(&heap).ms);
        let crowd = blocks(30, 200, &format!("{exact}\nradius = 1").replace("10]", "5]"));
        let trial = Trial::of(&crowd);
        let step_us = STEP.work as f32 * CONJUGATE_US[5].1 + STEP.pairs as f32;
        let parts_us = PART_US.iter().sum::<f32>() + NEW_GAMES as f32 * NEW_US;
        let most_us = parts_us + (2.0 + NEW_GAMES as f32) * step_us;
        assert!(trial.total_us < most_us, "{} us in {} ticks", trial.total_us, trial.ticks);
    }

    #[test]
    fn bodies_that_the_trial_did_not_see_count_too() {
        let trial = |made, bodies_max| Trial {
            bodies: 20,
            made,
            made_max: 100,
            bodies_max,
            ..Trial::default()
        };
        assert_eq!(trial(100, 200).growth(), 1.0);
        assert_eq!(trial(60, 200).growth(), 3.0);
        assert_eq!(trial(60, 30).growth(), 1.5, "a scene may have room for fewer");
    }
}
