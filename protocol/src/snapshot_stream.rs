//! One end of a stream of snapshots. Both ends have the newest snapshot and all points' positions in the four newest; a
//! message is a pure function of these and the next snapshot. WebSocket delivers messages in order, so the two ends
//! stay equal without acknowledgements. All readers whose keyframes are at least [`SnapshotStream::KEYFRAME_AGE`]
//! messages old share the same bytes.

use crate::codec::{self, Baseline, Content, EncodeScratch, SnapshotMessage, is_same};
use crate::error::DecodeError;
use crate::limits::QUIET_MESSAGES_MAX;
use crate::position_history::{Position, PositionHistory};
use crate::snapshot::{PlayerState, Snapshot, SnapshotBody, TimedEvent};
use std::iter::zip;
use std::mem::swap;
use std::sync::Arc;

/// One end of the stream. It starts empty, so the first message is a keyframe.
#[derive(Clone, Debug)]
pub struct SnapshotStream {
    /// Number of ticks between messages; larger while nothing moves.
    every: u8,
    newest: Option<Arc<Snapshot>>,
    /// Histories of the bodies in the newest snapshot.
    bodies: Vec<PositionHistory>,
    /// Histories of the pointers of the players in the newest snapshot.
    pointers: Vec<PositionHistory>,
    /// Replaced histories, kept so that their memory can be reused.
    spare: Vec<PositionHistory>,
}

impl SnapshotStream {
    /// Number of messages after a keyframe until its reader's state equals a long-time reader's.
    pub const KEYFRAME_AGE: u32 = 3;
    /// Maximum number of ticks between messages, because a delta contains only the low byte of its tick.
    pub const TICKS_MAX: u32 = 255;

    /// Creates an empty end, with a message every `every` ticks. A decoding end takes this number from keyframes.
    pub fn new(every: u8) -> SnapshotStream {
        assert!(every > 0, "a message every 0 ticks");
        SnapshotStream {
            every,
            newest: None,
            bodies: Vec::new(),
            pointers: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Creates an end that has just sent this end's newest snapshot as a keyframe, and returns it along with the
    /// keyframe. `particles` contains the encoded live particles for the same tick, or is empty. Panics if there is no
    /// snapshot yet.
    pub fn branch(&self, particles: &[u8]) -> (SnapshotStream, Vec<u8>) {
        let newest = self.newest.as_ref().expect("a snapshot was sent before");
        let mut branch = SnapshotStream::new(self.every);
        let bytes = branch.keyframe(newest, &[], particles);
        (branch, bytes)
    }

    /// Maximum number of ticks until the next message: one interval, or as many as may be omitted while nothing moves.
    pub fn ticks_until_next(&self) -> u32 {
        let quiet = self.newest.is_some() && !self.moves();
        let messages = if quiet { 1 + QUIET_MESSAGES_MAX } else { 1 };
        messages * u32::from(self.every)
    }

    fn moves(&self) -> bool {
        self.bodies.iter().chain(&self.pointers).any(PositionHistory::is_moving)
    }

    /// The newest snapshot.
    pub fn newest(&self) -> Option<&Arc<Snapshot>> {
        self.newest.as_ref()
    }

    /// Encodes the message that leads from the newest snapshot to the next, with the events in between. The bytes
    /// depend on nothing else.
    ///
    /// Panics unless bodies and players are in order, the snapshot is at most [`SnapshotStream::TICKS_MAX`] ticks
    /// newer, and there are at most `EVENTS_MAX` events, in tick order.
    pub fn encode(&mut self, snapshot: &Arc<Snapshot>, events: &[TimedEvent]) -> Vec<u8> {
        self.encode_with(&mut EncodeScratch::default(), snapshot, events).to_vec()
    }

    /// Encodes a message like [`SnapshotStream::encode`], but without allocating. Any number of streams may share
    /// `scratch`.
    pub fn encode_with<'a>(
        &mut self,
        scratch: &'a mut EncodeScratch,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
    ) -> &'a [u8] {
        let ticks = self.newest.as_ref().map_or(0, |newest| snapshot.tick - newest.tick);
        assert!(ticks <= SnapshotStream::TICKS_MAX, "{ticks} ticks without a message");
        let content = Content { snapshot, every: self.every, events, particles: &[] };
        let bytes = codec::encode(scratch, content, self.baseline());
        self.follow(Arc::clone(snapshot), codec::keeps_bodies(bytes));
        bytes
    }

    /// Restarts the stream with this snapshot, and returns its keyframe. See [`SnapshotStream::branch`] for
    /// `particles`.
    pub fn keyframe(
        &mut self,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
        particles: &[u8],
    ) -> Vec<u8> {
        *self = SnapshotStream::new(self.every);
        let mut scratch = EncodeScratch::default();
        let content = Content { snapshot, every: self.every, events, particles };
        let bytes = codec::encode(&mut scratch, content, None);
        self.follow(Arc::clone(snapshot), false);
        bytes.to_vec()
    }

