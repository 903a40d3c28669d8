//! Players and the round in a coded snapshot. Usually, each player's input number has grown by the number of ticks
//! since the baseline, which takes one bit. Other changes name their fields. `motion` codes pointer moves.

use super::round;
use super::sections::{self, bit};
use crate::appearance::Appearance;
use crate::error::{DecodeError, check};
use crate::ids::{read_id, read_leb16, read_seat, write_id, write_seat};
use crate::snapshot::{PlayerState, Snapshot};
use crate::wire::{Reader, Writer};
use jostle_game::{RoundInfo, SEATS_MAX, Seat};
use jostle_sim::BodyId;

/// Parts of the players section, with one bit each.
mod part {
    pub const GONE: u8 = 1 << 0;
    pub const CHANGED: u8 = 1 << 1;
    pub const NEW: u8 = 1 << 2;
    pub const ROUND: u8 = 1 << 3;
    pub const ALL: u8 = (1 << 4) - 1;
}

/// Fields of a player that may have changed, with one bit each.
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

/// Length of the shortest new player, bytes: seat, a one-byte name and its length, colour, connected, and six empty or
/// small fields.
const NEW_BYTES_MIN: usize = 11;

/// The difference between the players in two snapshots. Its memory is reused from one message to the next.
#[derive(Clone, Debug, Default)]
pub struct PlayerDifference {
    /// Whether each player in the baseline is gone; empty if all remain.
    gone: Vec<bool>,
    stayed: Vec<Stayed>,
    /// Indices into the snapshot's list.
    new: Vec<u32>,
    /// Whether the round differs from the baseline's.
    round: bool,
}

/// A player in both snapshots.
#[derive(Clone, Copy, Debug)]
struct Stayed {
    /// Index into the snapshot's list.
    index: u32,
    mask: u8,
    /// Whether the input number grew by the number of ticks between the snapshots.
    advanced: bool,
}

impl PlayerDifference {
    /// Compares the players of two snapshots by seat.
    pub fn find(&mut self, base: &Snapshot, snapshot: &Snapshot) {
        let (old, players) = (&base.players, &snapshot.players);
        assert!(players.is_sorted_by(|a, b| a.seat < b.seat), "players must be in seat order");
        let distance = snapshot.tick - base.tick;
        self.round = base.round != snapshot.round;
        let index_in = |list: &[PlayerState], player: &PlayerState| {
            list.binary_search_by_key(&player.seat, |other| other.seat).ok()
        };
        let stayed = |old: &PlayerState| {
            let index = index_in(players, old)?;
            let mask = changed_fields(old, &players[index], distance);
            let advanced = has_advanced(old, &players[index], distance);
            Some(Stayed { index: index as u32, mask, advanced })
        };
        self.stayed.clear();
        self.stayed.extend(old.iter().filter_map(stayed));
        self.gone.clear();
        if self.stayed.len() < old.len() {
            self.gone.extend(old.iter().map(|old| index_in(players, old).is_none()));
        }
        let numbered = (0u32..).zip(players);
        let new = numbered.filter(|(_, player)| index_in(old, player).is_none());
        self.new.clear();
        self.new.extend(new.map(|(index, _)| index));
    }

    /// The bits for the non-empty sections.
    pub fn sections(&self) -> u8 {
        bit(self.parts() != 0, sections::PLAYERS) | bit(self.any_advanced(), sections::INPUTS)
    }

    fn parts(&self) -> u8 {
        bit(!self.gone.is_empty(), part::GONE)
            | bit(self.stayed.iter().any(|stayed| stayed.mask != 0), part::CHANGED)
            | bit(!self.new.is_empty(), part::NEW)
            | bit(self.round, part::ROUND)
    }

    fn any_advanced(&self) -> bool {
        self.stayed.iter().any(|stayed| stayed.advanced)
    }

