//! Playing alone: a room inside the page, for a scene of the site, of a link or of a file, and the part of the
//! address after `#` that asks for it. Nothing of that part is ever sent.

use crate::net::api::{Request, bots_alone, query_value};
use crate::net::report::Fetched;
use crate::net::scene_link;
use crate::page::app::App;
use crate::page::awaited::{Awaited, Wish};
use crate::page::editing;
use crate::page::event::{Address, Effect, Form};
use crate::page::game::{ALONE, GameScreen, GhostSlot};
use crate::page::screen::Screen;
use crate::page::strings;
use crate::world::room_in_page::RoomInPage;
use jostle_game::Scene;
use jostle_game::scene::{SceneError, is_name, line_at};
use std::sync::Arc;

/// Name of a scene whose file is not known, only its text.
const LINKED: &str = "scene";
/// The address of a replay in the page's own.
const REPLAY: &str = "#replay=";

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
    /// Shows what the part of the address after `#` asks for; `false` if it asks for nothing that is known.
    pub(super) fn route_hash(&mut self, hash: &str) -> bool {
        if let Some(origin) = editing::requested(hash) {
            self.open_editor(origin);
        } else if let Some(file) = hash.strip_prefix(REPLAY).filter(|file| !file.is_empty()) {
            let name = file.rsplit('/').next().unwrap_or(file).to_owned();
            self.fetch_replay(name, file.to_owned());
        } else if let Some((link, wish)) = scene_link::in_hash(hash) {
            match scene_link::decode(link) {
                Ok(source) => self.play_text(&format!("{LINKED}.toml"), &source, Wish::of(wish)),
                Err(error) => self.visit.dialogs.card = Some(strings::bad_link(&error)),
            }
        } else if let Some(name) = query_value(hash.trim_start_matches('#'), "alone") {
            self.await_scene(Awaited::Alone(name.to_owned(), Wish::of(hash)));
            if !self.ctx.is_static {
                self.ctx.request(Effect::Request(Request::Records));
            }
        } else {
            return false;
        }
        true
    }

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

    /// Has the address name what is shown, unless it does already. Going back leads to where the player was.
    pub(super) fn show_hash(&mut self, hash: String) {
        if self.site.address.hash != hash {
            let path = self.home().to_owned();
            self.ctx.request(Effect::PushAddress(format!("{path}{hash}")));
            self.site.address = Address { path, query: String::new(), hash };
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
            self.show_hash(format!("#alone={scene}{bots}&seed={seed}"));
            self.route(self.site.address.clone());
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
                self.show_hash(format!("{}{}", scene_link::HASH, scene_link::encode(&text)));
                self.play_foreign(Arc::new(scene), Wish::default());
                self.ctx.request(Effect::FocusStage);
            }
            Err(error) => {
                let busy = self.screen.game().is_some() || self.screen.replay().is_some();
                self.visit.dialogs.card = Some(strings::bad_scene(&error, busy));
            }
        }
    }

    /// Name of the scene of the site that is played alone, and the seed of its game.
    pub(super) fn alone(&self) -> (Option<&str>, u64) {
        let hash = &self.site.address.hash;
        (query_value(hash.trim_start_matches('#'), "alone"), Wish::of(hash).seed.unwrap_or(1))
    }

    fn play_text(&mut self, file: &str, source: &str, wish: Wish) {
        match Scene::parse(file, source) {
            Ok(scene) => self.play_foreign(Arc::new(scene), wish),
            Err(error) => self.visit.dialogs.card = Some(strings::bad_linked_scene(&error)),
        }
    }

    /// Plays a scene that is not of the site alone. The player is asked first if it may be too heavy for the page.
    fn play_foreign(&mut self, scene: Arc<Scene>, wish: Wish) {
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
        if let Some((ghost, file)) = ghost.filter(|_| !self.ctx.is_static) {
            self.ctx.request(Effect::FetchReplay(file.clone()));
            game.ghost = Some(GhostSlot::Awaited(ghost, file));
        }
        self.screen = Screen::Game(Box::new(game));
    }
}