    /// Decodes a message from the other end, and advances to it. If there is an error, this end is unchanged.
    pub fn decode(&mut self, bytes: &[u8]) -> Result<Decoded, DecodeError> {
        let SnapshotMessage { snapshot, every, events, particles } =
            codec::decode(bytes, self.baseline())?;
        if let Some(every) = every {
            *self = SnapshotStream::new(every);
        }
        // All omitted messages were quiet.
        let quiet_until = snapshot.tick.saturating_sub(u32::from(self.every));
        let before = self.newest.as_ref().filter(|before| before.tick < quiet_until);
        let unchanged_until = before.map(|_| quiet_until);
        self.follow(Arc::new(snapshot), codec::keeps_bodies(bytes));
        Ok(Decoded { events, unchanged_until, particles })
    }

    /// Returns true if nothing has moved recently and the next snapshot is equal to the newest, so that it need not be
    /// sent. Sequence numbers of inputs may differ, because pages repeat their inputs while nothing happens.
    pub fn is_quiet(&self, next: &Snapshot) -> bool {
        self.newest.as_ref().is_some_and(|newest| {
            !self.moves()
                && newest.bodies == next.bodies
                && newest.players.len() == next.players.len()
                && zip(&newest.players, &next.players).all(|(old, next)| old.is_like(next))
                && newest.round == next.round
        })
    }

    fn baseline(&self) -> Option<Baseline<'_>> {
        let snapshot = self.newest.as_deref()?;
        Some(Baseline { snapshot, bodies: &self.bodies, pointers: &self.pointers })
    }

    /// Makes `next` the newest snapshot. `keeps_bodies` means that its bodies are the same, apart from their positions.
    fn follow(&mut self, next: Arc<Snapshot>, keeps_bodies: bool) {
        let nothing = Snapshot::default();
        let old = self.newest.as_deref().unwrap_or(&nothing);
        if keeps_bodies {
            zip(&mut self.bodies, &next.bodies)
                .for_each(|(history, body)| history.push(body.quanta));
        } else {
            self.spare.clear();
            self.spare.extend(body_histories(&old.bodies, &self.bodies, &next.bodies));
            swap(&mut self.bodies, &mut self.spare);
        }
        if zip(&old.players, &next.players).all(|(old, next)| is_same_pointer(old, next))
            && old.players.len() == next.players.len()
        {
            let pointers = next.players.iter().map(|player| player.pointer.unwrap_or_default());
            zip(&mut self.pointers, pointers).for_each(|(history, pointer)| history.push(pointer));
        } else {
            self.spare.clear();
            self.spare.extend(pointer_histories(&old.players, &self.pointers, &next.players));
            swap(&mut self.pointers, &mut self.spare);
        }
        self.newest = Some(next);
    }
}

impl Default for SnapshotStream {
    /// Creates an end with a message every tick.
    fn default() -> SnapshotStream {
        SnapshotStream::new(1)
    }
}

/// A message's contents other than its snapshot, which is now the stream's newest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decoded {
    /// Events since the previous snapshot.
    pub events: Vec<TimedEvent>,
    /// The tick until which the previous snapshot remained valid; `None` if no message was omitted.
    pub unchanged_until: Option<u32>,
    /// A keyframe's encoded live particles. May be empty.
    pub particles: Vec<u8>,
}

/// Histories of the bodies in the next snapshot. A new body counts as resting.
fn body_histories(
    old: &[SnapshotBody],
    histories: &[PositionHistory],
    next: &[SnapshotBody],
) -> impl Iterator<Item = PositionHistory> {
    let mut known = old.iter().zip(histories).peekable();
    next.iter().map(move |body| {
        while known.next_if(|(old, _)| old.id.index < body.id.index).is_some() {}
        match known.next_if(|(old, _)| is_same(old, body)) {
            Some((_, history)) => continued(history, body.quanta),
            None => PositionHistory::resting(body.quanta),
        }
    })
}

/// Returns true if both states belong to the same player, and either both or neither have a pointer.
fn is_same_pointer(old: &PlayerState, next: &PlayerState) -> bool {
    old.seat == next.seat && old.pointer.is_some() == next.pointer.is_some()
}

/// Histories of the pointers in the next snapshot. A new pointer counts as resting.
fn pointer_histories(
    old: &[PlayerState],
    histories: &[PositionHistory],
    next: &[PlayerState],
) -> impl Iterator<Item = PositionHistory> {
    next.iter().map(move |player| {
        let index = old.binary_search_by_key(&player.seat, |other| other.seat).ok();
        let known = index.filter(|&index| old[index].pointer.is_some());
        match (known, player.pointer) {
            (Some(index), Some(pointer)) => continued(&histories[index], pointer),
            (_, pointer) => PositionHistory::resting(pointer.unwrap_or_default()),
        }
    })
}

fn continued(history: &PositionHistory, position: Position) -> PositionHistory {
    let mut history = *history;
    history.push(position);
    history
}

#[cfg(test)]
mod tests;
