//! Playing alone: a room inside the page, for a scene of the site, of a link or of a file.

use crate::net::api::bots_alone;
use crate::net::report::Fetched;
use crate::net::scene_link;
use crate::page::address::{Awaited, Wish};
use crate::page::app::App;
use crate::page::event::{Effect, Form};
use crate::page::game::{ALONE, GameScreen, GhostSlot};
use crate::page::screen::Screen;
use crate::page::strings;
use crate::world::room_in_page::RoomInPage;
use jostle_game::Scene;
use jostle_game::scene::{SceneError, is_name, line_at};
use std::sync::Arc;

/// An error of a whole file, as the parser of scenes reports it.
pub fn file_error(file: &str, found: &str, allowed: &str) -> SceneError {
    let (file, found, allowed) = (file.to_owned(), found.to_owned(), allowed.to_owned());
    SceneError { file, line: 1, field: "file".to_owned(), found, allowed }
}

/// The text of a scene file; the error names the line that holds something else.
fn text_of(file: &str, bytes: Vec<u8>) -> Result<String, SceneError> {
    String::from_utf8(bytes).map_err(|error| {
        let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
        SceneError { line, ..file_error(file, "bytes that are not UTF-8", "UTF-8 text") }
    })
}

impl App {
    /// Asks for the file of a scene.
    pub(super) fn await_scene(&mut self, awaited: Awaited) {
        let name = awaited.scene().to_owned();
        self.screen = Screen::FetchingScene(awaited);
        // Anything else would be a path to some other file.
        if is_name(&name) {
            self.ctx.request(Effect::FetchScene(name));
        } else {
            self.take_scene(&name, Fetched::Nothing);
        }
    }

    /// Plays a scene of the lobby alone. The seed is in the address, so that the page begins the same game again when
    /// it is loaded again.
    pub(super) fn play_scene_alone(&mut self, scene: &str, form: &Form) {
        if self.read_form(form) {
            let card = self.lobby.scenes.iter().find(|card| card.name == scene);
            let bots = if form.bots { card.map(bots_alone) } else { Some(0) };
            let bots = bots.map_or(String::new(), |bots| format!("&bots={bots}"));
            let seed = self.ctx.random_bits();
            self.ctx.show_hash(format!("#alone={scene}{bots}&seed={seed}"));
            self.route(self.ctx.site.address.clone());
        }
    }

    /// Plays a scene file of this machine alone, or says what is wrong with it. The address becomes its link, so that
    /// the page begins the same game again when it is loaded again.
    pub(super) fn take_scene_file(&mut self, file: &str, contents: Result<Vec<u8>, SceneError>) {
        if !self.takes_files() {
            return;
        }
        let text = contents.and_then(|bytes| text_of(file, bytes));
        let text = match text {
            Ok(text) if self.screen.edit_screen().is_some() => {
                return self.replace_edited(file, text);
            }
            text => text,
        };
        let parsed = text.and_then(|text| Ok((Scene::parse(file, &text)?, text)));
        match parsed {
            Ok((scene, text)) => {
                self.end_screen();
                self.ctx.show_hash(format!("{}{}", scene_link::HASH, scene_link::encode(&text)));
                self.play_foreign(Arc::new(scene), Wish::default());
                self.ctx.request(Effect::FocusStage);
            }
            Err(error) => {
                let busy = self.screen.game().is_some() || self.screen.replay().is_some();
                self.visit.dialogs.card = Some(strings::bad_scene(&error, busy));
            }
        }
    }

    /// Plays a scene that is not of the site alone. The player is asked first if it may be too heavy for the page.
    pub(super) fn play_foreign(&mut self, scene: Arc<Scene>, wish: Wish) {
        match Wish::heavy_tick(&scene) {
            None => self.play_alone(scene, wish),
            Some(worst) => {
                self.visit.dialogs.card = Some(strings::heavy_scene(&worst, false));
                self.visit.heavy = Some((scene, wish));
            }
        }
    }

    /// Plays the scene that the player was asked about.
    pub(super) fn play_heavy(&mut self) {
        self.visit.dialogs.card = None;
        match self.visit.heavy.take() {
            Some((scene, wish)) => {
                self.play_alone(scene, wish);
                self.ctx.request(Effect::FocusStage);
            }
            None => {
                self.screen.with_editor(&self.ctx, |screen, _| screen.may_be_heavy = true);
                self.toggle_edit();
            }
        }
    }

    /// Begins a game in a room inside the page.
    pub(super) fn play_alone(&mut self, scene: Arc<Scene>, wish: Wish) {
        let bots = wish.bots_in(&scene);
        let ghost = wish.ghost.map(|ghost| (ghost, ghost.file(&scene.name)));
        let room = RoomInPage::alone(scene, wish.seed.unwrap_or(1), bots);
        let appearance = self.appearance.clone();
        let mut game = GameScreen::in_page(&mut self.ctx, ALONE, room, appearance);
        if let Some((ghost, file)) = ghost.filter(|_| !self.ctx.site.is_static) {
            self.ctx.request(Effect::FetchReplay(file.clone()));
            game.ghost = Some(GhostSlot::Awaited(ghost, file));
        }
        self.screen = Screen::Game(Box::new(game));
    }
}
