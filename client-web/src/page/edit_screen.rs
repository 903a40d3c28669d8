//! The editor on the page: the editor itself, its draft, its keys, and the picture of its scene before the first tick.

use crate::editor::drag::EditPointer;
use crate::editor::form;
use crate::editor::palette::Make;
use crate::editor::sketch;
use crate::editor::state::Editor;
use crate::editor::strings::NOT_KEPT;
use crate::editor::templates;
use crate::editor::update::EditorEvent;
use crate::input::action::Action;
use crate::input::bindings::Bindings;
use crate::language::say;
use crate::net::api::{Request, scene_error};
use crate::page::context::Context;
use crate::page::dialogs::Layer;
use crate::page::drafts::Draft;
use crate::page::event::{Canvas, Effect, Event, Focus, Key, Pointer, PointerChange};
use crate::page::page_action::{KeyUse, PageAction};
use crate::page::storage::Storage;
use crate::page::strings::{self, Card};
use crate::view::camera::{Camera, Target};
use crate::view::frame::{Frame, FrameRoom, Sketch, View};
use crate::world::replica::{Eye, Replica};
use jostle_game::scene::Camera as CameraRule;
use jostle_game::{Game, Scene, Seat};
use jostle_protocol::Snapshot;
use jostle_protocol::web::Posted;
use jostle_sim::{Particles, Vec2};
use std::sync::Arc;

/// The constant seed of games played from an edited scene.
pub const SEED: u64 = 1;
/// A seat that no player has.
const NO_PLAYER: Seat = Seat(u16::MAX);
/// How far a mouse pointer and a finger reach, CSS pixels.
const MOUSE_CSS: f32 = 12.0;
const FINGER_CSS: f32 = 22.0;
/// Maximum zoom; at 1 the whole scene is visible.
const ZOOM_MAX: f32 = 16.0;
/// Wheel movement that doubles the size of the picture, CSS pixels.
const WHEEL_PIXELS: f32 = 300.0;
/// The number of the middle mouse button in pointer events.
const MIDDLE: i16 = 1;

/// The screen that edits one scene.
pub struct EditScreen {
    pub editor: Editor,
    /// The seed of games started from the editor.
    pub seed: u64,
    view: EditView,
    draft: DraftStatus,
    /// The most recent valid scene at tick 0; `None` if the text is empty.
    picture: Option<Replica>,
    /// The number of the current picture, so that rendering can tell pictures apart.
    copy: u32,
    sketch: Sketch,
    /// An empty picture, used while there is no scene.
    empty: (FrameRoom, Particles),
    /// Whether the player agreed to play the scene even though it may be too heavy for the page.
    pub may_be_heavy: bool,
    /// Whether a room with the scene is being opened.
    pub opening: bool,
}

/// The draft of the scene in the browser's storage.
struct DraftStatus {
    /// The name of the built-in scene from which editing started.
    origin: Option<String>,
    /// The stored draft from which the text was derived.
    base: Option<String>,
    /// Revision of the text that was last stored as a draft.
    kept: u32,
    /// Whether the most recent draft could not be stored and the player has been told.
    is_refused: bool,
}

impl EditScreen {
    /// Opens the editor with a text.
    pub fn open(storage: &Storage, text: String, origin: Option<&str>, seed: u64) -> EditScreen {
        let file = origin.map(|name| format!("{name}.toml"));
        // A text from another source was not derived from the draft and must not overwrite it.
        let base = storage.draft(origin).filter(|draft| *draft == text).map(str::to_owned);
        let editor = Editor::open(text, file.as_deref());
        let (origin, kept) = (origin.map(str::to_owned), editor.doc.revision);
        let mut screen = EditScreen {
            editor,
            seed,
            view: EditView::default(),
            draft: DraftStatus { origin, base, kept, is_refused: false },
            picture: None,
            copy: 0,
            sketch: Sketch::default(),
            empty: (FrameRoom::default(), Particles::new(Vec::new(), 0)),
            may_be_heavy: false,
            opening: false,
        };
        screen.draw_scene();
        screen
    }

    /// The address fragment of this editor.
    pub fn hash(&self) -> String {
        self.draft.origin.as_ref().map_or("#edit".to_owned(), |origin| format!("#edit={origin}"))
    }

