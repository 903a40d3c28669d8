//! The snapshot codec. A message consists of a head with the set of sections, followed by each non-empty section in the
//! order of the sections' bits. Parts of the state that did not change, or that changed as predicted, take up no bytes.

mod bodies;
mod events;
mod motion;
mod players;
mod round;
mod sections;

pub use bodies::is_same;
pub use sections::keeps_bodies;

use crate::error::{DecodeError, check};
use crate::limits::{PARTICLES_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use crate::position_history::{Position, PositionHistory};
use crate::snapshot::{PlayerState, SNAPSHOT, Snapshot, SnapshotBody, TimedEvent};
use crate::wire::{Reader, Writer};
use sections::bit;

/// The snapshot against which the next one is coded.
#[derive(Clone, Copy, Debug)]
pub struct Baseline<'a> {
    /// The newest snapshot that both ends have.
    pub snapshot: &'a Snapshot,
    /// Histories of the bodies in the snapshot.
    pub bodies: &'a [PositionHistory],
    /// Histories of the players' pointers, including those of players without a pointer.
    pub pointers: &'a [PositionHistory],
}

impl Baseline<'_> {
    /// Histories of all points that may move: first the bodies at these indices, then the pointers.
    fn histories(&self, survivors: &[u32]) -> impl Iterator<Item = &PositionHistory> {
        let bodies = survivors.iter().map(|&index| &self.bodies[index as usize]);
        bodies.chain(self.pointing().map(|(_, history)| history))
    }

    /// Players who have a pointer.
    fn pointing(&self) -> impl Iterator<Item = (&PlayerState, &PositionHistory)> {
        let players = self.snapshot.players.iter().zip(self.pointers);
        players.filter(|(player, _)| player.pointer.is_some())
    }
}

/// The encoder's lists and output, reused from one message to the next.
#[derive(Clone, Debug, Default)]
pub struct EncodeScratch {
    bodies: bodies::BodyDifference,
    players: players::PlayerDifference,
    moves: motion::MoveEncoder,
    writer: Writer,
}

/// A message's contents.
#[derive(Clone, Copy, Debug)]
pub struct Content<'a> {
    pub snapshot: &'a Snapshot,
    /// Number of ticks between messages, in a keyframe.
    pub every: u8,
    /// Events since the baseline.
    pub events: &'a [TimedEvent],
    /// Encoded live particles, in a keyframe. May be empty.
    pub particles: &'a [u8],
}

/// Encodes a message against a baseline, or, without one, as a keyframe. See [`crate::SnapshotStream::encode`].
pub fn encode<'a>(
    scratch: &'a mut EncodeScratch,
    content: Content,
    baseline: Option<Baseline>,
) -> &'a [u8] {
    let Content { snapshot, every, events, particles } = content;
    assert!(particles.len() <= PARTICLES_BYTES_MAX, "{} bytes of particles", particles.len());
    assert!(particles.is_empty() || baseline.is_none(), "only a keyframe holds particles");
    let nothing = Snapshot::default();
    let base = baseline.map_or(&nothing, |baseline| baseline.snapshot);
    assert!(base.tick <= snapshot.tick, "baseline {} is newer than {}", base.tick, snapshot.tick);
    let EncodeScratch { bodies, players, moves, writer } = scratch;
    bodies.find(&base.bodies, &snapshot.bodies);
    players.find(base, snapshot);
    let moves = baseline.and_then(|baseline| encode_moves(&baseline, bodies, snapshot, moves));

    let present = bodies.sections()
        | bit(moves.is_some(), sections::MOVES)
        | players.sections()
        | bit(!particles.is_empty(), sections::PARTICLES)
        | bit(!events.is_empty(), sections::EVENTS)
        | bit(baseline.is_none(), sections::KEYFRAME);
    writer.clear();
    writer.byte(SNAPSHOT | present);
    match baseline {
        Some(_) => writer.byte(snapshot.tick as u8),
        None => {
            writer.leb32(snapshot.tick);
            writer.byte(every);
        }
    }
    bodies.write_deaths(writer);
    moves.iter().for_each(|moves| writer.raw(moves));
    bodies.write_births(writer);
    players.write(writer, snapshot);
    if !particles.is_empty() {
        writer.count(particles.len());
        writer.raw(particles);
    }
    if !events.is_empty() {
        events::write(writer, events, base.tick, snapshot.tick);
    }
    writer.bytes()
}

