//! Transitions between screens: opening what an address, the server or a file provides, and switching between editing
//! and playing.

use super::{App, Visit};
use crate::editor::field_words;
use crate::editor::templates;
use crate::net::api::{self, Request, bots_alone, file_error};
use crate::net::report::Fetched;
use crate::net::scene_link;
use crate::page::address::{Destination, PendingGame, PlayOptions};
use crate::page::bests::OwnResult;
use crate::page::edit_screen::{EditScreen, SEED};
use crate::page::event::{Address, Effect, Form};
use crate::page::game::GameScreen;
use crate::page::lobby;
use crate::page::replay_screen::{OpenReplay, Opening, bytes_of};
use crate::page::screen::Screen;
use crate::page::strings;
use crate::replay::error::ReplayLoadError;
use crate::replay::player::ReplayPlayer;
use crate::world::daily;
use jostle_game::Scene;
use jostle_game::scene::{SceneError, is_name, line_at};
use jostle_protocol::Role;
use jostle_protocol::replay::{ReplayError, ReplayReader};
use std::sync::Arc;

/// File name for a scene that arrived as text without a name.
const LINKED: &str = "scene.toml";
/// The address fragment while a local file is watched.
const FILE_HASH: &str = "#file";

impl App {
    /// Shows the screen for an address.
    pub(super) fn route(&mut self, address: Address) {
        self.end_screen();
        self.ctx.site.address = address.clone();
        match Destination::of(&address, self.ctx.site.is_static) {
            Destination::Lobby => self.lobby.show(&mut self.ctx),
            Destination::Room { code, watches } => {
                let role = if watches { Role::Spectator } else { Role::Player };
                let game = GameScreen::join(&mut self.ctx, code, self.appearance.clone(), role);
                self.screen = Screen::Game(Box::new(game));
            }
            Destination::Replay(name, file) => {
                self.screen = Screen::Fetching { name: name.to_owned(), file: file.clone() };
                self.ctx.request(Effect::FetchReplay(file));
            }
            Destination::Linked(link, wish) => match scene_link::decode(link) {
                Ok(source) => match Scene::parse(LINKED, &source) {
                    Ok(scene) => self.play_foreign(Arc::new(scene), wish),
                    Err(error) => self.visit.dialogs.show(strings::bad_linked_scene(&error)),
                },
                Err(error) => self.visit.dialogs.show(strings::bad_link(&error)),
            },
            Destination::Track(date, wish) => {
                match Scene::parse(&daily::name(date), &daily::track(date)) {
                    Ok(scene) => self.play_alone(Arc::new(scene), wish),
                    Err(error) => self.visit.dialogs.show(strings::bad_linked_scene(&error)),
                }
            }
            Destination::Scene(awaited) => {
                let has_records =
                    matches!(awaited, PendingGame::Alone(..)) && !self.ctx.site.is_static;
                self.await_scene(awaited);
                if has_records {
                    self.ctx.request(Effect::Request(Request::Records));
                }
            }
            // Use the scene's draft, if there is one.
            Destination::Editor(origin) => match (self.ctx.storage.draft(origin), origin) {
                (None, Some(name)) => self.await_scene(PendingGame::Edit(name.to_owned())),
                (draft, _) => self.edit(draft.unwrap_or(templates::EMPTY).to_owned(), origin, SEED),
            },
        }
        if let Screen::Game(_) = self.screen {
            self.ctx.request(Effect::FocusStage);
        }
    }

    /// Follows the browser's history. Back is easily pressed by mistake, so unlike "Leave" it gives nothing up: the
    /// server holds the seat as after a lost connection, and a game inside the page waits for Forward.
    pub(super) fn navigate(&mut self, address: Address) {
        let here = self.ctx.site.address.clone();
        let returns = self.set_aside.take_if(|(left, _)| *left == address && here != address);
        match std::mem::replace(&mut self.screen, Screen::Lobby) {
            Screen::Game(mut game) if game.is_in_page() && game.edited.is_none() => {
                game.release_input(&mut self.ctx);
                self.set_aside = Some((here, game));
            }
            Screen::Game(mut game) if game.connection.keeps_seat() => {
                game.connection.drop_socket(&mut self.ctx);
            }
            screen => self.screen = screen,
        }
        let Some((_, game)) = returns else { return self.route(address) };
        self.end_screen();
        self.ctx.site.address = address;
        self.screen = Screen::Game(game);
        self.ctx.request(Effect::FocusStage);
    }