    /// Handles an event that concerns only the editor.
    pub fn update(&mut self, ctx: &mut Context, event: Event) {
        match event {
            Event::Edited(deed) => self.editor.update(ctx.now_ms, deed),
            Event::FieldChanged(path, values) => {
                self.editor.set_field(ctx.now_ms, &path, &values);
            }
            Event::Pointer(pointer) => self.point(ctx.now_ms, &pointer),
            Event::Wheel(at, by) => {
                self.view.zoom(at, (-by / WHEEL_PIXELS).exp2(), self.editor.doc.world());
                ctx.request(Effect::PreventDefault);
            }
            Event::Pulse { .. } | Event::Closing => self.keep_draft(&mut ctx.storage),
            _ => {}
        }
    }

    /// Handles a pointer over the canvas.
    fn point(&mut self, now_ms: f64, pointer: &Pointer) {
        let is_free = self.editor.holds_nothing();
        if self.view.point(pointer, self.editor.doc.world(), is_free) {
            // Once a second finger is down, the first one no longer edits the scene.
            if pointer.touch && pointer.change == PointerChange::Down {
                self.editor.update(now_ms, EditorEvent::Cancelled);
            }
            return;
        }
        let hand = self.view.hand(pointer);
        let deed = match pointer.change {
            PointerChange::Down => EditorEvent::Down(hand),
            PointerChange::Moved => EditorEvent::Moved(hand),
            PointerChange::Up => match self.editor.pressed_piece(pointer.id) {
                Some(make) => EditorEvent::Placed(make, self.view.view.center),
                None => EditorEvent::Up(hand),
            },
            PointerChange::Left => return,
        };
        self.editor.update(now_ms, deed);
    }

    /// Performs the action of a button.
    pub fn click(&mut self, ctx: &mut Context, action: PageAction, value: &str) {
        let deed = match action {
            PageAction::EditUndo => EditorEvent::Undone,
            PageAction::EditRedo => EditorEvent::Redone,
            PageAction::EditDuplicate => EditorEvent::Duplicated,
            PageAction::EditPath => EditorEvent::PathExtended,
            PageAction::EditDelete => EditorEvent::Deleted,
            PageAction::EditPlace => match Make::named(value) {
                Some(make) => EditorEvent::Placed(make, self.view.view.center),
                None => return,
            },
            PageAction::EditNew => match templates::named(value) {
                Some(text) => return self.editor.replace(text.to_owned(), None),
                None => return,
            },
            PageAction::EditSave => {
                let (file, text) = (self.editor.doc.file.clone(), self.editor.text().to_owned());
                return ctx.request(Effect::SaveFile(file, text));
            }
            PageAction::EditCopy => {
                let link = ctx.site.scene_link(self.editor.text());
                return ctx.request(Effect::CopyLink(format!("{}{link}", ctx.site.origin)));
            }
            PageAction::EditRoom => return self.open_room(ctx),
            PageAction::EditError => return self.go_to_error(ctx),
            PageAction::EditLine => {
                return value.parse().into_iter().for_each(|at| ctx.request(Effect::FocusText(at)));
            }
            PageAction::EditRule | PageAction::EditUnrule => {
                match form::with_rules(&self.editor, value) {
                    Some(text) => EditorEvent::Rewritten(text),
                    None => return,
                }
            }
            _ => return,
        };
        self.editor.update(ctx.now_ms, deed);
    }

