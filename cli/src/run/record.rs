//! A run's replay, written while the run is played.

use super::bots::appearance;
use crate::output::{Failure, OrFail};
use jostle_game::{Game, Input, Seat};
use jostle_protocol::replay::{Change, Record, Start, header};
use jostle_room::GameLog;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// The room's name in such a replay.
const ROOM: &str = "run";

/// A replay file being written.
pub struct ReplayOutput {
    file: File,
    name: String,
    log: GameLog,
}

impl ReplayOutput {
    /// Begins a replay of a game in which nothing has happened yet. It contains no date, so that the same run produces
    /// the same bytes.
    pub fn create(path: &Path, game: &Game, seed: u64) -> Result<ReplayOutput, Failure> {
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
        let mut log = GameLog::new(start, false, game, Vec::new());
        log.record(0, game, Vec::new());
        let mut replay = ReplayOutput { file, name, log };
        replay.write(&header())?;
        Ok(replay)
    }

    /// Records a tick that has been played.
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
        self.log.tick(changes, inputs, game, members);
        let records = self.log.take_records();
        self.append(&records)
    }

    /// Completes the replay with the game's final state.
    pub fn finish(mut self, game: &Game) -> Result<(), Failure> {
        let records = self.log.recording_end(game);
        self.append(&records)
    }

    fn append(&mut self, records: &[Record]) -> Result<(), Failure> {
        records.iter().try_for_each(|record| self.write(&record.seal()))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.file.write_all(bytes).or_check(&self.name)
    }
}
