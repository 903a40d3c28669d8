//! What the camera of one player can see of a world that is larger than a view, and the feed of that.
//!
//! The view is around the own hero and stays inside of the world, as the page has it. A body is sent
//! from when it comes within a margin of where the view is and soon will be, until it is twice the
//! margin away; one that rests costs nothing, and is kept much longer. Which bodies those are is a
//! function of the snapshot, of what was sent before, and of where the hero was; to the stream they
//! are born and die.

use crate::camera::{AHEAD_TICKS, CATCH_UP_TICKS};
use crate::feed::{Feed, Flying, Rate, Reader};
use crate::press::Press;
use bytes::Bytes;
use jostle_protocol::limits::QUANTA_MAX;
use jostle_protocol::{Snapshot, SnapshotBody, TimedEvent};
use jostle_sim::scene::Camera;
use jostle_sim::{BodyId, Event, Particles, Scene, Seat, Vec2};
use std::sync::Arc;

/// Width and height of a view that the client did not tell, in heights of the scene's camera.
const VIEW_DEFAULT: Vec2 = Vec2::new(2.0, 1.0);
/// Width and height of a view at most, in the same measure.
const VIEW_HEIGHTS_MAX: f32 = 4.0;
/// The margin is the smaller side of the view divided by this; at the lowest rate three times that.
const MARGINS: i32 = 16;
/// Margins within which who rests is kept: half a view.
const MARGINS_KEPT: i32 = MARGINS / 2;
/// A hero that is elsewhere in the next tick by more than this part of the view's height was carried.
const CARRIED_PARTS: i32 = 8;

/// A place or an extent in quanta.
type Place = [i32; 2];

/// The extent of a view in a scene; `None` if the whole world fits it. `told` by the client, world
/// units.
pub fn view_of(scene: &Scene, told: Option<Vec2>) -> Option<Place> {
    let Camera::Follow { height } = scene.camera else { return None };
    let view = extent(scene, told.unwrap_or(VIEW_DEFAULT * height), height);
    if view == world_of(scene) { None } else { Some(view) }
}

/// The part of this width and height that there is of the world, at most what any view shows.
fn extent(scene: &Scene, size: Vec2, height: f32) -> Place {
    let world = world_of(scene);
    let most = quanta(VIEW_HEIGHTS_MAX * height, scene.quantum);
    let size = [size.x, size.y].map(|length| quanta(length, scene.quantum).clamp(1, most));
    [size[0].min(world[0]), size[1].min(world[1])]
}

fn world_of(scene: &Scene) -> Place {
    [scene.size.x, scene.size.y].map(|length| quanta(length, scene.quantum))
}

/// A length in quanta, at most the largest coordinate.
fn quanta(length: f32, quantum: f32) -> i32 {
    ((length / quantum) as i32).min(QUANTA_MAX)
}

/// A player's sight and its messages.
#[derive(Clone, Debug)]
pub struct Sight {
    seat: Seat,
    feed: Feed,
    area: Area,
}

impl Sight {
    /// A sight and the client that begins to read it, with its keyframe. The page's camera stays where
    /// it was when the rate changes: so does that of the sight `before`.
    pub fn begin(
        before: Option<Sight>,
        seat: Seat,
        rate: Rate,
        scene: &Scene,
        view: Place,
        newest: &Snapshot,
        flying: Option<Flying>,
    ) -> (Sight, Reader, Bytes) {
        let mut area = match before {
            Some(sight) => Area { view, ..sight.area },
            None => Area::new(scene, view),
        };
        area.follow(newest, seat, rate);
        let mut first = Snapshot::default();
        area.see(newest, &[], &mut first);
        let mut feed = Feed::new(rate, &Arc::new(first));
        let (reader, keyframe) = feed.begin(flying);
        (Sight { seat, feed, area }, reader.of(seat), keyframe)
    }

    /// The view has another width and height now, world units.
    pub fn resize(&mut self, scene: &Scene, size: Vec2) {
        if let Camera::Follow { height } = scene.camera {
            self.area.view = extent(scene, size, height);
        }
    }

    /// The next tick, see [`Feed::push`].
    pub fn push(
        &mut self,
        newest: &Snapshot,
        events: &[TimedEvent],
        particles: &Particles,
        press: &mut Press,
    ) {
        let Sight { seat, feed, area } = self;
        area.follow(newest, *seat, feed.rate());
        let told = events.iter().filter(|timed| area.tells(timed)).copied();
        feed.push_seen(newest.tick, told, particles, press, |before, next| {
            area.see(newest, &before.bodies, next);
        });
    }

    /// See [`Feed::message`].
    pub fn message(&self, reader: &Reader) -> Option<&Bytes> {
        self.feed.message(reader)
    }
}