    /// Handles a key and returns what the page should do about it.
    pub fn key_down(
        &mut self,
        ctx: &mut Context,
        keys: &Bindings,
        top: Layer,
        key: &Key,
    ) -> KeyUse {
        if top != Layer::Page {
            let is_help = key.code == "Escape" && top == Layer::Help || key.letter == "?";
            return if is_help { KeyUse::Action(PageAction::Help) } else { KeyUse::Unused };
        }
        let letter = key.letter.to_lowercase();
        let deed = match (letter.as_str(), key.command, key.shift) {
            ("z", true, false) => EditorEvent::Undone,
            ("z", true, true) | ("y", true, _) => EditorEvent::Redone,
            ("s", true, _) => return KeyUse::Action(PageAction::EditSave),
            ("escape", ..) if key.focus == Focus::Field => {
                ctx.request(Effect::FocusStage);
                return KeyUse::Used;
            }
            _ if key.focus == Focus::Field => return KeyUse::Unused,
            ("d", true, _) => EditorEvent::Duplicated,
            ("a", true, _) => EditorEvent::SelectedAll,
            _ if key.modified => return KeyUse::Unused,
            _ if keys.actions(&key.code, &key.letter).contains(&Action::Edit) => {
                let toggles = KeyUse::Action(PageAction::EditToggle);
                return if key.repeat { KeyUse::Used } else { toggles };
            }
            ("?", ..) => return KeyUse::Action(PageAction::Help),
            ("delete" | "backspace", ..) => EditorEvent::Deleted,
            ("escape", ..) => {
                self.editor.update(ctx.now_ms, EditorEvent::Deselected);
                // The browser closes the menu of templates.
                return KeyUse::when(key.focus != Focus::Button);
            }
            ("tab", _, back) if key.focus == Focus::Elsewhere => {
                return KeyUse::when(self.tab(ctx.now_ms, back));
            }
            ("arrowleft", _, far) => EditorEvent::Nudged { way: -Vec2::X, far },
            ("arrowright", _, far) => EditorEvent::Nudged { way: Vec2::X, far },
            ("arrowup", _, far) => EditorEvent::Nudged { way: Vec2::Y, far },
            ("arrowdown", _, far) => EditorEvent::Nudged { way: -Vec2::Y, far },
            _ => return KeyUse::Unused,
        };
        self.editor.update(ctx.now_ms, deed);
        KeyUse::Used
    }

    /// Selects the next piece; `false` at the end, so that the Tab key moves the focus to the buttons and is never
    /// trapped.
    fn tab(&mut self, now_ms: f64, back: bool) -> bool {
        let editor = &mut self.editor;
        let ends = match back {
            false => editor.doc.sheet.pieces.last(),
            true => editor.doc.sheet.pieces.first(),
        };
        let at_end = ends.is_none_or(|piece| editor.selection.last() == Some(&piece.id));
        editor.update(
            now_ms,
            if at_end { EditorEvent::Deselected } else { EditorEvent::Next { back } },
        );
        !at_end
    }

    /// Stores the text as a draft if it changed.
    pub fn keep_draft(&mut self, storage: &mut Storage) {
        if self.editor.is_held() || self.draft.kept == self.editor.doc.revision {
            return;
        }
        self.draft.kept = self.editor.doc.revision;
        let (origin, base) = (self.draft.origin.as_deref(), self.draft.base.as_deref());
        storage.keep_draft(origin, self.editor.text(), base);
    }

    /// Handles the result of storing a draft. If it was stored under another name, because the text was not derived
    /// from the draft already stored, both drafts remain, and the editor continues with the new one, as the returned
    /// card explains. If the browser could not store it, the editor tries again later and tells the player once.
    pub fn note_draft(
        &mut self,
        ctx: &mut Context,
        draft: Draft,
        kept: Option<Option<String>>,
    ) -> Option<Card> {
        if self.draft.origin != draft.origin {
            return None;
        }
        let Some(origin) = kept else {
            // Losing an empty draft does no harm.
            draft.text.as_ref()?;
            self.draft.kept = self.editor.doc.revision.wrapping_sub(1);
            if !std::mem::replace(&mut self.draft.is_refused, true) {
                self.editor.said = say(NOT_KEPT).to_owned();
            }
            return None;
        };
        self.draft.is_refused = false;
        self.draft.base = draft.text;
        if self.draft.origin == origin {
            return None;
        }
        let name = origin.clone().unwrap_or_default();
        self.draft.origin = origin;
        self.editor.doc.rename(&name);
        ctx.show_hash(self.hash());
        Some(strings::second_draft(&name))
    }

