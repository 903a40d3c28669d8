//! The best runs that the server keeps, as the page knows them, and the own run that is sent to it.

use crate::net::api::{self, Request};
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::game::GameScreen;
use crate::page::strings;
use jostle_game::RoundPhase;
use jostle_protocol::web::{self, Posted, RecordCard, RecordTable};

/// The records known to the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    /// The best run of each scene.
    pub list: web::Records,
    /// The message about the player's last run.
    pub said: String,
    /// The start tick of the last result whose run was examined.
    pub result_since: Option<u32>,
}

impl Records {
    /// Forgets the own run.
    pub fn begin(&mut self) {
        *self = Records { list: std::mem::take(&mut self.list), ..Records::default() };
    }

    /// Handles an answer about records; `false` if it is about something else.
    pub fn take(&mut self, ctx: &mut Context, request: &Request, answer: Option<&str>) -> bool {
        match request {
            Request::Records => {
                if let Some(list) = answer.and_then(api::parse) {
                    self.list = list;
                }
            }
            Request::Run(_) => {
                let answer = answer.and_then(api::parse::<Posted>);
                self.said = strings::run_said(answer.as_ref());
                ctx.request(Effect::Request(Request::Records));
            }
            _ => return false,
        }
        true
    }

    /// Submits the run of a round that the player just won alone, if the server stores runs of the scene.
    pub fn send_run(&mut self, ctx: &mut Context, game: &GameScreen) {
        let is_kept = |scene| self.table(scene).is_some();
        if !game.ranked_scene(ctx).is_some_and(is_kept) {
            return;
        }
        let Some(replica) = game.replica() else { return };
        let round = replica.room.round().filter(|round| round.phase == RoundPhase::Over);
        let Some(round) = round.filter(|r| self.result_since != Some(r.since)) else { return };
        let (since, won) = (round.since, round.winners.contains(&round.side_of(replica.room.seat)));
        let room = game.connection.room_in_page().filter(|_| won);
        self.result_since = Some(since);
        self.said = match room.map(|room| room.run()) {
            None => String::new(),
            Some(None) => strings::RUN_TOO_LONG.to_owned(),
            Some(Some(bytes)) => {
                ctx.request(Effect::Request(Request::Run(bytes)));
                strings::RUN_CHECKED.to_owned()
            }
        };
    }

    /// The record table of a scene, if the server stores its runs.
    pub fn table(&self, scene: &str) -> Option<&RecordTable> {
        self.list.scenes.iter().find(|table| table.scene == scene)
    }

    /// The best run of a scene, with its table.
    pub fn best(&self, scene: &str) -> Option<(&RecordTable, &RecordCard)> {
        let table = self.table(scene)?;
        Some((table, table.records.first()?))
    }
}
