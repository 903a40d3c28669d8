//! Interest management: the part of a large world that one player's camera can see, and the channel for it.
//!
//! The view is centred on the player's hero and stays inside the world, as on the page. A body is sent from the moment
//! it is, or soon will be, within a margin of the view, until it is two margins away. A body at rest costs nothing, so
//! it is kept out to a much greater distance. The selection depends on the snapshot, the bodies sent before, and the
//! hero's past positions. In the stream, bodies that enter and leave the area appear as births and deaths.

use super::buffer_pool::BufferPool;
use super::snapshot_channel::{LiveParticles, Rate, SnapshotChannel, Subscriber};
use bytes::Bytes;
use jostle_game::scene::Camera;
use jostle_game::{Event, Scene, Seat};
use jostle_protocol::limits::QUANTA_MAX;
use jostle_protocol::{Snapshot, SnapshotBody, TimedEvent};
use jostle_sim::{BodyId, Particles, Vec2};
use std::sync::Arc;

/// How far the page's camera looks ahead of its hero, in ticks of the hero's motion. A room has to know this, because a
/// body must be sent before the camera can see it. The page derives its own constants from these.
pub const CAMERA_AHEAD_TICKS: i32 = 11;
/// In each tick, the camera covers the distance to its goal divided by this number.
pub const CAMERA_CATCH_UP_TICKS: i32 = 9;
/// Default size of a view, in multiples of the scene's camera height.
const VIEW_DEFAULT: Vec2 = Vec2::new(2.0, 1.0);
/// Maximum width and height of a view, in multiples of the scene's camera height.
const VIEW_HEIGHTS_MAX: f32 = 4.0;
/// The smaller side of the view divided by the margin. At the lowest rate, the margin is three times as large.
const MARGINS: i32 = 16;
/// Number of margins within which a resting body is kept: half a view.
const MARGINS_KEPT: i32 = MARGINS / 2;
/// A hero that moves further in one tick than the view's height divided by this number has been teleported.
const TELEPORT_PARTS: i32 = 8;

/// A position in quanta.
type Position = [i32; 2];
/// A width and height in quanta.
pub type Extent = [i32; 2];

/// The extent of a view in a scene; `None` if it covers the whole world. `size` is in world units, and is known once
/// the client has reported it.
pub fn view_of(scene: &Scene, size: Option<Vec2>) -> Option<Extent> {
    let Camera::Follow { height } = scene.camera else { return None };
    let view = extent(scene, size.unwrap_or(VIEW_DEFAULT * height), height);
    (view != world_of(scene)).then_some(view)
}

/// The extent of a view of this size, limited to the world and to the largest view.
fn extent(scene: &Scene, size: Vec2, height: f32) -> Extent {
    let world = world_of(scene);
    let most = quanta(VIEW_HEIGHTS_MAX * height, scene.world.quantum);
    let size = [size.x, size.y].map(|length| quanta(length, scene.world.quantum).clamp(1, most));
    [size[0].min(world[0]), size[1].min(world[1])]
}

fn world_of(scene: &Scene) -> Extent {
    [scene.size.x, scene.size.y].map(|length| quanta(length, scene.world.quantum))
}

/// Converts a length to quanta, limited to the largest coordinate.
fn quanta(length: f32, quantum: f32) -> i32 {
    ((length / quantum) as i32).min(QUANTA_MAX)
}

/// One player's view, and the messages for it.
#[derive(Clone, Debug)]
pub struct InterestArea {
    seat: Seat,
    channel: SnapshotChannel,
    camera: CameraArea,
}

impl InterestArea {
    /// Creates an area, and subscribes its player with a keyframe. If there was an area `before`, its camera is kept,
    /// because the page's camera does not move when the rate changes.
    pub fn subscribe(
        before: Option<InterestArea>,
        seat: Seat,
        rate: Rate,
        scene: &Scene,
        view: Extent,
        newest: &Snapshot,
        live: Option<LiveParticles>,
    ) -> (InterestArea, Subscriber, Bytes) {
        let mut camera = match before {
            Some(area) => CameraArea { view, ..area.camera },
            None => CameraArea::new(scene, view),
        };
        camera.follow(newest, seat, rate);
        let mut first = Snapshot::default();
        camera.see(newest, &[], &mut first);
        let mut channel = SnapshotChannel::new(rate, &Arc::new(first));
        let (subscriber, keyframe) = channel.subscribe(live);
        (InterestArea { seat, channel, camera }, subscriber.of(seat), keyframe)
    }

