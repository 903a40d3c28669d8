//! Replication: what each subscriber is sent after a tick.

mod buffer_pool;
mod interest;
mod snapshot_channel;
mod subscriber;

pub use buffer_pool::BufferPool;
pub use interest::{Extent, InterestArea, view_of};
pub use snapshot_channel::{LiveParticles, SnapshotChannel};
pub use subscriber::{Rate, Subscriber};

use bytes::Bytes;
use jostle_game::{Game, Scene, Seat};
use jostle_protocol::{Snapshot, TimedEvent};
use jostle_sim::Vec2;
use std::sync::Arc;

/// Everything that a room sends after its ticks.
pub struct Replication {
    /// By rate, each from its first subscription on.
    channels: [Option<SnapshotChannel>; Rate::ALL.len()],
    /// By seat, of the players who see a part of the world.
    areas: Vec<Option<InterestArea>>,
    buffers: BufferPool,
    /// Events of the newest tick.
    events: Vec<TimedEvent>,
}

impl Replication {
    /// Creates replication without subscribers, for a room with this many seats.
    pub fn new(seats: usize) -> Replication {
        Replication {
            channels: [const { None }; Rate::ALL.len()],
            areas: vec![None; seats],
            buffers: BufferPool::default(),
            events: Vec::new(),
        }
    }

    /// Encodes the newest snapshot for every channel and interest area that is due.
    pub fn push(&mut self, game: &Game, newest: &Arc<Snapshot>) {
        let Replication { channels, areas, buffers, events } = self;
        let particles = game.world().particles();
        events.clear();
        let reported = game.events().iter();
        events.extend(reported.map(|&event| TimedEvent { tick: newest.tick, event }));
        for channel in channels.iter_mut().flatten() {
            channel.push(newest, events, particles, buffers);
        }
        for area in areas.iter_mut().flatten() {
            area.push(newest, events, particles, buffers);
        }
    }

    /// Subscribes a client to the whole world. See [`SnapshotChannel::subscribe`].
    pub fn subscribe(
        &mut self,
        rate: Rate,
        newest: &Arc<Snapshot>,
        live: Option<LiveParticles>,
    ) -> (Subscriber, Bytes) {
        let channel = &mut self.channels[rate as usize];
        channel.get_or_insert_with(|| SnapshotChannel::new(rate, newest)).subscribe(live)
    }

    /// Subscribes a player's client to an interest area of its own, in place of the player's last.
    pub fn subscribe_view(
        &mut self,
        seat: Seat,
        rate: Rate,
        scene: &Scene,
        view: Extent,
        newest: &Snapshot,
        live: Option<LiveParticles>,
    ) -> (Subscriber, Bytes) {
        let area = &mut self.areas[usize::from(seat.0)];
        let (next, subscriber, keyframe) =
            InterestArea::subscribe(area.take(), seat, rate, scene, view, newest, live);
        *area = Some(next);
        (subscriber, keyframe)
    }

    /// Changes the size of a player's interest area, if there is one.
    pub fn resize(&mut self, seat: Seat, scene: &Scene, size: Vec2) {
        if let Some(area) = &mut self.areas[usize::from(seat.0)] {
            area.resize(scene, size);
        }
    }

    /// Removes a player's interest area, if there is one.
    pub fn remove_area(&mut self, seat: Seat) {
        if let Some(area) = self.areas.get_mut(usize::from(seat.0)) {
            *area = None;
        }
    }

    /// See [`crate::Room::message`].
    pub fn message(&self, subscriber: &Subscriber) -> Option<&Bytes> {
        match subscriber.seat {
            None => self.channels[subscriber.rate as usize].as_ref()?.message(subscriber),
            Some(seat) => self.areas[usize::from(seat.0)].as_ref()?.message(subscriber),
        }
    }
}
