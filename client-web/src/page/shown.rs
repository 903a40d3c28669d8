//! Everything that the page shows, as it follows from the state of the app.

use crate::page::app::App;
use crate::page::dialogs::Card;
use crate::page::dialogs::Layer;
use crate::page::game::GameScreen;
use crate::page::game::connection::State;
use crate::page::screen::Screen;
use crate::page::strings;

/// A lost drawing context that is away for longer than this is spoken of, milliseconds.
const CONTEXT_WAIT_MS: f64 = 5000.0;

impl App {
    /// Time of the last event, milliseconds since the page was opened.
    pub fn now_ms(&self) -> f64 {
        self.ctx.now_ms
    }

    /// The page has no server.
    pub fn is_static(&self) -> bool {
        self.ctx.site.is_static
    }

    /// Whether the own hero is shown ahead of the server.
    pub fn predicts(&self) -> bool {
        self.ctx.predicts
    }

    /// The value of `data-state`. A frozen picture counts once it is drawn.
    pub fn state(&self) -> &'static str {
        match &self.screen {
            Screen::Game(_) | Screen::Replay(_) | Screen::Edit(_)
                if self.picture.graphics.failed =>
            {
                "unsupported"
            }
            Screen::Edit(_) => "editing",
            Screen::Replay(_) => "replay",
            Screen::Fetching { .. } | Screen::FetchingScene(_) => "connecting",
            _ if self.opening.is_some() => "connecting",
            Screen::NoReplay => "refused",
            Screen::Game(game) if game.is_frozen() && self.picture.drawn_frames == 0 => {
                "connecting"
            }
            Screen::Game(game) => game.connection.status.state.name(),
            Screen::Lobby if self.visit.dialogs.card.is_some() => "refused",
            Screen::Lobby => "lobby",
        }
    }

    /// The notice in the middle of the page.
    pub fn notice(&self) -> Option<Card> {
        let lost = self.picture.graphics.lost_ms;
        let lost = lost.is_some_and(|since| self.ctx.now_ms - since >= CONTEXT_WAIT_MS);
        if let Some(opening) = &self.opening {
            return Some(strings::reading(opening.reader.progress()));
        }
        match &self.screen {
            Screen::Fetching { .. } => Some(strings::FETCHING),
            Screen::FetchingScene(_) => Some(strings::connecting(0)),
            Screen::Game(_) | Screen::Replay(_) | Screen::Edit(_)
                if self.picture.graphics.failed =>
            {
                Some(strings::NO_WEBGL2)
            }
            Screen::Edit(_) if lost => Some(strings::GRAPHICS_LOST),
            Screen::Edit(_) => {
                let card = self.visit.dialogs.card.clone();
                card.or_else(|| self.other_draft().map(|_| strings::OTHER_DRAFT))
            }
            Screen::Game(game) => {
                let card = game_notice(game, lost).or_else(|| self.visit.dialogs.card.clone());
                let stalled_ms = game.connection.status.stalled_ms;
                card.or_else(|| Some(strings::stalled(stalled_ms?, self.edited.is_some())))
            }
            Screen::Replay(_) if lost => Some(strings::GRAPHICS_LOST),
            Screen::Replay(replay) => {
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
    match (game.connection.status.state, &game.connection.status.notice) {
        (State::Refused, Some(notice)) => Some(notice.clone()),
        _ if context_lost => Some(strings::GRAPHICS_LOST),
        (State::Connecting, _) => Some(strings::connecting(game.connection.attempts())),
        (State::Reconnecting, _) => Some(game.connection.loss()),
        _ => None,
    }
}
