//! Listens to a replica of a room and queues sound cues for the displayed world. Cues come from impacts that produce
//! sparks, bodies that appear or break, and changes in a round, all of which are known from snapshots and events that
//! are received anyway.

use super::moments::race::{Race, round_length};
use super::room::RoomView;
use crate::net::timeline::Sample;
use crate::sound::cue::{Cue, Sound};
use jostle_game::scene::Placed;
use jostle_game::{Kind, RoundInfo, RoundPhase, Scene, Seat, Side};
use jostle_sim::{BodyId, Shape, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;

/// Maximum number of queued cues; the oldest are dropped first.
const CUES_MAX: usize = 128;
/// Maximum age of cues, ticks. Older ones accumulate while the page is hidden.
const STALE_TICKS: f64 = 15.0;
/// Blocks with at least this restitution sound like rubber.
const RUBBER_RESTITUTION: f32 = 0.6;
/// A pack that appears within this distance of its player's hero is taken to have just been thrown, world units.
const THROW_REACH: f32 = 40.0;
/// Number of seconds at the end of a round that are counted.
pub const LATE_S: u32 = 10;
/// Points scored within this many ticks of each other, such as those for holding a hill, count as one goal.
pub const GOALS_APART_TICKS: u32 = 90;

/// The queued cues, and the state from which new ones are derived.
#[derive(Default)]
pub struct Listener {
    /// The queued cues with their ticks, oldest first.
    cues: VecDeque<(f64, Cue)>,
    /// The most recently displayed state of the round.
    round: Option<Turn>,
    /// Tick in which points were last scored, whether or not this was audible.
    goal: Option<f64>,
    /// The appearances of breakable bodies: their kinds, groups and shapes.
    fragile: Vec<(Kind, u8, Shape)>,
    /// The breakable bodies last displayed, with their positions and sizes.
    whole: Vec<(BodyId, Vec2, f32)>,
}

/// The audible state of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    pub phase: RoundPhase,
    /// Seconds left in the countdown or, if they are the last ones, in the round; otherwise this is one more.
    seconds: u32,
    players: usize,
    pub points: i32,
}

impl Listener {
    /// Creates a listener for a room that plays `scene`.
    pub fn new(scene: &Scene) -> Listener {
        let mut ears = Listener::default();
        for placed in scene.bodies.iter().filter(|placed| placed.breaks.is_some()) {
            let look = (placed.kind, placed.def.group, placed.def.shape);
            if !ears.fragile.contains(&look) {
                ears.fragile.push(look);
            }
        }
        ears
    }

    pub fn push(&mut self, tick: f64, cue: Cue) {
        if self.cues.len() == CUES_MAX {
            self.cues.pop_front();
        }
        self.cues.push_back((tick, cue));
    }

    /// Takes the oldest cue that is not too old for the displayed tick.
    pub fn pop(&mut self, display: f64) -> Option<Cue> {
        while let Some((tick, cue)) = self.cues.pop_front() {
            if tick >= display - STALE_TICKS {
                return Some(cue);
            }
        }
        None
    }

    /// Queues the cue for an impact. The movable body determines the sound; if both are movable, the smaller one does.
    pub fn hear_impact(
        &mut self,
        room: &RoomView,
        tick: u32,
        ids: [BodyId; 2],
        point: Vec2,
        speed: f32,
    ) {
        let mut movable = ids.map(|id| room.sampled(id).copied().filter(is_movable));
        let [one, other] = movable.map(|sample| sample.as_ref().map_or(f32::MAX, size));
        if other < one {
            movable.swap(0, 1);
        }
        let Some(sample) = &movable[0] else { return };
        let cue = Cue {
            sound: material(&room.scene, sample),
            at: Some(point),
            size: size(sample),
            speed,
            bodies: movable.map(|sample| sample.map(|sample| sample.id)),
        };
        self.push(f64::from(tick), cue);
    }

    /// Queues cues for bodies that first appear in the samples at `tick` or are missing from them.
    pub fn hear_samples(
        &mut self,
        room: &RoomView,
        race: Option<&Race>,
        tick: f64,
        is_first: bool,
    ) {
        self.hear_round(room, race, tick);
        self.hear_breaks(room, tick);
        for sample in &room.samples {
            if room.is_new(sample.id) && !is_first && is_movable(sample) {
                self.hear_birth(room, tick, sample);
            }
        }
    }

