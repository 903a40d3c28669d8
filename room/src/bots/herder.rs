//! How a bot herds: it gets behind a ball and shoves it along one axis, then along the other, no faster than the ball
//! comes to rest in the zone that keeps it.

use super::aims::{Goal, nearest_inside, zone_of};
use super::bot::Bot;
use super::bot_view::{BotView, GAIN, OwnHero};
use super::terrain::Terrain;
use jostle_game::scene::{Need, ZoneSpec};
use jostle_sim::math::{max, min};
use jostle_sim::{BodyId, Vec2};

/// Detour that a bot accepts for a robot which will soon be out of reach, world units, and how soon, seconds.
const ESCAPES: f32 = 100.0;
const ESCAPE_SECONDS: f32 = 8.0;
/// Detour that a bot accepts for a robot which is not in another team's zone, or that a defender accepts for one which is
/// in a zone that is nearly full, world units.
const RIVALS_ROBOT: f32 = 200.0;
/// Distance from the part of a zone that is well inside below which a ball stays where it is, world units.
const RESTS: f32 = 6.0;
/// Distance along an axis below which a ball needs no shove, and likewise at a wall of the zone, where there is no
/// room behind it, world units.
const ALIGNED: f32 = 1.0;
const FLUSH: f32 = 8.0;
/// Distance that a bot keeps from a ball until it shoves it, world units.
const GAP: f32 = 4.0;
/// Speeds at which bots shove, units/s.
const SPEEDS: [f32; 2] = [16.0, 60.0];
/// Error of a place from which a bot shoves, as a share of its error elsewhere.
const INEXACT: f32 = 0.4;
/// Share of the width of a hero by which it may be off the middle of the ball that it shoves.
const OFF: f32 = 0.7;

/// What a bot has to herd.
struct Flock<'a> {
    view: &'a BotView<'a>,
    terrain: &'a Terrain,
    goal: Goal,
    zone: &'a ZoneSpec,
    /// A hero's half extent.
    half: Vec2,
    /// Whether the bot keeps the others from filling their zones.
    guards: bool,
}

/// A ball, and where to shove it.
#[derive(Clone, Copy)]
struct Shove {
    at: Vec2,
    radius: f32,
    /// The axis along which to shove, and how far the ball has to move along it.
    way: Vec2,
    miss: f32,
}

impl Bot {
    /// A place from which to shove a ball into a zone that keeps it.
    pub(super) fn place_of_herder(
        &mut self,
        view: &BotView,
        terrain: &Terrain,
        own: &OwnHero,
    ) -> Option<Vec2> {
        let goal = view.aims.goals.iter().find(|goal| goal.keeps && goal.is_good_for(own.team))?;
        let half = view.game.world().shape(own.hero).half_extent();
        let zone = zone_of(view.game.scene(), goal.zone);
        let guards = self.guards(view, own);
        let flock = Flock { view, terrain, goal: *goal, zone, half, guards };
        let late = self.late();
        let ahead = self.ahead(view, own);
        if self.rng.below(60) == 0 {
            self.memory.herds = None;
        }
        let shove = self.memory.herds.and_then(|ball| flock.shove(ball, own.at, late));
        if shove.is_none() {
            let mates: Vec<Vec2> =
                view.mates(self.seat).map(|(_, hero)| view.game.world().position(hero)).collect();
            self.memory.herds = flock.choose(own, &mates);
        }
        let shove = shove.or_else(|| flock.shove(self.memory.herds?, own.at, late));
        let Some(shove) = shove else { return Some(ahead.seen_from(own, own.at)) };
        let miss = self.miss() * INEXACT;
        Some(ahead.seen_from(own, flock.place(ahead.at, &shove)) + miss)
    }
}

