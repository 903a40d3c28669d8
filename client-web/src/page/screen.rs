//! The screens of the page, each of which handles its own events, buttons and keys.

use crate::input::bindings::Bindings;
use crate::page::address::PendingGame;
use crate::page::context::Context;
use crate::page::dialogs::{Card, Layer};
use crate::page::drafts::{self, Draft};
use crate::page::edit_screen::EditScreen;
use crate::page::event::{Event, Key};
use crate::page::game::GameScreen;
use crate::page::page_action::{KeyUse, PageAction};
use crate::page::replay_screen::OpenReplay;
use crate::sound::cue::Cue;
use crate::view::frame::{Frame, View};
use crate::world::replica::Replica;

/// The screen that the page shows.
pub enum Screen {
    Lobby,
    Game(Box<GameScreen>),
    /// Waiting for the scene of an in-page game.
    FetchingScene(PendingGame),
    /// Waiting for a replay.
    Fetching {
        /// The replay's name as shown to the player.
        name: String,
        /// The address of the replay's file.
        file: String,
    },
    /// The replay could not be fetched or watched; a card says why.
    NoReplay,
    Replay(Box<OpenReplay>),
    Edit(Box<EditScreen>),
}

impl Screen {
    pub fn game(&self) -> Option<&GameScreen> {
        match self {
            Screen::Game(game) => Some(game),
            _ => None,
        }
    }

    pub fn replay(&self) -> Option<&OpenReplay> {
        match self {
            Screen::Replay(replay) => Some(replay),
            _ => None,
        }
    }

    pub fn edit_screen(&self) -> Option<&EditScreen> {
        match self {
            Screen::Edit(screen) => Some(screen),
            _ => None,
        }
    }

    /// The editor, even while its scene is being played.
    pub fn edited(&self) -> Option<&EditScreen> {
        match self {
            Screen::Edit(screen) => Some(screen),
            Screen::Game(game) => game.edited.as_deref(),
            _ => None,
        }
    }

    pub fn edited_mut(&mut self) -> Option<&mut EditScreen> {
        match self {
            Screen::Edit(screen) => Some(screen),
            Screen::Game(game) => game.edited.as_deref_mut(),
            _ => None,
        }
    }

    /// Handles an event that concerns only the screen.
    pub fn update(&mut self, ctx: &mut Context, event: Event) {
        match self {
            Screen::Game(game) => game.update(ctx, event),
            Screen::Replay(replay) => replay.update(ctx.now_ms, event),
            Screen::Edit(screen) => screen.update(ctx, event),
            _ => {}
        }
    }

    /// Performs the action of a button or a key.
    pub fn click(&mut self, ctx: &mut Context, action: PageAction, value: &str) {
        let keeps =
            matches!(action, PageAction::EditSave | PageAction::EditCopy | PageAction::EditRoom);
        match self {
            Screen::Game(game) => match &mut game.edited {
                Some(screen) if keeps => screen.click(ctx, action, value),
                _ => game.click(ctx, action, value),
            },
            Screen::Replay(replay) => replay.click(action, value),
            Screen::Edit(screen) => screen.click(ctx, action, value),
            _ => {}
        }
    }

    /// Handles a key on this screen, or returns what the page should do about it.
    pub fn key_down(
        &mut self,
        ctx: &mut Context,
        keys: &Bindings,
        top: Layer,
        key: &Key,
    ) -> KeyUse {
        match self {
            Screen::Game(game) => game.key_down(ctx, keys, top, key),
            Screen::Replay(replay) => replay.key_down(top, key),
            Screen::Edit(screen) => screen.key_down(ctx, keys, top, key),
            _ => KeyUse::Unused,
        }
    }

    /// Releases everything, so that no key sticks if its release is never seen.
    pub fn release_input(&mut self, ctx: &mut Context) {
        if let Screen::Game(game) = self {
            game.release_input(ctx);
        }
    }

    /// Tells the editor whether a draft was stored; the returned card informs the player.
    pub fn note_draft(
        &mut self,
        ctx: &mut Context,
        draft: Draft,
        kept: Option<Option<String>>,
    ) -> Option<Card> {
        if let Some(origin) = &kept {
            ctx.storage.take(&drafts::key(origin.as_deref()), draft.text.clone());
        }
        self.edited_mut()?.note_draft(ctx, draft, kept)
    }

    /// Leaves this screen for another one.
    pub fn leave(self, ctx: &mut Context) {
        match self {
            Screen::Game(game) => game.connection.leave(ctx),
            Screen::Edit(mut screen) => screen.keep_draft(&mut ctx.storage),
            _ => {}
        }
    }

    /// Whether a dropped file is opened. A game on a server is not abandoned for it.
    pub fn takes_files(&self) -> bool {
        self.game().is_none_or(GameScreen::is_in_page)
    }

    /// Switches prediction of the player's hero on or off, in this game and in later ones.
    pub fn set_prediction(&mut self, ctx: &mut Context, on: bool) {
        ctx.predicts = on;
        if let Screen::Game(game) = self {
            game.set_prediction(on);
        }
    }

    /// The replica of the displayed room.
    pub fn replica(&self) -> Option<&Replica> {
        match self {
            Screen::Game(game) => game.replica(),
            Screen::Replay(replay) => Some(replay.player.replica()),
            Screen::Edit(screen) => screen.picture(),
            _ => None,
        }
    }

    /// The replica in the picture, which is that of the highlight while one is shown.
    pub fn pictured_replica(&self) -> Option<&Replica> {
        match self {
            Screen::Game(game) => game.pictured_replica(),
            _ => self.replica(),
        }
    }

    /// The frame to draw now; `None` if the canvas is up to date.
    pub fn frame(&self, now_ms: f64, calm: bool) -> Option<Frame<'_>> {
        let seconds = (now_ms / 1000.0) as f32;
        match self {
            Screen::Game(game) => game.frame(seconds, calm),
            Screen::Replay(replay) => replay.frame(calm),
            Screen::Edit(screen) => Some(screen.frame(seconds)),
            _ => None,
        }
    }

    /// The sound cues reported since the previous frame, and the view for which they are mixed.
    pub fn take_cues(&mut self) -> Option<(Vec<Cue>, View)> {
        match self {
            Screen::Game(game) if !game.is_frozen() => Some((game.take_cues(), *game.view())),
            Screen::Replay(replay) => Some((replay.take_cues(), replay.view)),
            _ => None,
        }
    }

    pub fn has_sound(&self) -> bool {
        matches!(self, Screen::Game(_) | Screen::Replay(_))
    }

    /// Resumes a paused game or replay.
    pub fn resume(&mut self) {
        match self {
            Screen::Game(game) => game.connection.status.stalled_ms = None,
            Screen::Replay(replay) => replay.stalled_ms = None,
            _ => {}
        }
    }
}
