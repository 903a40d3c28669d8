//! Recorded traffic: the position of every body in every tick, in quanta. It allows sizes to be measured again without
//! the engine that played, which may be a peer.
//!
//! A file is deflated. It contains the first tick and the numbers of bodies and ticks as u32, then x and y for each
//! tick and body, each as a signed LEB128: the position minus its linear extrapolation from the two previous ticks.

use super::measure::{Position, snapshot};
use anyhow::{Context, Result, ensure};
use jostle_protocol::Snapshot;
use std::sync::Arc;

/// Largest unpacked size of a recording in bytes.
const BYTES_MAX: usize = 1 << 26;
const PACK_LEVEL: u8 = 9;

/// A recorded run of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The tick of the first entry in `positions`.
    pub first_tick: u32,
    /// Positions by tick and body; the number of bodies never changes.
    pub positions: Vec<Vec<Position>>,
}

impl Recording {
    /// Returns one snapshot per tick.
    pub fn snapshots(&self) -> impl Iterator<Item = Arc<Snapshot>> {
        let ticks = (self.first_tick..).zip(&self.positions);
        ticks.map(|(tick, positions)| Arc::new(snapshot(tick, positions.iter().copied())))
    }

    /// Returns the bytes of the file.
    pub fn pack(&self) -> Vec<u8> {
        let bodies = self.positions.first().map_or(0, Vec::len);
        let mut bytes = Vec::new();
        for number in [self.first_tick, bodies as u32, self.positions.len() as u32] {
            bytes.extend(number.to_le_bytes());
        }
        let mut histories = vec![[[0; 2]; 2]; bodies];
        for positions in &self.positions {
            for (history, position) in histories.iter_mut().zip(positions) {
                let expected = expected(history);
                push_signed(position[0] - expected[0], &mut bytes);
                push_signed(position[1] - expected[1], &mut bytes);
                *history = [*position, history[0]];
            }
        }
        miniz_oxide::deflate::compress_to_vec(&bytes, PACK_LEVEL)
    }

    pub fn unpack(packed: &[u8]) -> Result<Recording> {
        let unpacked = miniz_oxide::inflate::decompress_to_vec_with_limit(packed, BYTES_MAX);
        let bytes = unpacked.ok().context("the recording is not a deflated one")?;
        let mut rest = bytes.as_slice();
        let mut number = || take_u32(&mut rest);
        let (first_tick, bodies, ticks) = (number()?, number()? as usize, number()? as usize);
        ensure!(bodies.saturating_mul(ticks) <= BYTES_MAX, "{bodies} bodies in {ticks} ticks");
        let mut histories = vec![[[0; 2]; 2]; bodies];
        let mut positions = Vec::new();
        for _ in 0..ticks {
            for history in &mut histories {
                let mut position = expected(history);
                for axis in &mut position {
                    *axis += take_signed(&mut rest)?;
                }
                *history = [position, history[0]];
            }
            positions.push(histories.iter().map(|history| history[0]).collect());
        }
        ensure!(rest.is_empty(), "{} bytes are left over", rest.len());
        Ok(Recording { first_tick, positions })
    }
}

/// Linear extrapolation from the newest two positions.
fn expected(history: &[Position; 2]) -> Position {
    [0, 1].map(|axis| 2 * history[0][axis] - history[1][axis])
}

fn push_signed(value: i32, bytes: &mut Vec<u8>) {
    let mut rest = (value << 1 ^ value >> 31) as u32;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

fn take_signed(bytes: &mut &[u8]) -> Result<i32> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let (byte, rest) = bytes.split_first().context("the recording is cut")?;
        *bytes = rest;
        value |= u32::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok((value >> 1) as i32 ^ -((value & 1) as i32));
        }
    }
    anyhow::bail!("a number of more than five bytes")
}

fn take_u32(bytes: &mut &[u8]) -> Result<u32> {
    let (number, rest) = bytes.split_first_chunk().context("the recording is cut")?;
    *bytes = rest;
    Ok(u32::from_le_bytes(*number))
}

#[cfg(test)]
mod tests {
    use super::Recording;

    fn sample() -> Recording {
        let tick = |t: i32| vec![[7 * t, -3], [1 << 24, -(1 << 24) + t * t]];
        Recording { first_tick: 9, positions: (0..5).map(tick).collect() }
    }

    #[test]
    fn a_recording_survives_packing() {
        assert_eq!(Recording::unpack(&sample().pack()).unwrap(), sample());
        let ticks: Vec<u32> = sample().snapshots().map(|snapshot| snapshot.tick).collect();
        assert_eq!(ticks, [9, 10, 11, 12, 13]);
    }

    #[test]
    fn other_files_are_refused() {
        let again = |bytes: &[u8]| {
            Recording::unpack(&miniz_oxide::deflate::compress_to_vec(bytes, 1)).is_err()
        };
        let bytes = miniz_oxide::inflate::decompress_to_vec(&sample().pack()).unwrap();
        assert!(again(&bytes[..bytes.len() - 1]) && again(&[&bytes[..], &[0]].concat()));
        assert!(again(&[0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255]));
        assert!(Recording::unpack(b"no deflated bytes").is_err());
    }
}
