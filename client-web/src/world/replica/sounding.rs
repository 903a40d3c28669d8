//! Cues of the displayed world: the impacts that sparks show, bodies that come and break, and the
//! turns of a round. All of it follows from snapshots and events that are received anyway.

use super::Replica;
use super::ears::Turn;
use super::highlights::GOALS_APART_TICKS;
use crate::net::timeline::Sample;
use crate::sound::cue::{Cue, Sound};
use jostle_game::scene::Placed;
use jostle_game::{Kind, RoundInfo, RoundPhase, Scene, Seat, Side};
use jostle_sim::{BodyId, Vec2};

/// Cues older than this are of no interest any more, ticks: the page was hidden.
const STALE_TICKS: f64 = 15.0;
/// Blocks that bounce at least so well sound like rubber.
const RUBBER_RESTITUTION: f32 = 0.6;
/// A pack that appears at most this far from its player's hero was thrown just now, world units.
const THROW_REACH: f32 = 40.0;

impl Replica {
    /// The next cue that was not taken yet.
    pub fn next_cue(&mut self) -> Option<Cue> {
        self.ears.pop_since(self.display - STALE_TICKS)
    }

    /// Of two bodies that meet the movable one sounds, and of two of those the smaller.
    pub(super) fn hear_impact(&mut self, tick: u32, ids: [BodyId; 2], point: Vec2, speed: f32) {
        let mut movable = ids.map(|id| self.sampled(id).copied().filter(is_movable));
        let [one, other] = movable.map(|sample| sample.as_ref().map_or(f32::MAX, size));
        if other < one {
            movable.swap(0, 1);
        }
        let Some(sample) = &movable[0] else { return };
        let cue = Cue {
            sound: material(&self.scene, sample),
            at: Some(point),
            size: size(sample),
            speed,
            bodies: movable.map(|sample| sample.map(|sample| sample.id)),
        };
        self.ears.push(f64::from(tick), cue);
    }

    /// Hears what the samples at `tick` show for the first time, and what they lack.
    pub(super) fn hear_samples(&mut self, tick: f64, is_first: bool) {
        self.hear_round(tick);
        self.hear_breaks(tick);
        for index in 0..self.samples.len() {
            let sample = self.samples[index];
            let known = self.births.get(sample.id.index as usize);
            let is_new = known.is_none_or(|birth| birth.0 != sample.id.generation);
            if is_new && !is_first && is_movable(&sample) {
                self.hear_birth(tick, &sample);
            }
        }
    }

    fn hear_birth(&mut self, tick: f64, sample: &Sample) {
        let hero = self.samples.iter().find(|s| s.kind == Kind::Hero && s.owner == sample.owner);
        let hero = hero.filter(|_| sample.owner.is_some());
        let is_near = hero.is_some_and(|hero| hero.center.distance(sample.center) < THROW_REACH);
        // In a world larger than the view most that is new has only come into view.
        if !is_near && !self.scene.camera.sees_all() {
            return;
        }
        let sound = if sample.kind == Kind::Pack { Sound::Throw } else { Sound::Spawn };
        self.ears.push(tick, Cue::of_body(sound, sample.center, size(sample), sample.id));
    }

    /// A body that can break and is gone has broken, unless a round begins or ends.
    fn hear_breaks(&mut self, tick: f64) {
        if self.ears.fragile.is_empty() || !self.scene.camera.sees_all() {
            return;
        }
        let is_running = self.ears.round.is_none_or(|turn| turn.phase == RoundPhase::Running);
        let mut whole = std::mem::take(&mut self.ears.whole);
        for &(id, center, size) in whole.iter().filter(|_| is_running) {
            if self.sampled(id).is_none() {
                self.ears.push(tick, Cue::of_body(Sound::Break, center, size, id));
            }
        }
        let is_fragile = |sample: &&Sample| {
            self.ears.fragile.contains(&(sample.kind, sample.group, sample.shape))
        };
        whole.clear();
        let samples = self.samples.iter().filter(is_fragile);
        whole.extend(samples.map(|sample| (sample.id, sample.center, size(sample))));
        self.ears.whole = whole;
    }

    fn hear_round(&mut self, tick: f64) {
        let Some(spec) = &self.scene.rules.round else { return };
        let Some(round) = self.timeline.at_or_before(tick).and_then(|s| s.round.as_ref()) else {
            return;
        };
        let left = f64::from(spec.countdown) - (tick - f64::from(round.since));
        let now = Turn::of(round, left);
        let is_won = is_won(round, self.seat);
        let Some(before) = self.ears.round.replace(now).filter(|before| *before != now) else {
            return;
        };
        let sound = match now.phase {
            RoundPhase::Countdown => Some(Sound::Count),
            RoundPhase::Running if before.phase == RoundPhase::Countdown => Some(Sound::Go),
            RoundPhase::Over if before.phase != RoundPhase::Over => {
                Some(if is_won { Sound::Won } else { Sound::Lost })
            }
            RoundPhase::Running if now.scores_after(before) => {
                let last = self.ears.goal.replace(tick);
                last.is_none_or(|last| tick - last > f64::from(GOALS_APART_TICKS))
                    .then_some(Sound::Goal)
            }
            _ => None,
        };
        if let Some(sound) = sound {
            self.ears.push(tick, Cue::of_room(sound));
        }
    }
}

/// Whether the player with a seat has won, or only watches.
fn is_won(round: &RoundInfo, seat: Seat) -> bool {
    let Some(player) = round.player(seat) else { return true };
    let side = player.team.map_or(Side::Player(seat), Side::Team);
    round.winners.contains(&side)
}

fn is_movable(sample: &Sample) -> bool {
    !matches!(sample.kind, Kind::Wall | Kind::Platform)
}

/// Width of a square or circle of about the same area, world units.
fn size(sample: &Sample) -> f32 {
    let half = sample.shape.half_extent();
    2.0 * (half.x * half.y).sqrt()
}

fn material(scene: &Scene, sample: &Sample) -> Sound {
    match sample.kind {
        Kind::Hero | Kind::Minion | Kind::Pack => Sound::Rubber,
        Kind::Marble => Sound::Glass,
        Kind::Platform | Kind::Wall => Sound::Wood,
        Kind::Block => match entry(scene, sample) {
            Some(placed) if placed.def.restitution >= RUBBER_RESTITUTION => Sound::Rubber,
            _ => Sound::Wood,
        },
    }
}

/// The first entry of the scene that looks like a body.
fn entry<'a>(scene: &'a Scene, sample: &Sample) -> Option<&'a Placed> {
    scene.bodies.iter().find(|placed| {
        let def = &placed.def;
        placed.kind == sample.kind && def.group == sample.group && def.shape == sample.shape
    })
}