    /// Navigates to a path on this server.
    pub(super) fn go(&mut self, path: String, query: &str) {
        self.ctx.request(Effect::PushAddress(format!("{path}{query}")));
        self.route(Address { path, query: query.to_owned(), hash: String::new() });
    }

    pub(super) fn go_to_hash(&mut self, hash: String) {
        self.ctx.show_hash(hash);
        self.route(self.ctx.site.address.clone());
    }

    pub(super) fn enter(&mut self, code: Option<String>) {
        if let Some(code) = code {
            self.go(format!("/{code}"), "");
        }
    }

    /// Leaves the game, replay or editor.
    fn end_screen(&mut self) {
        std::mem::replace(&mut self.screen, Screen::Lobby).leave(&mut self.ctx);
        self.opening = None;
        self.begin_screen();
        self.picture.world_shown = false;
    }

    /// Resets the state that belongs to a single screen.
    fn begin_screen(&mut self) {
        let number = self.visit.number + 1;
        self.visit = Visit { number, own_color: self.appearance.color, ..Visit::default() };
        self.panels.network = false;
        self.panels.clean = false;
        self.settings.choice = None;
        self.sound.end();
        self.panels.sound = false;
        self.records.begin();
        self.own_result = OwnResult::default();
    }

    /// Requests the file of a scene.
    fn await_scene(&mut self, awaited: PendingGame) {
        let name = awaited.scene().to_owned();
        self.screen = Screen::FetchingScene(awaited);
        // An invalid name could form a path to some other file.
        if is_name(&name) {
            self.ctx.request(Effect::FetchScene(name));
        } else {
            self.take_scene(&name, Fetched::Nothing);
        }
    }

    /// Starts the in-page game or editor that waits for this scene.
    pub(super) fn take_scene(&mut self, name: &str, fetched: Fetched) {
        let Screen::FetchingScene(awaited) = &self.screen else { return };
        if awaited.scene() != name {
            return;
        }
        let awaited = awaited.clone();
        let source = match fetched {
            Fetched::Bytes(bytes) => String::from_utf8(bytes).unwrap_or_default(),
            _ => String::new(),
        };
        let Ok(scene) = Scene::parse(name, &source) else {
            self.screen = Screen::Lobby;
            return self.visit.dialogs.show(strings::NO_SCENE);
        };
        match awaited {
            PendingGame::Demo(request) => {
                if request.ticks.is_some() {
                    self.visit.own_color = 0;
                    self.picture.frozen_hud = Some(request.hud);
                    self.picture.drawn_frames = 0;
                }
                let appearance = self.appearance.clone();
                let game = GameScreen::demo(&mut self.ctx, Arc::new(scene), &request, appearance);
                self.screen = Screen::Game(Box::new(game));
            }
            PendingGame::Alone(_, wish) => self.play_alone(Arc::new(scene), wish),
            PendingGame::Edit(name) => self.edit(source, Some(&name), SEED),
        }
        self.ctx.request(Effect::FocusStage);
    }

    /// Reads the name and colour from the form; `false` if the name is not valid.
    pub(super) fn read_form(&mut self, form: &Form) -> bool {
        self.visit.own_color = form.color;
        let Some(appearance) = self.lobby.read(form) else { return false };
        self.ctx.storage.keep_player(&appearance.name, appearance.color);
        self.appearance = appearance;
        true
    }

    pub(super) fn play(&mut self, form: &Form) {
        if self.ctx.site.is_static {
            self.play_scene_alone(api::FIRST_SCENE, form);
        } else if self.read_form(form) {
            let code = self.lobby.play(&mut self.ctx);
            self.enter(code);
        }
    }

    /// Plays a scene from the lobby alone. The address contains the seed, so that reloading the page starts the same
    /// game again.
    pub(super) fn play_scene_alone(&mut self, scene: &str, form: &Form) {
        if self.read_form(form) {
            let card = self.lobby.scenes.iter().find(|card| card.name == scene);
            let bots = if form.bots { card.map(bots_alone) } else { Some(0) };
            let bots = bots.map_or(String::new(), |bots| format!("&bots={bots}"));
            if scene == daily::CARD {
                let date = daily::date(self.ctx.day());
                return self.go_to_hash(daily::hash(date) + &bots);
            }
            let seed = self.ctx.random_bits();
            self.go_to_hash(format!("#alone={scene}{bots}&seed={seed}"));
        }
    }

