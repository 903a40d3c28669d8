//! Prediction of the player's hero, which simulates a small world around the hero with the server's rules and time
//! step, from the newest snapshot through the inputs still in flight. The server is authoritative: reconciliation moves
//! the hero to the server's position, and the visible correction fades out.
//!
//! Two states are kept. [`AuthoritativeSim`] follows the snapshots: it steps from one to the next with the inputs that
//! the server reports as played, which gives it more precise velocities and positions than the snapshots contain.
//! [`PredictedSim`] continues from there.

mod authoritative;
mod near;
mod predicted;
mod schedule;

use crate::net::clock::{TICK_MS, paced};
use authoritative::AuthoritativeSim;
use jostle_game::{Input, Scene, Seat, Tools};
use jostle_protocol::{PlayerState, Snapshot};
use jostle_sim::{BodyDef, BodyId, Vec2};
pub(crate) use near::placed;
use predicted::PredictedSim;
use schedule::{InputSchedule, next_tick};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of ticks by which the hero is predicted past the newest snapshot; beyond that it waits for the
/// server.
pub const LEAD_TICKS_MAX: u32 = 60;
/// Time constant with which corrections fade, milliseconds. After this time about a third (1/e) remains.
const FADE_MS: f64 = 40.0;
/// Corrections longer than this many times the hero's longer side are shown as a jump.
const JUMP_SIDES: f32 = 3.0;
/// The displayed moment jumps if it is off by more than this, ticks.
const JUMP_TICKS: f64 = 20.0;
/// Time constant of the hero's transition into and out of the reference frame of a body that carries it, milliseconds.
const RIDE_MS: f64 = 60.0;
/// Weight of a new error in the displayed average.
const ERROR_SHARE: f32 = 0.1;

/// The player's hero as drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    pub id: BodyId,
    /// Centre, world units.
    pub center: Vec2,
    /// Velocity, units/s.
    pub velocity: Vec2,
}

/// Predicts the player's hero in one session.
pub struct Predictor {
    scene: Arc<Scene>,
    seat: Seat,
    schedule: InputSchedule,
    authoritative: Option<AuthoritativeSim>,
    predicted: Option<PredictedSim>,
    /// The drawn moment, as the tick whose snapshot will show it.
    moment: Option<f64>,
    updated_ms: f64,
    /// The sum of corrections that are still fading.
    fading: Vec2,
    riding: Vec2,
    /// Predicted positions at the time they were drawn, by tick.
    drawn: VecDeque<(u32, Vec2)>,
    /// Smoothed distance between the server's position and the one drawn for the same tick, world units.
    pub error: f32,
}

impl Predictor {
    /// Creates a predictor for a player in a scene; `None` if the scene has no hero to steer.
    pub fn new(scene: &Arc<Scene>, seat: Seat) -> Option<Predictor> {
        let steers = scene.tools.contains(Tools::STEER) && scene.world.solver.is_some();
        (steers && scene.hero.is_some()).then(|| Predictor {
            scene: Arc::clone(scene),
            seat,
            schedule: InputSchedule::default(),
            authoritative: None,
            predicted: None,
            moment: None,
            updated_ms: 0.0,
            fading: Vec2::ZERO,
            riding: Vec2::ZERO,
            drawn: VecDeque::new(),
            error: 0.0,
        })
    }

    /// Discards all sent inputs, because the room continues at `now_ms` on another socket, which has received none of
    /// them.
    pub fn restart(&mut self, now_ms: f64) {
        self.schedule.restart();
        self.updated_ms = now_ms;
    }

    /// Records that an input was sent at `now_ms`, with the clock's estimate of the server's tick.
    pub fn sent(&mut self, seq: u32, input: Input, server_tick: f64, now_ms: f64) {
        let moment = self.moment_at(server_tick, now_ms);
        if self.schedule.send(seq, input, server_tick, moment)
            && let Some(authoritative) = &self.authoritative
        {
            // The input changes the prediction. The change is the response to the key, so it must not fade in.
            self.predicted = Some(self.predict_to(authoritative, self.moment.unwrap_or(moment)));
        }
    }

    /// Handles the newest snapshot and the one before it.
    pub fn heard(&mut self, newest: &Snapshot, before: Option<&Snapshot>) {
        let Some(own) = newest.players.iter().find(|player| player.seat == self.seat) else {
            return self.lose();
        };
        let latest = newest.tick.saturating_sub(1);
        let since = before.map_or(latest, |before| before.tick).min(latest);
        let heard = self.authoritative.as_ref().map_or(since, |known| known.tick.min(since));
        self.schedule.acknowledge(own.input_seq, heard, since, newest.tick);
        self.measure(own, newest);
        match (&mut self.authoritative, own.hero) {
            (Some(authoritative), Some(hero)) if authoritative.follows(hero, newest.tick) => {
                authoritative.advance_to(&self.scene, &self.schedule, self.seat, newest, before);
            }
            (_, Some(hero)) => {
                self.lose();
                self.authoritative =
                    AuthoritativeSim::new(&self.scene, hero, self.seat, newest, before);
            }
            (_, None) => return self.lose(),
        }
        self.schedule.forget_before(newest.tick);
        self.predict_again();
    }

