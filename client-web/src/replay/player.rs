//! A replay that is being watched. It is simulated again tick by tick, drawn like a live game, and supports pausing,
//! seeking and different speeds.
//!
//! The picture at a tick depends only on the replay and that tick, not on how it was reached. Flashes and springs are
//! rebuilt by playing the preceding [`LEAD_TICKS`] without showing them.

use super::chapters::Chapters;
use super::checks::Checks;
use super::display::ReplayDisplay;
use super::error::ReplayLoadError;
use crate::sound::cue::Cue;
use crate::view::camera::{Camera, Target, watching_camera};
use crate::view::frame::{Frame, View};
use crate::world::replica::{News, Replica};
use jostle_game::{Scene, Seat, Tools};
use jostle_protocol::PlayerState;
use jostle_protocol::replay::{Ending, Replay};
use jostle_room::{Playback, PlaybackError};
use jostle_sim::{Particles, TICKS_PER_SECOND, Vec2};
use std::sync::Arc;

/// Number of ticks played, but not shown, before the target of a jump: twice as long as any drawn effect lasts.
pub const LEAD_TICKS: u32 = 120;
/// Selectable speeds, as multiples of real time.
pub const SPEEDS: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// A replay that is being watched.
pub struct ReplayPlayer {
    pub(super) playback: Playback,
    pub(super) display: ReplayDisplay,
    /// The results of comparing the recorded hashes.
    pub checks: Checks,
    /// Joins, leaves, bursts and round events found so far.
    pub chapters: Chapters,
    /// The tick on display, fractional while playing. The game is at the next whole tick.
    pub playhead: f64,
    pub playing: bool,
    /// The speed as a multiple of real time, one of [`SPEEDS`].
    pub speed: f64,
    pub(super) seek: Option<Seek>,
    /// The target of the next seek, which starts once the current one is done.
    pub(super) wish: Option<u32>,
    /// The number of times the displayed moment jumped; cameras cut on a change.
    pub jumps: u32,
    /// The player that the view follows.
    pub followed: Option<Seat>,
    pub(super) bounds_toggled: bool,
    /// Why the replay ends before the last recorded tick, and at which tick.
    pub(super) trouble: Option<(u32, PlaybackError)>,
}

/// A seek in progress.
pub(super) struct Seek {
    pub goal: u32,
    /// The tick at which the seek started playing.
    pub begin: u32,
    /// The display rebuilt for the goal; `None` if the seek merely continues the current one.
    pub rebuilt: Option<Rebuilt>,
}

/// The display being rebuilt for the goal of a seek.
pub(super) struct Rebuilt {
    /// The tick at which the lead begins.
    pub lead: u32,
    /// The new display, starting with the lead.
    pub display: Option<ReplayDisplay>,
    /// The particles shown in the meantime.
    pub particles: Particles,
    /// The matching [`crate::view::frame::Frame::particle_lead`].
    pub particle_lead: f32,
}

impl Seek {
    /// The number of ticks left to play.
    pub(super) fn left(&self, playback: &Playback) -> u32 {
        self.goal.saturating_sub(playback.tick())
    }
}

impl ReplayPlayer {
    /// Opens a replay at its beginning. The readable part of a truncated file can be watched; see
    /// [`ReplayPlayer::ending`].
    pub fn open(bytes: Vec<u8>) -> Result<ReplayPlayer, ReplayLoadError> {
        ReplayPlayer::new(Replay::read(bytes)?)
    }

    /// Opens a replay that has already been read.
    pub fn new(replay: Replay) -> Result<ReplayPlayer, ReplayLoadError> {
        let playback = Playback::new(Arc::new(replay))?;
        let checks = Checks::new(&playback);
        let mut film = ReplayPlayer {
            display: ReplayDisplay::begin(&playback),
            checks,
            chapters: Chapters::default(),
            playhead: f64::from(playback.tick()),
            playback,
            playing: false,
            speed: 1.0,
            seek: None,
            wish: None,
            jumps: 0,
            followed: None,
            bounds_toggled: false,
            trouble: None,
        };
        film.show();
        Ok(film)
    }

    pub fn replay(&self) -> &Arc<Replay> {
        self.playback.replay()
    }

    pub fn scene(&self) -> &Arc<Scene> {
        self.playback.game().scene()
    }

