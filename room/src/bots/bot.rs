//! A bot. It looks at the game from time to time, decides where to be and where to shoot, and holds its keys until it
//! looks again. It is slow and inexact, like a person.

use super::bot_view::{BotView, GAIN, OwnHero};
use super::skill::Skill;
use super::slinger::Slinger;
use super::terrain::Terrain;
use super::walker::Walker;
use jostle_game::scene::LaneAxis;
use jostle_game::{Buttons, Input, RoundPhase, Seat};
use jostle_sim::math::{clamp_length, max};
use jostle_sim::{BodyId, DT, Rng, Vec2};
use std::collections::VecDeque;

/// Minimum number of ticks between looks, and the random range added to it.
const LOOK_TICKS: u32 = 7;
const LOOK_MORE: u32 = 6;
/// Number of ticks between looks where heroes run and jump or defend a lane, which takes more care.
const CARE_TICKS: u32 = 3;
/// Distance at which bots shoot, world units.
const RANGE: f32 = 130.0;
/// Desired speed below which no key is pressed, units/s.
const IDLE_SPEED: f32 = 5.0;
/// Maximum error of a place where a ball that a bot misjudges reaches its lane, world units.
const MISJUDGED: f32 = 80.0;

/// How many times more often than otherwise a bot misjudges such a ball, which it does once for each time that it comes.
const LANE_SLIPS: f32 = 1.4;
/// Share of such balls that even the best bot misjudges, so that bots among themselves come to an end.
const LANE_SLIPS_MIN: f32 = 0.03;

/// Rate at which a hero without drag comes to rest by its keys, 1/s.
const BRAKES: f32 = 3.0;

/// A bot and its current intentions.
pub struct Bot {
    pub seat: Seat,
    pub(super) rng: Rng,
    pub(super) skill: Skill,
    /// How far the bot lets people catch up, 0..1.
    pub(super) ease: f32,
    /// Whether the bot does nothing, like all people in its team.
    pub(super) waits: bool,
    /// Ticks until the bot looks again.
    wait: u32,
    held: Input,
    /// The bot's decisions, each with the tick from which its inputs follow it.
    decided: VecDeque<(u32, Input)>,
    pub(super) memory: BotMemory,
    slinger: Slinger,
}

/// A bot's plans for a round.
#[derive(Clone, Copy, Debug, Default)]
pub struct BotMemory {
    /// Index of the next gate.
    pub gate: usize,
    /// The next step of the quest.
    pub step: usize,
    /// The tick of the game at which steps that were done no longer count.
    pub ends: Option<u32>,
    /// The tick of the game until which a nearer mate may do the step.
    pub patience: Option<u32>,
    /// The ball that the bot herds.
    pub herds: Option<BodyId>,
    /// The bot's destination while it has no other aim.
    pub roams_to: Option<Vec2>,
    /// How far the bot misjudges the ball that comes towards its lane, world units.
    pub misjudges: Option<f32>,
    /// The body onto which the hero jumps.
    pub hops_to: Option<BodyId>,
    /// Whether the hero jumps over a ball.
    pub leaps: bool,
    /// The tick of the game since which the hero pushes a ball that does not move.
    pub pushes_since: Option<u32>,
    /// The tick of the game until which the hero makes way for a rival who pushes the ball as hard.
    pub yields_until: Option<u32>,
}

impl Bot {
    /// Creates a bot that has not looked yet.
    pub fn new(seat: Seat, rng: Rng) -> Bot {
        Bot {
            seat,
            rng,
            skill: Skill::eased(0.0),
            ease: 0.0,
            waits: false,
            wait: 0,
            held: Input::default(),
            decided: VecDeque::new(),
            memory: BotMemory::default(),
            slinger: Slinger::default(),
        }
    }

    /// Lets people catch up by this share, 0..1; `None` if no person plays.
    pub fn ease(&mut self, ease: Option<f32>) {
        self.ease = ease.unwrap_or(0.0);
        self.skill = ease.map_or(Skill::BEST, Skill::eased);
    }