/// The part of the world that a camera shows.
#[derive(Clone, Debug)]
struct Area {
    quantum: f32,
    world: Place,
    view: Place,
    /// The hero that is followed and where it was a tick ago.
    hero: Option<(BodyId, Place)>,
    /// Middle of the view, as the page has it.
    middle: Option<Place>,
    margin: i32,
    /// Corners of all that may be on the screen until the next message.
    low: Place,
    high: Place,
}

impl Area {
    fn new(scene: &Scene, view: Place) -> Area {
        let (quantum, world) = (scene.quantum, world_of(scene));
        Area { quantum, world, view, hero: None, middle: None, margin: 0, low: [0; 2], high: world }
    }

    /// Goes with the hero. Without one the view stays where it was.
    fn follow(&mut self, newest: &Snapshot, seat: Seat, rate: Rate) {
        let hero = hero_of(newest, seat).map(|body| (body.id, body.quanta));
        let (at, way) = match (hero, self.hero) {
            (Some((id, at)), Some((old, before))) if id == old => (at, self.way(before, at)),
            (Some((_, at)), _) => (at, [0; 2]),
            (None, _) => (self.middle.unwrap_or(self.world.map(|length| length / 2)), [0; 2]),
        };
        self.hero = hero;
        let every = i32::from(rate.every());
        let after = |ticks: i32| self.inside([0, 1].map(|axis| at[axis] + ticks * way[axis]));
        let wanted = after(AHEAD_TICKS);
        let middle = match self.middle {
            Some(middle) if !self.is_jump(middle, wanted) => {
                [0, 1].map(|axis| middle[axis] + (wanted[axis] - middle[axis]) / CATCH_UP_TICKS)
            }
            _ => wanted,
        };
        // Until the next message it moves by this much.
        let there = after(AHEAD_TICKS + every);
        let way = [0, 1]
            .map(|axis| (there[axis] - middle[axis]) * every.min(CATCH_UP_TICKS) / CATCH_UP_TICKS);
        let half = |axis: usize| self.view[axis] / 2;
        self.low = [0, 1].map(|axis| middle[axis] + way[axis].min(0) - half(axis));
        self.high = [0, 1].map(|axis| middle[axis] + way[axis].max(0) + half(axis));
        // Where nobody was followed yet, the page jumps to its first hero.
        self.middle = self.middle.or(hero.map(|_| middle)).and(Some(middle));
        // A glide in whole quanta ends this far from where the page's does.
        let margin = (self.view[0].min(self.view[1]) / MARGINS).max(CATCH_UP_TICKS);
        self.margin = margin * (1 + every / 6);
    }

    /// The hero's way in a tick; none if it was carried off.
    fn way(&self, before: Place, at: Place) -> Place {
        let way = [0, 1].map(|axis| at[axis] - before[axis]);
        let fast = self.view[1] / CARRIED_PARTS;
        if way.iter().any(|axis| axis.abs() > fast) { [0; 2] } else { way }
    }

    /// Whether the page does not glide from one place to the other, but jumps.
    fn is_jump(&self, from: Place, to: Place) -> bool {
        let far = i64::from(self.view[1] + self.view[1] / 2);
        let way = [0, 1].map(|axis| i64::from(from[axis]) - i64::from(to[axis]));
        way[0] * way[0] + way[1] * way[1] > far * far
    }

    /// The middle of a view that stays inside of the world, or in its middle.
    fn inside(&self, at: Place) -> Place {
        [0, 1].map(|axis| {
            let (half, world) = (self.view[axis] / 2, self.world[axis]);
            if 2 * half >= world { world / 2 } else { at[axis].clamp(half, world - half) }
        })
    }

    /// What is seen of a snapshot by one who was sent these bodies before; the own hero always.
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
        seen.copy_players(&newest.players);
    }

    fn touches(&self, body: &SnapshotBody, margin: i32) -> bool {
        let half = body.shape.half_extent();
        let reach = [half.x, half.y].map(|half| quanta(half, self.quantum) + 1 + margin);
        self.contains(body.quanta, reach)
    }

    fn contains(&self, at: Place, reach: Place) -> bool {
        [0, 1].iter().all(|&axis| {
            let (low, high) = (self.low[axis] - reach[axis], self.high[axis] + reach[axis]);
            (low..=high).contains(&at[axis])
        })
    }

    /// Impacts are told where they are seen. All else is rare, and some of it is told in words.
    fn tells(&self, timed: &TimedEvent) -> bool {
        let Event::Impact { point, .. } = timed.event else { return true };
        let at = [point.x, point.y].map(|axis| (axis / self.quantum) as i32);
        self.contains(at, [2 * self.margin; 2])
    }
}

fn hero_of(snapshot: &Snapshot, seat: Seat) -> Option<&SnapshotBody> {
    let player = snapshot.players.binary_search_by_key(&seat, |player| player.seat).ok()?;
    let hero = snapshot.players[player].hero?;
    let place = snapshot.bodies.binary_search_by_key(&hero.index, |body| body.id.index).ok()?;
    Some(&snapshot.bodies[place]).filter(|body| body.id == hero)
}

#[cfg(test)]
mod tests;
