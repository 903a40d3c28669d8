//! The own hero before the server's word: the same rules and the same step as the server's, in a
//! small world around the hero, from the newest snapshot on through the inputs that are still on
//! their way. The server's word wins always; what it changes of what was drawn fades.
//!
//! Two states are kept. The anchor is what the newest snapshot says: it steps from snapshot to
//! snapshot with the inputs that the server says it played, so that it knows what the wire does
//! not tell, the velocity and places finer than the quantum. The lead goes on from there.

mod anchor;
mod near;
mod schedule;

use crate::clock::{TICK_MS, paced};
use anchor::{Anchor, Carrier};
use jostle_protocol::{PlayerState, Snapshot};
use jostle_sim::{BodyDef, BodyId, Input, Scene, Seat, Tools, Vec2};
pub(crate) use near::placed;
use schedule::Schedule;
use std::collections::VecDeque;
use std::sync::Arc;

/// Ticks past the newest snapshot after which the hero waits for the server.
pub const LEAD_TICKS_MAX: u32 = 60;
/// What is left of a correction after this time is a third, milliseconds: it is gone in three.
const FADE_MS: f64 = 40.0;
/// A correction longer than so many times the hero's longer side is shown as the jump that it is.
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
    /// The hero.
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
    schedule: Schedule,
    anchor: Option<Anchor>,
    lead: Option<Lead>,
    /// The moment that is drawn, as the tick whose snapshot will show it.
    moment: Option<f64>,
    updated_ms: f64,
    /// What corrections left to fade, and the way to the frame of what carries the hero.
    fading: Vec2,
    riding: Vec2,
    /// Places as they were predicted when they were drawn, by tick.
    drawn: VecDeque<(u32, Vec2)>,
    error: f32,
}

/// Where the hero goes from the anchor on.
struct Lead {
    world: Anchor,
    /// The hero's place at the end of the tick before the world's.
    before: Vec2,
    carrier: Option<Carrier>,
}

impl Predictor {
    /// A predictor for a player of a scene, or none where there is no hero to steer.
    pub fn new(scene: &Arc<Scene>, seat: Seat) -> Option<Predictor> {
        let steers = scene.tools.contains(Tools::STEER) && scene.solver.is_some();
        (steers && scene.hero.is_some()).then(|| Predictor {
            scene: Arc::clone(scene),
            seat,
            schedule: Schedule::default(),
            anchor: None,
            lead: None,
            moment: None,
            updated_ms: 0.0,
            fading: Vec2::ZERO,
            riding: Vec2::ZERO,
            drawn: VecDeque::new(),
            error: 0.0,
        })
    }