    fn hear_birth(&mut self, room: &RoomView, tick: f64, sample: &Sample) {
        let hero = room.samples.iter().find(|s| s.kind == Kind::Hero && s.owner == sample.owner);
        let hero = hero.filter(|_| sample.owner.is_some());
        let is_near = hero.is_some_and(|hero| hero.center.distance(sample.center) < THROW_REACH);
        // If the world is larger than the view, most new bodies have merely come into view.
        if !is_near && !room.scene.camera.sees_all() {
            return;
        }
        let sound = if sample.kind == Kind::Pack { Sound::Throw } else { Sound::Spawn };
        self.push(tick, Cue::of_body(sound, sample.center, size(sample), sample.id));
    }

    /// Queues cues for breakable bodies that are gone: they have broken, unless a round is beginning or ending.
    fn hear_breaks(&mut self, room: &RoomView, tick: f64) {
        if self.fragile.is_empty() || !room.scene.camera.sees_all() {
            return;
        }
        let is_running = self.round.is_none_or(|turn| turn.phase == RoundPhase::Running);
        let mut whole = std::mem::take(&mut self.whole);
        for &(id, center, size) in whole.iter().filter(|_| is_running) {
            if room.sampled(id).is_none() {
                self.push(tick, Cue::of_body(Sound::Break, center, size, id));
            }
        }
        let is_fragile =
            |sample: &&Sample| self.fragile.contains(&(sample.kind, sample.group, sample.shape));
        whole.clear();
        let samples = room.samples.iter().filter(is_fragile);
        whole.extend(samples.map(|sample| (sample.id, sample.center, size(sample))));
        self.whole = whole;
    }

    fn hear_round(&mut self, room: &RoomView, race: Option<&Race>, tick: f64) {
        let Some(spec) = &room.scene.rules.round else { return };
        let Some(round) = room.timeline.at_or_before(tick).and_then(|s| s.round.as_ref()) else {
            return;
        };
        let length = match round.phase {
            RoundPhase::Running => round_length(spec, race).map_or(f64::INFINITY, f64::from),
            _ => f64::from(spec.countdown),
        };
        let left = length - (tick - f64::from(round.since));
        let now = Turn::of(round, left);
        let is_won = is_won(round, room.seat);
        let Some(before) = self.round.replace(now).filter(|before| *before != now) else {
            return;
        };
        let sound = match now.phase {
            RoundPhase::Countdown => Some(Sound::Count),
            RoundPhase::Running if before.phase == RoundPhase::Countdown => Some(Sound::Go),
            RoundPhase::Over if before.phase != RoundPhase::Over => {
                Some(if is_won { Sound::Won } else { Sound::Lost })
            }
            RoundPhase::Running if now.scores_after(before) => {
                let last = self.goal.replace(tick);
                last.is_none_or(|last| tick - last > f64::from(GOALS_APART_TICKS))
                    .then_some(Sound::Goal)
            }
            RoundPhase::Running if now.seconds < before.seconds => Some(Sound::Late),
            _ => None,
        };
        if let Some(sound) = sound {
            self.push(tick, Cue::of_room(sound));
        }
    }
}

impl Turn {
    /// The state of a round with this many ticks left in its countdown or in itself.
    pub fn of(round: &RoundInfo, left: f64) -> Turn {
        let seconds = (left / f64::from(TICKS_PER_SECOND)).ceil().max(1.0) as u32;
        let seconds = match round.phase {
            RoundPhase::Countdown => seconds,
            RoundPhase::Running => seconds.min(LATE_S + 1),
            RoundPhase::Waiting | RoundPhase::Over => 0,
        };
        let teams = round.teams.iter().map(|info| info.score);
        let players = round.players.iter().map(|player| player.side.score);
        Turn {
            phase: round.phase,
            seconds,
            players: round.players.len(),
            points: teams.chain(players).fold(0, i32::saturating_add),
        }
    }

    /// Whether points were scored since `before`. Changes caused by players joining or leaving do not count.
    pub fn scores_after(self, before: Turn) -> bool {
        let is_same_game = (self.phase, self.players) == (before.phase, before.players);
        is_same_game && self.points > before.points
    }
}

/// Whether the player with this seat has won. Always true for a spectator.
fn is_won(round: &RoundInfo, seat: Seat) -> bool {
    let Some(player) = round.player(seat) else { return true };
    let side = player.team.map_or(Side::Player(seat), Side::Team);
    round.winners.contains(&side)
}

fn is_movable(sample: &Sample) -> bool {
    !matches!(sample.kind, Kind::Wall | Kind::Platform)
}

/// Width of a square or circle of about equal area, world units.
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

/// The first scene entry that looks like a body.
fn entry<'a>(scene: &'a Scene, sample: &Sample) -> Option<&'a Placed> {
    scene.bodies.iter().find(|placed| {
        let def = &placed.def;
        placed.kind == sample.kind && def.group == sample.group && def.shape == sample.shape
    })
}
