//! Players in a coded snapshot. In a usual tick each player's input number grows by the distance
//! to the baseline: one bit. Other changes name their fields. Where a pointer is that was there
//! before is told with all that moves, see `motion`.

use super::{read_id, section, write_id};
use crate::appearance::Appearance;
use crate::seat::{read_seat, write_seat};
use crate::snapshot::{PlayerState, Snapshot};
use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::{BodyId, SEATS_MAX, Seat};

/// Parts of the section of players, one bit each.
mod part {
    pub const GONE: u8 = 1 << 0;
    pub const CHANGED: u8 = 1 << 1;
    pub const NEW: u8 = 1 << 2;
    pub const ALL: u8 = (1 << 3) - 1;
}

/// Fields of a player that may change, one bit each.
mod field {
    pub const APPEARANCE: u8 = 1 << 0;
    pub const CONNECTED: u8 = 1 << 1;
    pub const HERO: u8 = 1 << 2;
    pub const SELECTED: u8 = 1 << 3;
    pub const HELD: u8 = 1 << 4;
    pub const SCORE: u8 = 1 << 5;
    pub const POINTER: u8 = 1 << 6;
    pub const INPUT_SEQ: u8 = 1 << 7;
}

/// Seat, name of one byte and its length, colour, connected, six empty or small fields.
const NEW_BYTES_MIN: usize = 11;

/// What happened to the players between two snapshots, in memory that is used again for the next two.
#[derive(Clone, Debug, Default)]
pub struct Difference {
    /// Whether each player of the baseline is gone; empty if nobody is.
    gone: Vec<bool>,
    /// Those in both.
    stayed: Vec<Stayed>,
    /// Places in the snapshot's list.
    new: Vec<u32>,
}

/// A player of both snapshots.
#[derive(Clone, Copy, Debug)]
struct Stayed {
    /// In the snapshot's list.
    place: u32,
    /// Changed fields.
    mask: u8,
    /// Whether the input number grew by the ticks between the two.
    advanced: bool,
}

impl Difference {
    /// Compares by seat.
    pub fn find(&mut self, base: &Snapshot, snapshot: &Snapshot) {
        let (old, players) = (&base.players, &snapshot.players);
        assert!(players.is_sorted_by(|a, b| a.seat < b.seat), "players must be in seat order");
        let distance = snapshot.tick - base.tick;
        let place_in = |list: &[PlayerState], player: &PlayerState| {
            list.binary_search_by_key(&player.seat, |other| other.seat).ok()
        };
        let stayed = |old: &PlayerState| {
            let place = place_in(players, old)?;
            let mask = changed_fields(old, &players[place], distance);
            let advanced = has_advanced(old, &players[place], distance);
            Some(Stayed { place: place as u32, mask, advanced })
        };
        self.stayed.clear();
        self.stayed.extend(old.iter().filter_map(stayed));
        self.gone.clear();
        if self.stayed.len() < old.len() {
            self.gone.extend(old.iter().map(|old| place_in(players, old).is_none()));
        }
        let numbered = (0u32..).zip(players);
        let new = numbered.filter(|(_, player)| place_in(old, player).is_none());
        self.new.clear();
        self.new.extend(new.map(|(place, _)| place));
    }

    /// Sections that are not empty.
    pub fn sections(&self) -> u8 {
        let bit = |present: bool, section: u8| if present { section } else { 0 };
        bit(self.parts() != 0, section::PLAYERS) | bit(self.any_advanced(), section::INPUTS)
    }

    fn parts(&self) -> u8 {
        let bit = |present: bool, part: u8| if present { part } else { 0 };
        bit(!self.gone.is_empty(), part::GONE)
            | bit(self.stayed.iter().any(|stayed| stayed.mask != 0), part::CHANGED)
            | bit(!self.new.is_empty(), part::NEW)
    }

    fn any_advanced(&self) -> bool {
        self.stayed.iter().any(|stayed| stayed.advanced)
    }

