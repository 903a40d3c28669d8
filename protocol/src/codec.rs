//! The codec of snapshots: a head with a set of sections, then each section that is not empty, in the
//! order of its bit. What did not change, or changed as it was expected to, costs nothing.

mod bodies;
mod events;
pub mod motion;
mod players;

pub use bodies::is_same;

use crate::limits::{BODIES_MAX, PARTICLES_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use crate::message::SNAPSHOT;
use crate::snapshot::{PlayerState, Snapshot, SnapshotBody, TimedEvent};
use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::BodyId;
use motion::{Place, Trail};

/// Sections of a coded snapshot, one bit each.
mod section {
    pub const DEATHS: u8 = 1 << 0;
    pub const MOVES: u8 = 1 << 1;
    pub const BIRTHS: u8 = 1 << 2;
    pub const PLAYERS: u8 = 1 << 3;
    pub const INPUTS: u8 = 1 << 4;
    /// In a keyframe, where no input number grew.
    pub const PARTICLES: u8 = INPUTS;
    pub const EVENTS: u8 = 1 << 5;
    /// No section: the snapshot starts from nothing.
    pub const KEYFRAME: u8 = 1 << 6;
    /// Sections that a keyframe may have: it has nothing to change or to remove.
    pub const IN_KEYFRAME: u8 = KEYFRAME | BIRTHS | PLAYERS | PARTICLES | EVENTS;
}

/// Names of the sections, in the order of their bits.
const SECTION_NAMES: [&str; 7] =
    ["deaths", "moves", "births", "players", "inputs", "events", "keyframe"];

/// See [`Snapshot::section_names`].
pub fn section_names(bytes: &[u8]) -> Result<Vec<&'static str>, DecodeError> {
    let sections = Reader::new(bytes).byte("sections")?;
    let is_keyframe = sections & section::KEYFRAME != 0;
    let mut names = SECTION_NAMES;
    if is_keyframe {
        names[section::PARTICLES.trailing_zeros() as usize] = "particles";
    }
    let present = |(bit, _): &(usize, &'static str)| sections >> bit & 1 == 1;
    Ok(names.into_iter().enumerate().filter(present).map(|(_, name)| name).collect())
}

/// What the next snapshot is coded against.
#[derive(Clone, Copy, Debug)]
pub struct Baseline<'a> {
    /// The newest that both ends hold.
    pub snapshot: &'a Snapshot,
    /// Of its bodies.
    pub bodies: &'a [Trail],
    /// Of its players' pointers, whether they have one or not.
    pub pointers: &'a [Trail],
}

impl Baseline<'_> {
    /// Trails of what may move: the bodies at these places, then the pointers that there are.
    fn trails(&self, survivors: &[u32]) -> impl Iterator<Item = &Trail> {
        let bodies = survivors.iter().map(|&place| &self.bodies[place as usize]);
        bodies.chain(self.pointing().map(|(_, trail)| trail))
    }

    /// Players with a pointer.
    fn pointing(&self) -> impl Iterator<Item = (&PlayerState, &Trail)> {
        let players = self.snapshot.players.iter().zip(self.pointers);
        players.filter(|(player, _)| player.pointer.is_some())
    }
}

/// What messages are written with, one after the other: the lists that are compared for a message,
/// and its bytes, in memory that is used again for the next one.
#[derive(Clone, Debug, Default)]
pub struct Pen {
    bodies: bodies::Difference,
    players: players::Difference,
    moves: motion::Moves,
    writer: Writer,
}

/// The whole message, in the pen. See [`crate::Stream::encode`]. `particles` are told in a keyframe,
/// unless empty.
pub fn encode<'a>(
    pen: &'a mut Pen,
    snapshot: &Snapshot,
    every: u8,
    baseline: Option<Baseline>,
    events: &[TimedEvent],
    particles: &[u8],
) -> &'a [u8] {
    assert!(particles.len() <= PARTICLES_BYTES_MAX, "{} bytes of particles", particles.len());
    assert!(particles.is_empty() || baseline.is_none(), "only a keyframe tells particles");
    let nothing = Snapshot::default();
    let base = baseline.map_or(&nothing, |baseline| baseline.snapshot);
    assert!(base.tick <= snapshot.tick, "baseline {} is newer than {}", base.tick, snapshot.tick);
    let Pen { bodies, players, moves, writer } = pen;
    bodies.find(&base.bodies, &snapshot.bodies);
    players.find(base, snapshot);
    let moves = baseline.and_then(|baseline| code_moves(&baseline, bodies, snapshot, moves));

    let bit = |present: bool, section: u8| if present { section } else { 0 };
    let sections = bodies.sections()
        | bit(moves.is_some(), section::MOVES)
        | players.sections()
        | bit(!particles.is_empty(), section::PARTICLES)
        | bit(!events.is_empty(), section::EVENTS)
        | bit(baseline.is_none(), section::KEYFRAME);
    writer.clear();
    writer.byte(SNAPSHOT | sections);
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
    players.write(writer, &snapshot.players);
    if !particles.is_empty() {
        writer.count(particles.len());
        writer.raw(particles);
    }
    if !events.is_empty() {
        events::write(writer, events, base.tick, snapshot.tick);
    }
    writer.bytes()
}

