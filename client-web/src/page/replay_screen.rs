//! A replay on the page, which is fetched or dropped and then played with a separate camera. Once its bytes are loaded,
//! it needs no server.

use crate::net::meter::Meter;
use crate::net::report::Fetched;
use crate::page::dialogs::Layer;
use crate::page::event::{Canvas, Event, Focus, Key};
use crate::page::game::stalled;
use crate::page::page_action::{KeyUse, PageAction};
use crate::page::strings::{self, Card};
use crate::replay::player::ReplayPlayer;
use crate::sound::cue::Cue;
use crate::view::camera::Camera;
use crate::view::frame::{Frame, View};
use jostle_game::Seat;
use jostle_protocol::replay::{Problem, ReplayReader};
use jostle_sim::TICKS_PER_SECOND;

/// Maximum time per frame for reading a file, milliseconds.
const READ_MS: f64 = 8.0;
/// Maximum time per frame for seeking, milliseconds.
const SEEK_MS: f64 = 11.0;
/// Maximum time per frame for playing, milliseconds. Beyond it the replay runs slower.
const PLAY_MS: f64 = 12.0;
/// Maximum time per frame for comparing hashes ahead of the playhead, milliseconds.
const AHEAD_MS: f64 = 3.0;
/// Like [`AHEAD_MS`], but while the replay is paused.
const AHEAD_STILL_MS: f64 = 8.0;
/// Maximum time between frames that is played back, seconds. A longer gap means that the page was hidden.
const FRAME_S_MAX: f64 = 0.25;

/// Number of ticks skipped by an arrow key.
const SKIP_TICKS: i64 = TICKS_PER_SECOND as i64;

/// The bytes of a requested replay, or a card that says why there are none.
pub fn bytes_of(file: &str, fetched: Fetched) -> Result<Vec<u8>, Card> {
    let (card, detail) = match fetched {
        Fetched::Bytes(bytes) => return Ok(bytes),
        Fetched::Refused(404) => (strings::NO_SUCH_REPLAY, file.to_owned()),
        Fetched::Refused(status) => (strings::REPLAY_REFUSED, format!("HTTP status {status}")),
        Fetched::Nothing => (strings::REPLAY_REFUSED, String::new()),
    };
    Err(Card { detail, ..card })
}

/// A replay that is being read in slices, one per frame. The previous picture stays until the replay is ready.
pub struct Opening {
    pub reader: ReplayReader,
    /// As in [`OpenReplay`].
    pub name: Option<String>,
    pub file: String,
}

impl Opening {
    /// Continues reading within a frame's time budget; returns whether reading is complete.
    pub fn read_on(&mut self, clock: fn() -> f64) -> bool {
        let mut more = within(clock, READ_MS);
        while self.reader.step() {
            if !more() {
                return false;
            }
        }
        true
    }
}

/// A replay that is being watched.
pub struct OpenReplay {
    pub player: ReplayPlayer,
    /// The replay's name, if the page's address refers to it.
    pub name: Option<String>,
    /// The name of the replay's file, if it is a local one.
    pub file: String,
    pub meter: Meter,
    camera: Camera,
    /// The camera's subject and the last jump that it followed.
    aimed: (Option<Seat>, bool, u32),
    /// The view of the most recent frame.
    pub view: View,
    framed_ms: f64,
    /// The duration of a frame that was too long, milliseconds. The replay has been paused since then.
    pub stalled_ms: Option<f64>,
    /// The frame on the canvas.
    pub drawn: Option<Drawn>,
    /// The number of jumps when news was last read.
    news_jumps: u32,
    /// The number of jumps when cues were last taken.
    cue_jumps: u32,
}

/// Everything on which a drawn frame depends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    playhead: f64,
    jumps: u32,
    view: View,
    bounds: bool,
    followed: Option<Seat>,
}

/// Creates a function that returns `true` for this many milliseconds.
fn within(clock: fn() -> f64, milliseconds: f64) -> impl FnMut() -> bool {
    let end = clock() + milliseconds;
    move || clock() < end
}

impl OpenReplay {
    /// Starts playing a replay.
    pub fn new(mut player: ReplayPlayer, name: Option<String>, file: String, now_ms: f64) -> Self {
        player.play();
        OpenReplay {
            camera: player.camera(),
            aimed: (None, false, 0),
            name,
            file,
            meter: Meter::default(),
            view: View::UNSEEN,
            framed_ms: now_ms,
            stalled_ms: None,
            drawn: None,
            news_jumps: 0,
            cue_jumps: 0,
            player,
        }
    }

    /// Handles an event that concerns only the replay.
    pub fn update(&mut self, now_ms: f64, event: Event) {
        match event {
            Event::Drawn(drawn) => self.note_drawn(drawn, now_ms),
            Event::SeekChosen(tick) => self.player.aim(tick),
            Event::SpeedChosen(speed) => self.player.set_speed(speed),
            Event::ContextLost => self.drawn = None,
            _ => {}
        }
    }

    /// Performs the action of a button.
    pub fn click(&mut self, action: PageAction, value: &str) {
        let player = &mut self.player;
        match action {
            PageAction::PlayPause => player.toggle(),
            PageAction::Step => player.step_by(value.parse().unwrap_or(0)),
            PageAction::Follow => {
                value.parse().into_iter().for_each(|seat| player.toggle_follow(Seat(seat)));
            }
            PageAction::Bounds => player.toggle_bounds(),
            _ => {}
        }
    }

