//! The codec of snapshots: a head of tick, distance to the baseline and a set of sections, then
//! each section that is not empty, in the order of its bit. What did not change costs nothing.

mod bodies;
mod events;
mod players;

use crate::limits::{BODIES_MAX, SERVER_MESSAGE_BYTES_MAX};
use crate::snapshot::{Snapshot, TimedEvent};
use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::BodyId;

/// Sections of a coded snapshot, one bit each.
mod section {
    pub const DEATHS: u8 = 1 << 0;
    pub const MOVES: u8 = 1 << 1;
    pub const BIRTHS: u8 = 1 << 2;
    pub const PLAYERS_GONE: u8 = 1 << 3;
    pub const PLAYERS_CHANGED: u8 = 1 << 4;
    pub const PLAYERS_NEW: u8 = 1 << 5;
    pub const EVENTS: u8 = 1 << 6;
    pub const ALL: u8 = (1 << 7) - 1;
    /// Sections that a keyframe may have: it has nothing to change or to remove.
    pub const KEYFRAME: u8 = BIRTHS | PLAYERS_NEW | EVENTS;
}

/// Names of the sections, in the order of their bits.
const SECTION_NAMES: [&str; 7] =
    ["deaths", "moves", "births", "players gone", "players changed", "players new", "events"];

/// See [`Snapshot::section_names`].
pub fn section_names(bytes: &[u8]) -> Result<Vec<&'static str>, DecodeError> {
    let mut reader = Reader::new(bytes);
    reader.leb32("tick")?;
    reader.leb64("baseline")?;
    let sections = reader.byte("sections")?;
    let present = |(bit, _): &(usize, &'static str)| sections >> bit & 1 == 1;
    Ok(SECTION_NAMES.into_iter().enumerate().filter(present).map(|(_, name)| name).collect())
}

/// See [`Snapshot::encode`].
pub fn encode(snapshot: &Snapshot, baseline: Option<&Snapshot>, events: &[TimedEvent]) -> Vec<u8> {
    let nothing = Snapshot::default();
    let base = baseline.unwrap_or(&nothing);
    assert!(base.tick <= snapshot.tick, "baseline {} is newer than {}", base.tick, snapshot.tick);
    let bodies = bodies::Difference::between(&base.bodies, &snapshot.bodies);
    let players = players::Difference::between(base, snapshot);
    let events_section = if events.is_empty() { 0 } else { section::EVENTS };

    let mut writer = Writer::new();
    writer.leb32(snapshot.tick);
    // 0 is a keyframe, so that a delta against the very same tick is different from one.
    writer.leb64(baseline.map_or(0, |base| u64::from(snapshot.tick - base.tick) + 1));
    writer.byte(bodies.sections() | players.sections() | events_section);
    bodies.write(&mut writer);
    players.write(&mut writer);
    if !events.is_empty() {
        events::write(&mut writer, events, base.tick, snapshot.tick);
    }
    writer.finish()
}

/// See [`Snapshot::decode`].
pub fn decode(
    bytes: &[u8],
    baseline: Option<&Snapshot>,
) -> Result<(Snapshot, Vec<TimedEvent>), DecodeError> {
    if bytes.len() > SERVER_MESSAGE_BYTES_MAX {
        let bytes_max = SERVER_MESSAGE_BYTES_MAX;
        return Err(DecodeError::TooLong { bytes: bytes.len(), bytes_max });
    }
    let nothing = Snapshot::default();
    let mut reader = Reader::new(bytes);
    let tick = reader.leb32("tick")?;
    let base = match read_baseline_tick(&mut reader, tick)? {
        None => &nothing,
        Some(tick) => baseline
            .filter(|baseline| baseline.tick == tick)
            .ok_or(DecodeError::MissingBaseline { tick })?,
    };
    let sections = reader.byte("sections")?;
    let allowed = if std::ptr::eq(base, &nothing) { section::KEYFRAME } else { section::ALL };
    if sections & !allowed != 0 {
        return Err(DecodeError::OutOfRange { field: "sections" });
    }

    let bodies = bodies::read(&mut reader, sections, &base.bodies)?;
    let players = players::read(&mut reader, sections, &base.players, tick - base.tick)?;
    let events = if sections & section::EVENTS == 0 {
        Vec::new()
    } else {
        events::read(&mut reader, base.tick, tick)?
    };
    reader.end()?;
    Ok((Snapshot { tick, bodies, players }, events))
}

/// The tick that the snapshot is coded against, `None` for a keyframe.
fn read_baseline_tick(reader: &mut Reader, tick: u32) -> Result<Option<u32>, DecodeError> {
    let distance = reader.leb64("baseline")?;
    let Some(distance) = distance.checked_sub(1) else { return Ok(None) };
    let found = u64::from(tick).checked_sub(distance).map(|tick| tick as u32);
    found.map(Some).ok_or(DecodeError::OutOfRange { field: "baseline" })
}

fn write_id(writer: &mut Writer, id: BodyId) {
    writer.leb32(id.index);
    writer.leb32(id.generation);
}

fn read_id(reader: &mut Reader, field: &'static str) -> Result<BodyId, DecodeError> {
    let index = reader.leb_up_to(BODIES_MAX as u32 - 1, field)?;
    Ok(BodyId { index, generation: reader.leb32(field)? })
}

fn write_quanta(writer: &mut Writer, base: [i32; 2], quanta: [i32; 2]) {
    for axis in 0..2 {
        writer.zigzag(quanta[axis] - base[axis]);
    }
}

#[cfg(test)]
mod tests;