    /// Writes the sections that are not empty; `players` are the snapshot's.
    pub fn write(&self, writer: &mut Writer, players: &[PlayerState]) {
        let parts = self.parts();
        if parts != 0 {
            writer.byte(parts);
        }
        if parts & part::GONE != 0 {
            writer.bits(self.gone.iter().copied());
        }
        if parts & part::CHANGED != 0 {
            writer.bits(self.stayed.iter().map(|stayed| stayed.mask != 0));
            for &Stayed { place, mask, .. } in &self.stayed {
                write_change(writer, &players[place as usize], mask);
            }
        }
        if parts & part::NEW != 0 {
            writer.count(self.new.len());
            self.new.iter().for_each(|&place| write_new(writer, &players[place as usize]));
        }
        if self.any_advanced() {
            writer.bits(self.stayed.iter().map(|stayed| stayed.advanced));
        }
    }
}

fn has_advanced(old: &PlayerState, new: &PlayerState, distance: u32) -> bool {
    distance > 0 && new.input_seq == old.input_seq.wrapping_add(distance)
}

fn changed_fields(old: &PlayerState, new: &PlayerState, distance: u32) -> u8 {
    let bit = |changed: bool, field: u8| if changed { field } else { 0 };
    let known_seq = new.input_seq == old.input_seq || has_advanced(old, new, distance);
    bit(old.appearance != new.appearance, field::APPEARANCE)
        | bit(old.connected != new.connected, field::CONNECTED)
        | bit(old.hero != new.hero, field::HERO)
        | bit(old.selected != new.selected, field::SELECTED)
        | bit(old.held != new.held, field::HELD)
        | bit(old.score != new.score, field::SCORE)
        | bit(old.pointer.is_some() != new.pointer.is_some(), field::POINTER)
        | bit(!known_seq, field::INPUT_SEQ)
}

/// Writes the fields of `mask`; nothing if it is empty. `CONNECTED` alone says that it turned, and
/// so does `POINTER`, with the place where it comes.
fn write_change(writer: &mut Writer, new: &PlayerState, mask: u8) {
    if mask == 0 {
        return;
    }
    writer.byte(mask);
    if mask & field::APPEARANCE != 0 {
        new.appearance.write(writer);
    }
    let bodies =
        [(field::HERO, new.hero), (field::SELECTED, new.selected), (field::HELD, new.held)];
    for (_, body) in bodies.into_iter().filter(|&(field, _)| mask & field != 0) {
        write_body(writer, body);
    }
    if mask & field::SCORE != 0 {
        writer.leb32(u32::from(new.score));
    }
    if let Some(pointer) = new.pointer.filter(|_| mask & field::POINTER != 0) {
        writer.quanta(pointer);
    }
    if mask & field::INPUT_SEQ != 0 {
        writer.leb32(new.input_seq);
    }
}

fn write_new(writer: &mut Writer, player: &PlayerState) {
    write_seat(writer, player.seat);
    player.appearance.write(writer);
    writer.flag(player.connected);
    for body in [player.hero, player.selected, player.held] {
        write_body(writer, body);
    }
    writer.leb32(u32::from(player.score));
    writer.flag(player.pointer.is_some());
    player.pointer.into_iter().for_each(|pointer| writer.quanta(pointer));
    writer.leb32(player.input_seq);
}

fn write_body(writer: &mut Writer, body: Option<BodyId>) {
    writer.flag(body.is_some());
    if let Some(id) = body {
        write_id(writer, id);
    }
}

/// Reads the sections of players and applies them to `players`, who are the baseline's.
pub fn read(
    reader: &mut Reader,
    sections: u8,
    players: &mut Vec<PlayerState>,
    distance: u32,
) -> Result<(), DecodeError> {
    let parts = if sections & section::PLAYERS == 0 { 0 } else { read_parts(reader)? };
    if parts & part::GONE != 0 {
        let gone = read_some_bits(reader, players.len(), "players gone")?;
        let mut place = 0..;
        players.retain(|_| place.next().is_some_and(|place| !gone.contains(place)));
    }
    let stayed: Vec<Seat> = players.iter().map(|player| player.seat).collect();
    if parts & part::CHANGED != 0 {
        let changed = read_some_bits(reader, players.len(), "players changed")?;
        for (place, player) in players.iter_mut().enumerate() {
            if changed.contains(place) {
                read_change(reader, player)?;
            }
        }
    }
    if parts & part::NEW != 0 {
        read_new_players(reader, players)?;
    }
    if sections & section::INPUTS != 0 {
        let advanced = read_some_bits(reader, stayed.len(), "inputs advanced")?;
        for player in players {
            if stayed.binary_search(&player.seat).is_ok_and(|place| advanced.contains(place)) {
                player.input_seq = player.input_seq.wrapping_add(distance);
            }
        }
    }
    Ok(())
}

