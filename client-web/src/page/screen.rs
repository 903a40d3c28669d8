//! The screens of the page, and what each makes of buttons, pointers and time.

use crate::editor::update::Deed;
use crate::page::address::Awaited;
use crate::page::context::Context;
use crate::page::edit_screen::EditScreen;
use crate::page::event::{Effect, Event};
use crate::page::game::GameScreen;
use crate::page::page_action::PageAction;
use crate::page::replay_screen::OpenReplay;
use crate::sound::cue::Cue;
use crate::view::frame::{Frame, View};
use crate::world::replica::Replica;

/// A wheel that turns so far doubles the picture of the editor, CSS pixels.
const WHEEL_PIXELS: f32 = 300.0;

/// The screen that the page shows.
pub enum Screen {
    Lobby,
    Game(Box<GameScreen>),
    /// Waiting for a scene to play it in the page.
    FetchingScene(Awaited),
    /// Waiting for a replay.
    Fetching {
        /// Its name, for people.
        name: String,
        /// The address of its file.
        file: String,
    },
    /// It did not come, or cannot be watched; a card says why.
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

    /// Handles an event that concerns the screen alone.
    pub fn update(&mut self, ctx: &mut Context, event: Event) {
        match (self, event) {
            (Screen::Edit(screen), Event::Pointer(pointer)) => screen.point(ctx.now_ms, &pointer),
            (Screen::Edit(screen), Event::Wheel(at, by)) => {
                screen.zoom(at, (-by / WHEEL_PIXELS).exp2());
                ctx.request(Effect::PreventDefault);
            }
            (Screen::Edit(screen), Event::Edited(deed)) => screen.update(ctx.now_ms, deed),
            (Screen::Edit(screen), Event::FieldChanged(path, values)) => {
                screen.editor.set_field(ctx.now_ms, &path, &values);
            }
            (Screen::Replay(replay), event) => replay.update(ctx.now_ms, event),
            (Screen::Game(game), event) => game.update(ctx, event),
            _ => {}
        }
    }

    /// Does what a button of a game or a replay says.
    pub fn click(&mut self, ctx: &mut Context, action: PageAction, value: &str) {
        match self {
            Screen::Game(game) => game.click(ctx, action, value),
            Screen::Replay(replay) => replay.click(action, value),
            _ => {}
        }
    }

    /// Calls `work` with the game that is on, if one is.
    pub fn with_game(
        &mut self,
        ctx: &mut Context,
        work: impl FnOnce(&mut GameScreen, &mut Context),
    ) {
        if let Screen::Game(game) = self {
            work(game, ctx);
        }
    }

    pub fn with_editor(&mut self, ctx: &Context, work: impl FnOnce(&mut EditScreen, f64)) {
        if let Screen::Edit(screen) = self {
            work(screen, ctx.now_ms);
        }
    }

    pub fn edit(&mut self, ctx: &Context, deed: Deed) {
        self.with_editor(ctx, |screen, now_ms| screen.update(now_ms, deed));
    }

    /// The copy of the room on display.
    pub fn replica(&self) -> Option<&Replica> {
        match self {
            Screen::Game(game) => game.replica(),
            Screen::Replay(replay) => Some(replay.player.replica()),
            Screen::Edit(screen) => screen.picture(),
            _ => None,
        }
    }

    /// The copy of the room in the picture: that of a highlight, while one is shown.
    pub fn pictured_replica(&self) -> Option<&Replica> {
        match self {
            Screen::Game(game) => game.pictured_replica(),
            _ => self.replica(),
        }
    }

    /// The frame to draw now, or `None` if the one on the canvas is still right.
    pub fn frame(&self, now_ms: f64, calm: bool) -> Option<Frame<'_>> {
        let seconds = (now_ms / 1000.0) as f32;
        match self {
            Screen::Game(game) => game.frame(seconds, calm),
            Screen::Replay(replay) => replay.frame(calm),
            Screen::Edit(screen) => Some(screen.frame(seconds)),
            _ => None,
        }
    }

    /// What was heard since the last frame, and where the camera was.
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

    /// Releases everything: no key may stick when its release is never seen.
    pub fn release_input(&mut self, ctx: &mut Context) {
        if let Screen::Game(game) = self {
            game.release_input(ctx);
        }
    }

    /// Goes on with a game or a replay that stands still.
    pub fn resume(&mut self) {
        match self {
            Screen::Game(game) => game.connection.status.stalled_ms = None,
            Screen::Replay(replay) => replay.stalled_ms = None,
            _ => {}
        }
    }

    /// Selects the next piece. After the last one the focus goes on to the buttons, so that it is never caught.
    pub fn tab(&mut self, ctx: &Context, back: bool) -> bool {
        let Screen::Edit(screen) = self else { return false };
        let editor = &mut screen.editor;
        let ends = match back {
            false => editor.doc.sheet.pieces.last(),
            true => editor.doc.sheet.pieces.first(),
        };
        let at_end = ends.is_none_or(|piece| editor.selection.last() == Some(&piece.id));
        let deed = if at_end { Deed::Deselected } else { Deed::Next { back } };
        self.edit(ctx, deed);
        !at_end
    }
}
