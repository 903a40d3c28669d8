//! The ears of a copy of a room: cues that wait to be taken, and the state that the next ones are compared with.

use crate::sound::cue::Cue;
use jostle_game::{Kind, RoundInfo, RoundPhase, Scene};
use jostle_sim::{BodyId, Shape, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;

/// Cues that wait to be taken; the oldest go first.
const CUES_MAX: usize = 128;

/// The state of hearing.
#[derive(Default)]
pub struct Ears {
    /// With their ticks, the oldest first.
    cues: VecDeque<(f64, Cue)>,
    /// The round as it was last on display.
    pub round: Option<Turn>,
    /// Tick of the newest points, heard or not.
    pub goal: Option<f64>,
    /// Looks of bodies that can break: their kinds, groups and shapes.
    pub fragile: Vec<(Kind, u8, Shape)>,
    /// Bodies that can break and were last on display, with their places and sizes.
    pub whole: Vec<(BodyId, Vec2, f32)>,
}

/// A round, as far as it is heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    pub phase: RoundPhase,
    /// Seconds left of the countdown.
    countdown: u32,
    players: usize,
    points: i32,
}

impl Ears {
    /// Of a room that plays `scene`.
    pub fn new(scene: &Scene) -> Ears {
        let mut ears = Ears::default();
        for placed in scene.bodies.iter().filter(|placed| placed.breaks.is_some()) {
            let look = (placed.kind, placed.def.group, placed.def.shape);
            if !ears.fragile.contains(&look) {
                ears.fragile.push(look);
            }
        }
        ears
    }

    /// Keeps a cue until it is taken.
    pub fn push(&mut self, tick: f64, cue: Cue) {
        if self.cues.len() == CUES_MAX {
            self.cues.pop_front();
        }
        self.cues.push_back((tick, cue));
    }

    /// Takes the oldest cue that is not from before a tick.
    pub fn pop_since(&mut self, tick: f64) -> Option<Cue> {
        while let Some((cued, cue)) = self.cues.pop_front() {
            if cued >= tick {
                return Some(cue);
            }
        }
        None
    }
}

impl Turn {
    /// A round with this many ticks left of a countdown.
    pub fn of(round: &RoundInfo, left: f64) -> Turn {
        let is_counting = round.phase == RoundPhase::Countdown;
        let seconds = (left / f64::from(TICKS_PER_SECOND)).ceil().max(1.0) as u32;
        let teams = round.teams.iter().map(|info| info.score);
        let players = round.players.iter().map(|player| player.side.score);
        Turn {
            phase: round.phase,
            countdown: if is_counting { seconds } else { 0 },
            players: round.players.len(),
            points: teams.chain(players).fold(0, i32::saturating_add),
        }
    }

    /// Points that come and go with players are no goals.
    pub fn scores_after(self, before: Turn) -> bool {
        let is_same_game = (self.phase, self.players) == (before.phase, before.players);
        is_same_game && self.points > before.points
    }
}
