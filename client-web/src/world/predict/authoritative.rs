//! The hero and its surroundings as a small simulated world, kept consistent with the snapshots.

use super::near::{self, NEAR_MAX, Near, body_of, step_between};
use super::schedule::InputSchedule;
use jostle_game::scene::LaneAxis;
use jostle_game::{Buttons, RoundPhase, RoundPlayer, Scene, Seat};
use jostle_protocol::{Snapshot, SnapshotBody};
use jostle_sim::WorldSettings;
use jostle_sim::particles::dequantise;
use jostle_sim::{Aabb, BodyDef, BodyId, DT, Motion, Vec2, World};

/// Maximum number of ticks between two snapshots across which the state is continued.
const GAP_TICKS_MAX: u32 = 60;
/// Prediction error above which the difference counts as an unpredicted collision, in quanta. Smaller errors only mean
/// that the velocity is not known accurately enough.
const COLLISION_QUANTA: f32 = 6.0;
/// Number of snapshots whose positions determine a velocity; older ones have no weight.
const MEMORY: u32 = 24;

/// The small world at the end of a tick.
#[derive(Clone)]
pub(super) struct AuthoritativeSim {
    world: World,
    /// The tick at the end of which the world is in this state.
    pub tick: u32,
    /// The hero's id in the room.
    pub hero: BodyId,
    /// The hero's id in the small world.
    local: BodyId,
    /// Nearby bodies, in index order of the room.
    others: Vec<Other>,
    /// The number of snapshots on each axis since the velocity was last reset.
    known: [u32; 2],
    /// The player's state in the round, if there is one.
    player: Option<RoundPlayer>,
    /// Whether nothing may move yet, because the countdown is running.
    stands_still: bool,
}

/// A body near the hero.
#[derive(Clone, Copy, Debug)]
struct Other {
    id: BodyId,
    local: BodyId,
    motion: Motion,
    path: Option<usize>,
}

/// A body that carries the hero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carrier {
    /// The body's id in the room.
    pub id: BodyId,
    /// The position, world units.
    pub center: Vec2,
    /// The displacement during the last tick, world units.
    pub step: Vec2,
}

impl AuthoritativeSim {
    /// Creates a world around a hero as shown in a snapshot; `None` if the snapshot does not contain the hero.
    pub fn new(
        scene: &Scene,
        hero: BodyId,
        seat: Seat,
        newest: &Snapshot,
        before: Option<&Snapshot>,
    ) -> Option<AuthoritativeSim> {
        let shown = body_of(newest, hero)?;
        let velocity = step_between(before, newest, hero, scene.world.quantum);
        let mut world = World::new(settings(scene));
        let position = dequantise(shown.quanta, scene.world.quantum);
        let local = world.add(&BodyDef { position, velocity, ..near::traits(scene, shown) })?;
        let (others, known) = (Vec::new(), [1, 1]);
        let player = player_of(newest, seat);
        let mut authoritative = AuthoritativeSim {
            world,
            tick: newest.tick,
            hero,
            local,
            others,
            known,
            player,
            stands_still: stands_still(newest),
        };
        authoritative.surround(scene, shown, newest, before);
        Some(authoritative)
    }

    /// Whether the world can advance to a snapshot at this tick with this hero.
    pub fn follows(&self, hero: BodyId, tick: u32) -> bool {
        let near_in_time = tick > self.tick && tick - self.tick <= GAP_TICKS_MAX;
        self.hero == hero && near_in_time && self.world.contains(self.local)
    }

    /// Steps to the newest snapshot and reconciles with it.
    pub fn advance_to(
        &mut self,
        scene: &Scene,
        schedule: &InputSchedule,
        seat: Seat,
        newest: &Snapshot,
        before: Option<&Snapshot>,
    ) {
        let ticks = newest.tick - self.tick;
        while self.tick < newest.tick {
            self.step(scene, schedule);
        }
        self.player = player_of(newest, seat);
        self.stands_still = stands_still(newest);
        let Some(shown) = body_of(newest, self.hero) else { return };
        self.reconcile(scene.world.quantum, shown, ticks);
        self.surround(scene, shown, newest, before);
    }