impl Flock<'_> {
    /// How a ball has to be shoved next, by a hero at `from` and in `late` seconds; `None` if it is where it belongs,
    /// or if there is no room behind it on an axis along which it has to move.
    fn shove(&self, ball: BodyId, from: Vec2, late: f32) -> Option<Shove> {
        let world = self.view.game.world();
        if !world.contains(ball) {
            return None;
        }
        let (now, velocity) = (world.position(ball), world.velocity(ball));
        let off = self.off(now);
        if self.zone.holds(now) && off.length() < RESTS {
            return None;
        }
        let radius = world.shape(ball).half_extent().x;
        let ways = along_axes(off).into_iter().filter(|axis| axis.length() > ALIGNED).map(|axis| {
            let (way, miss) = (axis.normalize(), axis.length());
            Shove { at: now + velocity * late, radius, way, miss }
        });
        let is_open = |shove: &Shove| self.terrain.has_room(now - shove.way * self.reach(shove));
        if ways.clone().any(|shove| shove.miss > FLUSH && !is_open(&shove)) {
            return None;
        }
        let open = ways.filter(|shove| {
            let is_free =
                self.terrain.has_room(now + shove.way * min(self.reach(shove), shove.miss));
            is_free && is_open(shove)
        });
        let detour = |shove: &Shove| from.distance(shove.at - shove.way * self.reach(shove));
        open.min_by(|a, b| detour(a).total_cmp(&detour(b)))
    }

    /// How far a ball at a point is from where it belongs.
    fn off(&self, at: Vec2) -> Vec2 {
        nearest_inside(self.zone, self.view.game.scene().size, at) - at
    }

    /// Returns whether a ball soon roams to a place from which it cannot be shoved.
    fn escapes(&self, ball: BodyId) -> bool {
        let world = self.view.game.world();
        let (now, radius) = (world.position(ball), world.shape(ball).half_extent().x);
        let soon = now + world.velocity(ball) * ESCAPE_SECONDS;
        let off = self.off(now);
        along_axes(off).into_iter().any(|axis| {
            let way = axis.normalize_or_zero();
            let reach = self.half.dot(way.abs()) + radius;
            axis.length() > FLUSH && !self.terrain.has_room(soon - way * reach)
        })
    }

    /// Distance from the middle of a ball to that of a hero that touches it from behind.
    fn reach(&self, shove: &Shove) -> f32 {
        self.half.dot(shove.way.abs()) + shove.radius
    }

    /// The ball to herd: the one that costs least, and that no mate is better placed for.
    fn choose(&self, own: &OwnHero, mates: &[Vec2]) -> Option<BodyId> {
        let world = self.view.game.world();
        let theirs = self.rivals_zones(own.team);
        let balls: Vec<(BodyId, Vec2, f32)> = self
            .view
            .balls(self.goal.balls)
            .filter(|&ball| self.shove(ball, own.at, 0.0).is_some())
            .map(|ball| {
                let at = world.position(ball);
                let cost = theirs.iter().find(|(zone, _)| zone.holds(at));
                let escapes = if self.escapes(ball) { -ESCAPES } else { 0.0 };
                (ball, at, self.off(at).length() + escapes + cost.map_or(0.0, |(_, cost)| *cost))
            })
            .collect();
        let cheapest = |from: Vec2, taken: &[BodyId]| {
            let free = balls.iter().filter(|(ball, ..)| !taken.contains(ball));
            let costs = free.map(|&(ball, at, cost)| (ball, cost + from.distance(at)));
            costs.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(ball, _)| ball)
        };
        let taken: Vec<BodyId> = mates
            .iter()
            .filter_map(|&mate| {
                let ball = cheapest(mate, &[])?;
                let at = world.position(ball);
                (mate.distance(at) < own.at.distance(at)).then_some(ball)
            })
            .collect();
        cheapest(own.at, &taken)
    }

    /// The zones of other teams, and what it costs to herd a ball that is in one.
    fn rivals_zones(&self, team: Option<u8>) -> Vec<(&ZoneSpec, f32)> {
        let (view, world) = (self.view, self.view.game.world());
        let is_nearly_full = |zone: &ZoneSpec| {
            let balls = view.balls(self.goal.balls);
            let inside = balls.filter(|&ball| zone.holds(world.position(ball))).count();
            matches!(zone.need, Need::Count(need) if inside + 1 >= need as usize)
        };
        let theirs = view.aims.goals.iter().filter(|other| other.keeps && !other.is_good_for(team));
        let zones = theirs.map(|other| zone_of(view.game.scene(), other.zone));
        zones
            .map(|zone| match (is_nearly_full(zone), self.guards) {
                (true, true) => (zone, -RIVALS_ROBOT),
                (true, false) => (zone, 0.0),
                _ => (zone, RIVALS_ROBOT),
            })
            .collect()
    }

    /// Where a hero goes to shove a ball: beside it, behind it, or through it.
    fn place(&self, from: Vec2, shove: &Shove) -> Vec2 {
        let &Shove { at, radius, way, miss } = shove;
        let (off, across) = (from - at, way.perp());
        let (behind, aside) = (-off.dot(way), off.dot(across));
        let (reach, wide) = (self.reach(shove), self.half.dot(across.abs()));
        if behind > reach - GAP {
            if aside.abs() > wide * OFF {
                return at - way * (reach + GAP);
            }
            let recovery = self.view.game.scene().minion_recovery;
            let [slow, fast] = SPEEDS;
            let speed = (2.0 * recovery * miss).sqrt().clamp(slow, fast);
            let speed = speed + max(behind - reach - 2.0 * GAP, 0.0);
            return from + way * (speed / GAIN) - across * aside;
        }
        let clear = wide + radius + GAP;
        let back = if behind < 0.0 { 0.0 } else { reach + GAP };
        let side = if aside < 0.0 { -1.0 } else { 1.0 };
        let beside = |side: f32| at + across * (side * clear) - way * back;
        if self.terrain.has_room(beside(side)) { beside(side) } else { beside(-side) }
    }
}

/// The parts of a vector along the two axes.
fn along_axes(vector: Vec2) -> [Vec2; 2] {
    [Vec2::new(vector.x, 0.0), Vec2::new(0.0, vector.y)]
}