    /// Changes the view's width and height, world units.
    pub fn resize(&mut self, scene: &Scene, size: Vec2) {
        if let Camera::Follow { height } = scene.camera {
            self.camera.view = extent(scene, size, height);
        }
    }

    /// See [`SnapshotChannel::note`].
    pub fn note(&mut self, acts: bool) {
        self.channel.note(acts);
    }

    /// Adds the next tick. See [`SnapshotChannel::push`].
    pub fn push(
        &mut self,
        newest: &Snapshot,
        events: &[TimedEvent],
        particles: &Particles,
        buffers: &mut BufferPool,
    ) {
        let InterestArea { seat, channel, camera } = self;
        camera.follow(newest, *seat, channel.rate());
        let events = events.iter().filter(|timed| camera.shows(timed)).copied();
        channel.push_seen(newest.tick, events, particles, buffers, |before, next| {
            camera.see(newest, &before.bodies, next);
        });
    }

    /// This tick's message. See [`SnapshotChannel::message`].
    pub fn message(&self, subscriber: &Subscriber) -> Option<&Bytes> {
        self.channel.message(subscriber)
    }
}

/// The part of the world that a camera shows.
#[derive(Clone, Debug)]
struct CameraArea {
    quantum: f32,
    world: Extent,
    view: Extent,
    /// The hero being followed, and its position one tick ago.
    hero: Option<(BodyId, Position)>,
    /// The view's centre, as on the page.
    center: Option<Position>,
    margin: i32,
    /// Corners of the region that may be visible until the next message.
    low: Position,
    high: Position,
}

impl CameraArea {
    fn new(scene: &Scene, view: Extent) -> CameraArea {
        let (quantum, world) = (scene.world.quantum, world_of(scene));
        let (low, high) = ([0; 2], world);
        CameraArea { quantum, world, view, hero: None, center: None, margin: 0, low, high }
    }

    /// Follows the hero. Without a hero, the view does not move.
    fn follow(&mut self, newest: &Snapshot, seat: Seat, rate: Rate) {
        let hero = hero_of(newest, seat).map(|body| (body.id, body.quanta));
        let (at, velocity) = match (hero, self.hero) {
            (Some((id, at)), Some((old, before))) if id == old => (at, self.velocity(before, at)),
            (Some((_, at)), _) => (at, [0; 2]),
            (None, _) => (self.center.unwrap_or(self.world.map(|length| length / 2)), [0; 2]),
        };
        self.hero = hero;
        let every = i32::from(rate.every());
        let after = |ticks: i32| self.inside([0, 1].map(|axis| at[axis] + ticks * velocity[axis]));
        let goal = after(CAMERA_AHEAD_TICKS);
        let center = match self.center {
            Some(center) if !self.is_jump(center, goal) => [0, 1]
                .map(|axis| center[axis] + (goal[axis] - center[axis]) / CAMERA_CATCH_UP_TICKS),
            _ => goal,
        };
        self.cover(center, after(CAMERA_AHEAD_TICKS + every), every);
        // If no hero has been followed yet, the page will jump to the first one.
        self.center = self.center.or(hero.map(|_| center)).and(Some(center));
    }

    /// Covers everything that the camera may show until the next message, while it moves from `center` towards `goal`.
    fn cover(&mut self, center: Position, goal: Position, every: i32) {
        let shift = [0, 1].map(|axis| {
            (goal[axis] - center[axis]) * every.min(CAMERA_CATCH_UP_TICKS) / CAMERA_CATCH_UP_TICKS
        });
        self.low = [0, 1].map(|axis| center[axis] + shift[axis].min(0) - self.view[axis] / 2);
        self.high = [0, 1].map(|axis| center[axis] + shift[axis].max(0) + self.view[axis] / 2);
        // The margin is never smaller than CAMERA_CATCH_UP_TICKS, since a glide in whole quanta ends this far from the
        // page's.
        let margin = (self.view[0].min(self.view[1]) / MARGINS).max(CAMERA_CATCH_UP_TICKS);
        self.margin = margin * (1 + every / 6);
    }

