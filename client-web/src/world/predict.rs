//! Prediction of the own hero: the same rules and the same step as the server's, in a small world around
//! the hero, from the newest snapshot on through the inputs that are still on their way. The server
//! always wins: reconciliation moves the hero to where the server has it, and the correction fades.
//!
//! Two states are kept. [`AuthoritativeSim`] follows the snapshots: it steps from one to the next with the
//! inputs that the server says it played, so that it knows what snapshots lack, velocities and positions
//! finer than the quantum. [`PredictedSim`] goes on from there.

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

/// Ticks past the newest snapshot after which the hero waits for the server.
pub const LEAD_TICKS_MAX: u32 = 60;
/// After this time a third of a correction is left, milliseconds; after three times that it is gone.
const FADE_MS: f64 = 40.0;
/// A correction longer than this many times the hero's longer side is shown as a jump.
const JUMP_SIDES: f32 = 3.0;
/// A moment further off than this is jumped to, ticks.
const JUMP_TICKS: f64 = 20.0;
/// How fast the hero is taken to the frame of what carries it, and back, milliseconds.
const RIDE_MS: f64 = 60.0;
/// Weight of a new error in the shown one.
const ERROR_SHARE: f32 = 0.1;

/// The own hero as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    pub id: BodyId,
    /// Centre, world units.
    pub center: Vec2,
    /// Units/s.
    pub velocity: Vec2,
}

/// Predicts the own hero of one session.
pub struct Predictor {
    scene: Arc<Scene>,
    seat: Seat,
    schedule: InputSchedule,
    authoritative: Option<AuthoritativeSim>,
    predicted: Option<PredictedSim>,
    /// The moment that is drawn, as the tick whose snapshot will show it.
    moment: Option<f64>,
    updated_ms: f64,
    /// Corrections that are still fading.
    fading: Vec2,
    riding: Vec2,
    /// Places as they were predicted when they were drawn, by tick.
    drawn: VecDeque<(u32, Vec2)>,
    /// Smoothed distance of the server's position from the one drawn for its tick, world units.
    pub error: f32,
}

impl Predictor {
    /// A predictor for a player of a scene, or none where there is no hero to steer.
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

    /// The room goes on at `now_ms` with another socket, which knows of none of the inputs that were sent.
    pub fn restart(&mut self, now_ms: f64) {
        self.schedule.restart();
        self.updated_ms = now_ms;
    }

    /// An input was sent at `now_ms`, when the server's tick was this one, as the clock estimates it.
    pub fn sent(&mut self, seq: u32, input: Input, server_tick: f64, now_ms: f64) {
        let buttons = input.buttons();
        let moment = self.moment_at(server_tick, now_ms);
        if self.schedule.send(seq, buttons, server_tick, moment)
            && let Some(authoritative) = &self.authoritative
        {
            // It changes what was to come: nothing to fade, this is the answer to the key.
            self.predicted = Some(self.predict_to(authoritative, self.moment.unwrap_or(moment)));
        }
    }

    /// Takes the newest snapshot, and the one before it.
    pub fn heard(&mut self, newest: &Snapshot, before: Option<&Snapshot>) {
        let Some(own) = newest.players.iter().find(|player| player.seat == self.seat) else {
            return self.lose();
        };
        let since = before.map_or(newest.tick, |before| before.tick);
        self.schedule.acknowledge(
            own.input_seq,
            since.min(newest.tick.saturating_sub(1)),
            newest.tick,
        );
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

    /// There is no hero: the next one starts over.
    fn lose(&mut self) {
        self.authoritative = None;
        self.predicted = None;
        (self.fading, self.riding) = (Vec2::ZERO, Vec2::ZERO);
        self.drawn.clear();
    }

    /// Measures the distance of the server's position from the one drawn for its tick.
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

    /// Predicts again from the newest snapshot; the correction at the drawn moment fades.
    fn predict_again(&mut self) {
        let (Some(authoritative), Some(moment)) = (&self.authoritative, self.moment) else {
            return;
        };
        // Nothing is known from before the newest snapshot.
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

    /// Brings the hero to `now_ms`, when the server's tick is this one. `shown` is where bodies are
    /// on display.
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

    /// The moment runs with the time, and closes in on the one that is wanted.
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

    /// Inputs that the server has not played yet, as far as is known.
    pub fn unacknowledged(&self) -> usize {
        self.schedule.waiting()
    }

    /// Ticks from an input's leaving to the news of its being played.
    pub fn lead_ticks(&self) -> f64 {
        self.schedule.lead
    }

    /// When an input would be played that leaves at `now_ms`, when the server's tick is this one: in the
    /// first tick after this moment.
    pub fn moment_at(&self, server_tick: f64, now_ms: f64) -> f64 {
        match self.moment {
            Some(moment) => moment + ((now_ms - self.updated_ms) / TICK_MS).max(0.0),
            None => server_tick + self.schedule.lead,
        }
    }

    /// The last tick in which something is played that was sent, as far as is known.
    pub fn booked(&self) -> u32 {
        self.schedule.booked()
    }
}

fn longer_side(body: &BodyDef) -> f32 {
    2.0 * body.shape.half_extent().max_element()
}

/// The tick at whose end the hero is drawn next.
fn last_tick(authoritative: &AuthoritativeSim, moment: f64) -> u32 {
    next_tick(moment).clamp(authoritative.tick, authoritative.tick + LEAD_TICKS_MAX)
}

#[cfg(test)]
mod tests;
