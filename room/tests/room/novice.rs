//! A scripted novice: goes straight for the obvious aim of a shipped scene, reacts late, and throws at the
//! nearest hero.

use jostle_game::{Buttons, Game, Input, Seat};
use jostle_sim::{BodyId, Motion, Rng, Vec2};
use std::collections::VecDeque;

/// Ticks between decisions, and from a decision to the keys: a person reacts after a quarter of a second, but lets go
/// of a key in time.
const LOOK_TICKS: u32 = 5;
const REACTION_TICKS: u32 = 15;
/// Speed at which the novice flies past obstacles, units/s.
const DARES: f32 = 42.0;
/// Random offset of a place or an aim, world units.
const MISS: f32 = 8.0;
/// One look in this many ends in a throw.
const THROW_CHANCE: u32 = 10;
/// Points on the way around the island of the race and past its obstacles, in flying order.
const WAY: [Vec2; 10] = [
    Vec2::new(150.0, 66.0),
    Vec2::new(190.0, 66.0),
    Vec2::new(235.0, 24.0),
    Vec2::new(314.0, 44.0),
    Vec2::new(314.0, 152.0),
    Vec2::new(222.0, 140.0),
    Vec2::new(188.0, 170.0),
    Vec2::new(140.0, 178.0),
    Vec2::new(55.0, 150.0),
    Vec2::new(55.0, 50.0),
];

pub struct Novice {
    rng: Rng,
    held: Input,
    /// Decisions that the novice has not carried out yet, the oldest first.
    decided: VecDeque<Input>,
    corner: usize,
}

impl Novice {
    pub fn new(seed: u64) -> Novice {
        let rng = Rng::new(seed, 77);
        Novice { rng, held: Input::default(), decided: VecDeque::new(), corner: 0 }
    }

    /// The input for the next tick.
    pub fn play(&mut self, game: &Game, seat: Seat) -> Input {
        if !game.tick_count().is_multiple_of(LOOK_TICKS) {
            self.held = self.held.with_buttons(Buttons(self.held.buttons().0 & !Buttons::FIRE.0));
            return self.held;
        }
        let hero = game.players().find(|player| player.seat == seat).and_then(|player| player.hero);
        let decided = hero.map_or(Input::default(), |hero| self.decide(game, seat, hero));
        self.decided.push_back(decided);
        let is_due = self.decided.len() > (REACTION_TICKS / LOOK_TICKS) as usize;
        self.held = is_due.then(|| self.decided.pop_front()).flatten().unwrap_or_default();
        self.held
    }

