//! `jostle replay info`: what a replay says about itself, and what its bytes are spent on.

use super::file::{duration, read};
use crate::output::{Failure, json, say};
use jostle_protocol::replay::{Change, Ending, Replay};
use jostle_server::replays::calendar;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

/// Print what a replay holds: scene, seed, time, players, ticks, and bytes by kind
#[derive(clap::Args)]
pub struct Info {
    /// The replay
    file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    file: String,
    scene: String,
    seed: u64,
    /// Version that recorded it.
    program: String,
    room: String,
    /// When it began, seconds since 1970; 0 if unknown.
    unix_s: u64,
    /// Ticks played before.
    first_tick: u32,
    last_tick: u32,
    ticks: u32,
    seconds: f64,
    players: Vec<Stay>,
    /// Sum of the ticks for which players were there.
    player_ticks: u64,
    bytes: Bytes,
    /// `null` where nobody played.
    bytes_per_player_hour: Option<f64>,
    /// Ticks after which there are keyframes.
    keyframes: Vec<u32>,
    whole: bool,
    cut: Option<Cut>,
}

/// A player, from one tick to another.
#[derive(Serialize)]
struct Stay {
    seat: u16,
    name: String,
    from_tick: u32,
    to_tick: u32,
}

#[derive(Serialize)]
struct Bytes {
    start: usize,
    hashes: usize,
    inputs: usize,
    keyframes: usize,
    end: usize,
    lost: usize,
    total: usize,
}

/// Where and why a file ends too early.
#[derive(Serialize)]
struct Cut {
    offset: usize,
    reason: String,
}

impl Info {
    /// Prints it.
    pub fn run(self) -> Result<(), Failure> {
        let report = Report::of(self.file.display().to_string(), &read(&self.file)?);
        if self.json { say(json(&report)) } else { say(report) }
    }
}

impl Report {
    fn of(file: String, replay: &Replay) -> Report {
        let start = replay.start().clone();
        let players = stays(replay);
        let ticks_of = |stay: &Stay| u64::from(stay.to_tick + 1 - stay.from_tick);
        let player_ticks: u64 = players.iter().map(ticks_of).sum();
        let (first_tick, last_tick) = (replay.first_tick(), replay.last_tick());
        let player_hours = player_ticks as f64 / f64::from(3600 * TICKS_PER_SECOND);
        let cut = match replay.ending() {
            Ending::Whole => None,
            Ending::Cut(error) => {
                Some(Cut { offset: error.offset, reason: error.problem.to_string() })
            }
        };
        Report {
            file,
            scene: start.scene_name,
            seed: start.seed,
            program: start.program,
            room: start.room,
            unix_s: start.unix_s,
            first_tick,
            last_tick,
            ticks: last_tick - first_tick,
            seconds: f64::from(last_tick - first_tick) / f64::from(TICKS_PER_SECOND),
            players,
            player_ticks,
            bytes: Bytes::of(replay),
            bytes_per_player_hour: (player_ticks > 0)
                .then(|| replay.byte_count() as f64 / player_hours),
            keyframes: replay.keyframe_ticks().collect(),
            whole: cut.is_none(),
            cut,
        }
    }
}

impl Bytes {
    fn of(replay: &Replay) -> Bytes {
        let sizes = replay.sizes();
        Bytes {
            start: sizes.start,
            hashes: sizes.hashes,
            inputs: sizes.inputs,
            keyframes: sizes.keyframes,
            end: sizes.end,
            lost: sizes.lost,
            total: replay.byte_count(),
        }
    }
}

/// Who was there when, in the order of coming.
fn stays(replay: &Replay) -> Vec<Stay> {
    let (first, last) = (replay.first_tick() + 1, replay.last_tick());
    let mut stays: Vec<Stay> = Vec::new();
    let mut here = BTreeMap::new();
    let come = |stays: &mut Vec<Stay>, seat: u16, name: &str, from_tick| {
        stays.push(Stay { seat, name: name.to_owned(), from_tick, to_tick: last });
        stays.len() - 1
    };
    let at_start = replay.keyframe_before(replay.first_tick()).map(|keyframe| keyframe.members);
    for (seat, appearance) in at_start.unwrap_or_default() {
        here.insert(seat.0, come(&mut stays, seat.0, &appearance.name, first));
    }
    let mut next = first;
    while let Some(block) = replay.block_with(next) {
        for (tick, number) in block.ticks.iter().zip(block.first..) {
            for change in &tick.changes {
                match change {
                    Change::Join(seat, appearance) => {
                        let stay = come(&mut stays, seat.0, &appearance.name, number);
                        here.insert(seat.0, stay);
                    }
                    Change::Leave(seat) => {
                        if let Some(stay) = here.remove(&seat.0) {
                            stays[stay].to_tick = number - 1;
                        }
                    }
                    Change::Look(seat, appearance) => {
                        if let Some(&stay) = here.get(&seat.0) {
                            stays[stay].name = appearance.name.to_string();
                        }
                    }
                }
            }
        }
        next = block.last() + 1;
    }
    stays
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Report { file, scene, seed, program, room, .. } = self;
        write!(out, "{file}: {scene} with seed {seed}, room {room:?}, recorded by {program}")?;
        if self.unix_s > 0 {
            let [year, month, day, hour, minute, second] = calendar(self.unix_s);
            write!(
                out,
                " on {year:04}-{month:02}-{day:02} at {hour:02}:{minute:02}:{second:02} UTC"
            )?;
        }
        let length = duration(u64::from(self.ticks));
        write!(out, "\n  ticks {} to {}, {length}", self.first_tick + 1, self.last_tick)?;
        match &self.cut {
            None => write!(out, ", whole")?,
            Some(Cut { offset, reason }) => write!(out, ", cut at byte {offset}: {reason}")?,
        }
        write!(out, "\n  {} keyframes", self.keyframes.len())?;
        let Bytes { start, hashes, inputs, keyframes, end, lost, total } = &self.bytes;
        write!(
            out,
            "\n  {total} bytes: start {start}, hashes {hashes}, inputs {inputs}, \
             keyframes {keyframes}, end {end}, lost {lost}"
        )?;
        if let Some(bytes) = self.bytes_per_player_hour {
            write!(out, "\n  {bytes:.0} bytes an hour and player")?;
        }
        for Stay { seat, name, from_tick, to_tick } in &self.players {
            write!(out, "\n  seat {seat}, ticks {from_tick} to {to_tick}: {name}")?;
        }
        Ok(())
    }
}