    /// The bot's input for the next tick.
    pub fn play(&mut self, view: &BotView, terrain: &mut Terrain) -> Input {
        let plays = view.round.is_none_or(|round| round.phase == RoundPhase::Running);
        if !plays {
            self.memory = BotMemory::default();
        } else if self.waits {
            return Input::default();
        }
        if plays && view.game.scene().hero.is_none() {
            return self.slinger.play(view, self.seat, self.skill, &mut self.rng);
        }
        let Some(own) = view.own(self.seat).filter(|_| plays) else {
            self.wait = 0;
            self.decided.clear();
            // A bot never delays people's next round.
            let is_over = view.round.is_some_and(|round| round.phase == RoundPhase::Over);
            let buttons = if is_over { Buttons::AGAIN } else { Buttons::default() };
            self.held = Input::default();
            return Input::new(buttons, None);
        };
        self.pass_gate(view, own.at);
        let tick = view.game.tick_count();
        if self.wait == 0 {
            let has_lane = view.game.scene().lane(own.team).is_some();
            let walks = view.game.scene().hero.as_ref().is_some_and(|hero| hero.walk.is_some());
            let cares = walks || has_lane;
            self.wait = if cares { CARE_TICKS } else { LOOK_TICKS + self.rng.below(LOOK_MORE) };
            let input = self.decide(view, terrain, &own);
            self.decided.push_back((tick + self.skill.reaction_ticks(), input));
        }
        self.wait -= 1;
        // Each shot is a single key press.
        let held = self.held.buttons().0 & !Buttons::FIRE.0;
        self.held = self.held.with_buttons(Buttons(held));
        while let Some((_, input)) = self.decided.pop_front_if(|(due, _)| *due <= tick) {
            self.held = input;
        }
        self.held
    }

    fn decide(&mut self, view: &BotView, terrain: &mut Terrain, own: &OwnHero) -> Input {
        match view.game.scene().lane(own.team) {
            Some(lane) => self.keep_lane(view, own, lane),
            None if self.rng.unit() < self.skill.slips() => Input::default(),
            None => self.fly(view, terrain, own),
        }
    }

    /// Once the hero is in the next gate, the gate after it becomes the next one.
    fn pass_gate(&mut self, view: &BotView, at: Vec2) {
        let Some(&zone) = view.aims.gates.get(self.memory.gate) else { return };
        if view.game.scene().rules.zones[usize::from(zone)].holds(at) {
            self.memory.gate = (self.memory.gate + 1) % view.aims.gates.len();
        }
    }

    /// Follows the ball along the lane, aiming slightly ahead.
    fn keep_lane(&mut self, view: &BotView, own: &OwnHero, lane: LaneAxis) -> Input {
        let balls = view.aims.goals.iter().fold(0, |all, goal| all | goal.balls);
        let Some((ball, velocity)) = view.nearest_ball(balls, own.at) else {
            return Input::default();
        };
        let (along, across) = match lane {
            LaneAxis::X => (0, 1),
            LaneAxis::Y => (1, 0),
        };
        let comes = (own.at[across] - ball[across]) * velocity[across] > 0.0;
        // The bot returns to the middle while the ball moves away.
        let middle = view.game.scene().size[along] * 0.5;
        let late = self.late();
        if comes && self.memory.misjudges.is_none() {
            let share = max(self.skill.slips() * LANE_SLIPS, LANE_SLIPS_MIN);
            let misjudges = self.rng.unit() < share;
            let miss = if misjudges { MISJUDGED } else { self.skill.miss() };
            self.memory.misjudges = Some(self.rng.range(-miss, miss));
        }
        self.memory.misjudges.take_if(|_| !comes);
        let wanted = match self.memory.misjudges {
            Some(miss) => ball[along] + velocity[along] * (late + 0.1) + miss,
            None => middle,
        };
        let mut way = Vec2::ZERO;
        way[along] = wanted - self.rest(view, own)[along];
        Input::new(keys(way), None)
    }

    /// Where the hero comes to rest by its drag, or soon by its keys, after those that it has decided to press.
    fn rest(&self, view: &BotView, own: &OwnHero) -> Vec2 {
        let Some(spec) = &view.game.scene().hero else { return own.at };
        let drag = spec.body.drag.linear;
        let pending = self.pending(view.game.tick_count());
        let (at, velocity) = pending.fold((own.at, own.velocity), |(at, velocity), (way, time)| {
            let ticks = (time / DT + 0.5) as u32;
            (0..ticks).fold((at, velocity), |(at, velocity), _| {
                let faster = clamp_length(velocity + way * spec.thrust * DT, spec.speed_max);
                let velocity = faster * (1.0 - drag * DT);
                (at + velocity * DT, velocity)
            })
        });
        at + velocity / max(drag, BRAKES)
    }