/// The moves of what may move. A pointer that went away counts as where it was expected.
fn code_moves<'a>(
    baseline: &Baseline,
    bodies: &bodies::Difference,
    snapshot: &Snapshot,
    moves: &'a mut motion::Moves,
) -> Option<&'a [u8]> {
    let centers =
        bodies.survivors.iter().map(|&(place, quanta)| (&baseline.bodies[place as usize], quanta));
    let pointers = baseline.pointing().map(|(player, trail)| {
        let now = snapshot.players.binary_search_by_key(&player.seat, |other| other.seat);
        let now = now.ok().and_then(|place| snapshot.players[place].pointer);
        (trail, now.unwrap_or_else(|| trail.expected()))
    });
    moves.code(centers.chain(pointers))
}

/// Whether the bodies after this message are those before it, maybe elsewhere; from its first byte.
pub fn keeps_bodies(bytes: &[u8]) -> bool {
    const OTHERS: u8 = section::DEATHS | section::BIRTHS | section::KEYFRAME;
    bytes.first().is_some_and(|sections| sections & OTHERS == 0)
}

/// A message that was read.
#[derive(Debug)]
pub struct Decoded {
    /// What it led to.
    pub snapshot: Snapshot,
    /// Ticks between messages, if it is a keyframe.
    pub every: Option<u8>,
    /// What happened since the message before.
    pub events: Vec<TimedEvent>,
    /// What a keyframe told of particles; empty if nothing.
    pub particles: Vec<u8>,
}

/// Reads a message. See [`crate::Stream::decode`].
pub fn decode(bytes: &[u8], baseline: Option<Baseline>) -> Result<Decoded, DecodeError> {
    if bytes.len() > SERVER_MESSAGE_BYTES_MAX {
        let bytes_max = SERVER_MESSAGE_BYTES_MAX;
        return Err(DecodeError::TooLong { bytes: bytes.len(), bytes_max });
    }
    let mut reader = Reader::new(bytes);
    let head = reader.byte("sections")?;
    let sections = head & !SNAPSHOT;
    let nothing = Snapshot::default();
    let start = Baseline { snapshot: &nothing, bodies: &[], pointers: &[] };
    let is_keyframe = sections & section::KEYFRAME != 0;
    if head & SNAPSHOT == 0 || is_keyframe && sections & !section::IN_KEYFRAME != 0 {
        return Err(DecodeError::OutOfRange { field: "sections" });
    }
    let (base, tick, every) = if is_keyframe {
        (start, reader.leb32("tick")?, Some(read_every(&mut reader)?))
    } else {
        let base = baseline.ok_or(DecodeError::NoBaseline)?;
        (base, read_tick(&mut reader, base.snapshot.tick)?, None)
    };
    let (survivors, mut players) = read_survivors(&mut reader, sections, &base)?;
    let bodies = bodies::read(&mut reader, sections, survivors)?;
    let changes = if is_keyframe { sections & !section::INPUTS } else { sections };
    players::read(&mut reader, changes, &mut players, tick - base.snapshot.tick)?;
    let particles = if is_keyframe && sections & section::PARTICLES != 0 {
        read_particles(&mut reader)?
    } else {
        Vec::new()
    };
    let events = if sections & section::EVENTS == 0 {
        Vec::new()
    } else {
        events::read(&mut reader, base.snapshot.tick, tick)?
    };
    reader.end()?;
    Ok(Decoded { snapshot: Snapshot { tick, bodies, players }, every, events, particles })
}

fn read_every(reader: &mut Reader) -> Result<u8, DecodeError> {
    match reader.byte("ticks between messages")? {
        0 => Err(DecodeError::OutOfRange { field: "ticks between messages" }),
        every => Ok(every),
    }
}

/// Bytes that only who knows the scene can read further.
fn read_particles(reader: &mut Reader) -> Result<Vec<u8>, DecodeError> {
    match reader.count(PARTICLES_BYTES_MAX, 1, "particles")? {
        0 => Err(DecodeError::OutOfRange { field: "particles" }),
        bytes => Ok(reader.raw(bytes, "particles")?.to_vec()),
    }
}

/// The tick whose low byte is told: the next such after `base`.
fn read_tick(reader: &mut Reader, base: u32) -> Result<u32, DecodeError> {
    let distance = reader.byte("tick")?.wrapping_sub(base as u8);
    base.checked_add(u32::from(distance)).ok_or(DecodeError::OutOfRange { field: "tick" })
}

/// Bodies and pointers of the baseline that live on, where they are now.
fn read_survivors(
    reader: &mut Reader,
    sections: u8,
    base: &Baseline,
) -> Result<(Vec<SnapshotBody>, Vec<PlayerState>), DecodeError> {
    let survivors = bodies::read_survivors(reader, sections, &base.snapshot.bodies)?;
    let trails = base.trails(&survivors);
    let places = if sections & section::MOVES == 0 {
        trails.map(Trail::expected).collect()
    } else {
        motion::read(trails, reader)?
    };
    let (centers, pointers) = places.split_at(survivors.len());
    let moved = |(&place, &quanta): (&u32, &Place)| SnapshotBody {
        quanta,
        ..base.snapshot.bodies[place as usize]
    };
    let mut players = base.snapshot.players.clone();
    let pointing = players.iter_mut().filter_map(|player| player.pointer.as_mut());
    pointing.zip(pointers).for_each(|(pointer, place)| *pointer = *place);
    Ok((survivors.iter().zip(centers).map(moved).collect(), players))
}

fn write_id(writer: &mut Writer, id: BodyId) {
    writer.leb32(id.index);
    writer.leb32(id.generation);
}

fn read_id(reader: &mut Reader, field: &'static str) -> Result<BodyId, DecodeError> {
    let index = reader.leb_up_to(BODIES_MAX as u32 - 1, field)?;
    Ok(BodyId { index, generation: reader.leb32(field)? })
}
