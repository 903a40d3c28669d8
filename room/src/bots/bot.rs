//! A bot. It looks at the game from time to time, decides where to be and where to shoot, and holds its keys until it
//! looks again. It is slow and inexact, like a person.

use super::aims::{Aims, Errand, Goal, middle, nearest_inside};
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
/// Distance from a ball within which an obstacle does not keep a bot from reaching it, world units.
const NEAR_SIDE: f32 = 22.0;
/// Share of the looks at which a bot idles that is as far ahead as it counts.
const EASE_SHARE: f32 = 0.7;
/// Desired speed below which no key is pressed, units/s.
const IDLE_SPEED: f32 = 5.0;

/// A bot and its current intentions.
pub struct Bot {
    pub seat: Seat,
    rng: Rng,
    /// Ticks until the bot looks again.
    wait: u32,
    held: Input,
    /// How far the bot lets people catch up, 0..1.
    pub ease: f32,
    /// Index of the next gate.
    gate: usize,
    /// The ball that the bot herds.
    herds: Option<BodyId>,
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
        let held = Input::default();
        Bot { seat, rng, wait: 0, held, ease: 0.0, gate: 0, herds: None, roams_to: None }
    }

    /// The bot's input for the next tick.
    pub fn play(&mut self, game: &Game, aims: &Aims, terrain: &mut Terrain) -> Input {
        let round = game.round();
        let plays = round.as_ref().is_none_or(|round| round.phase == RoundPhase::Running);
        if !plays {
            (self.gate, self.herds, self.roams_to) = (0, None, None);
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
        let is_easy = self.rng.range(0.0, 1.0) < self.ease * EASE_SHARE;
        self.held = match game.scene().lane(own.team) {
            Some(lane) => self.keep_lane(game, aims, &own, lane),
            // A bot far ahead of the people idles at some of its looks.
            None if is_easy => Input::default(),
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
        let is_off = self.rng.range(0.0, 1.0) < 0.33 + self.ease * 0.3;
        let miss = if is_off { 7.0 * MISS } else { MISS };
        let off = wanted + self.rng.range(-miss, miss) - own.at[along];
        let mut way = Vec2::ZERO;
        way[along] = off * 4.0 - own.velocity[along] * 0.5;
        Input::new(keys(way), None)
    }

    /// Flies to the place that the rules reward most, and shoots at a nearby hero.
    fn fly(&mut self, game: &Game, aims: &Aims, terrain: &mut Terrain, own: &Own) -> Input {
        let place = self.place(game, aims, terrain, own);
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

    fn place(&mut self, game: &Game, aims: &Aims, terrain: &Terrain, own: &Own) -> Vec2 {
        let (scene, zones) = (game.scene(), &game.scene().rules.zones);
        if let Some(&zone) = aims.gates.get(self.gate) {
            return middle(&zones[usize::from(zone)], scene.size);
        }
        if let Some(zone) = aims.hill.filter(|_| self.ease < 1.0) {
            let spread = Vec2::new(self.rng.range(-4.0, 4.0) * MISS, 0.0);
            return middle(&zones[usize::from(zone)], scene.size) + spread;
        }
        let place = self.place_of_errand(game, aims, own);
        let place = place.or_else(|| self.place_of_herder(game, aims, own));
        if let Some(place) = place.or_else(|| self.place_at_ball(game, aims, terrain, own)) {
            return place;
        }
        let is_bored = self.rng.below(40) == 0;
        if is_bored || self.roams_to.is_none_or(|place| place.distance(own.at) < 20.0) {
            let (x, y) = (self.rng.range(0.1, 0.9), self.rng.range(0.1, 0.8));
            self.roams_to = Some(Vec2::new(x, y) * scene.size);
        }
        self.roams_to.unwrap_or(own.at)
    }

    /// Where to carry a thing that belongs elsewhere, where to get it, or where a thing is that must be sent back.
    fn place_of_errand(&mut self, game: &Game, aims: &Aims, own: &Own) -> Option<Vec2> {
        let (scene, world) = (game.scene(), game.world());
        let is_own = |errand: &&Errand| errand.team.is_none() || errand.team == own.team;
        let fetch = aims.fetches.iter().find(is_own)?;
        let zone = |errand: &Errand| &scene.rules.zones[usize::from(errand.zone)];
        let home = middle(zone(fetch), scene.size);
        let (thing, _) = nearest_ball(game, fetch.things, own.at)?;
        let lost = aims.guards.iter().filter(is_own).find_map(|guard| {
            let (at, velocity) = nearest_ball(game, guard.things, own.at)?;
            (!zone(guard).holds(at)).then_some(at + velocity * 0.2)
        });
        let is_thing = |id: BodyId| fetch.things >> world.group(id) & 1 == 1;
        let carriers = game.players().filter(|player| player.carried.is_some_and(is_thing));
        let carrier = carriers.map(|player| player.seat).next();
        Some(match (carrier, lost) {
            // The thing, not the hero, has to be in the zone.
            (Some(seat), None) if seat == self.seat => home - (thing - own.at),
            (Some(_), Some(lost)) => lost,
            (Some(_), None) => home,
            (None, Some(lost)) if self.guards(game, own) => lost,
            (None, Some(lost)) if lost.distance(own.at) < thing.distance(own.at) => lost,
            (None, _) => thing,
        })
    }

    /// Returns whether the bot is one of the defenders, which every second player of a team is.
    fn guards(&self, game: &Game, own: &Own) -> bool {
        let mates = game.round().into_iter().flat_map(|round| round.players);
        mates.filter(|mate| mate.team == own.team && mate.seat < self.seat).count() % 2 == 1
    }

    /// A place from which to shove a ball into a zone that keeps it.
    fn place_of_herder(&mut self, game: &Game, aims: &Aims, own: &Own) -> Option<Vec2> {
        let (scene, world) = (game.scene(), game.world());
        let goal = aims.goals.iter().find(|goal| goal.keeps && goal.is_good_for(own.team))?;
        let zone = &scene.rules.zones[usize::from(goal.zone)];
        let is_out = |id: BodyId| {
            let at = world.position(id);
            !zone.holds(at) || nearest_inside(zone, scene.size, at).distance(at) > 6.0
        };
        if self.rng.below(60) == 0 {
            self.herds = None;
        }
        self.herds.take_if(|&mut id| !world.contains(id) || !is_out(id));
        if self.herds.is_none() {
            let balls = game.bodies().filter(|body| goal.balls >> body.group & 1 == 1);
            let outside = balls.map(|body| body.id).filter(|&id| is_out(id));
            let cost = |id: BodyId| {
                let at = world.position(id);
                let miss = own.at.distance(at);
                miss + nearest_inside(zone, scene.size, at).distance(at)
            };
            self.herds = outside.min_by(|&a, &b| cost(a).total_cmp(&cost(b)));
        }
        let ball = self.herds?;
        let at = world.position(ball) + world.velocity(ball) * 0.1;
        let aim = (nearest_inside(zone, scene.size, at) - at).normalize_or_zero();
        let half = |id: BodyId| world.shape(id).half_extent();
        let reach = max(half(own.hero).x, half(own.hero).y) + half(ball).x + 3.0;
        Some(self.place_behind(own, at, aim, reach))
    }

    /// A place behind the ball, or beyond it so that the bot hits it. The team's player nearest to the ball attacks;
    /// the others stay between the ball and their own goal.
    fn place_at_ball(
        &mut self,
        game: &Game,
        aims: &Aims,
        terrain: &Terrain,
        own: &Own,
    ) -> Option<Vec2> {
        let (scene, team) = (game.scene(), own.team);
        let attacked = aims.goals.iter().find(|goal| goal.is_good_for(team))?;
        let goal = |goal: &Goal| middle(&scene.rules.zones[usize::from(goal.zone)], scene.size);
        let (ball, velocity) = nearest_ball(game, attacked.balls, own.at)?;
        let defended = aims.goals.iter().find(|goal| !goal.is_good_for(team));
        let late = (own.at.distance(ball) / 110.0).clamp(0.0, 0.5);
        let ball = ball + velocity * late;
        if let Some(home) = defended.map(goal) {
            let near_side = ball + (own.at - ball).clamp_length_max(NEAR_SIDE);
            let is_far = !terrain.is_open(own.at, near_side);
            if is_far || (self.guards(game, own) && own.at.distance(ball) > 45.0) {
                let share = if self.guards(game, own) { 0.25 } else { 0.4 };
                return Some(home.lerp(ball, share));
            }
        }
        let miss = Vec2::new(self.rng.range(-MISS, MISS), self.rng.range(-MISS, MISS));
        let aim = (goal(attacked) + miss * 2.0 - ball).normalize_or_zero();
        Some(self.place_behind(own, ball, aim, 16.0) + miss * 0.3)
    }

    /// A place behind a ball that is to move along `aim`, or beyond the ball once the bot is behind it.
    fn place_behind(&self, own: &Own, ball: Vec2, aim: Vec2, reach: f32) -> Vec2 {
        let off = own.at - ball;
        if off.normalize_or_zero().dot(aim) < -0.85 {
            ball + aim * 50.0
        } else if off.dot(aim) > 0.0 {
            // The bot flies around the ball.
            let side = aim.perp() * if aim.perp_dot(off) < 0.0 { -reach } else { reach };
            ball + side - aim * reach
        } else {
            ball - aim * reach
        }
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
