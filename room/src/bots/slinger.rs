//! How a bot shoots with a sling: it takes its turn, looks for a shot, pulls the ball back slowly and lets go.

use super::bot_view::BotView;
use super::skill::Skill;
use jostle_game::scene::SlingSpec;
use jostle_game::{Buttons, Game, Input, Seat};
use jostle_sim::math::{clamp_length, cos, max, sin};
use jostle_sim::{Motion, Rng, Vec2};

/// Ticks for which a bot looks before it pulls, for which it pulls, and for which it aims.
const THINK_TICKS: u32 = 90;
const PULL_TICKS: u32 = 45;
const AIM_TICKS: u32 = 20;
/// Ticks for which a bot waits for a player whose turn it is.
const TURN_TICKS: u32 = 900;
/// Number of directions and of powers that a bot considers.
const DIRECTIONS: u32 = 48;
const POWERS: u32 = 3;
/// Time between two points of a path, seconds, and number of points.
const PATH_STEP: f32 = 0.06;
const PATH_POINTS: u32 = 80;
/// Maximum number of bodies that a bot considers in its shots. If there are more, it considers targets only.
const OBSTACLES_MAX: usize = 128;
/// Error of an aim, radians per world unit of a hero's aiming error.
const MISS_ANGLE: f32 = 0.012;
/// How much better a shot is that meets a target first, or something else that breaks, world units.
const MEETS_TARGET: f32 = 1000.0;
const MEETS_BREAKABLE: f32 = 20.0;
/// Random preference between shots, world units.
const TASTE: f32 = 60.0;

/// A bot's turn at the sling.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slinger {
    /// Ticks since the ball was ready.
    waited: u32,
    /// How far it pulls, and for how many ticks it has done so.
    pull: Option<(Vec2, u32)>,
}

/// Something that a ball can hit.
struct Obstacle {
    at: Vec2,
    half: Vec2,
    is_target: bool,
    breaks: bool,
}

impl Slinger {
    /// The input for the next tick.
    pub fn play(&mut self, view: &BotView, seat: Seat, skill: Skill, rng: &mut Rng) -> Input {
        let scene = view.game.scene();
        let (Some(spec), Some(round)) = (&scene.sling, view.round) else { return Input::default() };
        let Some(sling) = round.sling.filter(|sling| sling.shots > 0 && !sling.is_flying) else {
            *self = Slinger::default();
            return Input::default();
        };
        self.waited += 1;
        let start = scene.bodies[spec.ball].def.position;
        let Some((pull, ticks)) = self.pull else {
            let shot = usize::from(spec.shots.saturating_sub(sling.shots));
            let turn = round.players.get(shot % round.players.len().max(1));
            let is_own = turn.is_some_and(|player| player.seat == seat);
            if self.waited > THINK_TICKS + if is_own { 0 } else { TURN_TICKS } {
                self.pull = Some((choose(view, spec, start, skill, rng), 0));
            }
            return Input::new(Buttons::default(), Some(start));
        };
        if ticks > PULL_TICKS + AIM_TICKS {
            *self = Slinger::default();
            return Input::new(Buttons::default(), Some(start + pull));
        }
        self.pull = Some((pull, ticks + 1));
        let share = (ticks as f32 / PULL_TICKS as f32).clamp(0.0, 1.0);
        Input::new(Buttons::FIRE, Some(start + pull * share))
    }
}

/// The pull of the most promising shot, inexact by the bot's skill.
fn choose(view: &BotView, spec: &SlingSpec, start: Vec2, skill: Skill, rng: &mut Rng) -> Vec2 {
    let obstacles = obstacles(view, spec);
    let mut best = (f32::MIN, Vec2::new(-spec.pull, 0.0));
    for number in 0..DIRECTIONS * POWERS {
        let angle = (number / POWERS) as f32 * (std::f32::consts::TAU / DIRECTIONS as f32);
        let power = 1.0 - (number % POWERS) as f32 * 0.15;
        let pull = inside(view.game, start, Vec2::new(cos(angle), sin(angle)) * spec.pull * power);
        let worth = worth(view.game, spec, start, pull, &obstacles) + rng.range(0.0, TASTE);
        if worth > best.0 {
            best = (worth, pull);
        }
    }
    let miss = skill.miss() * MISS_ANGLE;
    let (turn, power) = (rng.range(-miss, miss), 1.0 - rng.range(0.0, miss));
    let turned = best.1 * power + best.1.perp() * turn;
    inside(view.game, start, clamp_length(turned, spec.pull))
}

/// Shortens a pull so that the pointer stays in the world.
fn inside(game: &Game, start: Vec2, pull: Vec2) -> Vec2 {
    (start + pull).clamp(Vec2::ONE, game.scene().size - 1.0) - start
}

fn obstacles(view: &BotView, spec: &SlingSpec) -> Vec<Obstacle> {
    let (game, scene) = (view.game, view.game.scene());
    let ball = &scene.bodies[spec.ball].def;
    let breakable = scene.bodies.iter().filter(|body| body.breaks.is_some());
    let breakable = breakable.fold(0u32, |all, body| all | 1 << body.def.group);
    let others = game.bodies().filter(|body| {
        let at = game.world().position(body.id);
        let is_ball = body.group == ball.group && at.distance(ball.position) <= spec.pull + 1.0;
        !is_ball && scene.groups_meet(ball.group, body.group)
    });
    let obstacle = others.map(|body| Obstacle {
        at: game.world().position(body.id),
        half: body.shape.half_extent() + ball.shape.half_extent(),
        is_target: view.aims.targets >> body.group & 1 == 1,
        breaks: breakable >> body.group & 1 == 1 && game.world().motion(body.id) == Motion::Dynamic,
    });
    let mut obstacles: Vec<Obstacle> = obstacle.collect();
    if obstacles.len() > OBSTACLES_MAX {
        obstacles.retain(|obstacle| obstacle.is_target);
        obstacles.truncate(OBSTACLES_MAX);
    }
    obstacles
}

/// How promising a shot is: whether its path first meets a target, or otherwise how near it comes to one.
fn worth(game: &Game, spec: &SlingSpec, start: Vec2, pull: Vec2, obstacles: &[Obstacle]) -> f32 {
    let Some(velocity) = spec.launch(pull) else { return f32::MIN };
    let ball = &game.scene().bodies[spec.ball].def;
    let world = &game.scene().world;
    let mut velocity = clamp_length(velocity, world.speed_max);
    let fall = world.gravity * ball.gravity_scale * PATH_STEP;
    let (mut at, mut nearest) = (start + pull, f32::MAX);
    for _ in 0..PATH_POINTS {
        velocity += fall;
        at += velocity * PATH_STEP;
        for other in obstacles {
            let off = (other.at - at).abs() - other.half;
            if off.x < 0.0 && off.y < 0.0 {
                return match (other.is_target, other.breaks) {
                    (true, _) => MEETS_TARGET,
                    (_, true) => MEETS_BREAKABLE - nearest,
                    _ => -nearest,
                };
            }
            if other.is_target {
                let miss = max(off.x, off.y);
                nearest = if miss < nearest { miss } else { nearest };
            }
        }
    }
    -nearest
}
