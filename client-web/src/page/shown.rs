//! Everything that the page shows, as it follows from the state of the app.

use crate::page::app::{Activity, App};
use crate::page::dialogs::Card;
use crate::page::game::GameScreen;
use crate::page::game::status::State;
use crate::page::layers::Layer;
use crate::page::replay_screen::OpenReplay;
use crate::page::strings;
use crate::view::frame::Frame;
use crate::world::replica::Replica;

/// A lost drawing context that is away for longer than this is spoken of, milliseconds.
const CONTEXT_WAIT_MS: f64 = 5000.0;

impl App {
    /// Time of the last event, milliseconds since the page was opened.
    pub fn now_ms(&self) -> f64 {
        self.ctx.now_ms
    }

    /// The page has no server.
    pub fn is_static(&self) -> bool {
        self.ctx.is_static
    }

    /// Whether the own hero is shown ahead of the server.
    pub fn predicts(&self) -> bool {
        self.ctx.predicts
    }

    pub fn game(&self) -> Option<&GameScreen> {
        match &self.activity {
            Activity::Game(game) => Some(game),
            _ => None,
        }
    }

    pub fn replay(&self) -> Option<&OpenReplay> {
        match &self.activity {
            Activity::Replay(replay) => Some(replay),
            _ => None,
        }
    }

    /// The copy of the room on display.
    pub fn replica(&self) -> Option<&Replica> {
        match &self.activity {
            Activity::Game(game) => game.replica(),
            Activity::Replay(replay) => Some(replay.player.replica()),
            Activity::Edit(screen) => screen.picture(),
            _ => None,
        }
    }

    /// The copy of the room in the picture: that of a highlight, while one is shown.
    pub fn pictured_replica(&self) -> Option<&Replica> {
        match self.game() {
            Some(game) => game.pictured_replica(),
            None => self.replica(),
        }
    }

    /// The frame to draw now, or `None` if the one on the canvas is still right.
    pub fn frame(&self) -> Option<Frame<'_>> {
        match &self.activity {
            Activity::Game(game) => {
                game.frame((self.ctx.now_ms / 1000.0) as f32, self.settings.calm)
            }
            Activity::Replay(replay) => replay.frame(self.settings.calm),
            Activity::Edit(screen) => Some(screen.frame((self.ctx.now_ms / 1000.0) as f32)),
            _ => None,
        }
    }

    /// The value of `data-state`. A frozen picture counts once it is drawn.
    pub fn state(&self) -> &'static str {
        match &self.activity {
            Activity::Game(_) | Activity::Replay(_) | Activity::Edit(_)
                if self.picture.graphics.failed =>
            {
                "unsupported"
            }
            Activity::Edit(_) => "editing",
            Activity::Replay(_) => "replay",
            Activity::Fetching { .. } | Activity::FetchingScene(_) => "connecting",
            _ if self.opening.is_some() => "connecting",
            Activity::NoReplay => "refused",
            Activity::Game(game) if game.is_frozen() && self.picture.drawn_frames == 0 => {
                "connecting"
            }
            Activity::Game(game) => game.status.state.name(),
            Activity::Lobby if self.visit.dialogs.card.is_some() => "refused",
            Activity::Lobby => "lobby",
        }
    }

    /// The notice in the middle of the page.
    pub fn notice(&self) -> Option<Card> {
        let lost = self.picture.graphics.lost_ms;
        let lost = lost.is_some_and(|since| self.ctx.now_ms - since >= CONTEXT_WAIT_MS);
        if let Some(opening) = &self.opening {
            return Some(strings::reading(opening.reader.progress()));
        }
        match &self.activity {
            Activity::Fetching { .. } => Some(strings::FETCHING),
            Activity::FetchingScene(_) => Some(strings::connecting(0)),
            Activity::Game(_) | Activity::Replay(_) | Activity::Edit(_)
                if self.picture.graphics.failed =>
            {
                Some(strings::NO_WEBGL2)
            }
            Activity::Edit(_) if lost => Some(strings::GRAPHICS_LOST),
            Activity::Edit(_) => {
                let card = self.visit.dialogs.card.clone();
                card.or_else(|| self.other_draft().map(|_| strings::OTHER_DRAFT))
            }
            Activity::Game(game) => {
                let card = game_notice(game, lost).or_else(|| self.visit.dialogs.card.clone());
                let stalled_ms = game.status.stalled_ms;
                card.or_else(|| Some(strings::stalled(stalled_ms?, self.edited.is_some())))
            }
            Activity::Replay(_) if lost => Some(strings::GRAPHICS_LOST),
            Activity::Replay(replay) => {
                let card = self.visit.dialogs.card.clone();
                card.or_else(|| Some(strings::stalled(replay.stalled_ms?, false)))
            }
            _ => self.visit.dialogs.card.clone(),
        }
    }

    /// The layer that takes keys and clicks.
    pub fn top(&self) -> Layer {
        self.visit.dialogs.layers(self.notice().as_ref()).top()
    }
}

fn game_notice(game: &GameScreen, context_lost: bool) -> Option<Card> {
    match (game.status.state, &game.status.notice) {
        (State::Refused, Some(notice)) => Some(notice.clone()),
        _ if context_lost => Some(strings::GRAPHICS_LOST),
        (State::Connecting, _) => Some(strings::connecting(game.attempts())),
        (State::Reconnecting, _) => Some(game.loss()),
        _ => None,
    }
}