    /// Writes the non-empty sections.
    pub fn write(&self, writer: &mut Writer, snapshot: &Snapshot) {
        let players = &snapshot.players;
        let parts = self.parts();
        if parts != 0 {
            writer.byte(parts);
        }
        if parts & part::GONE != 0 {
            writer.bits(self.gone.iter().copied());
        }
        if parts & part::CHANGED != 0 {
            writer.bits(self.stayed.iter().map(|stayed| stayed.mask != 0));
            for &Stayed { index, mask, .. } in &self.stayed {
                write_change(writer, &players[index as usize], mask);
            }
        }
        if parts & part::NEW != 0 {
            writer.count(self.new.len());
            self.new.iter().for_each(|&index| write_new(writer, &players[index as usize]));
        }
        if self.round {
            round::write(writer, snapshot.round.as_ref());
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

/// Writes the fields in `mask`, or nothing if it is empty. The `CONNECTED` and `POINTER` bits mean that the field was
/// toggled; a new pointer is followed by its position.
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
        writer.option(body, write_id);
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
        writer.option(body, write_id);
    }
    writer.leb32(u32::from(player.score));
    writer.option(player.pointer, Writer::quanta);
    writer.leb32(player.input_seq);
}

/// Reads the player sections, applies them to the baseline's `players`, and returns the round if it changed.
pub fn read(
    reader: &mut Reader,
    present: u8,
    players: &mut Vec<PlayerState>,
    distance: u32,
) -> Result<Option<Option<RoundInfo>>, DecodeError> {
    let parts = if present & sections::PLAYERS == 0 { 0 } else { read_parts(reader)? };
    if parts & part::GONE != 0 {
        let gone = read_some_bits(reader, players.len(), "players gone")?;
        let mut gone = gone.into_iter();
        players.retain(|_| gone.next() == Some(false));
    }
    let stayed: Vec<Seat> = players.iter().map(|player| player.seat).collect();
    if parts & part::CHANGED != 0 {
        let changed = read_some_bits(reader, players.len(), "players changed")?;
        for (player, _) in players.iter_mut().zip(changed).filter(|(_, changed)| *changed) {
            read_change(reader, player)?;
        }
    }
    if parts & part::NEW != 0 {
        read_new_players(reader, players)?;
    }
    let is_new_round = parts & part::ROUND != 0;
    let round = is_new_round.then(|| round::read(reader)).transpose()?;
    if present & sections::INPUTS != 0 {
        let advanced = read_some_bits(reader, stayed.len(), "inputs advanced")?;
        for player in players {
            if stayed.binary_search(&player.seat).is_ok_and(|index| advanced[index]) {
                player.input_seq = player.input_seq.wrapping_add(distance);
            }
        }
    }
    Ok(round)
}

fn read_parts(reader: &mut Reader) -> Result<u8, DecodeError> {
    let parts = reader.byte("players")?;
    check(parts != 0 && parts & !part::ALL == 0, "players")?;
    Ok(parts)
}

/// Reads bits of which at least one must be set, since otherwise the section would have been omitted.
fn read_some_bits(
    reader: &mut Reader,
    count: usize,
    field: &'static str,
) -> Result<Vec<bool>, DecodeError> {
    let bits = reader.bits(count, field)?;
    check(bits.contains(&true), field)?;
    Ok(bits)
}

fn read_change(reader: &mut Reader, player: &mut PlayerState) -> Result<(), DecodeError> {
    let mask = reader.byte("player fields")?;
    check(mask != 0, "player fields")?;
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
        player.score = read_leb16(reader, "score")?;
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
    let count = reader.some_count(SEATS_MAX - players.len(), NEW_BYTES_MIN, "players")?;
    let mut seat_min = 0;
    for _ in 0..count {
        let player = read_new(reader)?;
        match players.binary_search_by_key(&player.seat, |other| other.seat) {
            Err(index) if player.seat.0 >= seat_min => {
                seat_min = player.seat.0 + 1;
                players.insert(index, player);
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
        score: read_leb16(reader, "score")?,
        pointer: reader.option("pointer", |reader| reader.quanta("pointer"))?,
        input_seq: reader.leb32("input seq")?,
    })
}

fn read_body(reader: &mut Reader) -> Result<Option<BodyId>, DecodeError> {
    reader.option("player's body", |reader| read_id(reader, "player's body"))
}
