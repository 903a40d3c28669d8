//! The replay of a run, written as it is played.

use super::bots::appearance;
use crate::output::{Failure, OrFail};
use jostle_game::{Game, Input, Seat};
use jostle_protocol::replay::{Change, Record, Start, header};
use jostle_room::Recorder;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Name of the room in such a replay.
const ROOM: &str = "run";

/// A file that is being written.
pub struct ReplayFile {
    file: File,
    name: String,
    recorder: Recorder,
}

impl ReplayFile {
    /// Begins a replay of a game in which nothing has happened yet. It says nothing of the time: the
    /// same run gives the same bytes.
    pub fn create(path: &Path, game: &Game, seed: u64) -> Result<ReplayFile, Failure> {
        let name = path.display().to_string();
        let file = File::create(path).or_usage(format_args!("--replay {name}"))?;
        let start = Start {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            unix_s: 0,
            room: ROOM.to_owned(),
            scene_name: game.scene().name.clone(),
            scene: game.scene().source.clone(),
            seed,
            first_tick: 0,
        };
        let recorder = Recorder::new(start, game, Vec::new());
        let mut replay = ReplayFile { file, name, recorder };
        replay.write(&header())?;
        Ok(replay)
    }

    /// Records a tick that was played.
    pub fn tick(
        &mut self,
        changes: Vec<Change>,
        inputs: &[(Seat, Input)],
        game: &Game,
    ) -> Result<(), Failure> {
        let members = || {
            let seats = game.players().map(|player| player.seat);
            seats.map(|seat| (seat, appearance(seat))).collect()
        };
        self.recorder.tick(changes, inputs, game, game.hash(), members);
        let records = self.recorder.take();
        self.append(&records)
    }

    /// Ends the replay with the game.
    pub fn finish(mut self, game: &Game) -> Result<(), Failure> {
        let records = self.recorder.clone().finish(game);
        self.append(&records)
    }

    fn append(&mut self, records: &[Record]) -> Result<(), Failure> {
        records.iter().try_for_each(|record| self.write(&record.seal()))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.file.write_all(bytes).or_check(&self.name)
    }
}
