//! One end of a stream of snapshots. Both ends hold the newest snapshot and where everything was in
//! the four newest; a message is a pure function of that and of the next snapshot. WebSocket delivers
//! in order, so that both ends stay the same without acknowledgements, and all readers who started
//! from keyframes at least [`Stream::KEYFRAME_AGE`] messages old share the same bytes.

use crate::codec::motion::Trail;
use crate::codec::{self, Baseline, Decoded, Pen, is_same};
use crate::limits::QUIET_MESSAGES_MAX;
use crate::snapshot::{PlayerState, Snapshot, SnapshotBody, TimedEvent};
use crate::wire::DecodeError;
use std::iter::zip;
use std::mem::swap;
use std::sync::Arc;

/// What both ends hold; at first nothing, and the first message is a keyframe.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Ticks from one message to the next; more where nothing moved.
    every: u8,
    newest: Option<Arc<Snapshot>>,
    /// Of the newest one's bodies.
    bodies: Vec<Trail>,
    /// Of its players' pointers.
    pointers: Vec<Trail>,
    /// Trails that were replaced: their memory is used again.
    spare: Vec<Trail>,
}

impl Stream {
    /// Messages after a keyframe, itself not counted, until nothing tells its reader's end from one
    /// that was there long before.
    pub const KEYFRAME_AGE: u32 = 3;
    /// Ticks from one message to the next at most: its tick is told by the low byte.
    pub const TICKS_MAX: u32 = 255;

    /// An end that holds nothing, for a message every so many ticks. One that reads learns that from
    /// its keyframes.
    pub fn new(every: u8) -> Stream {
        assert!(every > 0, "a message every 0 ticks");
        Stream { every, newest: None, bodies: Vec::new(), pointers: Vec::new(), spare: Vec::new() }
    }

    /// An end that was just sent the newest snapshot of this one as a keyframe, and those bytes. They
    /// tell `particles` too, unless that is empty: what [`jostle_sim::Particles::tell`] makes of those
    /// of the same tick. Panics if there is no snapshot yet.
    pub fn branch(&self, particles: &[u8]) -> (Stream, Vec<u8>) {
        let newest = self.newest.as_ref().expect("a snapshot was sent before");
        let mut branch = Stream::new(self.every);
        let bytes = branch.keyframe(newest, &[], particles);
        (branch, bytes)
    }

    /// Ticks until the next message: one interval, or as many as may be left out while nothing moves.
    pub fn patience(&self) -> u32 {
        let quiet = self.newest.is_some() && !self.moves();
        let messages = if quiet { 1 + QUIET_MESSAGES_MAX } else { 1 };
        messages * u32::from(self.every)
    }

    fn moves(&self) -> bool {
        self.bodies.iter().chain(&self.pointers).any(Trail::is_moving)
    }

    /// The newest snapshot.
    pub fn newest(&self) -> Option<&Arc<Snapshot>> {
        self.newest.as_ref()
    }

    /// The coded message that leads from the newest snapshot to the next, with the events after the
    /// one's tick up to the other's. The bytes depend on nothing else.
    ///
    /// Panics unless bodies and players are in order, the snapshot is at most
    /// [`Stream::TICKS_MAX`] ticks newer, and the events are in tick order, at most `EVENTS_MAX`.
    pub fn encode(&mut self, snapshot: &Arc<Snapshot>, events: &[TimedEvent]) -> Vec<u8> {
        self.write(&mut Pen::default(), snapshot, events).to_vec()
    }

