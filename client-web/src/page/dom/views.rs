//! All views of the page. They depend only on the app's state.

use crate::browser;
use crate::net::api::query_value;
use crate::page::app::{App, Panels};
use crate::page::dom;
use crate::page::dom::editor::EditorView;
use crate::page::dom::language::Translated;
use crate::page::dom::lobby;
use crate::page::dom::patch::{Patch, rescue_focus};
use crate::page::dom::stage::{self, Stage};
use crate::page::dom::tags::Tags;
use crate::page::edit_screen::EditScreen;
use crate::page::event::Canvas;
use crate::page::lobby::LobbyNote;
use crate::page::panels::{self, dialogs, emotes, zones};
use crate::page::queue::Events;
use crate::page::screen::Screen;
use crate::view::frame::View;

/// Interval between updates of the numbers, milliseconds.
const NUMBERS_MS: f64 = 200.0;

/// The most recently shown page.
pub struct Views {
    pub stage: Stage,
    patch: Patch,
    /// The most recently shown lobby note.
    note: LobbyNote,
    translated: Translated,
    tags: Tags,
    pub editor: EditorView,
    /// The number of the most recently shown screen.
    screen: u32,
    opened: Panels,
    world_shown: bool,
    numbers_ms: f64,
    /// The heights covered by the bar at the top of the canvas and by the key caps at its bottom, CSS pixels.
    covered_css: [f32; 2],
    /// Whether to focus the canvas as soon as it is visible.
    pub focus_stage: bool,
    /// Where to focus the edited text, as a byte offset, if requested.
    pub focus_text: Option<usize>,
}

impl Views {
    /// Creates the views of a page that shows nothing yet.
    pub fn new(events: Events, app: &App) -> Views {
        let query = browser::window().location().search().unwrap_or_default();
        Views {
            stage: Stage::new(events, query_value(&query, "sharp") == Some("1")),
            patch: Patch::default(),
            note: LobbyNote::default(),
            translated: Translated::collect(),
            tags: Tags::default(),
            editor: EditorView::default(),
            screen: app.visit.number,
            opened: Panels::default(),
            world_shown: false,
            numbers_ms: 0.0,
            covered_css: [0.0; 2],
            focus_stage: false,
            focus_text: None,
        }
    }

    /// Shows everything that may have changed. The lobby is updated only after events.
    pub fn show(&mut self, app: &App, had_events: bool) {
        let is_told = self.translated.show(&app.settings.spoken);
        if is_told {
            self.patch.forget();
            self.editor.retell();
        }
        if self.screen != app.visit.number || is_told {
            self.screen = app.visit.number;
            self.begin_screen(app);
        }
        self.patch.show_all(&panels::ALL, app);
        if !std::mem::replace(&mut self.world_shown, app.picture.world_shown)
            && app.picture.world_shown
        {
            rescue_focus();
        }
        if std::mem::replace(&mut self.opened, app.panels) != app.panels {
            // Update the numbers of newly opened panels with the next frame.
            self.numbers_ms = 0.0;
        }
        if let Screen::Lobby = app.screen {
            self.show_lobby(app, had_events);
        }
        if let Some(screen) = app.screen.edit_screen() {
            self.editor.text.show(&screen.editor);
        }
        if std::mem::take(&mut self.focus_stage) {
            dom::focus_stage();
        }
        self.patch.show(dialogs::view(app));
        if let Some(at) = self.focus_text.take() {
            self.editor.focus_text(at);
        }
    }

    fn show_lobby(&mut self, app: &App, had_events: bool) {
        lobby::load_visible();
        if !had_events {
            return;
        }
        self.patch.show(panels::lobby::view(app, (app.ctx.unix_s)()));
        if self.note != app.lobby.note {
            self.note = app.lobby.note.clone();
            if self.note.bad {
                lobby::reveal_note(&app.lobby);
            }
        }
    }

    fn begin_screen(&mut self, app: &App) {
        self.numbers_ms = 0.0;
        self.covered_css = [0.0; 2];
        self.tags.clear();
        self.patch.show_all(&panels::OF_FRAMES, app);
        self.patch.show_all(&panels::OF_NUMBERS, app);
        self.patch.show(emotes::shown(app, &View::UNSEEN, 1.0));
        self.patch.show(zones::view(app, &View::UNSEEN, 1.0));
        self.stage.reset();
        lobby::fill_form(&app.appearance);
    }

    /// The canvas for the next frame; `None` while drawing is not possible.
    pub fn canvas(&mut self, app: &App) -> Option<Canvas> {
        let covered_css = match app.screen.replay() {
            Some(_) => {
                let covered = dom::html("deck").get_bounding_client_rect();
                let stage_css = f64::from(dom::html("stage").client_height());
                [0.0, (stage_css - covered.top()).max(0.0) as f32]
            }
            // Editing and playing use the same picture.
            None if app.screen.edited().is_some() => [0.0; 2],
            // The style sheet hides the controls only after the first frame.
            None if app.picture.frozen_hud == Some(false) => [0.0; 2],
            None => self.covered_css,
        };
        self.stage.canvas(app, covered_css)
    }

    /// Draws the picture. `None` if there is no frame, `false` if the surface had no texture to draw on.
    pub fn draw(&mut self, app: &App) -> Option<bool> {
        let drawn = self.stage.draw(app)?;
        if let (Some(replica), Some(view)) = (app.screen.pictured_replica(), view(app)) {
            let css_per_pixel = stage::css_per_pixel(view.pixels);
            self.tags.update(replica, view, css_per_pixel);
            self.patch.show(emotes::shown(app, view, css_per_pixel));
            self.patch.show(zones::view(app, view, css_per_pixel));
        }
        Some(drawn)
    }

    /// Updates everything that may change with every frame.
    pub fn show_frame(&mut self, app: &App) {
        let now_ms = app.ctx.now_ms;
        let tick = if let Some(game) = app.screen.game() {
            game.replica().map(|replica| format!("{:.0}", replica.room.display.floor()))
        } else if let Some(replay) = app.screen.replay() {
            Some(replay.player.tick().to_string())
        } else if let Some(screen) = app.screen.edit_screen() {
            self.editor.show_frame(&screen.editor, &mut self.patch);
            Some("0".to_owned())
        } else {
            return;
        };
        self.patch.show_all(&panels::OF_FRAMES, app);
        if now_ms - self.numbers_ms >= NUMBERS_MS {
            self.numbers_ms = now_ms;
            self.patch.show_all(&panels::OF_NUMBERS, app);
            // The buttons, the scoreboard and the clock of a race form the bar.
            let bar = ["board", "bar-right", "race"]
                .map(|id| dom::html(id).get_bounding_client_rect().bottom() as f32);
            let caps = dom::html("caps").offset_height() as f32;
            self.covered_css = [bar.into_iter().fold(0.0, f32::max), caps];
        }
        if tick.is_some() {
            dom::set(&dom::root(), "data-tick", tick.as_deref());
        }
    }
}

/// The view of the most recent frame.
pub fn view(app: &App) -> Option<&View> {
    match (app.screen.game(), app.screen.replay()) {
        (Some(game), _) => Some(game.view()),
        (_, Some(replay)) => Some(&replay.view),
        _ => app.screen.edit_screen().map(EditScreen::view),
    }
}
