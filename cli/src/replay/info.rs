//! `jostle replay info` shows a replay's header, its players, and its bytes by kind.

use super::file::{duration, read};
use crate::output::{Failure, say};
use jostle_protocol::replay::{Change, Replay, ReplayError, Sizes, Start};
use jostle_server::log::calendar;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Describe a replay: scene, seed, time, players, ticks, and bytes by kind
#[derive(clap::Args)]
pub struct Info {
    /// The replay file
    file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// A player's stay, from one tick to another.
#[derive(Serialize)]
struct Stay {
    seat: u16,
    name: String,
    from_tick: u32,
    to_tick: u32,
}

impl Info {
    /// Prints the description.
    pub fn run(self) -> Result<(), Failure> {
        let replay = read(&self.file)?;
        let (file, stays) = (self.file.display().to_string(), stays(&replay));
        let cut = replay.ending().error();
        if self.json {
            say(as_json(&file, &replay, &stays, cut))
        } else {
            say(as_text(&file, &replay, &stays, cut))
        }
    }
}

/// Total number of ticks during which players were present.
fn player_ticks(stays: &[Stay]) -> u64 {
    stays.iter().map(|stay| u64::from(stay.to_tick + 1 - stay.from_tick)).sum()
}

/// `None` for a game without players.
fn bytes_per_player_hour(replay: &Replay, stays: &[Stay]) -> Option<f64> {
    let hours = player_ticks(stays) as f64 / f64::from(3600 * TICKS_PER_SECOND);
    (hours > 0.0).then(|| replay.byte_count() as f64 / hours)
}

fn as_json(file: &str, replay: &Replay, stays: &[Stay], cut: Option<ReplayError>) -> Value {
    let (start, sizes) = (replay.start(), replay.sizes());
    let ticks = replay.last_tick() - replay.first_tick();
    let cut = cut.map(|cut| json!({ "offset": cut.offset, "reason": cut.problem.to_string() }));
    json!({
        "file": file,
        "scene": start.scene_name,
        "seed": start.seed,
        "program": start.program,
        "room": start.room,
        "unix_s": start.unix_s,
        "first_tick": replay.first_tick(),
        "last_tick": replay.last_tick(),
        "ticks": ticks,
        "seconds": f64::from(ticks) / f64::from(TICKS_PER_SECOND),
        "players": stays,
        "player_ticks": player_ticks(stays),
        "bytes": {
            "start": sizes.start,
            "hashes": sizes.hashes,
            "inputs": sizes.inputs,
            "keyframes": sizes.keyframes,
            "end": sizes.end,
            "lost": sizes.lost,
            "total": replay.byte_count(),
        },
        "bytes_per_player_hour": bytes_per_player_hour(replay, stays),
        "keyframes": replay.keyframe_ticks().collect::<Vec<_>>(),
        "whole": cut.is_none(),
        "cut": cut,
    })
}

fn as_text(file: &str, replay: &Replay, stays: &[Stay], cut: Option<ReplayError>) -> String {
    let Start { scene_name, seed, program, room, unix_s, .. } = replay.start();
    let mut text =
        format!("{file}: {scene_name} with seed {seed}, room {room:?}, recorded by {program}");
    if *unix_s > 0 {
        let [year, month, day, hour, minute, second] = calendar(*unix_s);
        text +=
            &format!(" on {year:04}-{month:02}-{day:02} at {hour:02}:{minute:02}:{second:02} UTC");
    }
    let (first, last) = (replay.first_tick(), replay.last_tick());
    text += &format!("\n  ticks {} to {last}, {}", first + 1, duration(u64::from(last - first)));
    text += &match cut {
        None => ", whole".to_owned(),
        Some(cut) => format!(", cut at byte {}: {}", cut.offset, cut.problem),
    };
    let Sizes { start, hashes, inputs, keyframes, end, lost } = replay.sizes();
    text += &format!(
        "\n  {} keyframes\n  {} bytes: start {start}, hashes {hashes}, inputs {inputs}, \
         keyframes {keyframes}, end {end}, lost {lost}",
        replay.keyframe_ticks().count(),
        replay.byte_count()
    );
    if let Some(bytes) = bytes_per_player_hour(replay, stays) {
        text += &format!("\n  {bytes:.0} bytes an hour and player");
    }
    for Stay { seat, name, from_tick, to_tick } in stays {
        text += &format!("\n  seat {seat}, ticks {from_tick} to {to_tick}: {name}");
    }
    text
}

/// All players' stays, in the order in which they joined.
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