    /// A position within half a quantum of the server's is kept. Otherwise a growing-memory filter (Brookner 1998,
    /// 1.2.10: least-squares fit of a line) corrects position and velocity. After an unpredicted collision it restarts
    /// with a velocity that explains the difference.
    fn reconcile(&mut self, quantum: f32, shown: &SnapshotBody, ticks: u32) {
        let place = dequantise(shown.quanta, quantum);
        let (mut at, mut speed) = (self.center(), self.velocity());
        for axis in 0..2 {
            let off = place[axis] - at[axis];
            self.known[axis] = (self.known[axis] + 1).min(MEMORY);
            if off.abs() <= 0.5 * quantum {
                continue;
            }
            if off.abs() > COLLISION_QUANTA * quantum {
                at[axis] = place[axis];
                speed[axis] += off / (ticks as f32 * DT);
                self.known[axis] = 1;
                continue;
            }
            let n = self.known[axis] as f32;
            at[axis] += off * (2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)));
            speed[axis] += off * (6.0 / (n * (n + 1.0))) / (ticks as f32 * DT);
        }
        self.world.set_position(self.local, at);
        self.world.set_velocity(self.local, speed);
    }

    /// Updates the bodies near the hero. Bodies found where they were expected are left unchanged.
    fn surround(
        &mut self,
        scene: &Scene,
        hero: &SnapshotBody,
        newest: &Snapshot,
        before: Option<&Snapshot>,
    ) {
        let found = near::find(scene, hero, self.velocity(), newest, before);
        let AuthoritativeSim { world, others, .. } = self;
        others.retain(|other| {
            let place = found.binary_search_by_key(&other.id, |near| near.id);
            let stays = place.is_ok_and(|place| found[place].def.motion == other.motion);
            let stays = stays && world.contains(other.local);
            if !stays {
                world.remove(other.local);
            }
            stays
        });
        for near in found {
            match others.binary_search_by_key(&near.id, |other| other.id) {
                Ok(place) => update(world, &others[place], &near, scene.world.quantum),
                Err(place) => {
                    let Some(local) = world.add(&near.def) else { continue };
                    let Near { id, path, def } = near;
                    others.insert(place, Other { id, local, motion: def.motion, path });
                }
            }
        }
    }

    /// Plays one tick as the room does.
    pub fn step(&mut self, scene: &Scene, schedule: &InputSchedule) {
        self.tick += 1;
        if self.stands_still {
            return;
        }
        for other in &self.others {
            let placed = other.path.and_then(|index| scene.bodies.get(index));
            if let Some(path) = placed.and_then(|placed| placed.path.as_ref())
                && self.world.contains(other.local)
            {
                let place = self.world.position(other.local);
                let velocity = path.velocity_to(self.tick, place, scene.world.speed_max);
                self.world.set_velocity(other.local, velocity);
            }
        }
        if let Some(spec) = &scene.hero {
            let is_stunned = self.player.is_some_and(|player| player.is_stunned);
            let down = if is_stunned { Buttons::default() } else { schedule.at(self.tick) };
            let velocity = spec.steered_in(&self.world, scene, self.local, down);
            let velocity = match scene.lane(self.player.and_then(|player| player.team)) {
                None => velocity,
                Some(LaneAxis::X) => Vec2::new(velocity.x, 0.0),
                Some(LaneAxis::Y) => Vec2::new(0.0, velocity.y),
            };
            self.world.set_velocity(self.local, velocity);
        }
        self.world.step();
    }

    /// The hero's centre, world units.
    pub fn center(&self) -> Vec2 {
        self.world.position(self.local)
    }

    /// The hero's velocity, units/s.
    pub fn velocity(&self) -> Vec2 {
        self.world.velocity(self.local)
    }

    /// The body that carries the hero, such as a lift: it moves, cannot be pushed, and touches the hero.
    pub fn carrier(&self) -> Option<Carrier> {
        let mut touches = self.world.touches().iter();
        let local = touches.find_map(|touch| {
            let other = match (touch.a == self.local, touch.b == self.local) {
                (true, _) => touch.b,
                (_, true) => touch.a,
                _ => return None,
            };
            let moves = self.world.motion(other) == Motion::Kinematic;
            (moves && self.world.velocity(other) != Vec2::ZERO).then_some(other)
        })?;
        let other = self.others.iter().find(|other| other.local == local)?;
        let (center, step) = (self.world.position(local), self.world.velocity(local) * DT);
        Some(Carrier { id: other.id, center, step })
    }
}

fn player_of(snapshot: &Snapshot, seat: Seat) -> Option<RoundPlayer> {
    snapshot.round.as_ref()?.player(seat).copied()
}

fn stands_still(snapshot: &Snapshot) -> bool {
    snapshot.round.as_ref().is_some_and(|round| round.phase == RoundPhase::Countdown)
}

/// Settings of the small world, which are the scene's minus everything that cannot affect the hero.
fn settings(scene: &Scene) -> WorldSettings {
    let everywhere = Aabb { low: Vec2::splat(f32::MIN), high: Vec2::splat(f32::MAX) };
    WorldSettings {
        sleeping: false,
        kill_zone: everywhere,
        bodies_max: NEAR_MAX + 1,
        particles_max: 0,
        ..scene.world_settings()
    }
}

fn update(world: &mut World, other: &Other, near: &Near, quantum: f32) {
    let off = near.def.position - world.position(other.local);
    if off.abs().max_element() > 0.5 * quantum {
        world.set_position(other.local, near.def.position);
        world.set_velocity(other.local, near.def.velocity);
    } else if near.def.motion == Motion::Kinematic {
        world.set_velocity(other.local, near.def.velocity);
    }
}
