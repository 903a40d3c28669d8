//! A replay as it is watched: it is played again, tick by tick, with a pause, a speed and a place
//! to be at, and drawn by what draws a live game.
//!
//! What is shown at a tick depends on the replay and that tick alone, however one got there: what
//! flashes and springs is rebuilt by playing the [`LEAD_TICKS`] before it unseen.
//!
//! ```no_run
//! # use jostle_client_web::{draw::DrawList, film::Film, render::headless::Headless};
//! # fn picture(bytes: Vec<u8>) -> Result<(), Box<dyn std::error::Error>> {
//! let mut film = Film::open(bytes)?;
//! film.seek(738);
//! let mut list = DrawList::new();
//! list.fill(&film.frame(film.still_view([1280, 720], 0)));
//! let picture = Headless::open()?.picture([1280, 720], &list)?;
//! # Ok(())
//! # }
//! ```

mod chapters;
mod checks;
mod error;
mod reel;
mod seek;

pub use chapters::{Chapter, Chapters};
pub use checks::Checks;
pub use error::FilmError;

use crate::camera::{Camera, Target};
use crate::frame::{Frame, FrameBody, View};
use crate::replica::Replica;
use jostle_protocol::PlayerState;
use jostle_protocol::replay::{Ending, Replay};
use jostle_room::{Playback, PlaybackError};
use jostle_sim::scene::Camera as CameraRule;
use jostle_sim::{Particles, Scene, Seat, TICKS_PER_SECOND, Tools, Vec2};
use reel::Reel;
use seek::{Rebuilt, Seek};
use std::sync::Arc;

/// Ticks that are played unseen before a tick that was jumped to: twice as long as anything that
/// is drawn remembers.
pub const LEAD_TICKS: u32 = 120;
/// Speeds to choose from, as multiples of real time.
pub const SPEEDS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Height of what is seen around a followed player, where the scene does not say, as a share of
/// the world's.
const FOLLOW_SHARE: f32 = 0.6;

/// A replay that is being watched.
pub struct Film {
    playback: Playback,
    reel: Reel,
    checks: Checks,
    chapters: Chapters,
    /// The tick on display; between two ticks while it plays. The game is at the next whole one.
    playhead: f64,
    playing: bool,
    speed: f64,
    seek: Option<Seek>,
    /// Where to go when the present seek is done.
    wish: Option<u32>,
    /// How often something else than the next moment came on display.
    jumps: u32,
    followed: Option<Seat>,
    bounds_toggled: bool,
    /// Why it ends before the last recorded tick, and at which.
    trouble: Option<(u32, PlaybackError)>,
}

