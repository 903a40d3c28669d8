//! The editor on the page: the editor itself, and the picture of its scene before the first tick.

use crate::editor::hand::Hand;
use crate::editor::sketch;
use crate::editor::state::Editor;
use crate::editor::update::Deed;
use crate::page::event::{Canvas, Pointer, PointerChange};
use crate::view::camera::{Camera, Target};
use crate::view::frame::{Frame, FrameRoom, Sketch, View};
use crate::world::replica::{Eye, Replica};
use jostle_game::scene::Camera as CameraRule;
use jostle_game::{Game, Scene, Seat};
use jostle_protocol::Snapshot;
use jostle_sim::{Particles, Vec2};
use std::sync::Arc;

/// Seed of the games that are played of a scene that is edited: the same each time.
pub const SEED: u64 = 1;
/// A seat without a player.
const NO_PLAYER: Seat = Seat(u16::MAX);
/// Reach of a mouse and of a finger, CSS pixels.
const MOUSE_CSS: f32 = 12.0;
const FINGER_CSS: f32 = 22.0;
/// The scene is shown so much larger than as a whole, at most.
const ZOOM_MAX: f32 = 16.0;
/// The browser's number of the middle button.
const MIDDLE: i16 = 1;

/// The editor of one scene.
pub struct EditScreen {
    pub editor: Editor,
    /// Name of the shipped scene that it began with.
    pub origin: Option<String>,
    /// Seed of the games that are played of it.
    pub seed: u64,
    /// The scene at tick 0; of the last text that was a scene.
    picture: Option<Replica>,
    /// Number of the picture.
    copy: u32,
    sketch: Sketch,
    /// A picture without a scene.
    empty: (FrameRoom, Particles),
    pub view: View,
    /// How much larger than as a whole the scene is shown, and how far from its middle, world units.
    zoom: f32,
    pan: Vec2,
    /// Pointers that move the picture, not the scene, and where they are, CSS pixels: a middle button, or two fingers.
    pinch: Vec<(i32, Vec2)>,
    /// The finger that went down first, which becomes one of them.
    first_touch: Option<(i32, Vec2)>,
    /// CSS pixels a device pixel.
    css_per_pixel: f32,
    /// Revision of the text that was kept for the next visit.
    pub kept: u32,
    /// The browser did not take the last draft, and the visitor was told.
    pub is_refused: bool,
    /// The kept draft that the text was made from.
    pub base: Option<String>,
    /// The player wants to play it although it may be too heavy for the page.
    pub may_be_heavy: bool,
    /// A room with it is being opened.
    pub opening: bool,
}

impl EditScreen {
    pub fn new(editor: Editor, origin: Option<String>, seed: u64) -> EditScreen {
        let kept = editor.doc.revision;
        let mut screen = EditScreen {
            editor,
            origin,
            seed,
            picture: None,
            copy: 0,
            sketch: Sketch::default(),
            empty: (FrameRoom::default(), Particles::new(Vec::new(), 0)),
            view: View::UNSEEN,
            zoom: 1.0,
            pan: Vec2::ZERO,
            pinch: Vec::new(),
            first_touch: None,
            css_per_pixel: 1.0,
            kept,
            is_refused: false,
            base: None,
            may_be_heavy: false,
            opening: false,
        };
        screen.draw_scene();
        screen
    }

    /// The part of the address after `#` under which it is edited.
    pub fn hash(&self) -> String {
        self.origin.as_ref().map_or("#edit".to_owned(), |origin| format!("#edit={origin}"))
    }

    /// Does something to the scene.
    pub fn update(&mut self, now_ms: f64, deed: Deed) {
        self.editor.update(now_ms, deed);
    }

    /// Does what a pointer over the canvas means.
    pub fn point(&mut self, now_ms: f64, pointer: &Pointer) {
        if self.move_picture(now_ms, pointer) {
            return;
        }
        let hand = self.hand(pointer);
        let deed = match pointer.change {
            PointerChange::Down => Deed::Down(hand),
            PointerChange::Moved => Deed::Moved(hand),
            PointerChange::Up => Deed::Up(hand),
            PointerChange::Left => return,
        };
        self.update(now_ms, deed);
    }