    fn decide(&mut self, game: &Game, seat: Seat, hero: BodyId) -> Input {
        let (world, scene) = (game.world(), game.scene());
        let at = world.position(hero);
        let round = game.round().expect("a round");
        let own = round.side_of(seat);
        let others = game.players().filter(|player| round.side_of(player.seat) != own);
        let heroes = others.filter_map(|player| player.hero).map(|hero| world.position(hero));
        let rival = heroes.min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)));
        let team = round.player(seat).and_then(|player| player.team).unwrap_or(0);
        let miss = Vec2::new(self.rng.range(-MISS, MISS), self.rng.range(-MISS, MISS));
        let place = self.place(game, seat, at, team).or(rival).unwrap_or(at) + miss * 0.5;
        let mut way = (place - at) * 2.0;
        if scene.name == "race" {
            way = way.clamp_length_max(DARES);
        }
        let mut wish = way - world.velocity(hero);
        wish.y -= scene.world.gravity.y * world.gravity_scale(hero) * 0.15;
        let buttons = keys(wish);
        let near = rival.filter(|rival| rival.distance(at) < 150.0);
        let throws = near.is_some() && self.rng.below(THROW_CHANCE) == 0;
        let fire = if throws { Buttons::FIRE.0 } else { 0 };
        Input::new(Buttons(buttons.0 | fire), near.map(|rival| rival + miss))
    }

    /// Where the aim of the scene is; `None` where it is to fight.
    fn place(&mut self, game: &Game, seat: Seat, at: Vec2, team: u8) -> Option<Vec2> {
        let left = team == 0;
        match game.scene().name.as_str() {
            "hill" => Some(Vec2::new(160.0, 98.0)),
            "race" => {
                if at.distance(WAY[self.corner]) < 28.0 {
                    self.corner = (self.corner + 1) % WAY.len();
                }
                Some(WAY[self.corner])
            }
            "pong" => ahead(game, "ball"),
            "hockey" => Some(shove(
                at,
                ahead(game, "puck")?,
                Vec2::new(if left { 270.0 } else { 10.0 }, 60.0),
            )),
            "roundup" => {
                let pen = Vec2::new(if left { 34.0 } else { 286.0 }, 32.0);
                Some(shove(at, outside(game, at, pen)?, pen))
            }
            "flags" => {
                let carries = game.players().any(|p| p.seat == seat && p.carried.is_some());
                let home = Vec2::new(if left { 26.0 } else { 294.0 }, 73.0);
                let [own, other] =
                    if left { ["left-flag", "right-flag"] } else { ["right-flag", "left-flag"] };
                let own = nearest(game, own, at)?;
                let aim = match own.distance(home) > 30.0 {
                    true => own,
                    false if carries => home,
                    false => nearest(game, other, at)?,
                };
                // Over the wall in the middle.
                let is_behind = (at.x - 160.0) * (aim.x - 160.0) < 0.0;
                Some(if is_behind && at.y < 88.0 {
                    Vec2::new(at.x, 100.0)
                } else if is_behind {
                    Vec2::new(aim.x, 98.0)
                } else {
                    aim
                })
            }
            _ => None,
        }
    }
}

/// A place behind a ball, or through it.
fn shove(at: Vec2, ball: Vec2, to: Vec2) -> Vec2 {
    let aim = (to - ball).normalize_or_zero();
    let off = at - ball;
    if off.normalize_or_zero().dot(aim) < -0.7 {
        ball + aim * 20.0
    } else if off.dot(aim) > 0.0 {
        ball - aim * 18.0 + aim.perp() * 18.0
    } else {
        ball - aim * 18.0
    }
}

fn positions<'a>(game: &'a Game, group: &'a str) -> impl Iterator<Item = Vec2> + 'a {
    let index = game.scene().groups.iter().position(|name| name == group);
    let world = game.world();
    let bodies = game.bodies().filter(move |body| Some(usize::from(body.group)) == index);
    bodies
        .filter(move |body| world.motion(body.id) == Motion::Dynamic)
        .map(move |body| world.position(body.id))
}

/// Where the only ball will be when the keys are pressed.
fn ahead(game: &Game, group: &str) -> Option<Vec2> {
    let index = game.scene().groups.iter().position(|name| name == group);
    let ball = game.bodies().find(|body| Some(usize::from(body.group)) == index)?.id;
    let late = REACTION_TICKS as f32 / 60.0;
    Some(game.world().position(ball) + game.world().velocity(ball) * late)
}

fn nearest(game: &Game, group: &str, at: Vec2) -> Option<Vec2> {
    positions(game, group).min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)))
}

fn outside(game: &Game, at: Vec2, pen: Vec2) -> Option<Vec2> {
    let out = positions(game, "minion").filter(|robot| {
        let off = (*robot - pen).abs();
        // Nobody gets behind a robot in the opposite corner.
        let behind = *robot - (pen - *robot).normalize() * 12.0;
        let is_free = (8.0..312.0).contains(&behind.x) && (8.0..105.0).contains(&behind.y);
        is_free && (off.x > 28.0 || off.y > 26.0)
    });
    out.min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)))
}

fn keys(wish: Vec2) -> Buttons {
    let key = |wish: f32, more: Buttons, less: Buttons| match wish {
        _ if wish > 6.0 => more.0,
        _ if wish < -6.0 => less.0,
        _ => 0,
    };
    Buttons(key(wish.x, Buttons::RIGHT, Buttons::LEFT) | key(wish.y, Buttons::UP, Buttons::DOWN))
}