    /// Plays a local scene file alone, or shows its error. The address becomes the scene's link, so that reloading the
    /// page starts the same game again.
    pub(super) fn take_scene_file(&mut self, file: &str, contents: Result<Vec<u8>, SceneError>) {
        if !self.screen.takes_files() {
            return;
        }
        let text = contents.and_then(|bytes| text_of(file, bytes));
        // It replaces the text being edited.
        let text = match (text, &mut self.screen) {
            (Ok(text), Screen::Edit(screen)) => return screen.editor.replace(text, Some(file)),
            (text, _) => text,
        };
        let parsed = text.and_then(|text| Ok((Scene::parse(file, &text)?, text)));
        match parsed {
            Ok((scene, text)) => {
                self.end_screen();
                self.ctx.show_hash(format!("{}{}", scene_link::HASH, scene_link::encode(&text)));
                self.play_foreign(Arc::new(scene), PlayOptions::default());
                self.ctx.request(Effect::FocusStage);
            }
            Err(error) => {
                let busy = self.screen.game().is_some() || self.screen.replay().is_some();
                self.visit.dialogs.show(strings::bad_scene(&error, busy));
            }
        }
    }

    /// Plays a scene that is not from the site alone. Asks the player first if it may be too heavy for the page.
    fn play_foreign(&mut self, scene: Arc<Scene>, wish: PlayOptions) {
        match PlayOptions::heavy_tick(&scene) {
            None => self.play_alone(scene, wish),
            Some(worst) => {
                self.visit.dialogs.show(strings::heavy_scene(&worst, false));
                self.visit.heavy = Some((scene, wish));
            }
        }
    }

    /// Plays the heavy scene that the player confirmed.
    pub(super) fn play_heavy(&mut self) {
        self.visit.dialogs.card = None;
        match self.visit.heavy.take() {
            Some((scene, wish)) => {
                self.play_alone(scene, wish);
                self.ctx.request(Effect::FocusStage);
            }
            None => {
                if let Screen::Edit(screen) = &mut self.screen {
                    screen.may_be_heavy = true;
                }
                self.toggle_edit();
            }
        }
    }

    fn play_alone(&mut self, scene: Arc<Scene>, wish: PlayOptions) {
        let game = GameScreen::alone(&mut self.ctx, scene, wish, self.appearance.clone());
        self.screen = Screen::Game(Box::new(game));
    }

    /// Opens the editor with a text.
    fn edit(&mut self, text: String, origin: Option<&str>, seed: u64) {
        let mut screen = EditScreen::open(&self.ctx.storage, text, origin, seed);
        screen.editor.number = self.ctx.next_number();
        self.screen = Screen::Edit(Box::new(screen));
        self.ctx.request(Effect::FocusStage);
        if !field_words::are_known() {
            self.ctx.request(Effect::FetchWords);
        }
    }

    /// Switches between playing and editing while keeping the picture.
    pub(super) fn toggle_edit(&mut self) {
        match &mut self.screen {
            Screen::Edit(_) => return self.play_edited(),
            Screen::Game(game) if game.is_in_page() => {
                if let Some(screen) = game.edited.take() {
                    self.screen = Screen::Edit(screen);
                } else if let Some(scene) = game.replica().map(|replica| replica.room.scene.clone())
                {
                    let (name, seed) = self.ctx.site.alone();
                    let name = name.map(str::to_owned);
                    self.edit(scene.source.clone(), name.as_deref(), seed);
                    let hash = self.screen.edit_screen().map(EditScreen::hash).unwrap_or_default();
                    self.ctx.show_hash(hash);
                } else {
                    return;
                }
            }
            _ => return,
        }
        self.begin_screen();
        self.ctx.request(Effect::FocusStage);
    }

    fn play_edited(&mut self) {
        let Screen::Edit(screen) = &mut self.screen else { return };
        let Some(scene) = screen.scene_to_play(&mut self.ctx) else { return };
        if !screen.may_be_heavy
            && let Some(worst) = PlayOptions::heavy_tick(&scene)
        {
            return self.visit.dialogs.show(strings::heavy_scene(&worst, true));
        }
        let wish = PlayOptions { seed: Some(screen.seed), ..PlayOptions::default() };
        let mut game = GameScreen::alone(&mut self.ctx, scene, wish, self.appearance.clone());
        // The room is in the page, so the player gets a seat without waiting.
        game.advance(&mut self.ctx, None);
        let edits = std::mem::replace(&mut self.screen, Screen::Lobby);
        if let Screen::Edit(screen) = edits {
            game.edited = Some(screen);
        }
        self.screen = Screen::Game(Box::new(game));
        self.begin_screen();
        self.ctx.request(Effect::FocusStage);
    }

