//! How a bot gets around where heroes run and jump: over the tops of bodies, onto those that move and off them again.

use super::bot_view::{BotView, OwnHero};
use jostle_game::scene::{Path, WalkSpec};
use jostle_game::{Buttons, SnapshotBody};
use jostle_sim::math::{max, min};
use jostle_sim::{BodyId, Motion, Vec2};
use std::collections::VecDeque;

/// Distance from its feet to the top of what a hero stands on, world units.
const STANDS: f32 = 1.0;
/// Distance from the end of a surface at which a bot turns around, as a share of half a hero's width.
const MARGIN: f32 = 0.5;
/// Error that a bot accepts in its position, world units.
const NEAR: f32 = 1.5;
/// Highest jump that a bot dares, as a share of the highest possible one; from one body that moves onto another, the
/// share at which it jumps; and likewise how far it dares to drop.
const JUMP: f32 = 0.8;
const JUMP_ONTO: f32 = 0.4;
const DROP: f32 = 0.2;

/// Maximum number of surfaces among which a bot looks for a way. If there are more, it knows those nearby.
const SURFACES_MAX: usize = 64;
/// Distance within which a surface is nearby, world units.
const NEARBY: f32 = 120.0;

/// Something to stand on, for the centre of a hero.
#[derive(Clone, Copy, Debug)]
struct Surface {
    body: BodyId,
    left: f32,
    right: f32,
    top: f32,
    bottom: f32,
    velocity: Vec2,
    /// Corners of the area in which its centre moves, relative to where it is.
    swept: [Vec2; 2],
}

impl Surface {
    /// Returns whether a point is at most [`NEARBY`] away, horizontally and vertically.
    fn is_near(&self, at: Vec2) -> bool {
        let off_x = at.x - at.x.clamp(self.left, max(self.left, self.right));
        off_x.abs() < NEARBY && (at.y - self.top).abs() < NEARBY
    }
}

/// A walking hero, and the surfaces on which it can stand.
pub struct Walker {
    walk: WalkSpec,
    /// Height of the highest jump, world units.
    height: f32,
    fall: f32,
    width: f32,
    at: Vec2,
    feet: f32,
    /// Time until the hero does what the bot decides, seconds.
    late: f32,
    surfaces: Vec<Surface>,
}

impl Walker {
    /// The hero as it will be after `late` seconds, during `strides` of which it runs to the right; `None` if heroes fly.
    pub fn of(view: &BotView, own: &OwnHero, late: f32, strides: f32) -> Option<Walker> {
        let scene = view.game.scene();
        let walk = scene.hero.as_ref()?.walk?;
        let half = view.game.world().shape(own.hero).half_extent();
        let fall = max(-scene.world.gravity.y * view.game.world().gravity_scale(own.hero), 1.0);
        let bodies = view.game.bodies().filter(|body| {
            let meets = scene.groups_meet(view.game.world().group(own.hero), body.group);
            meets && view.game.world().motion(body.id) != Motion::Dynamic
        });
        let margin = half.x * MARGIN;
        let mut surfaces: Vec<Surface> =
            bodies.map(|body| surface(view, &body, margin, late)).collect();
        if surfaces.len() > SURFACES_MAX {
            surfaces.retain(|surface| surface.is_near(own.at));
            surfaces.truncate(SURFACES_MAX);
        }
        let at = own.at + Vec2::new(strides * walk.speed, 0.0);
        let height = walk.jump * walk.jump / (2.0 * fall);
        Some(Walker {
            walk,
            height,
            fall,
            width: half.x,
            at,
            feet: own.at.y - half.y,
            late,
            surfaces,
        })
    }

