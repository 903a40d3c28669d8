//! Deaths and births of bodies in a coded snapshot. `motion` codes the survivors' positions.

use super::sections::{self, bit};
use crate::error::{DecodeError, check};
use crate::ids::{kind_of, read_seat, write_seat};
use crate::limits::BODIES_MAX;
use crate::position_history::Position;
use crate::snapshot::SnapshotBody;
use crate::wire::{Gaps, Reader, Writer};
use jostle_sim::GROUPS_MAX;
use jostle_sim::{BodyId, Shape, Vec2};
use std::iter::zip;

const BOX: u8 = 1 << 3;
const OWNED: u8 = 1 << 4;
const TAG_ALL: u8 = (1 << 5) - 1;

/// Length of the shortest birth, bytes: gap, generation, tag, group, radius and two coordinates.
const BIRTH_BYTES_MIN: usize = 10;

/// The difference between the bodies in two snapshots. Its memory is reused from one message to the next.
#[derive(Clone, Debug, Default)]
pub struct BodyDifference {
    /// Indices into the baseline's list.
    deaths: Vec<u32>,
    /// Bodies in both snapshots, each as its index into the baseline's list and its current position.
    pub survivors: Vec<(u32, Position)>,
    births: Vec<SnapshotBody>,
}

impl BodyDifference {
    /// Compares two lists, both in id order. A body in which anything but the position has changed counts as a death
    /// and a birth, so that any pair of snapshots can be coded.
    pub fn find(&mut self, base: &[SnapshotBody], bodies: &[SnapshotBody]) {
        let BodyDifference { deaths, survivors, births } = self;
        deaths.clear();
        survivors.clear();
        births.clear();
        // Usually all bodies are the same. The general comparison starts at the first difference.
        let same = zip(base, bodies).take_while(|(known, body)| is_same(known, body)).count();
        survivors.extend((0u32..).zip(&bodies[..same]).map(|(index, body)| (index, body.quanta)));
        let mut old = (same as u32..).zip(&base[same..]).peekable();
        for body in &bodies[same..] {
            while let Some((index, _)) = old.next_if(|(_, known)| known.id.index < body.id.index) {
                deaths.push(index);
            }
            match old.next_if(|(_, known)| known.id.index == body.id.index) {
                Some((index, known)) if is_same(known, body) => {
                    survivors.push((index, body.quanta));
                }
                other => {
                    deaths.extend(other.map(|(index, _)| index));
                    births.push(*body);
                }
            }
        }
        deaths.extend(old.map(|(index, _)| index));
    }

    /// The bits for the non-empty sections.
    pub fn sections(&self) -> u8 {
        bit(!self.deaths.is_empty(), sections::DEATHS)
            | bit(!self.births.is_empty(), sections::BIRTHS)
    }

    /// Writes the bodies that died, if any.
    pub fn write_deaths(&self, writer: &mut Writer) {
        if !self.deaths.is_empty() {
            writer.count(self.deaths.len());
            let mut gaps = Gaps::default();
            self.deaths.iter().for_each(|&index| gaps.write(writer, index));
        }
    }

    /// Writes the new bodies, if any.
    pub fn write_births(&self, writer: &mut Writer) {
        if !self.births.is_empty() {
            writer.count(self.births.len());
            let mut gaps = Gaps::default();
            self.births.iter().for_each(|body| write_birth(writer, &mut gaps, body));
        }
    }
}

/// Returns true if `b` is the same body as `a`, possibly moved.
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
    let is_box = matches!(body.shape, Shape::Box { .. });
    writer.byte(body.kind as u8 | bit(is_box, BOX) | bit(body.owner.is_some(), OWNED));
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

/// Reads the survivors, as indices into the baseline's list.
pub fn read_survivors(
    reader: &mut Reader,
    present: u8,
    base: &[SnapshotBody],
) -> Result<Vec<u32>, DecodeError> {
    if present & sections::DEATHS == 0 {
        return Ok((0..base.len() as u32).collect());
    }
    let mut alive = vec![true; base.len()];
    let mut gaps = Gaps::default();
    for _ in 0..reader.some_count(base.len(), 1, "deaths")? {
        alive[gaps.read(reader, base.len(), "death")? as usize] = false;
    }
    Ok((0u32..).zip(alive).filter_map(|(index, alive)| alive.then_some(index)).collect())
}

/// Reads the new bodies and adds them to the survivors.
pub fn read(
    reader: &mut Reader,
    present: u8,
    survivors: Vec<SnapshotBody>,
) -> Result<Vec<SnapshotBody>, DecodeError> {
    if present & sections::BIRTHS == 0 {
        return Ok(survivors);
    }
    let births = read_births(reader, BODIES_MAX.saturating_sub(survivors.len()))?;
    merge(survivors, births)
}

fn read_births(reader: &mut Reader, births_max: usize) -> Result<Vec<SnapshotBody>, DecodeError> {
    let count = reader.some_count(births_max, BIRTH_BYTES_MIN, "births")?;
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
    check(tag & !TAG_ALL == 0, "body tag")?;
    let kind = kind_of(tag & (BOX - 1))?;
    let group = reader.byte("group")?;
    check(usize::from(group) < GROUPS_MAX, "group")?;
    let owner = (tag & OWNED != 0).then(|| read_seat(reader)).transpose()?;
    let shape = if tag & BOX == 0 {
        Shape::Circle { radius: read_extent(reader)? }
    } else {
        Shape::Box { half: Vec2::new(read_extent(reader)?, read_extent(reader)?) }
    };
    let quanta = reader.quanta("position")?;
    Ok(SnapshotBody { id, kind, owner, group, shape, quanta })
}

fn read_extent(reader: &mut Reader) -> Result<f32, DecodeError> {
    let extent = reader.finite("body size")?;
    check(extent > 0.0, "body size")?;
    Ok(extent)
}

/// Merges two lists that are in id order. Fails if an index appears in both.
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
        check(rest.first().is_none_or(|body| body.id.index != born.id.index), "birth")?;
        merged.push(born);
    }
    merged.extend_from_slice(rest);
    Ok(merged)
}
