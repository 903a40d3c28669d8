//! Records: the own run that is sent to the server, its answers, and the ghost of a run.

use crate::net::api::{self, Request};
use crate::net::report::Fetched;
use crate::page::app::App;
use crate::page::event::Effect;
use crate::page::screen::Screen;
use crate::page::strings;
use jostle_game::RoundPhase;
use jostle_protocol::web::Posted;

impl App {
    /// Name of the scene of this site that is played alone now.
    pub fn ranked_scene(&self) -> Option<&str> {
        let is_played =
            self.screen.game().is_some_and(|game| game.is_alone()) && self.edited.is_none();
        self.ctx.site.alone().0.filter(|_| is_played && !self.ctx.site.is_static)
    }

    /// Takes an answer about records; `false` if it is about something else.
    pub(super) fn take_record(&mut self, request: &Request, answer: Option<&str>) -> bool {
        match request {
            Request::Records => {
                if let Some(list) = answer.and_then(api::parse) {
                    self.records.list = list;
                }
            }
            Request::Run(_) => {
                let answer = answer.and_then(api::parse::<Posted>);
                self.records.said = strings::run_said(answer.as_ref());
                self.ctx.request(Effect::Request(Request::Records));
            }
            _ => return false,
        }
        true
    }

    /// Sends the run of a round that the player has just won alone, if the server keeps runs of the scene.
    pub(super) fn send_run(&mut self) {
        let is_kept = |scene| self.records.table(scene).is_some();
        if !self.ranked_scene().is_some_and(is_kept) {
            return;
        }
        let (Some(game), Some(replica)) = (self.screen.game(), self.screen.replica()) else {
            return;
        };
        let round = replica.room.round().filter(|round| round.phase == RoundPhase::Over);
        let Some(round) = round.filter(|r| self.records.result_since != Some(r.since)) else {
            return;
        };
        let (since, won) = (round.since, round.winners.contains(&round.side_of(replica.room.seat)));
        let run = game.connection.room_in_page().filter(|_| won).map(|room| room.run());
        self.records.result_since = Some(since);
        self.records.said = match run {
            None => String::new(),
            Some(None) => strings::RUN_TOO_LONG.to_owned(),
            Some(Some(bytes)) => {
                self.ctx.request(Effect::Request(Request::Run(bytes)));
                strings::RUN_CHECKED.to_owned()
            }
        };
    }

    /// Takes the replay of a ghost.
    pub(super) fn take_ghost(&mut self, file: &str, fetched: Fetched) {
        let Screen::Game(game) = &mut self.screen else { return };
        if !game.awaits_ghost(file) {
            return;
        }
        let bytes = match fetched {
            Fetched::Bytes(bytes) => bytes,
            Fetched::Refused(_) | Fetched::Nothing => Vec::new(),
        };
        if !game.take_ghost(bytes) {
            self.visit.dialogs.card = Some(strings::NO_GHOST);
        }
    }
}
