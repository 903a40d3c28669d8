//! A bot. It looks at the game from time to time, decides where to be and where to shoot, and holds its keys until it
//! looks again. It is slow and inexact, like a person.

use super::aims::{Aims, Goal, middle};
use super::terrain::Terrain;
use jostle_game::scene::LaneAxis;
use jostle_game::{Buttons, Game, Input, RoundInfo, RoundPhase, Seat};
use jostle_sim::math::max;
use jostle_sim::{BodyId, Motion, Rng, Vec2};

/// Minimum number of ticks between looks, and the random range added to it.
const LOOK_TICKS: u32 = 7;
const LOOK_MORE: u32 = 6;
/// Maximum aiming error, world units.
const MISS: f32 = 6.0;
/// Distance at which bots shoot, world units.
const RANGE: f32 = 130.0;
/// A bot shoots on one in this many looks.
const SHOT_CHANCE: u32 = 4;
/// Desired speed below which no key is pressed, units/s.
const IDLE_SPEED: f32 = 5.0;

/// A bot and its current intentions.
pub struct Bot {
    pub seat: Seat,
    rng: Rng,
    /// Ticks until the bot looks again.
    wait: u32,
    held: Input,
    /// Index of the next gate.
    gate: usize,
    /// The bot's destination while it has no other aim.
    roams_to: Option<Vec2>,
}

/// The state of the bot's own hero.
struct Own {
    hero: BodyId,
    at: Vec2,
    velocity: Vec2,
    team: Option<u8>,
}

impl Bot {
    /// Creates a bot that has not looked yet.
    pub fn new(seat: Seat, rng: Rng) -> Bot {
        Bot { seat, rng, wait: 0, held: Input::default(), gate: 0, roams_to: None }
    }

    /// The bot's input for the next tick.
    pub fn play(&mut self, game: &Game, aims: &Aims, terrain: &mut Terrain) -> Input {
        let round = game.round();
        let plays = round.as_ref().is_none_or(|round| round.phase == RoundPhase::Running);
        if !plays {
            (self.gate, self.roams_to) = (0, None);
        }
        let Some(own) = self.own(game, round.as_ref()).filter(|_| plays) else {
            self.wait = 0;
            // A bot never delays people's next round.
            let is_over = round.is_some_and(|round| round.phase == RoundPhase::Over);
            let buttons = if is_over { Buttons::AGAIN } else { Buttons::default() };
            return Input::new(buttons, None);
        };
        self.pass_gate(game, aims, own.at);
        if self.wait > 0 {
            self.wait -= 1;
            // Each shot is a single key press.
            let held = self.held.buttons().0 & !Buttons::FIRE.0;
            self.held = self.held.with_buttons(Buttons(held));
            return self.held;
        }
        self.wait = LOOK_TICKS + self.rng.below(LOOK_MORE);
        self.held = match game.scene().lane(own.team) {
            Some(lane) => self.keep_lane(game, aims, &own, lane),
            None => self.fly(game, aims, terrain, &own),
        };
        self.held
    }

    fn own(&self, game: &Game, round: Option<&RoundInfo>) -> Option<Own> {
        let hero = game.players().find(|player| player.seat == self.seat)?.hero?;
        let world = game.world();
        let team = round.and_then(|round| round.player(self.seat)?.team);
        Some(Own { hero, at: world.position(hero), velocity: world.velocity(hero), team })
    }

    /// Once the hero is in the next gate, the gate after it becomes the next one.
    fn pass_gate(&mut self, game: &Game, aims: &Aims, at: Vec2) {
        let Some(&zone) = aims.gates.get(self.gate) else { return };
        if game.scene().rules.zones[usize::from(zone)].holds(at) {
            self.gate = (self.gate + 1) % aims.gates.len();
        }
    }

    /// Follows the ball along the lane, aiming slightly ahead.
    fn keep_lane(&mut self, game: &Game, aims: &Aims, own: &Own, lane: LaneAxis) -> Input {
        let balls = aims.goals.iter().fold(0, |all, goal| all | goal.balls);
        let Some((ball, velocity)) = nearest_ball(game, balls, own.at) else {
            return Input::default();
        };
        let (along, across) = match lane {
            LaneAxis::X => (0, 1),
            LaneAxis::Y => (1, 0),
        };
        let comes = (own.at[across] - ball[across]) * velocity[across] > 0.0;
        // The bot returns to the middle while the ball moves away.
        let middle = game.scene().size[along] * 0.5;
        let wanted = if comes { ball[along] + velocity[along] * 0.15 } else { middle };
        // Sometimes the bot misjudges the ball.
        let miss = if self.rng.below(3) == 0 { 6.0 * MISS } else { MISS };
        let off = wanted + self.rng.range(-miss, miss) - own.at[along];
        let mut way = Vec2::ZERO;
        way[along] = off * 4.0 - own.velocity[along] * 0.5;
        Input::new(keys(way), None)
    }

