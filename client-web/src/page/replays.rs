//! Replays: fetched from the server or read from a file, opened, refused, and controlled.

use crate::net::report::Fetched;
use crate::page::app::{Activity, App};
use crate::page::dialogs::Card;
use crate::page::event::{Address, Effect};
use crate::page::replay_screen::OpenReplay;
use crate::page::strings;
use crate::replay::error::ReplayLoadError;
use crate::replay::player::ReplayPlayer;
use jostle_protocol::replay::ReplayError;

/// In the address while a file of this machine is watched.
const FILE_HASH: &str = "#file";

impl App {
    /// Calls `work` with the player of the replay that is on, if one is.
    pub(super) fn with_replay(&mut self, work: impl FnOnce(&mut ReplayPlayer)) {
        if let Activity::Replay(replay) = &mut self.activity {
            work(&mut replay.player);
        }
    }

    pub(super) fn take_fetched(&mut self, name: &str, fetched: Fetched) {
        let Activity::Fetching(awaited) = &self.activity else { return };
        if awaited != name {
            return;
        }
        let (card, detail) = match fetched {
            Fetched::Bytes(bytes) => {
                self.open_replay(Some(name.to_owned()), String::new(), bytes);
                return;
            }
            Fetched::Refused(404) => (strings::NO_SUCH_REPLAY, format!("/replay/{name}")),
            Fetched::Refused(status) => (strings::REPLAY_REFUSED, format!("HTTP status {status}")),
            Fetched::Nothing => (strings::REPLAY_REFUSED, String::new()),
        };
        self.activity = Activity::NoReplay;
        self.dialogs.card = Some(Card { detail, ..card });
    }

    /// Watches a file of this machine. A game that is on is not left for it.
    pub(super) fn take_file(&mut self, file: String, contents: Result<Vec<u8>, ReplayError>) {
        if let Activity::Game(_) = self.activity {
            return;
        }
        match contents {
            Ok(bytes) => {
                let opened = self.open_replay(None, file, bytes);
                // Going back leads to where the player was.
                if opened && self.address.hash != FILE_HASH {
                    self.address = Address { hash: FILE_HASH.to_owned(), ..Address::default() };
                    self.ctx.request(Effect::PushAddress(format!("/{FILE_HASH}")));
                }
            }
            Err(error) => self.refuse_replay(&error.into()),
        }
    }

    /// Watches a replay, or says why that cannot be.
    fn open_replay(&mut self, name: Option<String>, file: String, bytes: Vec<u8>) -> bool {
        let player = match ReplayPlayer::open(bytes) {
            Ok(player) => player,
            Err(error) => {
                self.refuse_replay(&error);
                return false;
            }
        };
        self.end_screen();
        let replay = OpenReplay::new(player, name, file, self.ctx.now_ms);
        self.dialogs.card = replay.cut();
        self.activity = Activity::Replay(Box::new(replay));
        self.drawn_frames = 0;
        self.ctx.request(Effect::FocusStage);
        true
    }

    /// Says why a file cannot be watched. What is being watched stays.
    fn refuse_replay(&mut self, error: &ReplayLoadError) {
        let watching = self.replay().is_some();
        if let Activity::Fetching(_) = self.activity {
            self.activity = Activity::NoReplay;
        }
        self.dialogs.card = Some(strings::bad_replay(error, watching));
    }
}