    /// The replica of the displayed room.
    pub fn replica(&self) -> &Replica {
        &self.display.replica
    }

    /// The next unread news item.
    pub fn next_news(&mut self) -> Option<News> {
        self.display.replica.news.pop_front()
    }

    /// Takes the next sound cue.
    pub fn next_cue(&mut self) -> Option<Cue> {
        self.display.replica.next_cue()
    }

    /// How the file ends.
    pub fn ending(&self) -> Ending {
        self.replay().ending()
    }

    /// Why the replay cannot be played to its last recorded tick, once that is known.
    pub fn trouble(&self) -> Option<&PlaybackError> {
        self.trouble.as_ref().map(|(_, error)| error)
    }

    /// The tick before the first recorded one.
    pub fn first_tick(&self) -> u32 {
        self.replay().first_tick()
    }

    /// The last tick that can be shown.
    pub fn last_tick(&self) -> u32 {
        self.trouble.as_ref().map_or(self.replay().last_tick(), |&(tick, _)| tick)
    }

    /// The whole tick on display, to which [`ReplayPlayer::hash`] refers.
    pub fn tick(&self) -> u32 {
        self.playhead.ceil() as u32
    }

    /// The state hash at [`ReplayPlayer::tick`]; `None` during a seek.
    pub fn hash(&self) -> Option<u64> {
        (!self.is_seeking()).then(|| self.playback.game().hash())
    }

    /// Whether the replay is at its last tick.
    pub fn is_at_end(&self) -> bool {
        !self.is_seeking() && self.tick() >= self.last_tick()
    }

    /// Plays, restarting from the beginning if at the end.
    pub fn play(&mut self) {
        if self.is_at_end() {
            self.aim(self.first_tick());
        }
        self.playing = self.last_tick() > self.first_tick();
    }

    pub fn toggle(&mut self) {
        if self.playing { self.pause() } else { self.play() }
    }

    /// Pauses at the next whole tick.
    pub fn pause(&mut self) {
        self.playing = false;
        if !self.is_seeking() {
            self.playhead = self.playhead.ceil();
            self.show();
        }
    }

    /// Sets the speed to the nearest of [`SPEEDS`].
    pub fn set_speed(&mut self, speed: f64) {
        let apart = |offered: &f64| (offered - speed).abs();
        let nearest = SPEEDS.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        self.speed = nearest.unwrap_or(1.0);
    }

    /// Sets the speed to the next higher or lower of [`SPEEDS`].
    pub fn shift_speed(&mut self, faster: bool) {
        let now = SPEEDS.iter().position(|&speed| speed == self.speed).unwrap_or(3);
        let next = if faster { now + 1 } else { now.saturating_sub(1) };
        self.speed = SPEEDS[next.min(SPEEDS.len() - 1)];
    }

    /// Follows a player, or shows the whole world if that player is already followed.
    pub fn toggle_follow(&mut self, seat: Seat) {
        self.follow(Some(seat).filter(|_| self.followed != Some(seat)));
    }

    /// Follows a player, or shows the whole world.
    pub fn follow(&mut self, seat: Option<Seat>) {
        self.followed = seat;
        self.show();
    }

    /// Whether outlines are drawn. They are on by default in scenes in which the player selects bodies.
    pub fn bounds(&self) -> bool {
        self.scene().tools.contains(Tools::SELECT) != self.bounds_toggled
    }

    /// Shows or hides the outlines.
    pub fn toggle_bounds(&mut self) {
        self.bounds_toggled = !self.bounds_toggled;
        self.show();
    }

    /// Plays one tick into the current or rebuilt display; `false` at the end.
    pub(super) fn step(&mut self) -> bool {
        let played = match self.playback.step() {
            Ok(Some(played)) => played,
            Ok(None) => return false,
            Err(error) => {
                self.fail(error);
                return false;
            }
        };
        self.checks.note(played);
        match self.seek.as_mut().and_then(|seek| seek.rebuilt.as_mut()) {
            None => self.display.step(&self.playback),
            Some(Rebuilt { display: Some(display), .. }) => display.step(&self.playback),
            Some(_) => {}
        }
        true
    }

    /// Records that the replay cannot continue past the current tick.
    pub(super) fn fail(&mut self, error: PlaybackError) {
        self.trouble = Some((self.playback.tick(), error));
        self.playing = false;
    }