    /// Moves the picture if a pointer is to; `false` if the pointer is for the scene.
    fn move_picture(&mut self, now_ms: f64, pointer: &Pointer) -> bool {
        let here = (pointer.id, pointer.at);
        match pointer.change {
            PointerChange::Down if pointer.button == MIDDLE => self.pinch = vec![here],
            PointerChange::Down if pointer.touch => {
                let first = self.first_touch.replace(here).filter(|first| first.0 != pointer.id);
                // A finger that holds a piece keeps it.
                let Some(first) = first.filter(|_| self.editor.holds_nothing()) else {
                    return false;
                };
                self.update(now_ms, Deed::Cancelled);
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
                self.show_at(before.0, after.0, after.1 / before.1);
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

    /// The middle of the pointers that move the picture, and their distance, CSS pixels.
    fn span(&self) -> (Vec2, f32) {
        match self.pinch[..] {
            [(_, one), (_, other)] => ((one + other) * 0.5, (one - other).length().max(1.0)),
            [(_, one), ..] => (one, 1.0),
            [] => (Vec2::ZERO, 1.0),
        }
    }

    /// Zooms at a point of the canvas, CSS pixels.
    pub fn zoom(&mut self, at: Vec2, factor: f32) {
        self.show_at(at, at, factor);
    }

    /// Shows the world point that was at `from` at `to`, CSS pixels, and everything larger by a factor.
    fn show_at(&mut self, from: Vec2, to: Vec2, factor: f32) {
        let point = self.view.to_world(from / self.css_per_pixel);
        let zoom = (self.zoom * factor).clamp(1.0, ZOOM_MAX);
        self.view.height *= self.zoom / zoom;
        self.zoom = zoom;
        let by = point - self.view.to_world(to / self.css_per_pixel);
        // As a whole it is in the middle, and its edges come no further than there.
        let most = self.editor.doc.world() * (0.5 - 0.5 / zoom);
        let pan = (self.pan + by).clamp(-most, most);
        self.view.center += pan - self.pan;
        self.pan = pan;
    }

    fn hand(&mut self, pointer: &Pointer) -> Hand {
        let pixels = self.view.pixels[0].max(1) as f32;
        self.css_per_pixel = pointer.canvas.x.max(1.0) / pixels;
        let step = self.view.unit_per_pixel() / self.css_per_pixel;
        let Vec2 { x, y } = pointer.at;
        Hand {
            id: pointer.id,
            at: self.view.to_world(pointer.at / self.css_per_pixel),
            inside: x >= 0.0 && y >= 0.0 && x <= pointer.canvas.x && y <= pointer.canvas.y,
            reach: step * if pointer.touch { FINGER_CSS } else { MOUSE_CSS },
            step,
            adds: pointer.shift,
            free: pointer.alt,
        }
    }

    /// Checks what was typed or dragged, and brings the picture to the present.
    pub fn advance(&mut self, canvas: Option<Canvas>) {
        if self.editor.doc.check() && self.editor.doc.error.is_none() {
            self.draw_scene();
        }
        let Some(Canvas { pixels, top, bottom, css_width }) = canvas else { return };
        self.css_per_pixel = css_width as f32 / pixels[0] as f32;
        let mut camera = Camera::new(CameraRule::Fit, self.editor.doc.world());
        self.view = camera.view(Target { pixels, hero: None, top, bottom, elapsed_s: 0.0 });
        self.view.height /= self.zoom;
        self.view.center += self.pan;
        let pixel = self.view.unit_per_pixel() / self.css_per_pixel.max(f32::MIN_POSITIVE);
        sketch::draw(&self.editor, pixel, &mut self.sketch);
    }

    fn draw_scene(&mut self) {
        let Some(scene) = &self.editor.doc.scene else { return };
        let game = Game::new(Arc::clone(scene), self.seed);
        let mut picture = Replica::without_particles(Arc::clone(scene), NO_PLAYER);
        picture.file(Snapshot::capture(&game, Vec::new()), Vec::new());
        picture.advance(0.0, Eye::default());
        self.picture = Some(picture);
        self.copy += 1;
    }

    /// The scene before its first tick.
    pub fn picture(&self) -> Option<&Replica> {
        self.picture.as_ref()
    }

    /// The scene to play, if the text is one.
    pub fn playable(&mut self) -> Option<Arc<Scene>> {
        self.editor.update(0.0, Deed::Cancelled);
        self.editor.doc.check();
        self.editor.doc.scene.clone().filter(|_| self.editor.doc.error.is_none())
    }

    /// The frame to draw. `time` is the page's age in seconds.
    pub fn frame(&self, time: f32) -> Frame<'_> {
        let picture = self.picture.as_ref();
        Frame {
            view: self.view,
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