    /// The stored draft of the scene, if the text was not derived from it.
    pub fn other_draft<'a>(&self, storage: &'a Storage) -> Option<&'a str> {
        let kept = storage.draft(self.draft.origin.as_deref())?;
        let is_other = Some(kept) != self.draft.base.as_deref() && kept != self.editor.text();
        is_other.then_some(kept)
    }

    /// Replaces the text with the other draft, as a step that can be undone.
    pub fn take_other_draft(&mut self, storage: &Storage) {
        let Some(text) = self.other_draft(storage).map(str::to_owned) else { return };
        self.draft.base = Some(text.clone());
        let file = self.editor.doc.file.clone();
        self.editor.replace(text, Some(&file));
        self.draft.kept = self.editor.doc.revision;
    }

    /// Asks the server to open a private room with the text.
    fn open_room(&mut self, ctx: &mut Context) {
        if self.opening {
            return;
        }
        if self.playable().is_none() {
            return self.go_to_error(ctx);
        }
        self.opening = true;
        let text = self.editor.text().to_owned();
        ctx.request(Effect::Request(Request::OpenGuest(text)));
    }

    /// Handles the server's refusal to open a room. The returned card says why, unless the error can be shown in the
    /// text.
    pub fn take_refusal(&mut self, sent: &str, refused: Posted) -> Option<Card> {
        let sentence = refused.error.clone().unwrap_or_else(|| strings::SILENCE.to_owned());
        let error = scene_error(refused, &self.editor.doc.file);
        let Some(error) = error.filter(|_| self.editor.text() == sent) else {
            return Some(strings::no_room(&sentence));
        };
        self.editor.doc.refusal = Some(error);
        None
    }

    /// Gives the keyboard focus to the error in the text.
    pub fn go_to_error(&self, ctx: &mut Context) {
        if let Some(at) = self.editor.doc.error_bytes() {
            ctx.request(Effect::FocusText(at.start));
        }
    }

    /// Checks changes to the text and updates the picture.
    pub fn advance(&mut self, canvas: Option<Canvas>) {
        let doc = &mut self.editor.doc;
        if doc.check() && (doc.error.is_none() || doc.scene.is_none()) {
            self.draw_scene();
        }
        let Some(canvas) = canvas else { return };
        let pixel = self.view.advance(canvas, self.editor.doc.world());
        sketch::draw(&self.editor, pixel, &mut self.sketch);
    }

    fn draw_scene(&mut self) {
        self.picture = self.editor.doc.scene.as_ref().map(|scene| {
            let game = Game::new(Arc::clone(scene), self.seed);
            let mut picture = Replica::without_particles(Arc::clone(scene), NO_PLAYER);
            picture.file(Snapshot::capture(&game, Vec::new()), Vec::new());
            picture.advance(0.0, Eye::default());
            picture
        });
        self.copy += 1;
    }

    /// The view of the most recent frame.
    pub fn view(&self) -> &View {
        &self.view.view
    }

    /// The scene as it is before its first tick.
    pub fn picture(&self) -> Option<&Replica> {
        self.picture.as_ref()
    }

    /// The scene to play. If the text is not a valid scene, shows the error.
    pub fn scene_to_play(&mut self, ctx: &mut Context) -> Option<Arc<Scene>> {
        self.keep_draft(&mut ctx.storage);
        let scene = self.playable();
        if scene.is_none() {
            let error = self.editor.doc.error.as_ref();
            self.editor.said = error.map_or(String::new(), |error| error.to_string());
            self.go_to_error(ctx);
        }
        scene
    }

    /// The scene that the text describes, if it is valid.
    fn playable(&mut self) -> Option<Arc<Scene>> {
        self.editor.update(0.0, EditorEvent::Cancelled);
        self.editor.doc.check();
        self.editor.doc.scene.clone().filter(|_| self.editor.doc.error.is_none())
    }

    /// The frame to draw. `time` is the time since the page opened, seconds.
    pub fn frame(&self, time: f32) -> Frame<'_> {
        let picture = self.picture.as_ref();
        Frame {
            view: self.view.view,
            world_size: self.editor.doc.world(),
            room: picture.map_or(&self.empty.0, |picture| &picture.picture.drawn),
            particles: &self.empty.1,
            particle_lead: 0.0,
            time,
            bounds: false,
            calm: true,
            copy: self.copy,
            dimmed: false,
            sketch: Some(&self.sketch),
            ghost: None,
        }
    }
}

/// The editor's view, which is zoomed and moved with the wheel, the middle button or two fingers.
#[derive(Debug)]
struct EditView {
    view: View,
    /// The zoom, where 1 shows the whole scene. `pan` is the offset from the scene's centre, world units.
    zoom: f32,
    pan: Vec2,
    /// The pointers that move the view instead of the scene, with their positions in CSS pixels: a middle button or two
    /// fingers.
    pinch: Vec<(i32, Vec2)>,
    /// The first finger, which joins `pinch` when a second one touches down.
    first_touch: Option<(i32, Vec2)>,
    /// CSS pixels per device pixel.
    css_per_pixel: f32,
}

