//! Editing a scene: how the editor is opened, played and left, and what its buttons and keys do.

use crate::editor::palette::Make;
use crate::editor::state::Editor;
use crate::editor::strings::NOT_KEPT;
use crate::editor::update::Deed;
use crate::input::action::Action;
use crate::language::say;
use crate::net::api::{Request, scene_error};
use crate::net::scene_link;
use crate::page::address::Wish;
use crate::page::app::App;
use crate::page::dialogs::Layer;
use crate::page::drafts::{self, Draft};
use crate::page::edit_screen::{EditScreen, SEED};
use crate::page::event::{Effect, Focus, Key};
use crate::page::lobby;
use crate::page::page_action::PageAction;
use crate::page::screen::Screen;
use crate::page::strings;
use jostle_sim::Vec2;

impl App {
    /// Opens the editor with a text.
    pub(super) fn edit(&mut self, text: String, origin: Option<&str>, seed: u64) {
        let file = origin.map(|name| format!("{name}.toml"));
        // A text from elsewhere was not made from the draft, and is not written over it.
        let base = self.ctx.storage.draft(origin).filter(|draft| *draft == text);
        let base = base.map(str::to_owned);
        let editor = Editor::open(text, file.as_deref());
        let mut screen = EditScreen::new(editor, origin.map(str::to_owned), seed);
        screen.base = base;
        self.screen = Screen::Edit(Box::new(screen));
        self.ctx.request(Effect::FocusStage);
    }

    /// From playing to editing and back, in the same picture.
    pub(super) fn toggle_edit(&mut self) {
        match &mut self.screen {
            Screen::Edit(_) => self.play_edited(),
            Screen::Game(game) if game.is_in_page() => self.stop_playing(),
            _ => {}
        }
    }

    fn play_edited(&mut self) {
        self.keep_draft();
        let Screen::Edit(screen) = &mut self.screen else { return };
        let Some(scene) = screen.playable() else {
            screen.editor.said =
                screen.editor.doc.error.as_ref().map_or(String::new(), |e| e.to_string());
            return self.go_to_error();
        };
        let wish = Wish { seed: Some(screen.seed), ..Wish::default() };
        if !screen.may_be_heavy
            && let Some(worst) = Wish::heavy_tick(&scene)
        {
            self.visit.dialogs.card = Some(strings::heavy_scene(&worst, true));
            return;
        }
        let edits = std::mem::replace(&mut self.screen, Screen::Lobby);
        self.play_alone(scene, wish);
        // It takes its seat at once: nothing is to be waited for.
        self.screen.with_game(&mut self.ctx, |game, ctx| game.advance(ctx, None));
        if let Screen::Edit(screen) = edits {
            self.edited = Some(screen);
        }
        self.begin_in_place();
    }

    fn stop_playing(&mut self) {
        let known = self.edited.take();
        let Screen::Game(game) = &self.screen else { return };
        match known {
            Some(screen) => self.screen = Screen::Edit(screen),
            None => {
                let Some(scene) = game.replica().map(|replica| replica.room.scene.clone()) else {
                    return;
                };
                let (name, seed) = self.ctx.site.alone();
                let name = name.map(str::to_owned);
                self.edit(scene.source.clone(), name.as_deref(), seed);
                let hash = self.screen.edit_screen().map(EditScreen::hash).unwrap_or_default();
                self.ctx.show_hash(hash);
            }
        }
        self.begin_in_place();
    }

    /// The next screen shows the same picture.
    fn begin_in_place(&mut self) {
        self.begin_screen();
        self.ctx.request(Effect::FocusStage);
    }

    /// The editor, also while its scene is played.
    pub fn edited(&self) -> Option<&EditScreen> {
        self.screen.edit_screen().or(self.edited.as_deref())
    }

    pub(super) fn edited_mut(&mut self) -> Option<&mut EditScreen> {
        match &mut self.screen {
            Screen::Edit(screen) => Some(screen),
            _ => self.edited.as_deref_mut(),
        }
    }

    fn go_to_hash(&mut self, hash: String) {
        self.ctx.show_hash(hash);
        self.route(self.ctx.site.address.clone());
    }

    /// Keeps the text for the next visit, if it changed.
    pub(super) fn keep_draft(&mut self) {
        let screen = match &mut self.screen {
            Screen::Edit(screen) => screen,
            _ => return,
        };
        if screen.editor.is_held() || screen.kept == screen.editor.doc.revision {
            return;
        }
        screen.kept = screen.editor.doc.revision;
        let (origin, base) = (screen.origin.as_deref(), screen.base.as_deref());
        self.ctx.storage.keep_draft(origin, screen.editor.text(), base);
    }

