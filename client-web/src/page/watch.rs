//! A replay on the page: fetched or dropped, then a film with its camera. No server is needed once
//! its bytes are here.

use super::app::App;
use super::deck::Deck;
use super::http::{self, Fetched};
use super::play::Canvas;
use super::{app, dom, modal, notice};
use crate::api;
use crate::camera::Camera;
use crate::film::{Film, FilmError};
use crate::frame::{Frame, View};
use crate::layers::Layer;
use crate::meter::Meter;
use crate::words::{self, Notice};
use jostle_protocol::replay::{Ending, Problem};
use jostle_sim::{Seat, Vec2};

/// Time that a frame may take to go on with a seek, milliseconds.
const SEEK_MS: f64 = 11.0;
/// Time that a frame may take to play, milliseconds; past it the film runs slower.
const PLAY_MS: f64 = 12.0;
/// Time that a frame may take to compare what is not watched yet, milliseconds.
const AHEAD_MS: f64 = 3.0;
/// The same while the film stands still.
const AHEAD_STILL_MS: f64 = 8.0;
/// A frame that came later than this came after a pause that nobody watched, seconds.
const FRAME_S_MAX: f64 = 0.25;

/// What becomes of a replay that the page was asked for.
pub enum Screening {
    /// It is on its way.
    Fetching(String),
    /// It did not come; a card says why.
    Failed,
    /// It is being watched.
    On(Box<Watch>),
}

/// A film that is being watched.
pub struct Watch {
    /// The film.
    pub film: Film,
    /// Its name on the server, if it came from there.
    pub name: Option<String>,
    /// The name of its file, if it did not.
    pub file: String,
    /// Its controls.
    pub deck: Deck,
    /// Figures of drawing.
    pub meter: Meter,
    camera: Camera,
    /// What the camera was made for, and the last jump that it saw.
    aimed: (Option<Seat>, bool, u32),
    view: View,
    framed_ms: f64,
    drawn: Option<Drawn>,
}

/// All that a drawn frame depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drawn {
    playhead: f64,
    jumps: u32,
    view: View,
    bounds: bool,
    followed: Option<Seat>,
}

impl Watch {
    fn new(film: Film, name: Option<String>, file: String) -> Watch {
        Watch {
            camera: film.camera(),
            aimed: (None, false, 0),
            name,
            file,
            deck: Deck::default(),
            meter: Meter::default(),
            view: View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] },
            framed_ms: dom::now_ms(),
            drawn: None,
            film,
        }
    }

    /// The view of the last frame.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Brings film and camera to `now_ms`.
    pub fn advance(&mut self, now_ms: f64, canvas: Option<Canvas>) {
        let elapsed_s = ((now_ms - self.framed_ms) / 1000.0).clamp(0.0, FRAME_S_MAX);
        self.framed_ms = now_ms;
        if self.film.is_seeking() {
            self.film.work(within(SEEK_MS));
        } else {
            // Nothing is missed while a card is read.
            if modal::top() == Layer::Page {
                self.film.advance(elapsed_s, within(PLAY_MS));
            }
            let ahead_ms = if self.film.is_playing() { AHEAD_MS } else { AHEAD_STILL_MS };
            self.film.look_ahead(within(ahead_ms));
        }
        if let Some(canvas) = canvas {
            self.look(canvas, elapsed_s as f32);
        }
    }

    fn look(&mut self, canvas: Canvas, elapsed_s: f32) {
        let there = self.film.followed_hero().is_some();
        let aimed = (self.film.followed(), there, self.film.jumps());
        if self.aimed != aimed {
            self.aimed = aimed;
            self.camera = self.film.camera();
        }
        let Canvas { pixels, bottom } = canvas;
        // What moves faster is followed faster.
        let elapsed_s = elapsed_s * self.film.speed().max(1.0) as f32;
        self.view = self.film.view(&mut self.camera, pixels, bottom, elapsed_s);
    }

    /// What to draw, if it is not what was drawn last.
    pub fn picture(&mut self, calm: bool) -> Option<Frame<'_>> {
        let now = Drawn {
            playhead: self.film.playhead(),
            jumps: self.film.jumps(),
            view: self.view,
            bounds: self.film.bounds(),
            followed: self.film.followed(),
        };
        if self.drawn == Some(now) {
            return None;
        }
        self.drawn = Some(now);
        Some(Frame { calm, ..self.film.frame(self.view) })
    }

    /// What was drawn is gone, or never got there.
    pub fn forget_drawn(&mut self) {
        self.drawn = None;
    }
}