fn read_parts(reader: &mut Reader) -> Result<u8, DecodeError> {
    let parts = reader.byte("players")?;
    let known = parts != 0 && parts & !part::ALL == 0;
    if known { Ok(parts) } else { Err(DecodeError::OutOfRange { field: "players" }) }
}

/// Bits of which at least one is set: else the section would not have been written.
fn read_some_bits<'a>(
    reader: &mut Reader<'a>,
    count: usize,
    field: &'static str,
) -> Result<crate::wire::Bits<'a>, DecodeError> {
    let bits = reader.bits(count, field)?;
    if bits.is_empty() { Err(DecodeError::OutOfRange { field }) } else { Ok(bits) }
}

fn read_change(reader: &mut Reader, player: &mut PlayerState) -> Result<(), DecodeError> {
    let mask = reader.byte("player fields")?;
    if mask == 0 {
        return Err(DecodeError::OutOfRange { field: "player fields" });
    }
    if mask & field::APPEARANCE != 0 {
        player.appearance = Appearance::read(reader)?;
    }
    player.connected ^= mask & field::CONNECTED != 0;
    if mask & field::HERO != 0 {
        player.hero = read_body(reader)?;
    }
    if mask & field::SELECTED != 0 {
        player.selected = read_body(reader)?;
    }
    if mask & field::HELD != 0 {
        player.held = read_body(reader)?;
    }
    if mask & field::SCORE != 0 {
        player.score = read_score(reader)?;
    }
    if mask & field::POINTER != 0 {
        player.pointer = match player.pointer {
            Some(_) => None,
            None => Some(reader.quanta("pointer")?),
        };
    }
    if mask & field::INPUT_SEQ != 0 {
        player.input_seq = reader.leb32("input seq")?;
    }
    Ok(())
}

fn read_new_players(
    reader: &mut Reader,
    players: &mut Vec<PlayerState>,
) -> Result<(), DecodeError> {
    let count = reader.count(SEATS_MAX - players.len(), NEW_BYTES_MIN, "players")?;
    if count == 0 {
        return Err(DecodeError::OutOfRange { field: "players" });
    }
    let mut seat_min = 0;
    for _ in 0..count {
        let player = read_new(reader)?;
        let place = players.binary_search_by_key(&player.seat, |other| other.seat);
        match place {
            Err(place) if player.seat.0 >= seat_min => {
                seat_min = player.seat.0 + 1;
                players.insert(place, player);
            }
            _ => return Err(DecodeError::OutOfRange { field: "seat" }),
        }
    }
    Ok(())
}

fn read_new(reader: &mut Reader) -> Result<PlayerState, DecodeError> {
    Ok(PlayerState {
        seat: read_seat(reader)?,
        appearance: Appearance::read(reader)?,
        connected: reader.flag("connected")?,
        hero: read_body(reader)?,
        selected: read_body(reader)?,
        held: read_body(reader)?,
        score: read_score(reader)?,
        pointer: read_pointer(reader)?,
        input_seq: reader.leb32("input seq")?,
    })
}

fn read_body(reader: &mut Reader) -> Result<Option<BodyId>, DecodeError> {
    let some = reader.flag("player's body")?;
    some.then(|| read_id(reader, "player's body")).transpose()
}

fn read_score(reader: &mut Reader) -> Result<u16, DecodeError> {
    Ok(reader.leb_up_to(u32::from(u16::MAX), "score")? as u16)
}

fn read_pointer(reader: &mut Reader) -> Result<Option<[i32; 2]>, DecodeError> {
    let some = reader.flag("pointer")?;
    some.then(|| reader.quanta("pointer")).transpose()
}