impl Default for EditView {
    fn default() -> EditView {
        EditView {
            view: View::UNSEEN,
            zoom: 1.0,
            pan: Vec2::ZERO,
            pinch: Vec::new(),
            first_touch: None,
            css_per_pixel: 1.0,
        }
    }
}

impl EditView {
    /// Moves the picture if the pointer controls the view; `false` if it acts on the scene or holds a piece.
    fn point(&mut self, pointer: &Pointer, world: Vec2, is_free: bool) -> bool {
        let here = (pointer.id, pointer.at);
        match pointer.change {
            PointerChange::Down if pointer.button == MIDDLE => self.pinch = vec![here],
            PointerChange::Down if pointer.touch => {
                let first = self.first_touch.replace(here).filter(|first| first.0 != pointer.id);
                // A finger that holds a piece keeps holding it.
                let Some(first) = first.filter(|_| is_free) else {
                    return false;
                };
                self.pinch = vec![first, here];
            }
            PointerChange::Moved => {
                if let Some(first) = self.first_touch.as_mut().filter(|first| first.0 == here.0) {
                    first.1 = here.1;
                }
                let Some(at) = self.pinch.iter().position(|held| held.0 == here.0) else {
                    return false;
                };
                self.css_per_pixel = pointer.canvas.x.max(1.0) / self.view.pixels[0].max(1) as f32;
                let before = self.span();
                self.pinch[at].1 = here.1;
                let after = self.span();
                self.show_at(before.0, after.0, after.1 / before.1, world);
            }
            PointerChange::Up => {
                self.first_touch = None;
                let count = self.pinch.len();
                self.pinch.retain(|held| held.0 != here.0);
                return self.pinch.len() < count;
            }
            _ => return false,
        }
        true
    }

    /// The midpoint of the pointers that move the view, and the distance between them, CSS pixels.
    fn span(&self) -> (Vec2, f32) {
        match self.pinch[..] {
            [(_, one), (_, other)] => ((one + other) * 0.5, (one - other).length().max(1.0)),
            [(_, one), ..] => (one, 1.0),
            [] => (Vec2::ZERO, 1.0),
        }
    }

    /// Zooms around a point on the canvas, CSS pixels.
    fn zoom(&mut self, at: Vec2, factor: f32, world: Vec2) {
        self.show_at(at, at, factor, world);
    }

    /// Zooms by a factor and moves the world point at `from` to `to`, CSS pixels.
    fn show_at(&mut self, from: Vec2, to: Vec2, factor: f32, world: Vec2) {
        let point = self.view.to_world(from / self.css_per_pixel);
        let zoom = (self.zoom * factor).clamp(1.0, ZOOM_MAX);
        self.view.height *= self.zoom / zoom;
        self.zoom = zoom;
        let by = point - self.view.to_world(to / self.css_per_pixel);
        // The whole scene is centred; when zoomed in, the view stays within its edges.
        let most = world * (0.5 - 0.5 / zoom);
        let pan = (self.pan + by).clamp(-most, most);
        self.view.center += pan - self.pan;
        self.pan = pan;
    }

    fn hand(&mut self, pointer: &Pointer) -> EditPointer {
        let pixels = self.view.pixels[0].max(1) as f32;
        self.css_per_pixel = pointer.canvas.x.max(1.0) / pixels;
        let step = self.view.unit_per_pixel() / self.css_per_pixel;
        let Vec2 { x, y } = pointer.at;
        EditPointer {
            id: pointer.id,
            at: self.view.to_world(pointer.at / self.css_per_pixel),
            inside: x >= 0.0 && y >= 0.0 && x <= pointer.canvas.x && y <= pointer.canvas.y,
            reach: step * if pointer.touch { FINGER_CSS } else { MOUSE_CSS },
            step,
            adds: pointer.shift,
            free: pointer.alt,
        }
    }

    /// Updates the view and returns the size of a CSS pixel in world units.
    fn advance(&mut self, canvas: Canvas, world: Vec2) -> f32 {
        let Canvas { pixels, top, bottom, css_width } = canvas;
        self.css_per_pixel = css_width as f32 / pixels[0] as f32;
        let mut camera = Camera::new(CameraRule::Fit, world);
        self.view = camera.view(Target { pixels, hero: None, top, bottom, elapsed_s: 0.0 });
        self.view.height /= self.zoom;
        self.view.center += self.pan;
        self.view.unit_per_pixel() / self.css_per_pixel.max(f32::MIN_POSITIVE)
    }
}