    /// Flies to the place that the rules reward most, and shoots at a nearby hero.
    fn fly(&mut self, game: &Game, aims: &Aims, terrain: &mut Terrain, own: &Own) -> Input {
        let place = self.place(game, aims, own);
        let next =
            if terrain_is_open(game, own.at, place) { place } else { terrain.next(own.at, place) };
        let fall = -game.scene().world.gravity.y * game.world().gravity_scale(own.hero);
        let lift = Vec2::new(0.0, fall * 0.15);
        let buttons = keys((next - own.at) * 2.5 - own.velocity + lift);
        let target = if aims.shoots { self.target(game, own) } else { None };
        let fires = target.is_some() && self.rng.below(SHOT_CHANCE) == 0;
        let fire = if fires { Buttons::FIRE.0 } else { 0 };
        Input::new(Buttons(buttons.0 | fire), target)
    }

    fn place(&mut self, game: &Game, aims: &Aims, own: &Own) -> Vec2 {
        let (scene, zones) = (game.scene(), &game.scene().rules.zones);
        if let Some(&zone) = aims.gates.get(self.gate) {
            return middle(&zones[usize::from(zone)], scene.size);
        }
        if let Some(zone) = aims.hill {
            let spread = Vec2::new(self.rng.range(-4.0, 4.0) * MISS, 0.0);
            return middle(&zones[usize::from(zone)], scene.size) + spread;
        }
        if let Some(place) = self.place_at_ball(game, aims, own) {
            return place;
        }
        let is_bored = self.rng.below(40) == 0;
        if is_bored || self.roams_to.is_none_or(|place| place.distance(own.at) < 20.0) {
            let (x, y) = (self.rng.range(0.1, 0.9), self.rng.range(0.1, 0.8));
            self.roams_to = Some(Vec2::new(x, y) * scene.size);
        }
        self.roams_to.unwrap_or(own.at)
    }

    /// A place behind the ball, or beyond it so that the bot hits it. Every second bot on a team stays between the ball
    /// and its own goal.
    fn place_at_ball(&mut self, game: &Game, aims: &Aims, own: &Own) -> Option<Vec2> {
        let scene = game.scene();
        let team = own.team?;
        let good = |goal: &&Goal| (goal.team == team) == goal.is_good;
        let attacked = aims.goals.iter().find(good)?;
        let goal = |goal: &Goal| middle(&scene.rules.zones[usize::from(goal.zone)], scene.size);
        let (ball, velocity) = nearest_ball(game, attacked.balls, own.at)?;
        let ball = ball + velocity * 0.1;
        let mates = game.round().into_iter().flat_map(|round| round.players);
        let before = mates.filter(|mate| mate.team == Some(team) && mate.seat < self.seat).count();
        if before % 2 == 1
            && let Some(defended) = aims.goals.iter().find(|goal| !good(goal))
        {
            let home = goal(defended);
            return Some(home + (ball - home).clamp_length_max(40.0));
        }
        let miss = Vec2::new(self.rng.range(-MISS, MISS), self.rng.range(-MISS, MISS));
        let aim = (goal(attacked) + miss * 2.0 - ball).normalize_or_zero();
        let reach = 16.0;
        let off = own.at - ball;
        Some(if off.normalize_or_zero().dot(aim) < -0.85 {
            ball + aim * 50.0
        } else if off.dot(aim) > 0.0 {
            // The bot flies around the ball.
            let side = aim.perp() * if aim.perp_dot(off) < 0.0 { -reach } else { reach };
            ball + side - aim * reach
        } else {
            ball - aim * reach + miss * 0.3
        })
    }

    /// Where to aim a throw: slightly ahead of the nearest hero on another side.
    fn target(&mut self, game: &Game, own: &Own) -> Option<Vec2> {
        let round = game.round()?;
        let own_side = round.side_of(self.seat);
        let world = game.world();
        let others = game.players().filter(|player| round.side_of(player.seat) != own_side);
        let heroes = others.filter_map(|player| player.hero);
        let distance = |&hero: &BodyId| world.position(hero).distance(own.at);
        let hero = heroes.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let away = distance(&hero);
        if away > RANGE {
            return None;
        }
        let speed = game.scene().pack.as_ref().map_or(1.0, |pack| max(pack.speed.abs(), 1.0));
        let lead = world.velocity(hero) * (away / speed);
        let miss = Vec2::new(self.rng.range(-MISS, MISS), self.rng.range(-MISS, MISS));
        let size = game.scene().size;
        Some((world.position(hero) + lead + miss).clamp(Vec2::ZERO, size))
    }
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

/// Position and velocity of the nearest movable body in these groups.
fn nearest_ball(game: &Game, groups: u32, at: Vec2) -> Option<(Vec2, Vec2)> {
    let world = game.world();
    let of_group = game.bodies().filter(|body| groups >> body.group & 1 == 1);
    let balls = of_group.filter(|body| world.motion(body.id) == Motion::Dynamic);
    let near = |id: BodyId| world.position(id).distance_squared(at);
    let ball = balls.map(|body| body.id).min_by(|&a, &b| near(a).total_cmp(&near(b)))?;
    Some((world.position(ball), world.velocity(ball)))
}

/// Returns whether a bot is so close that it does not need a path search.
fn terrain_is_open(game: &Game, at: Vec2, place: Vec2) -> bool {
    let hero = game.scene().hero.as_ref();
    let side = hero.map_or(1.0, |hero| hero.body.shape.half_extent().x);
    at.distance(place) < 3.0 * side
}