    /// A draft was kept. As that of another scene if there was one already that it was not made from: both are there then, and
    /// the editor goes on with the new one.
    pub(super) fn note_draft(&mut self, draft: Draft, kept: Option<Option<String>>) {
        let Some(origin) = kept else { return self.note_refused_draft(&draft) };
        self.ctx.storage.take(&drafts::key(origin.as_deref()), draft.text.clone());
        let Some(screen) = self.edited_mut().filter(|screen| screen.origin == draft.origin) else {
            return;
        };
        screen.is_refused = false;
        screen.base = draft.text;
        if screen.origin != origin {
            screen.origin = origin;
            let name = screen.origin.clone().unwrap_or_default();
            screen.editor.doc.rename(&name);
            let hash = screen.hash();
            self.visit.dialogs.card = Some(strings::second_draft(&name));
            self.ctx.show_hash(hash);
        }
    }

    /// The browser did not take a draft: it is offered again, and the visitor is told once.
    fn note_refused_draft(&mut self, draft: &Draft) {
        let Some(screen) = self.edited_mut().filter(|screen| screen.origin == draft.origin) else {
            return;
        };
        // An empty draft is none: nothing is lost.
        if draft.text.is_none() {
            return;
        }
        screen.kept = screen.editor.doc.revision.wrapping_sub(1);
        if !std::mem::replace(&mut screen.is_refused, true) {
            screen.editor.said = say(NOT_KEPT).to_owned();
        }
    }

    /// The kept draft of the scene that is edited, if the text was not made from that.
    pub fn other_draft(&self) -> Option<&str> {
        let screen = self.screen.edit_screen()?;
        let kept = self.ctx.storage.draft(screen.origin.as_deref())?;
        Some(kept)
            .filter(|kept| Some(*kept) != screen.base.as_deref() && *kept != screen.editor.text())
    }

    /// Puts that draft in the place of the text, as a step that can be undone.
    pub(super) fn take_other_draft(&mut self) {
        let Some(text) = self.other_draft().map(str::to_owned) else { return };
        self.screen.with_editor(&self.ctx, |screen, _| {
            screen.base = Some(text.clone());
            let file = screen.editor.doc.file.clone();
            screen.editor.replace(text, Some(&file));
            screen.kept = screen.editor.doc.revision;
        });
    }

    /// A scene file was dropped or chosen: its text takes the place of the one that is edited.
    pub(super) fn replace_edited(&mut self, file: &str, text: String) {
        self.screen.with_editor(&self.ctx, |screen, _| screen.editor.replace(text, Some(file)));
    }

    /// Does what a button of the editor says; `false` if it is none.
    pub(super) fn click_editor(&mut self, action: PageAction, value: &str) {
        match action {
            PageAction::EditScene => self.go_to_hash(format!("#edit={value}")),
            PageAction::EditNewScene => self.go_to_hash("#edit".to_owned()),
            PageAction::EditToggle => self.toggle_edit(),
            PageAction::EditUndo => self.screen.edit(&self.ctx, Deed::Undone),
            PageAction::EditRedo => self.screen.edit(&self.ctx, Deed::Redone),
            PageAction::EditDuplicate => self.screen.edit(&self.ctx, Deed::Duplicated),
            PageAction::EditPath => self.screen.edit(&self.ctx, Deed::PathExtended),
            PageAction::EditDelete => self.screen.edit(&self.ctx, Deed::Deleted),
            PageAction::EditNew => self
                .screen
                .with_editor(&self.ctx, |screen, _| screen.editor.replace(String::new(), None)),
            PageAction::EditPlace => {
                if let Some(make) = Make::named(value) {
                    self.screen.with_editor(&self.ctx, |screen, now_ms| {
                        let at: Vec2 = screen.view.center;
                        screen.update(now_ms, Deed::Placed(make, at));
                    });
                }
            }
            PageAction::EditSave => self.save_file(),
            PageAction::EditCopy => self.copy_link(),
            PageAction::EditRoom => self.open_guest_room(),
            PageAction::EditError => self.go_to_error(),
            _ => {}
        }
    }

    fn save_file(&mut self) {
        let Some(screen) = self.edited() else { return };
        let editor = &screen.editor;
        let effect = Effect::SaveFile(editor.doc.file.clone(), editor.text().to_owned());
        self.ctx.request(effect);
    }

    fn copy_link(&mut self) {
        if let Some(link) = self.edited_link() {
            self.ctx.request(Effect::CopyLink(format!("{}{link}", self.ctx.site.origin)));
        }
    }