    /// An input was sent at `now_ms`, when the server's tick was this one, as the clock estimates it.
    pub fn sent(&mut self, seq: u32, input: Input, server_tick: f64, now_ms: f64) {
        let buttons = input.rounded().buttons;
        let moment = self.moment_at(server_tick, now_ms);
        if self.schedule.send(seq, buttons, server_tick, moment)
            && let Some(anchor) = &self.anchor
        {
            // It changes what was to come: nothing to fade, this is the answer to the key.
            self.lead = Some(self.lead_to(anchor, self.moment.unwrap_or(moment)));
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
        match (&mut self.anchor, own.hero) {
            (Some(anchor), Some(hero)) if anchor.follows(hero, newest.tick) => {
                anchor.hear(&self.scene, &self.schedule, newest, before);
            }
            (_, Some(hero)) => {
                self.lose();
                self.anchor = Anchor::new(&self.scene, hero, newest, before);
            }
            (_, None) => return self.lose(),
        }
        self.schedule.forget_before(newest.tick);
        self.lead_again();
    }

    /// There is no hero: the next one begins anew.
    fn lose(&mut self) {
        self.anchor = None;
        self.lead = None;
        (self.fading, self.riding) = (Vec2::ZERO, Vec2::ZERO);
        self.drawn.clear();
    }

    /// How far the server's word is from what was drawn for its tick.
    fn measure(&mut self, own: &PlayerState, newest: &Snapshot) {
        while self.drawn.front().is_some_and(|(tick, _)| *tick < newest.tick) {
            self.drawn.pop_front();
        }
        let drawn = self.drawn.front().filter(|(tick, _)| *tick == newest.tick);
        let place = own.hero.and_then(|hero| anchor::place_of(newest, hero, self.scene.quantum));
        if let (Some((_, drawn)), Some(place)) = (drawn, place) {
            self.error += ((place - *drawn).length() - self.error) * ERROR_SHARE;
        }
    }

    /// Goes on from what is known now; what that changes at the drawn moment fades.
    fn lead_again(&mut self) {
        let (Some(anchor), Some(moment)) = (&self.anchor, self.moment) else { return };
        // Before the anchor nothing is known any more.
        let moment = moment.max(f64::from(anchor.tick()));
        let lead = self.lead_to(anchor, moment);
        if let Some(mut old) = self.lead.take() {
            old.go_on(&self.scene, &self.schedule, lead.world.tick());
            self.fading += old.center(moment) - lead.center(moment);
            let side = self.scene.hero.as_ref().map_or(1.0, |spec| longer_side(&spec.body));
            if self.fading.length() > side * JUMP_SIDES {
                self.fading = Vec2::ZERO;
            }
        }
        self.lead = Some(lead);
    }

    fn lead_to(&self, anchor: &Anchor, moment: f64) -> Lead {
        let before = anchor.center();
        let mut lead = Lead { world: anchor.clone(), before, carrier: None };
        lead.go_on(&self.scene, &self.schedule, last_tick(anchor, moment));
        lead
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
        let moment = self.pace(server_tick + self.schedule.lead_ticks(), elapsed_ms);
        let anchor = self.anchor.as_ref()?;
        let last = last_tick(anchor, moment);
        if self.lead.is_none() {
            self.lead = Some(self.lead_to(anchor, moment));
        }
        let lead = self.lead.as_mut()?;
        while lead.world.tick() < last {
            let drawn = (lead.world.tick(), lead.world.center());
            if self.drawn.back().is_none_or(|newest| newest.0 < drawn.0) {
                self.drawn.push_back(drawn);
            }
            lead.go_on(&self.scene, &self.schedule, lead.world.tick() + 1);
        }
        let aside = lead.aside(moment, shown);
        self.fading *= (-elapsed_ms / FADE_MS).exp() as f32;
        self.riding += (aside - self.riding) * (1.0 - (-elapsed_ms / RIDE_MS).exp()) as f32;
        Some(Predicted {
            id: lead.world.hero(),
            center: lead.center(moment) + self.fading + self.riding,
            velocity: lead.world.velocity(),
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

    /// Smoothed distance of the server's word from what was drawn for its tick, world units.
    pub fn error(&self) -> f32 {
        self.error
    }

    /// Inputs that the server has not played yet, as far as is known.
    pub fn unacknowledged(&self) -> usize {
        self.schedule.waiting()
    }

    /// Ticks from an input's leaving to the news of its being played.
    pub fn lead_ticks(&self) -> f64 {
        self.schedule.lead_ticks()
    }

    /// When an input would be played that leaves at `now_ms`, when the server's tick is this one: in the
    /// first tick after this moment.
    pub fn moment_at(&self, server_tick: f64, now_ms: f64) -> f64 {
        match self.moment {
            Some(moment) => moment + ((now_ms - self.updated_ms) / TICK_MS).max(0.0),
            None => server_tick + self.schedule.lead_ticks(),
        }
    }

    /// The last tick in which something is played that was sent, as far as is known.
    pub fn booked(&self) -> u32 {
        self.schedule.booked()
    }
}

/// The first tick that a moment has not seen.
fn next_tick(moment: f64) -> u32 {
    moment.max(0.0) as u32 + 1
}

fn longer_side(body: &BodyDef) -> f32 {
    2.0 * body.shape.half_extent().max_element()
}

/// The tick at whose end the hero is drawn next.
fn last_tick(anchor: &Anchor, moment: f64) -> u32 {
    next_tick(moment).clamp(anchor.tick(), anchor.tick() + LEAD_TICKS_MAX)
}

impl Lead {
    /// Steps to the end of a tick.
    fn go_on(&mut self, scene: &Scene, schedule: &Schedule, last: u32) {
        while self.world.tick() < last {
            self.before = self.world.center();
            self.world.step(scene, schedule);
            self.carrier = self.world.carrier();
        }
    }

    /// Share of the way through the last tick at a moment.
    fn share(&self, moment: f64) -> f32 {
        (moment - f64::from(self.world.tick()) + 1.0).clamp(0.0, 1.0) as f32
    }

    fn center(&self, moment: f64) -> Vec2 {
        self.before + (self.world.center() - self.before) * self.share(moment)
    }

    /// From where what carries the hero will be to where it is on display: it is shown later than
    /// the hero is, and the hero is to stand on it.
    fn aside(&self, moment: f64, shown: impl Fn(BodyId) -> Option<Vec2>) -> Vec2 {
        let place = |carrier: &Carrier| {
            let to_come = carrier.step * (1.0 - self.share(moment));
            Some(shown(carrier.id)? - (carrier.center - to_come))
        };
        self.carrier.as_ref().and_then(place).unwrap_or(Vec2::ZERO)
    }
}

#[cfg(test)]
mod tests;