    /// Opens the invalid scene from the address in the editor, at the error.
    pub(super) fn edit_linked(&mut self) {
        let link = scene_link::in_hash(&self.ctx.site.address.hash);
        let Some(text) = link.and_then(|(link, _)| scene_link::decode(link).ok()) else { return };
        self.edit(text, None, SEED);
        self.ctx.show_hash("#edit".to_owned());
        self.begin_screen();
        self.ctx.request(Effect::FocusStage);
        if let Screen::Edit(screen) = &self.screen {
            screen.go_to_error(&mut self.ctx);
        }
    }

    /// Handles the answer to a request for a room with the edited text. The player enters the room, unless they have
    /// gone elsewhere in the meantime. If the text was refused, the editor shows why.
    pub(super) fn take_guest_room(&mut self, sent: &str, answer: Option<&str>) {
        let taken = lobby::take_room(&mut self.ctx, answer);
        let Some(screen) = self.screen.edited_mut().filter(|screen| screen.opening) else { return };
        screen.opening = false;
        match taken {
            Ok(code) => self.enter(Some(code)),
            Err(refused) => match screen.take_refusal(sent, *refused) {
                Some(card) => self.visit.dialogs.show(card),
                None if self.screen.edit_screen().is_none() => self.toggle_edit(),
                None => {}
            },
        }
    }

    pub(super) fn take_fetched(&mut self, from: &str, fetched: Fetched) {
        match &mut self.screen {
            Screen::Fetching { name, file } if file == from => match bytes_of(from, fetched) {
                Ok(bytes) => {
                    let name = Some(name.clone());
                    self.open_replay(name, String::new(), Ok(bytes));
                }
                Err(card) => {
                    self.screen = Screen::NoReplay;
                    self.visit.dialogs.show(card);
                }
            },
            Screen::Game(game) => {
                let is_ghost = game.take_ghost(from, fetched);
                if !is_ghost {
                    self.visit.dialogs.show(strings::NO_GHOST);
                }
            }
            _ => {}
        }
    }

    /// Starts reading a replay; short ones open immediately.
    pub(super) fn open_replay(
        &mut self,
        name: Option<String>,
        file: String,
        contents: Result<Vec<u8>, ReplayError>,
    ) {
        match contents.and_then(ReplayReader::new) {
            Ok(reader) => self.opening = Some(Opening { reader, name, file }),
            Err(error) => return self.refuse_replay(&error.into()),
        }
        self.read_on();
    }

    /// Continues reading the replay being opened, if any, and starts it when complete.
    pub(super) fn read_on(&mut self) {
        let Some(opening) = &mut self.opening else { return };
        if !opening.read_on(self.ctx.clock) {
            return;
        }
        let Some(Opening { reader, name, file }) = self.opening.take() else { return };
        let player = match ReplayPlayer::new(reader.finish()) {
            Ok(player) => player,
            Err(error) => return self.refuse_replay(&error),
        };
        self.end_screen();
        // The back button then returns to the previous screen.
        if name.is_none() {
            self.ctx.show_hash(FILE_HASH.to_owned());
        }
        let replay = OpenReplay::new(player, name, file, self.ctx.now_ms);
        self.visit.dialogs.card = replay.cut();
        self.screen = Screen::Replay(Box::new(replay));
        self.picture.drawn_frames = 0;
        self.ctx.request(Effect::FocusStage);
    }

    /// Shows why a file cannot be watched. The current replay or game stays open.
    fn refuse_replay(&mut self, error: &ReplayLoadError) {
        let watching = self.screen.replay().is_some() || self.screen.game().is_some();
        if let Screen::Fetching { .. } = self.screen {
            self.screen = Screen::NoReplay;
        }
        self.visit.dialogs.show(strings::bad_replay(error, watching));
    }
}

/// The text of a scene file; the error names the first line that is not valid UTF-8.
fn text_of(file: &str, bytes: Vec<u8>) -> Result<String, SceneError> {
    String::from_utf8(bytes).map_err(|error| {
        let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
        SceneError { line, ..file_error(file, "bytes that are not UTF-8", "UTF-8 text") }
    })
}
