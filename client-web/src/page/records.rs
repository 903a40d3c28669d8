//! The server's best runs, as known to the page, and the player's own run, which is submitted to the server.

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
    /// The scene whose best runs are shown.
    pub open: Option<String>,
    /// The best runs of a scene, once the server has sent them.
    top: Option<RecordTable>,
    /// The message about the player's most recent run.
    pub said: String,
    /// The start tick of the most recent result whose run was examined.
    pub result_since: Option<u32>,
}

impl Records {
    /// Forgets the player's own run.
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
            Request::BestRuns(_) => {
                let list = answer.and_then(api::parse::<web::Records>);
                self.top = list.and_then(|list| list.scenes.into_iter().next());
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

    /// Shows or hides the best runs of a scene.
    pub fn toggle(&mut self, ctx: &mut Context, scene: &str) {
        if self.open.take_if(|open| open == scene).is_none() {
            self.open = Some(scene.to_owned());
            self.top = None;
            ctx.request(Effect::Request(Request::BestRuns(scene.to_owned())));
        }
    }

    /// The best runs of a scene, if they are shown.
    pub fn shown(&self, scene: &str) -> Option<&RecordTable> {
        let is_open = self.open.as_deref() == Some(scene);
        self.top.as_ref().filter(|table| is_open && table.scene == scene)
    }

    /// Submits the run if the player has just won a round alone and the server stores runs of the scene.
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

    /// A scene's record table, if the server stores runs of that scene.
    pub fn table(&self, scene: &str) -> Option<&RecordTable> {
        self.list.scenes.iter().find(|table| table.scene == scene)
    }

    /// A scene's best run, with its record table.
    pub fn best(&self, scene: &str) -> Option<(&RecordTable, &RecordCard)> {
        let table = self.table(scene)?;
        Some((table, table.records.first()?))
    }
}
