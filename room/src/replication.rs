//! Replication: the messages to each subscriber after a tick.

mod buffer_pool;
mod interest;
mod snapshot_channel;

pub use buffer_pool::BufferPool;
pub use interest::{CAMERA_AHEAD_TICKS, CAMERA_CATCH_UP_TICKS, InterestArea, view_of};
pub use snapshot_channel::{LiveParticles, Rate, SnapshotChannel, Subscriber};

use bytes::Bytes;
use jostle_game::{Game, Scene, Seat};
use jostle_protocol::{Snapshot, TimedEvent};
use jostle_sim::Vec2;
use litemap::LiteMap;
use std::sync::Arc;

/// Everything that a room sends after its ticks.
#[derive(Default)]
pub struct Replication {
    /// Channels by rate, each created at its first subscription.
    channels: [Option<SnapshotChannel>; Rate::ALL.len()],
    /// Interest areas of players who see only part of the world.
    pub areas: LiteMap<Seat, InterestArea>,
    buffers: BufferPool,
    /// The newest tick's events.
    events: Vec<TimedEvent>,
}

impl Replication {
    /// Encodes the newest snapshot for every channel and interest area that is due. `acts` tells whether a player's
    /// input has changed.
    pub fn push(&mut self, game: &Game, newest: &Arc<Snapshot>, acts: bool) {
        let Replication { channels, areas, buffers, events } = self;
        let particles = game.world().particles();
        events.clear();
        let reported = game.events().iter();
        events.extend(reported.map(|&event| TimedEvent { tick: newest.tick, event }));
        for channel in channels.iter_mut().flatten() {
            channel.note(acts);
            channel.push(newest, events, particles, buffers);
        }
        for (_, area) in areas.iter_mut() {
            area.note(acts);
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

    /// Changes the size of a player's interest area, if the player has one.
    pub fn resize(&mut self, seat: Seat, scene: &Scene, size: Vec2) {
        if let Some(area) = self.areas.get_mut(&seat) {
            area.resize(scene, size);
        }
    }

    /// See [`crate::Room::message`].
    pub fn message(&self, subscriber: &Subscriber) -> Option<&Bytes> {
        match subscriber.seat {
            None => self.channels[subscriber.rate as usize].as_ref()?.message(subscriber),
            Some(seat) => self.areas.get(&seat)?.message(subscriber),
        }
    }
}