/// Encodes all moves. A pointer that has disappeared is coded as if it were at its expected position.
fn encode_moves<'a>(
    baseline: &Baseline,
    bodies: &bodies::BodyDifference,
    snapshot: &Snapshot,
    moves: &'a mut motion::MoveEncoder,
) -> Option<&'a [u8]> {
    let centers =
        bodies.survivors.iter().map(|&(index, quanta)| (&baseline.bodies[index as usize], quanta));
    let pointers = baseline.pointing().map(|(player, history)| {
        let now = snapshot.players.binary_search_by_key(&player.seat, |other| other.seat);
        let now = now.ok().and_then(|index| snapshot.players[index].pointer);
        (history, now.unwrap_or_else(|| history.expected()))
    });
    moves.encode(centers.chain(pointers))
}

#[derive(Debug)]
pub struct SnapshotMessage {
    pub snapshot: Snapshot,
    /// Number of ticks between messages, if the message is a keyframe.
    pub every: Option<u8>,
    /// Events since the baseline.
    pub events: Vec<TimedEvent>,
    /// Encoded live particles. May be empty.
    pub particles: Vec<u8>,
}

/// Decodes a message. See [`crate::SnapshotStream::decode`].
pub fn decode(bytes: &[u8], baseline: Option<Baseline>) -> Result<SnapshotMessage, DecodeError> {
    if bytes.len() > SERVER_MESSAGE_BYTES_MAX {
        let bytes_max = SERVER_MESSAGE_BYTES_MAX;
        return Err(DecodeError::TooLong { bytes: bytes.len(), bytes_max });
    }
    let mut reader = Reader::new(bytes);
    let head = reader.byte("sections")?;
    let present = head & !SNAPSHOT;
    let nothing = Snapshot::default();
    let start = Baseline { snapshot: &nothing, bodies: &[], pointers: &[] };
    let is_keyframe = present & sections::KEYFRAME != 0;
    check(head & SNAPSHOT != 0, "sections")?;
    check(!is_keyframe || present & !sections::IN_KEYFRAME == 0, "sections")?;
    let (base, tick, every) = if is_keyframe {
        (start, reader.leb32("tick")?, Some(read_every(&mut reader)?))
    } else {
        let base = baseline.ok_or(DecodeError::NoBaseline)?;
        (base, read_tick(&mut reader, base.snapshot.tick)?, None)
    };
    let (survivors, mut players) = read_survivors(&mut reader, present, &base)?;
    let bodies = bodies::read(&mut reader, present, survivors)?;
    let of_players = if is_keyframe { present & !sections::INPUTS } else { present };
    let distance = tick - base.snapshot.tick;
    let round = players::read(&mut reader, of_players, &mut players, distance)?;
    let round = round.unwrap_or_else(|| base.snapshot.round.clone());
    let (mut particles, mut events) = (Vec::new(), Vec::new());
    if is_keyframe && present & sections::PARTICLES != 0 {
        let bytes = reader.some_count(PARTICLES_BYTES_MAX, 1, "particles")?;
        particles = reader.raw(bytes, "particles")?.to_vec();
    }
    if present & sections::EVENTS != 0 {
        events = events::read(&mut reader, base.snapshot.tick, tick)?;
    }
    reader.end()?;
    Ok(SnapshotMessage {
        snapshot: Snapshot { tick, bodies, players, round },
        every,
        events,
        particles,
    })
}

fn read_every(reader: &mut Reader) -> Result<u8, DecodeError> {
    let every = reader.byte("ticks between messages")?;
    check(every > 0, "ticks between messages")?;
    Ok(every)
}

/// Reads a tick from its low byte: the first tick, starting at `base`, that has this low byte.
fn read_tick(reader: &mut Reader, base: u32) -> Result<u32, DecodeError> {
    let distance = reader.byte("tick")?.wrapping_sub(base as u8);
    base.checked_add(u32::from(distance)).ok_or(DecodeError::OutOfRange { field: "tick" })
}

/// Reads deaths and moves, and returns the baseline's bodies and players with their new positions.
fn read_survivors(
    reader: &mut Reader,
    present: u8,
    base: &Baseline,
) -> Result<(Vec<SnapshotBody>, Vec<PlayerState>), DecodeError> {
    let survivors = bodies::read_survivors(reader, present, &base.snapshot.bodies)?;
    let histories = base.histories(&survivors);
    let positions = if present & sections::MOVES == 0 {
        histories.map(PositionHistory::expected).collect()
    } else {
        motion::read(histories, reader)?
    };
    let (centers, pointers) = positions.split_at(survivors.len());
    let moved = |(&index, &quanta): (&u32, &Position)| SnapshotBody {
        quanta,
        ..base.snapshot.bodies[index as usize]
    };
    let mut players = base.snapshot.players.clone();
    let pointing = players.iter_mut().filter_map(|player| player.pointer.as_mut());
    pointing.zip(pointers).for_each(|(pointer, position)| *pointer = *position);
    Ok((survivors.iter().zip(centers).map(moved).collect(), players))
}