impl Film {
    /// Reads a replay and stands at its beginning. What a cut file still has is shown, see
    /// [`Film::ending`].
    pub fn open(bytes: Vec<u8>) -> Result<Film, FilmError> {
        let replay = Arc::new(Replay::read(bytes)?);
        let playback = Playback::new(replay)?;
        let checks = Checks::new(&playback);
        let mut film = Film {
            reel: Reel::begin(&playback),
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

    /// The replay.
    pub fn replay(&self) -> &Arc<Replay> {
        self.playback.replay()
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        self.playback.game().scene()
    }

    /// The room on display.
    pub fn replica(&self) -> &Replica {
        self.reel.replica()
    }

    /// The room on display, to take its news.
    pub fn replica_mut(&mut self) -> &mut Replica {
        self.reel.replica_mut()
    }

    /// How the file ends.
    pub fn ending(&self) -> Ending {
        self.replay().ending()
    }

    /// Why it cannot be played to its last recorded tick, once that is known.
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

    /// The tick on display, between two ticks while it plays.
    pub fn playhead(&self) -> f64 {
        self.playhead
    }

    /// The whole tick on display, to which [`Film::hash`] belongs.
    pub fn tick(&self) -> u32 {
        self.playhead.ceil() as u32
    }

    /// The state hash of [`Film::tick`]; `None` while a seek is on its way.
    pub fn hash(&self) -> Option<u64> {
        (!self.is_seeking()).then(|| self.playback.game().hash())
    }

    /// What is known of the recorded hashes.
    pub fn checks(&self) -> &Checks {
        &self.checks
    }

    /// Joins, leaves and bursts, as far as they are known.
    pub fn chapters(&self) -> &Chapters {
        &self.chapters
    }

    /// Whether it plays.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Whether it stands at its last tick.
    pub fn is_at_end(&self) -> bool {
        !self.is_seeking() && self.tick() >= self.last_tick()
    }

    /// Plays, from the start if it is at the end.
    pub fn play(&mut self) {
        if self.is_at_end() {
            self.aim(self.first_tick());
        }
        self.playing = self.last_tick() > self.first_tick();
    }

    /// Stands still at the next whole tick.
    pub fn pause(&mut self) {
        self.playing = false;
        if !self.is_seeking() {
            self.playhead = self.playhead.ceil();
            self.show();
        }
    }

    /// Multiple of real time, one of [`SPEEDS`].
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Chooses the nearest of [`SPEEDS`].
    pub fn set_speed(&mut self, speed: f64) {
        let apart = |offered: &f64| (offered - speed).abs();
        let nearest = SPEEDS.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        self.speed = nearest.unwrap_or(1.0);
    }

    /// The player whom the view follows.
    pub fn followed(&self) -> Option<Seat> {
        self.followed
    }

    /// Follows a player, or shows the whole world.
    pub fn follow(&mut self, seat: Option<Seat>) {
        self.followed = seat;
        self.show();
    }

    /// Whether bounds are drawn: where bodies are selected by them, else on demand.
    pub fn bounds(&self) -> bool {
        self.scene().tools.contains(Tools::SELECT) != self.bounds_toggled
    }

    /// Shows or hides the bounds.
    pub fn toggle_bounds(&mut self) {
        self.bounds_toggled = !self.bounds_toggled;
        self.show();
    }

    /// Plays one tick into what is being shown or rebuilt; `false` at the end.
    fn step(&mut self) -> bool {
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
            None => self.reel.step(&self.playback),
            Some(Rebuilt { reel: Some(reel), .. }) => reel.step(&self.playback),
            Some(_) => {}
        }
        true
    }

    /// The replay does not go on past the present tick.
    fn fail(&mut self, error: PlaybackError) {
        self.trouble = Some((self.playback.tick(), error));
        self.playing = false;
    }

    /// Plays for so many seconds of real time, as far as `more` gives time for it.
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

    /// Uses time to compare further hashes and to find chapters, wherever the film stands. Seeking
    /// to what was looked at is quick from then on.
    pub fn look_ahead(&mut self, more: impl FnMut() -> bool) {
        self.checks.run(&mut self.playback, &mut self.chapters, more);
    }

    /// Brings what is drawn to the playhead.
    fn show(&mut self) {
        let bounds = self.bounds();
        self.reel.show(self.playhead, self.eye_of(), bounds);
    }

    /// With whose eyes the scene is seen: those of the followed player, or of the first one where
    /// something is selected.
    fn eye_of(&self) -> Option<Seat> {
        let selecting = self.scene().tools.contains(Tools::SELECT);
        let first = || self.players().first().map(|player| player.seat).filter(|_| selecting);
        self.followed.or_else(first)
    }

    /// Players of the displayed moment in seat order.
    pub fn players(&self) -> &[PlayerState] {
        self.replica().players()
    }

    /// Centre and velocity of the followed hero.
    pub fn followed_hero(&self) -> Option<(Vec2, Vec2)> {
        let seat = self.followed?;
        let player = self.players().iter().find(|player| player.seat == seat)?;
        let hero = self.bodies().iter().find(|body| Some(body.id) == player.hero)?;
        Some((hero.center, hero.velocity))
    }

    /// How often something else than the next moment came on display: a camera is to cut then.
    pub fn jumps(&self) -> u32 {
        self.jumps
    }

    /// A camera for the whole world, or for the hero that is followed, if there is one now.
    pub fn camera(&self) -> Camera {
        let scene = self.scene();
        let rule = match (self.followed_hero(), scene.camera) {
            (None, _) => CameraRule::Fit,
            (Some(_), CameraRule::Fit) => {
                CameraRule::Follow { height: scene.size.y * FOLLOW_SHARE }
            }
            (Some(_), follow) => follow,
        };
        Camera::new(rule, scene.size)
    }

    /// The view in which a camera comes to rest while the film stands still. `bottom` are pixels
    /// that something else covers: what is to be seen is above them.
    pub fn still_view(&self, pixels: [u32; 2], bottom: u32) -> View {
        self.view(&mut self.camera(), pixels, bottom, 0.0)
    }

    /// The view of a camera of this film, so many seconds after its last one.
    pub fn view(&self, camera: &mut Camera, pixels: [u32; 2], bottom: u32, elapsed_s: f32) -> View {
        let [width, height] = pixels;
        let free = height - bottom.min(height / 2);
        let hero = self.followed_hero();
        let above = camera.view(Target { pixels: [width, free], hero, bottom: 0, elapsed_s });
        let unit = above.unit_per_pixel();
        let down = Vec2::new(0.0, 0.5 * unit * (height - free) as f32);
        View { center: above.center - down, height: unit * height as f32, pixels }
    }

    /// Bodies on display.
    pub fn bodies(&self) -> &[FrameBody] {
        self.reel.bodies()
    }

    /// Particles on display: those of the game itself.
    pub fn particles(&self) -> &Particles {
        match self.rebuilt() {
            Some(rebuilt) => &rebuilt.particles,
            None => self.playback.game().world().particles(),
        }
    }

    fn rebuilt(&self) -> Option<&Rebuilt> {
        self.seek.as_ref().and_then(|seek| seek.rebuilt.as_ref())
    }

    fn particle_lead(&self) -> f32 {
        let ticks = self.playhead - f64::from(self.playback.tick());
        ticks.clamp(-1.0, 0.0) as f32 / TICKS_PER_SECOND as f32
    }

    /// What a camera shows now.
    pub fn frame(&self, view: View) -> Frame<'_> {
        Frame {
            view,
            world_size: self.scene().size,
            bodies: self.bodies(),
            particles: self.particles(),
            recipes: &self.scene().recipes,
            particle_lead: self.rebuilt().map_or(self.particle_lead(), |r| r.particle_lead),
            effects: self.replica().effects(),
            time: (self.playhead / f64::from(TICKS_PER_SECOND)) as f32,
            bounds: self.bounds(),
            calm: false,
            own_seat: self.followed,
            pointer: None,
            copy: self.jumps,
            dimmed: false,
        }
    }
}

#[cfg(test)]
mod tests;
