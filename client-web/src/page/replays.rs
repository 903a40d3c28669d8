//! Replays: fetched from the server or read from a file, opened, refused, and controlled.

use crate::net::report::Fetched;
use crate::page::app::App;
use crate::page::event::Effect;
use crate::page::replay_screen::{OpenReplay, Opening, bytes_of};
use crate::page::screen::Screen;
use crate::page::strings;
use crate::replay::error::ReplayLoadError;
use crate::replay::player::ReplayPlayer;
use jostle_protocol::replay::{ReplayError, ReplayReader};

/// In the address while a file of this machine is watched.
const FILE_HASH: &str = "#file";

impl App {
    pub(super) fn take_fetched(&mut self, from: &str, fetched: Fetched) {
        let Screen::Fetching { name, file } = &self.screen else {
            return self.take_ghost(from, fetched);
        };
        if file != from {
            return;
        }
        match bytes_of(from, fetched) {
            Ok(bytes) => {
                let name = Some(name.clone());
                self.begin_replay(name, String::new(), bytes);
            }
            Err(card) => {
                self.screen = Screen::NoReplay;
                self.visit.dialogs.card = Some(card);
            }
        }
    }

    /// Watches a file of this machine. A game that is on is not left for it.
    pub(super) fn take_file(&mut self, file: String, contents: Result<Vec<u8>, ReplayError>) {
        if !self.takes_files() {
            return;
        }
        match contents {
            Ok(bytes) => self.begin_replay(None, file, bytes),
            Err(error) => self.refuse_replay(&error.into()),
        }
    }

    /// Begins to read a replay; one that is short is on at once.
    fn begin_replay(&mut self, name: Option<String>, file: String, bytes: Vec<u8>) {
        match ReplayReader::new(bytes) {
            Ok(reader) => self.opening = Some(Opening { reader, name, file }),
            Err(error) => return self.refuse_replay(&error.into()),
        }
        self.read_on();
    }

    /// Reads on in the replay that is being read, if one is, and watches it once it was read.
    pub(super) fn read_on(&mut self) {
        let Some(opening) = &mut self.opening else { return };
        if !opening.read_on(self.ctx.clock) {
            return;
        }
        let Some(Opening { reader, name, file }) = self.opening.take() else { return };
        match ReplayPlayer::new(reader.finish()) {
            Ok(player) => self.watch(player, name, file),
            Err(error) => self.refuse_replay(&error),
        }
    }

    fn watch(&mut self, player: ReplayPlayer, name: Option<String>, file: String) {
        self.end_screen();
        // Going back leads to where the player was.
        if name.is_none() {
            self.ctx.show_hash(FILE_HASH.to_owned());
        }
        let replay = OpenReplay::new(player, name, file, self.ctx.now_ms);
        self.visit.dialogs.card = replay.cut();
        self.screen = Screen::Replay(Box::new(replay));
        self.picture.drawn_frames = 0;
        self.ctx.request(Effect::FocusStage);
    }

    /// Says why a file cannot be watched. What is being watched stays.
    fn refuse_replay(&mut self, error: &ReplayLoadError) {
        let watching = self.screen.replay().is_some() || self.screen.game().is_some();
        if let Screen::Fetching { .. } = self.screen {
            self.screen = Screen::NoReplay;
        }
        self.visit.dialogs.card = Some(strings::bad_replay(error, watching));
    }
}