    pub fn key_down(&mut self, top: Layer, key: &Key) -> KeyUse {
        match (key.code.as_str(), key.letter.as_str()) {
            ("F2", _) if !key.repeat => KeyUse::Action(PageAction::Bounds),
            (_, "?") if !key.repeat => KeyUse::Action(PageAction::Help),
            ("Escape", _) if top == Layer::Help => KeyUse::Action(PageAction::Help),
            _ if key.modified || top != Layer::Page || is_used_by_focus(key) => KeyUse::Unused,
            (_, " " | "m" | "M") if key.repeat => KeyUse::Used,
            (_, "m" | "M") => KeyUse::Action(PageAction::Mute),
            (_, letter) => KeyUse::when(self.control(letter)),
        }
    }

    /// Performs the action of the key with this letter; `false` if it has none.
    fn control(&mut self, letter: &str) -> bool {
        let player = &mut self.player;
        match letter {
            " " => player.toggle(),
            "," => player.step_by(-1),
            "." => player.step_by(1),
            "ArrowLeft" => player.skip(-SKIP_TICKS),
            "ArrowRight" => player.skip(SKIP_TICKS),
            "ArrowUp" => player.shift_speed(true),
            "ArrowDown" => player.shift_speed(false),
            "Home" => player.aim(player.first_tick()),
            "End" => player.aim(player.last_tick()),
            "g" => player.skip_to_goal(true),
            "G" => player.skip_to_goal(false),
            "0" => player.follow(None),
            digit => match digit.parse::<usize>() {
                Ok(number @ 1..) => {
                    let seat = player.players().get(number - 1).map(|player| player.seat);
                    seat.into_iter().for_each(|seat| player.toggle_follow(seat));
                }
                _ => return false,
            },
        }
        true
    }

    /// Advances the replay and its camera to `now_ms`. `plays` is false while a dialog is open that must be answered
    /// first.
    pub fn advance(
        &mut self,
        now_ms: f64,
        canvas: Option<Canvas>,
        plays: bool,
        clock: fn() -> f64,
    ) {
        let elapsed_s = ((now_ms - self.framed_ms) / 1000.0).clamp(0.0, FRAME_S_MAX);
        self.framed_ms = now_ms;
        let began_ms = clock();
        if self.stalled_ms.is_some() {
            // The player decides whether it continues.
        } else if self.player.is_seeking() {
            self.player.work(within(clock, SEEK_MS));
        } else {
            if plays {
                self.player.advance(elapsed_s, within(clock, PLAY_MS));
            }
            let ahead_ms = if self.player.playing { AHEAD_MS } else { AHEAD_STILL_MS };
            self.player.look_ahead(within(clock, ahead_ms));
        }
        self.stalled_ms = self.stalled_ms.or(stalled(clock() - began_ms));
        if let Some(canvas) = canvas {
            self.aim(canvas, elapsed_s as f32);
        }
    }

    fn aim(&mut self, canvas: Canvas, elapsed_s: f32) {
        let there = self.player.followed_hero().is_some();
        let aimed = (self.player.followed, there, self.player.jumps);
        if self.aimed != aimed {
            self.aimed = aimed;
            self.camera = self.player.camera();
        }
        let Canvas { pixels, bottom, .. } = canvas;
        // The camera adapts to the replay's speed.
        let elapsed_s = elapsed_s * self.player.speed.max(1.0) as f32;
        self.view = self.player.view(&mut self.camera, pixels, bottom, elapsed_s);
    }

    /// The frame to draw; `None` if it is already on the canvas.
    pub fn frame(&self, calm: bool) -> Option<Frame<'_>> {
        let changed = self.drawn != Some(self.shown());
        changed.then(|| Frame { calm, ..self.player.frame(self.view) })
    }

    fn shown(&self) -> Drawn {
        Drawn {
            playhead: self.player.playhead,
            jumps: self.player.jumps,
            view: self.view,
            bounds: self.player.bounds(),
            followed: self.player.followed,
        }
    }

    /// Records whether the frame was drawn.
    fn note_drawn(&mut self, drawn: bool, now_ms: f64) {
        self.drawn = drawn.then(|| self.shown());
        if drawn {
            self.meter.drawn(now_ms);
        }
    }

    /// Whether the playhead has jumped since the previous call, which makes earlier news irrelevant.
    pub fn has_jumped(&mut self) -> bool {
        std::mem::replace(&mut self.news_jumps, self.player.jumps) != self.player.jumps
    }

    /// Takes the sound cues reported since the previous call. Only a replay in real time has sound: when faster, a
    /// second would contain the sounds of eight, and when slower, tones would not match the picture. Single steps and
    /// seeks show moments, which have no sound.
    pub fn take_cues(&mut self) -> Vec<Cue> {
        let player = &mut self.player;
        let cues = std::iter::from_fn(|| player.next_cue()).collect();
        let has_jumped = std::mem::replace(&mut self.cue_jumps, player.jumps) != player.jumps;
        let is_heard = player.playing && player.speed == 1.0 && !player.is_seeking();
        if is_heard && !has_jumped { cues } else { Vec::new() }
    }

    /// The card for a truncated replay. A replay that merely lacks an end record may still be in progress; a hint says
    /// so instead.
    pub fn cut(&self) -> Option<Card> {
        let error = self.player.ending().error()?;
        let ticks = self.player.last_tick() - self.player.first_tick();
        (error.problem != Problem::NoEnd).then(|| strings::cut_replay(ticks, &error))
    }
}

/// Whether the focused element itself uses a key.
fn is_used_by_focus(key: &Key) -> bool {
    let letter = key.letter.as_str();
    match key.focus {
        Focus::Button => matches!(letter, " " | "Enter"),
        Focus::Field => {
            let moves = letter.starts_with("Arrow") || letter.starts_with("Page");
            moves || matches!(letter, "Home" | "End")
        }
        Focus::Elsewhere => false,
    }
}