    /// The link of the scene that is edited, from the first slash on.
    pub(super) fn edited_link(&self) -> Option<String> {
        Some(self.ctx.site.scene_link(self.edited()?.editor.text()))
    }

    /// Edits the scene of the address, which has an error, there.
    pub(super) fn edit_linked(&mut self) {
        let link = scene_link::in_hash(&self.ctx.site.address.hash);
        let Some(text) = link.and_then(|(link, _)| scene_link::decode(link).ok()) else { return };
        self.visit.dialogs.card = None;
        self.edit(text, None, SEED);
        self.ctx.show_hash("#edit".to_owned());
        self.begin_in_place();
        self.go_to_error();
    }

    /// Has the server open a private room with the text.
    fn open_guest_room(&mut self) {
        let Some(screen) = self.edited_mut().filter(|screen| !screen.opening) else { return };
        if screen.playable().is_none() {
            return self.go_to_error();
        }
        screen.opening = true;
        let text = screen.editor.text().to_owned();
        self.ctx.request(Effect::Request(Request::OpenGuest(text)));
    }

    /// Takes the answer to that: the player goes into the room, unless they went elsewhere meanwhile. What is
    /// wrong with the text is shown there.
    pub(super) fn take_guest_room(&mut self, sent: &str, answer: Option<&str>) {
        let taken = lobby::take_room(&mut self.ctx, answer);
        let Some(screen) = self.edited_mut().filter(|screen| screen.opening) else { return };
        screen.opening = false;
        let refused = match taken {
            Ok(code) => return self.enter(Some(code)),
            Err(refused) => refused,
        };
        let sentence = refused.error.clone().unwrap_or_else(|| strings::SILENCE.to_owned());
        let error = scene_error(*refused, &screen.editor.doc.file);
        let Some(error) = error.filter(|_| screen.editor.text() == sent) else {
            self.visit.dialogs.card = Some(strings::no_room(&sentence));
            return;
        };
        screen.editor.doc.refusal = Some(error);
        if self.screen.edit_screen().is_none() {
            self.toggle_edit();
        }
    }

    fn go_to_error(&mut self) {
        let at = self.screen.edit_screen().and_then(|screen| screen.editor.doc.error_bytes());
        if let Some(at) = at {
            self.ctx.request(Effect::FocusText(at.start));
        }
    }

    pub(super) fn editor_key_down(&mut self, key: &Key) {
        if self.top() != Layer::Page {
            if key.code == "Escape" && self.top() == Layer::Help || key.letter == "?" {
                self.toggle_help();
                self.ctx.request(Effect::PreventDefault);
            }
            return;
        }
        if self.editor_command(key) {
            self.ctx.request(Effect::PreventDefault);
        }
    }

    /// Does what a key means to the editor; `false` if that is nothing.
    fn editor_command(&mut self, key: &Key) -> bool {
        let letter = key.letter.to_lowercase();
        match (letter.as_str(), key.command, key.shift) {
            ("z", true, false) => self.screen.edit(&self.ctx, Deed::Undone),
            ("z", true, true) | ("y", true, _) => self.screen.edit(&self.ctx, Deed::Redone),
            ("s", true, _) => self.save_file(),
            ("escape", ..) if key.focus == Focus::Field => self.ctx.request(Effect::FocusStage),
            _ if key.focus == Focus::Field => return false,
            ("d", true, _) => self.screen.edit(&self.ctx, Deed::Duplicated),
            ("a", true, _) => self.screen.edit(&self.ctx, Deed::SelectedAll),
            _ if key.modified => return false,
            _ if self.settings.keys.actions(&key.code, &key.letter).contains(&Action::Edit) => {
                if !key.repeat {
                    self.toggle_edit();
                }
            }
            ("?", ..) => self.toggle_help(),
            ("delete" | "backspace", ..) => self.screen.edit(&self.ctx, Deed::Deleted),
            ("escape", ..) => self.screen.edit(&self.ctx, Deed::Deselected),
            ("tab", _, back) if key.focus == Focus::Elsewhere => {
                return self.screen.tab(&self.ctx, back);
            }
            (arrow, _, far) => {
                let way = match arrow {
                    "arrowleft" => -Vec2::X,
                    "arrowright" => Vec2::X,
                    "arrowup" => Vec2::Y,
                    "arrowdown" => -Vec2::Y,
                    _ => return false,
                };
                self.screen.edit(&self.ctx, Deed::Nudged { way, far });
            }
        }
        true
    }
}