    /// Flies to the place that the rules reward most, and shoots at a nearby hero.
    fn fly(&mut self, view: &BotView, terrain: &mut Terrain, own: &OwnHero) -> Input {
        let (game, scene) = (view.game, view.game.scene());
        let strides = self.pending(game.tick_count()).map(|(way, time)| way.x * time).sum();
        let walker = Walker::of(view, own, self.late(), strides);
        self.memory.leaps = false;
        let place = self.place(view, terrain, own, walker.as_ref());
        if let Some(walker) = walker {
            let jump = if self.memory.leaps { Buttons::UP.0 } else { 0 };
            let keys = walker.keys(place, &mut self.memory.hops_to);
            return Input::new(Buttons(keys.0 | jump), None);
        }
        let place = self.dodge(view, terrain, own, place).unwrap_or(place);
        let side = game.world().shape(own.hero).half_extent().x;
        // A path search is needless for a place next to the hero.
        let is_near = own.at.distance(place) < 3.0 * side;
        let next = if is_near { place } else { terrain.next(own.at, place) };
        let fall = -scene.world.gravity.y * game.world().gravity_scale(own.hero);
        let lift = Vec2::new(0.0, fall * 0.15);
        let buttons = keys((next - own.at) * GAIN - own.velocity + lift);
        let target = if view.aims.shoots { self.target(view, own) } else { None };
        let fires = target.is_some() && self.rng.unit() < self.skill.shots();
        let fire = if fires { Buttons::FIRE.0 } else { 0 };
        Input::new(Buttons(buttons.0 | fire), target)
    }

    /// Where to aim a throw: slightly ahead of the nearest hero on another side.
    fn target(&mut self, view: &BotView, own: &OwnHero) -> Option<Vec2> {
        let (game, world) = (view.game, view.game.world());
        let distance = |hero: BodyId| world.position(hero).distance(own.at);
        let rivals = view.rivals(self.seat).map(|(_, hero)| hero);
        let hero = rivals.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
        let away = distance(hero);
        if away > RANGE {
            return None;
        }
        let speed = game.scene().pack.as_ref().map_or(1.0, |pack| max(pack.speed.abs(), 1.0));
        let lead = world.velocity(hero) * (away / speed);
        let aim = world.position(hero) + lead + self.miss();
        Some(aim.clamp(Vec2::ZERO, game.scene().size))
    }

    /// The keys that the hero holds until it does what the bot decides now: how many to the right and up, and for how
    /// many seconds.
    fn pending(&self, tick: u32) -> impl Iterator<Item = (Vec2, f32)> {
        let until = tick + self.skill.reaction_ticks();
        let starts = self.decided.iter().map(|(due, _)| *due);
        let ends = starts.clone().chain([until]);
        let inputs = [self.held].into_iter().chain(self.decided.iter().map(|(_, input)| *input));
        let spans = [tick].into_iter().chain(starts).zip(ends).zip(inputs);
        spans.map(|((start, end), input)| {
            (way_of(input.buttons()), end.saturating_sub(start) as f32 * DT)
        })
    }

    /// The hero as it will be when it does what the bot decides now, if it flies and nothing is in its way.
    pub(super) fn ahead(&self, view: &BotView, own: &OwnHero) -> OwnHero {
        let (scene, world) = (view.game.scene(), view.game.world());
        let Some(spec) = &scene.hero else { return *own };
        let fall = scene.world.gravity * world.gravity_scale(own.hero);
        self.pending(view.game.tick_count()).fold(*own, |own, (way, time)| {
            let velocity = clamp_length(own.velocity + way * spec.thrust * time, spec.speed_max);
            let velocity = velocity + fall * time;
            let at = own.at + (own.velocity + velocity) * (time * 0.5);
            OwnHero { at, velocity, ..own }
        })
    }

    /// Time from a look to the keys that it leads to, seconds.
    pub(super) fn late(&self) -> f32 {
        self.skill.reaction_ticks() as f32 * DT
    }

    /// A random error of a place or an aim.
    pub(super) fn miss(&mut self) -> Vec2 {
        let miss = self.skill.miss();
        Vec2::new(self.rng.range(-miss, miss), self.rng.range(-miss, miss))
    }
}

/// The direction in which keys steer.
fn way_of(buttons: Buttons) -> Vec2 {
    let is_held = |key: Buttons| f32::from(u8::from(buttons.0 & key.0 != 0));
    let (right, left) = (is_held(Buttons::RIGHT), is_held(Buttons::LEFT));
    Vec2::new(right - left, is_held(Buttons::UP) - is_held(Buttons::DOWN))
}

/// The keys that produce a desired velocity.
fn keys(wish: Vec2) -> Buttons {
    let key = |wish: f32, more: Buttons, less: Buttons| match wish {
        _ if wish > IDLE_SPEED => more.0,
        _ if wish < -IDLE_SPEED => less.0,
        _ => 0,
    };
    let across = key(wish.x, Buttons::RIGHT, Buttons::LEFT);
    Buttons(across | key(wish.y, Buttons::UP, Buttons::DOWN))
}