    /// The hero's displacement in one tick, or zero if the hero was teleported.
    fn velocity(&self, before: Position, at: Position) -> Position {
        let velocity = [0, 1].map(|axis| at[axis] - before[axis]);
        let most = self.view[1] / TELEPORT_PARTS;
        if velocity.iter().any(|axis| axis.abs() > most) { [0; 2] } else { velocity }
    }

    /// Returns true if the page's camera jumps between the two positions instead of gliding.
    fn is_jump(&self, from: Position, to: Position) -> bool {
        let far = i64::from(self.view[1] + self.view[1] / 2);
        let distance = [0, 1].map(|axis| i64::from(from[axis]) - i64::from(to[axis]));
        distance[0] * distance[0] + distance[1] * distance[1] > far * far
    }

    /// The centre nearest to `at` for which the view stays inside the world, or the world's centre if the view does not
    /// fit.
    fn inside(&self, at: Position) -> Position {
        [0, 1].map(|axis| {
            let (half, world) = (self.view[axis] / 2, self.world[axis]);
            if 2 * half >= world { world / 2 } else { at[axis].clamp(half, world - half) }
        })
    }

    /// Writes the part of a snapshot that the camera sees to `seen`, for a client whose last message contained the
    /// bodies in `before`. The player's own hero is always included.
    fn see(&self, newest: &Snapshot, before: &[SnapshotBody], seen: &mut Snapshot) {
        let own = self.hero.map(|(id, _)| id);
        let mut held = before.iter().peekable();
        let is_seen = |body: &&SnapshotBody| {
            while held.next_if(|old| old.id.index < body.id.index).is_some() {}
            let old = held.peek().filter(|old| old.id == body.id);
            let margins = match old {
                Some(old) if old.quanta == body.quanta => MARGINS_KEPT,
                Some(_) => 2,
                None => 1,
            };
            own == Some(body.id) || self.touches(body, margins * self.margin)
        };
        seen.tick = newest.tick;
        seen.bodies.clear();
        seen.bodies.extend(newest.bodies.iter().filter(is_seen));
        seen.players.clone_from(&newest.players);
        // The round rarely changes, and copying it would allocate.
        if seen.round != newest.round {
            seen.round.clone_from(&newest.round);
        }
    }

    fn touches(&self, body: &SnapshotBody, margin: i32) -> bool {
        let half = body.shape.half_extent();
        let reach = [half.x, half.y].map(|half| quanta(half, self.quantum) + 1 + margin);
        self.contains(body.quanta, reach)
    }

    fn contains(&self, at: Position, reach: Extent) -> bool {
        [0, 1].iter().all(|&axis| {
            let (low, high) = (self.low[axis] - reach[axis], self.high[axis] + reach[axis]);
            (low..=high).contains(&at[axis])
        })
    }

    /// Returns true if an event should be sent. Impacts are sent only where they are visible; other events are rare,
    /// and the page displays some of them as text.
    fn shows(&self, timed: &TimedEvent) -> bool {
        let Event::Impact { point, .. } = timed.event else { return true };
        let at = [point.x, point.y].map(|axis| (axis / self.quantum) as i32);
        self.contains(at, [2 * self.margin; 2])
    }
}

fn hero_of(snapshot: &Snapshot, seat: Seat) -> Option<&SnapshotBody> {
    let player = snapshot.players.binary_search_by_key(&seat, |player| player.seat).ok()?;
    let hero = snapshot.players[player].hero?;
    let body = snapshot.bodies.binary_search_by_key(&hero.index, |body| body.id.index).ok()?;
    Some(&snapshot.bodies[body]).filter(|body| body.id == hero)
}

#[cfg(test)]
mod tests;