    /// Plays this many seconds of real time, for as long as `more` returns `true`.
    pub fn advance(&mut self, elapsed_s: f64, mut more: impl FnMut() -> bool) {
        if !self.playing || self.is_seeking() {
            return;
        }
        let ticks = elapsed_s * f64::from(TICKS_PER_SECOND) * self.speed;
        let wanted = (self.playhead + ticks).min(f64::from(self.last_tick()));
        let mut reached = wanted;
        while f64::from(self.playback.tick()) < wanted {
            if !more() || !self.step() {
                reached = f64::from(self.playback.tick());
                break;
            }
        }
        self.playhead = reached.max(self.playhead);
        if self.playhead >= f64::from(self.last_tick()) {
            self.playing = false;
        }
        self.show();
    }

    /// Uses spare time to compare more hashes and find chapters, regardless of where the playhead is. This makes
    /// seeking within the examined part quick.
    pub fn look_ahead(&mut self, more: impl FnMut() -> bool) {
        self.checks.run(&mut self.playback, &mut self.chapters, more);
    }

    /// Updates the display to the playhead.
    pub(super) fn show(&mut self) {
        let bounds = self.bounds();
        // Sees through the eyes of the followed player or, in scenes with selection, those of the first player.
        let selecting = self.scene().tools.contains(Tools::SELECT);
        let first = || self.players().first().map(|player| player.seat).filter(|_| selecting);
        let eyes = self.followed.or_else(first);
        self.display.show(self.playhead, eyes, bounds);
    }

    /// The players at the displayed moment, ordered by seat.
    pub fn players(&self) -> &[PlayerState] {
        self.replica().room.players()
    }

    /// Centre and velocity of the followed hero.
    pub fn followed_hero(&self) -> Option<(Vec2, Vec2)> {
        let seat = self.followed?;
        let player = self.players().iter().find(|player| player.seat == seat)?;
        let hero = self.replica().bodies().iter().find(|body| Some(body.id) == player.hero)?;
        Some((hero.center, hero.velocity))
    }

    /// The displayed particles, which are those of the game itself, and how far they lag behind the playhead, seconds.
    pub fn particles(&self) -> (&Particles, f32) {
        match self.seek.as_ref().and_then(|seek| seek.rebuilt.as_ref()) {
            Some(rebuilt) => (&rebuilt.particles, rebuilt.particle_lead),
            None => (self.playback.game().world().particles(), self.particle_lead()),
        }
    }

    pub(super) fn particle_lead(&self) -> f32 {
        let ticks = self.playhead - f64::from(self.playback.tick());
        ticks.clamp(-1.0, 0.0) as f32 / TICKS_PER_SECOND as f32
    }

    /// A camera for the whole world, or for the followed hero if it currently exists.
    pub fn camera(&self) -> Camera {
        let scene = self.scene();
        watching_camera(scene, self.followed_hero().is_some())
    }

    /// The view in which the camera comes to rest while the replay is paused. The bottom `bottom` pixels are covered by
    /// controls, so the picture is centred above them.
    pub fn still_view(&self, pixels: [u32; 2], bottom: u32) -> View {
        self.view(&mut self.camera(), pixels, bottom, 0.0)
    }

    /// The camera's view, this many seconds after its previous one.
    pub fn view(&self, camera: &mut Camera, pixels: [u32; 2], bottom: u32, elapsed_s: f32) -> View {
        let [width, height] = pixels;
        let free = height - bottom.min(height / 2);
        let hero = self.followed_hero();
        let above =
            camera.view(Target { pixels: [width, free], hero, top: 0, bottom: 0, elapsed_s });
        let unit = above.unit_per_pixel();
        let down = Vec2::new(0.0, 0.5 * unit * (height - free) as f32);
        View { center: above.center - down, height: unit * height as f32, pixels }
    }

    /// The frame for a view.
    pub fn frame(&self, view: View) -> Frame<'_> {
        let (particles, particle_lead) = self.particles();
        Frame {
            view,
            world_size: self.scene().size,
            room: &self.replica().picture.drawn,
            particles,
            particle_lead,
            time: (self.playhead / f64::from(TICKS_PER_SECOND)) as f32,
            bounds: self.bounds(),
            calm: false,
            copy: self.jumps,
            dimmed: false,
            sketch: None,
            ghost: None,
        }
    }
}

#[cfg(test)]
mod tests;