    /// The keys with which it gets closer to a place. `hops_to` is the body to which it jumps at the moment.
    pub fn keys(&self, to: Vec2, hops_to: &mut Option<BodyId>) -> Buttons {
        let here = self.surfaces.iter().position(|surface| self.stands_on(surface));
        let Some(here) = here else {
            let target = self.surfaces.iter().find(|surface| Some(surface.body) == *hops_to);
            return self
                .run_to(target.map_or(to.x, |it| to.x.clamp(it.left, max(it.left, it.right))));
        };
        *hops_to = None;
        match self.next(here, to) {
            Some(next) => {
                *hops_to = Some(self.surfaces[next].body);
                self.hop(&self.surfaces[here], &self.surfaces[next])
            }
            None => self.run_to(to.x),
        }
    }

    /// Where the hero will be when it does what the bot decides.
    pub fn at(&self) -> Vec2 {
        self.at
    }

    /// How far the hero runs until it has risen by `rise` in a jump, world units; `None` if it dares no such jump.
    pub fn run_up(&self, rise: f32) -> Option<f32> {
        let up = self.walk.jump;
        let time = (up - max(up * up - 2.0 * self.fall * rise, 0.0).sqrt()) / self.fall;
        (rise < self.height * JUMP).then_some(self.walk.speed * time)
    }

    fn stands_on(&self, surface: &Surface) -> bool {
        let (top, reach) = (surface.top, self.width * (1.0 + MARGIN));
        let now = top - surface.velocity.y * self.late;
        (self.feet - now).abs() < STANDS
            && self.at.x > surface.left - reach
            && self.at.x < surface.right + reach
    }

    fn run_to(&self, x: f32) -> Buttons {
        match x - self.at.x {
            way if way > NEAR => Buttons::RIGHT,
            way if way < -NEAR => Buttons::LEFT,
            _ => Buttons::default(),
        }
    }

    /// The surface to jump to on the way to a place; `None` if it is on the one that the hero stands on, or nowhere.
    fn next(&self, here: usize, to: Vec2) -> Option<usize> {
        let is_under = |surface: &Surface| {
            let reach = self.width + NEAR;
            surface.left - reach < to.x && to.x < surface.right + reach && surface.top <= to.y
        };
        let under = (0..self.surfaces.len()).filter(|&index| is_under(&self.surfaces[index]));
        let goal = under.max_by(|&a, &b| self.surfaces[a].top.total_cmp(&self.surfaces[b].top))?;
        if goal == here {
            return None;
        }
        // Backwards, so that the first surface found from which the goal is reached is the hero's own.
        let mut next = vec![None; self.surfaces.len()];
        let mut queue = VecDeque::from([goal]);
        while let Some(index) = queue.pop_front() {
            for (from, surface) in self.surfaces.iter().enumerate() {
                let is_new = from != goal && next[from].is_none();
                if is_new && self.reaches(surface, &self.surfaces[index]) {
                    next[from] = Some(index);
                    queue.push_back(from);
                }
            }
        }
        next[here]
    }

    /// Returns whether a hero can jump from one surface to another, at some time.
    fn reaches(&self, from: &Surface, to: &Surface) -> bool {
        let lowest = to.top + to.swept[0].y - from.top - from.swept[1].y;
        let highest = to.top + to.swept[1].y - from.top - from.swept[0].y;
        let rise = 0.0f32.clamp(lowest, max(lowest, highest));
        if rise > self.height * JUMP {
            return false;
        }
        let left = to.left + to.swept[0].x - from.right - from.swept[1].x;
        let right = from.left + from.swept[0].x - to.right - to.swept[1].x;
        let up = self.walk.jump;
        let time = (up + max(up * up - 2.0 * self.fall * rise, 0.0).sqrt()) / self.fall;
        max(left, right) < self.walk.speed * time * JUMP
    }

    /// Returns whether a body is in the way of a hero whose middle is at `x`, and whose feet are at `feet`.
    fn is_beside(&self, wall: &Surface, x: f32, feet: f32) -> bool {
        let is_high = wall.bottom < feet + STANDS && wall.top > feet + STANDS;
        is_high && wall.left - self.width < x && x < wall.right + self.width
    }

