//! The display of consecutively played ticks: bodies with their springs, flashes and news.

use crate::view::draw::motion::SquashSpring;
use crate::world::replica::{Eye, Replica};
use jostle_game::Seat;
use jostle_protocol::TimedEvent;
use jostle_room::Playback;
use jostle_sim::{BodyId, DT};
use std::sync::Arc;

/// Maximum age of a body, seconds; anything older is drawn the same way.
const AGE_MAX_S: f32 = 1.0;
/// Springs are rounded to multiples of the reciprocal of this. Traces of motion from before the lead are far smaller,
/// so they are invisible.
const SQUASH_STEPS: f32 = 1024.0;
/// A seat that no player has.
const NO_PLAYER: Seat = Seat(u16::MAX);

/// Consecutively played ticks, as drawn.
pub struct ReplayDisplay {
    pub replica: Replica,
    springs: Vec<Option<Sprung>>,
    tick: u32,
}

#[derive(Clone, Copy)]
struct Sprung {
    id: BodyId,
    spring: SquashSpring,
    /// The squash one tick earlier.
    before: f32,
}

impl ReplayDisplay {
    /// Starts at the current tick of a playback.
    pub fn begin(playback: &Playback) -> ReplayDisplay {
        let scene = Arc::clone(playback.game().scene());
        let replica = Replica::without_particles(scene, NO_PLAYER);
        let mut display = ReplayDisplay { replica, springs: Vec::new(), tick: playback.tick() };
        display.replica.file(playback.snapshot(), Vec::new());
        display.replica.advance(f64::from(display.tick), Eye::default());
        display.spring();
        display
    }

    /// Adds the tick that a playback has just played.
    pub fn step(&mut self, playback: &Playback) {
        // Events refer to the bodies on display, which must be those of a whole tick.
        if self.replica.room.display != f64::from(self.tick) {
            self.replica.show(f64::from(self.tick), Eye::default());
        }
        self.replica.room.seat = NO_PLAYER;
        self.tick = playback.tick();
        let timed = |&event| TimedEvent { tick: self.tick, event };
        let events = playback.game().events().iter().map(timed).collect();
        self.replica.file(playback.snapshot(), events);
        self.replica.advance(f64::from(self.tick), Eye::default());
        self.spring();
    }

    /// Advances the springs to the newest tick.
    fn spring(&mut self) {
        for body in self.replica.bodies() {
            let slot = body.id.index as usize;
            if slot >= self.springs.len() {
                self.springs.resize(slot + 1, None);
            }
            let known = self.springs[slot].filter(|sprung| sprung.id == body.id);
            let mut spring =
                known.map_or(SquashSpring::at_rest(body.velocity), |sprung| sprung.spring);
            let before = spring.squash;
            spring.advance(body.velocity, DT);
            self.springs[slot] = Some(Sprung { id: body.id, spring, before });
        }
    }

    /// Shows a moment at or just before the newest tick, from a player's point of view.
    pub fn show(&mut self, playhead: f64, eye_of: Option<Seat>, bounds: bool) {
        self.replica.room.seat = eye_of.unwrap_or(NO_PLAYER);
        self.replica.show(playhead, Eye { pointer: None, bounds });
        let share = (playhead - f64::from(self.tick) + 1.0).clamp(0.0, 1.0) as f32;
        for body in &mut self.replica.picture.drawn.bodies {
            let sprung = self.springs.get(body.id.index as usize).copied().flatten();
            let squash = sprung.filter(|sprung| sprung.id == body.id).map_or(0.0, |sprung| {
                let now = sprung.spring.squash;
                let squash = sprung.before + (now - sprung.before) * share;
                (squash * SQUASH_STEPS).round() / SQUASH_STEPS
            });
            body.age = body.age.min(AGE_MAX_S);
            body.squash = Some(squash);
        }
    }
}