/// `true` until so many milliseconds from now.
fn within(milliseconds: f64) -> impl FnMut() -> bool {
    let end = dom::now_ms() + milliseconds;
    move || dom::now_ms() < end
}

impl App {
    /// Gets the replay of a name from the server.
    pub fn fetch_replay(&mut self, name: &str) {
        self.screening = Some(Screening::Fetching(name.to_owned()));
        let name = name.to_owned();
        http::fetch(&api::replay_file(&name), move |fetched| {
            app::with(|app| app.take_fetched(&name, fetched));
        });
    }

    fn take_fetched(&mut self, name: &str, fetched: Fetched) {
        let awaited = |s: &Screening| matches!(s, Screening::Fetching(other) if other == name);
        if !self.screening.as_ref().is_some_and(awaited) {
            return;
        }
        let (notice, detail) = match fetched {
            Fetched::Bytes(bytes) => {
                return self.open_replay(Some(name.to_owned()), String::new(), bytes);
            }
            Fetched::Refused(404) => (words::NO_SUCH_REPLAY, format!("/replay/{name}")),
            Fetched::Refused(status) => (words::REPLAY_REFUSED, format!("HTTP status {status}")),
            Fetched::Nothing => (words::REPLAY_REFUSED, String::new()),
        };
        self.screening = Some(Screening::Failed);
        self.show_card(notice, detail);
    }

    /// Watches a replay, or says why that cannot be.
    pub fn open_replay(&mut self, name: Option<String>, file: String, bytes: Vec<u8>) {
        match Film::open(bytes) {
            Ok(film) => {
                self.end_play();
                let cut = cut(&film);
                let mut watch = Watch::new(film, name, file);
                watch.deck.adopt(&watch.film, watch.name.as_deref(), &watch.file);
                watch.film.play();
                self.screening = Some(Screening::On(Box::new(watch)));
                self.drawn_frames = 0;
                self.show_state();
                let _ = dom::by_id::<web_sys::HtmlElement>("stage").focus();
                if let Some((notice, text, detail)) = cut {
                    self.show_card_saying(notice, &text, detail);
                }
            }
            Err(error) => self.refuse_replay(&error),
        }
    }

    /// Says why a file cannot be watched. What is being watched stays.
    pub fn refuse_replay(&mut self, error: &FilmError) {
        let watching = self.watch().is_some();
        if !watching && self.screening.is_some() {
            self.screening = Some(Screening::Failed);
        }
        let notice = words::bad_replay(error.title(), error.advice(), watching);
        self.show_card(notice, error.to_string());
    }

    fn show_card(&mut self, notice: Notice, detail: String) {
        self.show_card_saying(notice, notice.text, detail);
    }

    fn show_card_saying(&mut self, notice: Notice, text: &str, detail: String) {
        self.card = Some(notice);
        notice::show_saying(&notice, text, &detail);
        self.show_state();
    }

    /// The film that is on.
    pub fn watch(&self) -> Option<&Watch> {
        match &self.screening {
            Some(Screening::On(watch)) => Some(watch),
            _ => None,
        }
    }

    /// The film that is on.
    pub fn watch_mut(&mut self) -> Option<&mut Watch> {
        match &mut self.screening {
            Some(Screening::On(watch)) => Some(watch),
            _ => None,
        }
    }
}

/// Works on the film that is on.
pub fn with_film(work: impl FnOnce(&mut Film)) {
    app::with(|app| app.watch_mut().map(|watch| work(&mut watch.film)));
}

/// What to say of a film that ends too early. One that just was not ended may still be recorded:
/// that is a note and no card.
fn cut(film: &Film) -> Option<(Notice, String, String)> {
    let Ending::Cut(error) = film.ending() else { return None };
    let ticks = film.last_tick() - film.first_tick();
    let loses = error.problem != Problem::NoEnd;
    loses.then(|| (words::REPLAY_CUT, words::cut_at(ticks), error.to_string()))
}
