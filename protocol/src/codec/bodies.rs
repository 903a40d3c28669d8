//! Bodies in a coded snapshot: who died, who was born. Where the others are is told with all that
//! moves, see `motion`.

use super::section;
use crate::limits::BODIES_MAX;
use crate::seat::{read_seat, write_seat};
use crate::snapshot::SnapshotBody;
use crate::wire::{DecodeError, Gaps, Reader, Writer};
use jostle_sim::world::GROUPS_MAX;
use jostle_sim::{BodyId, Kind, Shape, Vec2};
use std::iter::zip;

const BOX: u8 = 1 << 3;
const OWNED: u8 = 1 << 4;
const TAG_ALL: u8 = (1 << 5) - 1;

/// Gap, generation, tag, group, radius, and two coordinates.
const BIRTH_BYTES_MIN: usize = 10;

/// What happened to the bodies between two snapshots, in memory that is used again for the next two.
#[derive(Clone, Debug, Default)]
pub struct Difference {
    /// Places in the baseline's list.
    deaths: Vec<u32>,
    /// Those in both: place in the baseline's list, and where it is now.
    pub survivors: Vec<(u32, [i32; 2])>,
    births: Vec<SnapshotBody>,
}

impl Difference {
    /// Walks both lists in index order. A body that changed more than its place counts as another
    /// one, so that every pair of snapshots can be coded.
    pub fn find(&mut self, base: &[SnapshotBody], bodies: &[SnapshotBody]) {
        let Difference { deaths, survivors, births } = self;
        deaths.clear();
        survivors.clear();
        births.clear();
        // Mostly all are the same: the walk begins where they are not.
        let same = zip(base, bodies).take_while(|(known, body)| is_same(known, body)).count();
        survivors.extend((0u32..).zip(&bodies[..same]).map(|(place, body)| (place, body.quanta)));
        let mut old = (same as u32..).zip(&base[same..]).peekable();
        for body in &bodies[same..] {
            while let Some((place, _)) = old.next_if(|(_, known)| known.id.index < body.id.index) {
                deaths.push(place);
            }
            match old.next_if(|(_, known)| known.id.index == body.id.index) {
                Some((place, known)) if is_same(known, body) => {
                    survivors.push((place, body.quanta));
                }
                other => {
                    deaths.extend(other.map(|(place, _)| place));
                    births.push(*body);
                }
            }
        }
        deaths.extend(old.map(|(place, _)| place));
    }

    /// Sections that are not empty.
    pub fn sections(&self) -> u8 {
        let bit = |empty: bool, section: u8| if empty { 0 } else { section };
        bit(self.deaths.is_empty(), section::DEATHS) | bit(self.births.is_empty(), section::BIRTHS)
    }

    /// Writes the places of the dead, if there are any.
    pub fn write_deaths(&self, writer: &mut Writer) {
        if !self.deaths.is_empty() {
            writer.count(self.deaths.len());
            let mut gaps = Gaps::default();
            self.deaths.iter().for_each(|&place| gaps.write(writer, place));
        }
    }

    /// Writes the newborn, if there are any.
    pub fn write_births(&self, writer: &mut Writer) {
        if !self.births.is_empty() {
            writer.count(self.births.len());
            let mut gaps = Gaps::default();
            self.births.iter().for_each(|body| write_birth(writer, &mut gaps, body));
        }
    }
}

/// Whether `b` is `a`, maybe at another place.
pub fn is_same(a: &SnapshotBody, b: &SnapshotBody) -> bool {
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
        write_seat(writer, seat);
    }
    match body.shape {
        Shape::Circle { radius } => writer.finite(radius),
        Shape::Box { half } => writer.point(half),
    }
    writer.quanta(body.quanta);
}

/// Places in the baseline's list of those who live on.
pub fn read_survivors(
    reader: &mut Reader,
    sections: u8,
    base: &[SnapshotBody],
) -> Result<Vec<u32>, DecodeError> {
    if sections & section::DEATHS == 0 {
        return Ok((0..base.len() as u32).collect());
    }
    let mut alive = vec![true; base.len()];
    let mut gaps = Gaps::default();
    for _ in 0..read_count(reader, base.len(), 1, "deaths")? {
        alive[gaps.read(reader, base.len(), "death")? as usize] = false;
    }
    Ok((0u32..).zip(alive).filter_map(|(place, alive)| alive.then_some(place)).collect())
}

/// The survivors with who was born.
pub fn read(
    reader: &mut Reader,
    sections: u8,
    survivors: Vec<SnapshotBody>,
) -> Result<Vec<SnapshotBody>, DecodeError> {
    if sections & section::BIRTHS == 0 {
        return Ok(survivors);
    }
    let births = read_births(reader, BODIES_MAX.saturating_sub(survivors.len()))?;
    merge(survivors, births)
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
    let quanta = reader.quanta("position")?;
    Ok(SnapshotBody { id, kind, owner, group, shape, quanta })
}

/// A kind from its place in [`Kind::ALL`].
pub fn read_kind(byte: u8) -> Result<Kind, DecodeError> {
    let kind = Kind::ALL.get(usize::from(byte)).copied();
    kind.ok_or(DecodeError::OutOfRange { field: "body kind" })
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