    /// Returns whether a hero that jumps now comes down on a body that moves, whose top is `rise` higher than its feet.
    fn lands_on(&self, to: &Surface, rise: f32) -> bool {
        let gap = max(to.left - self.at.x, self.at.x - to.right);
        let time = max(gap, 0.0) / self.walk.speed;
        // Bodies turn around at the ends of their paths.
        let off = to.velocity.y * time;
        let turned = off.clamp(to.swept[0].y, max(to.swept[0].y, to.swept[1].y));
        let above = self.walk.jump * time - self.fall * time * time * 0.5 - rise;
        above - (2.0 * turned - off) > STANDS
    }

    /// The keys with which a hero on one surface jumps to another, or waits until it can.
    fn hop(&self, from: &Surface, to: &Surface) -> Buttons {
        let rise = to.top - from.top;
        let is_below = rise < -self.height && to.left < from.right && from.left < to.right;
        if is_below {
            // Over the nearer end that something is below.
            let ends = [from.left - 3.0 * self.width, from.right + 3.0 * self.width];
            let is_open = |x: f32| {
                let is_over = to.left - 4.0 * self.width < x && x < to.right + 4.0 * self.width;
                is_over && !self.surfaces.iter().any(|wall| self.is_beside(wall, x, from.top))
            };
            let [left, right] =
                ends.map(|x| if is_open(x) { (x - self.at.x).abs() } else { f32::MAX });
            return self.run_to(if left < right { ends[0] } else { ends[1] });
        }
        let middle = (to.left + to.right) * 0.5;
        let edge = middle.clamp(from.left, max(from.left, from.right));
        let in_reach = match (is_still(from), is_still(to)) {
            (true, true) => true,
            (true, false) => self.lands_on(to, rise),
            (false, _) => {
                let highest = if is_still(to) { JUMP } else { JUMP_ONTO };
                rise < self.height * highest && rise > -self.height * DROP
            }
        };
        if (self.at.x - edge).abs() > 2.0 * NEAR || !in_reach {
            return self.run_to(edge);
        }
        let way = if middle > self.at.x { Buttons::RIGHT } else { Buttons::LEFT };
        Buttons(way.0 | Buttons::UP.0)
    }
}

fn is_still(surface: &Surface) -> bool {
    surface.swept == [Vec2::ZERO; 2]
}

fn surface(view: &BotView, body: &SnapshotBody, margin: f32, late: f32) -> Surface {
    let world = view.game.world();
    let (half, velocity) = (body.shape.half_extent(), world.velocity(body.id));
    let now = world.position(body.id);
    let mut swept = [Vec2::ZERO; 2];
    if world.motion(body.id) == Motion::Kinematic
        && let Some(path) = path_through(view, body, now)
    {
        let points = path.points().iter().map(|&point| point - now);
        swept = points.fold(swept, |[low, high], point| {
            [
                Vec2::new(min(low.x, point.x), min(low.y, point.y)),
                Vec2::new(max(high.x, point.x), max(high.y, point.y)),
            ]
        });
    }
    let at = now + velocity * late;
    let (left, right) = (at.x - half.x + margin, at.x + half.x - margin);
    Surface {
        body: body.id,
        left,
        right,
        top: at.y + half.y,
        bottom: at.y - half.y,
        velocity,
        swept,
    }
}

/// The path on which a body is: one of a body of the same shape, which leads past where it is.
fn path_through<'a>(view: &BotView<'a>, body: &SnapshotBody, at: Vec2) -> Option<&'a Path> {
    let same = view.game.scene().bodies.iter().filter(|placed| placed.def.shape == body.shape);
    same.filter_map(|placed| placed.path.as_ref()).find(|path| {
        path.points().windows(2).any(|leg| {
            let way = leg[1] - leg[0];
            let share = ((at - leg[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0);
            (leg[0] + way * share).distance(at) < NEAR
        })
    })
}
