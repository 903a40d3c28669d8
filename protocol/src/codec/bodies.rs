//! Bodies in a coded snapshot: who died, by how much survivors moved, who was born.

use super::{section, write_quanta};
use crate::limits::BODIES_MAX;
use crate::snapshot::SnapshotBody;
use crate::wire::{DecodeError, Gaps, Reader, Writer};
use jostle_sim::world::GROUPS_MAX;
use jostle_sim::{BodyId, Kind, SEATS_MAX, Seat, Shape, Vec2};

const BOX: u8 = 1 << 3;
const OWNED: u8 = 1 << 4;
const TAG_ALL: u8 = (1 << 5) - 1;

/// Gap, generation, tag, group, radius, and two coordinates.
const BIRTH_BYTES_MIN: usize = 10;
/// Gap and two coordinates.
const MOVE_BYTES_MIN: usize = 3;

/// What happened to the bodies between two snapshots.
pub struct Difference<'a> {
    /// Places in the baseline's list.
    deaths: Vec<u32>,
    /// Place in the list of survivors, where it was, where it is.
    moves: Vec<(u32, [i32; 2], [i32; 2])>,
    births: Vec<&'a SnapshotBody>,
}

impl<'a> Difference<'a> {
    /// Walks both lists in index order. A body that changed more than its place counts as another
    /// one, so that every pair of snapshots can be coded.
    pub fn between(base: &[SnapshotBody], bodies: &'a [SnapshotBody]) -> Difference<'a> {
        let mut found = Difference { deaths: Vec::new(), moves: Vec::new(), births: Vec::new() };
        let mut old = 0;
        let mut survivors = 0;
        for body in bodies {
            while old < base.len() && base[old].id.index < body.id.index {
                found.deaths.push(old as u32);
                old += 1;
            }
            let same_index = base.get(old).filter(|known| known.id.index == body.id.index);
            let survivor = same_index.filter(|known| is_same(known, body));
            if let Some(known) = survivor {
                if known.quanta != body.quanta {
                    found.moves.push((survivors, known.quanta, body.quanta));
                }
                survivors += 1;
            } else {
                found.deaths.extend(same_index.map(|_| old as u32));
                found.births.push(body);
            }
            old += usize::from(same_index.is_some());
        }
        found.deaths.extend(old as u32..base.len() as u32);
        found
    }

    /// Sections that are not empty.
    pub fn sections(&self) -> u8 {
        let bit = |empty: bool, section: u8| if empty { 0 } else { section };
        bit(self.deaths.is_empty(), section::DEATHS)
            | bit(self.moves.is_empty(), section::MOVES)
            | bit(self.births.is_empty(), section::BIRTHS)
    }

    /// Writes the sections that are not empty.
    pub fn write(&self, writer: &mut Writer) {
        if !self.deaths.is_empty() {
            writer.count(self.deaths.len());
            let mut gaps = Gaps::default();
            self.deaths.iter().for_each(|&place| gaps.write(writer, place));
        }
        if !self.moves.is_empty() {
            writer.count(self.moves.len());
            let mut gaps = Gaps::default();
            for &(place, from, to) in &self.moves {
                gaps.write(writer, place);
                write_quanta(writer, from, to);
            }
        }
        if !self.births.is_empty() {
            writer.count(self.births.len());
            let mut gaps = Gaps::default();
            self.births.iter().for_each(|body| write_birth(writer, &mut gaps, body));
        }
    }
}

/// Whether `b` is `a`, maybe at another place.
fn is_same(a: &SnapshotBody, b: &SnapshotBody) -> bool {
    a.id == b.id
        && a.kind == b.kind
        && a.owner == b.owner
        && a.group == b.group
        && a.shape == b.shape
}

fn write_birth(writer: &mut Writer, gaps: &mut Gaps, body: &SnapshotBody) {
    gaps.write(writer, body.id.index);
    writer.leb32(body.id.generation);
    let outline = if matches!(body.shape, Shape::Box { .. }) { BOX } else { 0 };
    let owned = if body.owner.is_some() { OWNED } else { 0 };
    writer.byte(body.kind as u8 | outline | owned);
    writer.byte(body.group);
    if let Some(seat) = body.owner {
        writer.byte(seat.0);
    }
    match body.shape {
        Shape::Circle { radius } => writer.finite(radius),
        Shape::Box { half } => writer.point(half),
    }
    write_quanta(writer, [0, 0], body.quanta);
}

/// Reads the sections of bodies and applies them to the baseline's.
pub fn read(
    reader: &mut Reader,
    sections: u8,
    base: &[SnapshotBody],
) -> Result<Vec<SnapshotBody>, DecodeError> {
    let mut survivors =
        if sections & section::DEATHS == 0 { base.to_vec() } else { read_survivors(reader, base)? };
    if sections & section::MOVES != 0 {
        read_moves(reader, &mut survivors)?;
    }
    if sections & section::BIRTHS == 0 {
        return Ok(survivors);
    }
    let births = read_births(reader, BODIES_MAX.saturating_sub(survivors.len()))?;
    merge(survivors, births)
}

fn read_survivors(
    reader: &mut Reader,
    base: &[SnapshotBody],
) -> Result<Vec<SnapshotBody>, DecodeError> {
    let deaths = read_count(reader, base.len(), 1, "deaths")?;
    let mut survivors = Vec::with_capacity(base.len());
    let mut gaps = Gaps::default();
    let mut alive_from = 0;
    for _ in 0..deaths {
        let dead = gaps.read(reader, base.len(), "death")? as usize;
        survivors.extend_from_slice(&base[alive_from..dead]);
        alive_from = dead + 1;
    }
    survivors.extend_from_slice(&base[alive_from..]);
    Ok(survivors)
}

fn read_moves(reader: &mut Reader, survivors: &mut [SnapshotBody]) -> Result<(), DecodeError> {
    let moves = read_count(reader, survivors.len(), MOVE_BYTES_MIN, "moves")?;
    let mut gaps = Gaps::default();
    for _ in 0..moves {
        let body = &mut survivors[gaps.read(reader, survivors.len(), "move")? as usize];
        let quanta = reader.quanta(body.quanta, "move")?;
        if quanta == body.quanta {
            return Err(DecodeError::OutOfRange { field: "move" });
        }
        body.quanta = quanta;
    }
    Ok(())
}

fn read_births(reader: &mut Reader, births_max: usize) -> Result<Vec<SnapshotBody>, DecodeError> {
    let count = read_count(reader, births_max, BIRTH_BYTES_MIN, "births")?;
    let mut births = Vec::with_capacity(count);
    let mut gaps = Gaps::default();
    for _ in 0..count {
        births.push(read_birth(reader, &mut gaps)?);
    }
    Ok(births)
}

fn read_birth(reader: &mut Reader, gaps: &mut Gaps) -> Result<SnapshotBody, DecodeError> {
    let index = gaps.read(reader, BODIES_MAX, "birth")?;
    let id = BodyId { index, generation: reader.leb32("generation")? };
    let tag = reader.byte("body tag")?;
    if tag & !TAG_ALL != 0 {
        return Err(DecodeError::OutOfRange { field: "body tag" });
    }
    let kind = read_kind(tag & (BOX - 1))?;
    let group = reader.byte("group")?;
    if usize::from(group) >= GROUPS_MAX {
        return Err(DecodeError::OutOfRange { field: "group" });
    }
    let owner = (tag & OWNED != 0).then(|| read_seat(reader)).transpose()?;
    let shape = if tag & BOX == 0 {
        Shape::Circle { radius: read_extent(reader)? }
    } else {
        Shape::Box { half: Vec2::new(read_extent(reader)?, read_extent(reader)?) }
    };
    let quanta = reader.quanta([0, 0], "position")?;
    Ok(SnapshotBody { id, kind, owner, group, shape, quanta })
}

/// A kind from its place in [`Kind::ALL`].
pub fn read_kind(byte: u8) -> Result<Kind, DecodeError> {
    let kind = Kind::ALL.get(usize::from(byte)).copied();
    kind.ok_or(DecodeError::OutOfRange { field: "body kind" })
}

/// A seat, one byte.
pub fn read_seat(reader: &mut Reader) -> Result<Seat, DecodeError> {
    let seat = reader.byte("seat")?;
    if usize::from(seat) < SEATS_MAX {
        Ok(Seat(seat))
    } else {
        Err(DecodeError::OutOfRange { field: "seat" })
    }
}

fn read_extent(reader: &mut Reader) -> Result<f32, DecodeError> {
    let extent = reader.finite("body size")?;
    if extent > 0.0 { Ok(extent) } else { Err(DecodeError::OutOfRange { field: "body size" }) }
}

/// A count of a section: an empty section would not have been written.
fn read_count(
    reader: &mut Reader,
    count_max: usize,
    bytes_each: usize,
    field: &'static str,
) -> Result<usize, DecodeError> {
    match reader.count(count_max, bytes_each, field)? {
        0 => Err(DecodeError::OutOfRange { field }),
        count => Ok(count),
    }
}

/// Both lists as one in index order; an index in both is refused.
fn merge(
    survivors: Vec<SnapshotBody>,
    births: Vec<SnapshotBody>,
) -> Result<Vec<SnapshotBody>, DecodeError> {
    let mut merged = Vec::with_capacity(survivors.len() + births.len());
    let mut rest = survivors.as_slice();
    for born in births {
        let lower = rest.partition_point(|body| body.id.index < born.id.index);
        merged.extend_from_slice(&rest[..lower]);
        rest = &rest[lower..];
        if rest.first().is_some_and(|body| body.id.index == born.id.index) {
            return Err(DecodeError::OutOfRange { field: "birth" });
        }
        merged.push(born);
    }
    merged.extend_from_slice(rest);
    Ok(merged)
}