    /// [`Stream::encode`] with the pen that the messages before were written with, maybe those of other
    /// streams: no memory is asked for.
    pub fn write<'a>(
        &mut self,
        pen: &'a mut Pen,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
    ) -> &'a [u8] {
        let ticks = self.newest.as_ref().map_or(0, |newest| snapshot.tick - newest.tick);
        assert!(ticks <= Stream::TICKS_MAX, "{ticks} ticks without a message");
        let bytes = codec::encode(pen, snapshot, self.every, self.baseline(), events, &[]);
        self.follow(Arc::clone(snapshot), codec::keeps_bodies(bytes));
        bytes
    }

    /// Begins anew with this snapshot: the bytes of its keyframe, with the particles of the same tick,
    /// see [`Stream::branch`].
    pub fn keyframe(
        &mut self,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
        particles: &[u8],
    ) -> Vec<u8> {
        *self = Stream::new(self.every);
        let mut pen = Pen::default();
        let bytes = codec::encode(&mut pen, snapshot, self.every, None, events, particles);
        self.follow(Arc::clone(snapshot), false);
        bytes.to_vec()
    }

    /// Reads what the other end's `encode` wrote and follows it. After an error this end is as it
    /// was.
    pub fn decode(&mut self, bytes: &[u8]) -> Result<Heard, DecodeError> {
        let Decoded { snapshot, every, events, particles } = codec::decode(bytes, self.baseline())?;
        if let Some(every) = every {
            *self = Stream::new(every);
        }
        // Between two messages of the rate nothing is left out but what was quiet.
        let quiet_until = snapshot.tick.saturating_sub(u32::from(self.every));
        let before = self.newest.as_ref().filter(|before| before.tick < quiet_until);
        let still_until = before.map(|_| quiet_until);
        self.follow(Arc::new(snapshot), codec::keeps_bodies(bytes));
        Ok(Heard { events, still_until, particles })
    }

    /// Whether nothing moved lately and the next snapshot shows the same: it need not be sent.
    pub fn is_quiet(&self, next: &Snapshot) -> bool {
        self.newest.as_ref().is_some_and(|newest| {
            !self.moves() && newest.bodies == next.bodies && newest.players == next.players
        })
    }

    fn baseline(&self) -> Option<Baseline<'_>> {
        let snapshot = self.newest.as_deref()?;
        Some(Baseline { snapshot, bodies: &self.bodies, pointers: &self.pointers })
    }

    /// `keeps_bodies`: they are those of the newest snapshot, maybe elsewhere.
    fn follow(&mut self, next: Arc<Snapshot>, keeps_bodies: bool) {
        let nothing = Snapshot::default();
        let old = self.newest.as_deref().unwrap_or(&nothing);
        if keeps_bodies {
            zip(&mut self.bodies, &next.bodies).for_each(|(trail, body)| trail.go(body.quanta));
        } else {
            self.spare.clear();
            self.spare.extend(body_trails(&old.bodies, &self.bodies, &next.bodies));
            swap(&mut self.bodies, &mut self.spare);
        }
        if zip(&old.players, &next.players).all(|(old, next)| goes_on(old, next))
            && old.players.len() == next.players.len()
        {
            let pointers = next.players.iter().map(|player| player.pointer.unwrap_or_default());
            zip(&mut self.pointers, pointers).for_each(|(trail, pointer)| trail.go(pointer));
        } else {
            self.spare.clear();
            self.spare.extend(pointer_trails(&old.players, &self.pointers, &next.players));
            swap(&mut self.pointers, &mut self.spare);
        }
        self.newest = Some(next);
    }
}

impl Default for Stream {
    /// For a message every tick.
    fn default() -> Stream {
        Stream::new(1)
    }
}

/// What a message told beside the snapshot that is the newest now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// What happened since the snapshot before.
    pub events: Vec<TimedEvent>,
    /// Until this tick all was as in the snapshot before; `None` if that was the message before.
    pub still_until: Option<u32>,
    /// What a keyframe told of the particles of its tick, for [`jostle_sim::Particles::told`]; empty if
    /// nothing, or if none fly.
    pub particles: Vec<u8>,
}

/// Trails of the next snapshot's bodies; who was just born was always there.
fn body_trails(
    old: &[SnapshotBody],
    trails: &[Trail],
    next: &[SnapshotBody],
) -> impl Iterator<Item = Trail> {
    let mut known = old.iter().zip(trails).peekable();
    next.iter().map(move |body| {
        while known.next_if(|(old, _)| old.id.index < body.id.index).is_some() {}
        match known.next_if(|(old, _)| is_same(old, body)) {
            Some((_, trail)) => gone_on(trail, body.quanta),
            None => Trail::resting(body.quanta),
        }
    })
}

/// Whether the trail of a player's pointer goes on: the same player, who points as before or still does
/// not.
fn goes_on(old: &PlayerState, next: &PlayerState) -> bool {
    old.seat == next.seat && old.pointer.is_some() == next.pointer.is_some()
}

/// Trails of the next snapshot's pointers; one that just came was always there.
fn pointer_trails(
    old: &[PlayerState],
    trails: &[Trail],
    next: &[PlayerState],
) -> impl Iterator<Item = Trail> {
    next.iter().map(move |player| {
        let place = old.binary_search_by_key(&player.seat, |other| other.seat).ok();
        let known = place.filter(|&place| old[place].pointer.is_some());
        match (known, player.pointer) {
            (Some(place), Some(pointer)) => gone_on(&trails[place], pointer),
            (_, pointer) => Trail::resting(pointer.unwrap_or_default()),
        }
    })
}

fn gone_on(trail: &Trail, place: [i32; 2]) -> Trail {
    let mut trail = *trail;
    trail.go(place);
    trail
}

#[cfg(test)]
mod tests;