    /// Discards the prediction because the hero is gone; prediction of the next hero starts from scratch.
    fn lose(&mut self) {
        self.authoritative = None;
        self.predicted = None;
        (self.fading, self.riding) = (Vec2::ZERO, Vec2::ZERO);
        self.drawn.clear();
    }

    /// Measures the distance between the server's position and the one drawn for the same tick.
    fn measure(&mut self, own: &PlayerState, newest: &Snapshot) {
        while self.drawn.front().is_some_and(|(tick, _)| *tick < newest.tick) {
            self.drawn.pop_front();
        }
        let drawn = self.drawn.front().filter(|(tick, _)| *tick == newest.tick);
        let place =
            own.hero.and_then(|hero| near::place_of(newest, hero, self.scene.world.quantum));
        if let (Some((_, drawn)), Some(place)) = (drawn, place) {
            self.error += ((place - *drawn).length() - self.error) * ERROR_SHARE;
        }
    }

    /// Predicts again from the newest snapshot; the correction at the drawn moment fades out.
    fn predict_again(&mut self) {
        let (Some(authoritative), Some(moment)) = (&self.authoritative, self.moment) else {
            return;
        };
        // Nothing before the newest snapshot can be predicted.
        let moment = moment.max(f64::from(authoritative.tick));
        let predicted = self.predict_to(authoritative, moment);
        if let Some(mut old) = self.predicted.take() {
            old.go_on(&self.scene, &self.schedule, predicted.world.tick);
            self.fading += old.center(moment) - predicted.center(moment);
            let side = self.scene.hero.as_ref().map_or(1.0, |spec| longer_side(&spec.body));
            if self.fading.length() > side * JUMP_SIDES {
                self.fading = Vec2::ZERO;
            }
        }
        self.predicted = Some(predicted);
    }

    fn predict_to(&self, authoritative: &AuthoritativeSim, moment: f64) -> PredictedSim {
        let mut predicted = PredictedSim::new(authoritative);
        predicted.go_on(&self.scene, &self.schedule, last_tick(authoritative, moment));
        predicted
    }

    /// Advances the hero to `now_ms`, given the server's current tick. `shown` returns the displayed position of a
    /// body.
    pub fn advance(
        &mut self,
        server_tick: f64,
        now_ms: f64,
        shown: impl Fn(BodyId) -> Option<Vec2>,
    ) -> Option<Predicted> {
        let elapsed_ms = (now_ms - self.updated_ms).max(0.0);
        self.updated_ms = now_ms;
        let moment = self.pace(server_tick + self.schedule.lead, elapsed_ms);
        let authoritative = self.authoritative.as_ref()?;
        let last = last_tick(authoritative, moment);
        if self.predicted.is_none() {
            self.predicted = Some(self.predict_to(authoritative, moment));
        }
        let predicted = self.predicted.as_mut()?;
        while predicted.world.tick < last {
            let drawn = (predicted.world.tick, predicted.world.center());
            if self.drawn.back().is_none_or(|newest| newest.0 < drawn.0) {
                self.drawn.push_back(drawn);
            }
            predicted.go_on(&self.scene, &self.schedule, predicted.world.tick + 1);
        }
        let aside = predicted.aside(moment, shown);
        self.fading *= (-elapsed_ms / FADE_MS).exp() as f32;
        self.riding += (aside - self.riding) * (1.0 - (-elapsed_ms / RIDE_MS).exp()) as f32;
        Some(Predicted {
            id: predicted.world.hero,
            center: predicted.center(moment) + self.fading + self.riding,
            velocity: predicted.world.velocity(),
        })
    }

    /// Advances the moment with time and moves it closer to the wanted one.
    fn pace(&mut self, wanted: f64, elapsed_ms: f64) -> f64 {
        let elapsed = elapsed_ms / TICK_MS;
        let next = match self.moment {
            Some(moment) if (wanted - moment).abs() < JUMP_TICKS + elapsed => {
                moment + paced(elapsed, wanted - moment)
            }
            _ => wanted,
        };
        self.moment = Some(next);
        next
    }

    /// The number of inputs that the server has not yet acknowledged.
    pub fn unacknowledged(&self) -> usize {
        self.schedule.waiting()
    }

    /// Ticks between sending an input and the snapshot that includes it.
    pub fn lead_ticks(&self) -> f64 {
        self.schedule.lead
    }

    /// The moment at which an input sent at `now_ms` would be played, given the server's current tick: in the first
    /// tick after this moment.
    pub fn moment_at(&self, server_tick: f64, now_ms: f64) -> f64 {
        match self.moment {
            Some(moment) => moment + ((now_ms - self.updated_ms) / TICK_MS).max(0.0),
            None => server_tick + self.schedule.lead,
        }
    }

    /// The last tick in which a sent input is expected to be played.
    pub fn booked(&self) -> u32 {
        self.schedule.booked()
    }
}

fn longer_side(body: &BodyDef) -> f32 {
    2.0 * body.shape.half_extent().max_element()
}

/// The tick whose end state is needed to draw this moment.
fn last_tick(authoritative: &AuthoritativeSim, moment: f64) -> u32 {
    next_tick(moment).clamp(authoritative.tick, authoritative.tick + LEAD_TICKS_MAX)
}

#[cfg(test)]
mod tests;
