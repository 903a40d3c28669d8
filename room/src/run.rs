//! Runs: won rounds, read from a replay by playing it again.
//!
//! A run belongs to the scene whose text is in the replay. Its measure follows from the scene's rules: the time until a
//! side wins, or the winners' points. Only the players' inputs are trusted. The game starts at tick 0 with the replay's
//! seed, every hash and every state in the file is compared with the game, and the result is read from the game. The
//! replay cannot prove that a person pressed the keys, or whose name it bears.

use crate::playback::{Playback, PlaybackError};
use jostle_game::scene::{RoundSpec, RuleSpec};
use jostle_game::{RoundInfo, RoundPhase, Scene, Seat, Side};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Ending, Replay, ReplayError};
use jostle_sim::TICKS_PER_SECOND;
use std::sync::Arc;

/// Maximum number of ticks in a run's replay: half an hour, because the game is always played from the first tick.
pub const RUN_TICKS_MAX: u32 = 30 * 60 * TICKS_PER_SECOND;

/// The measure that determines which of two runs in a scene is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The run in which a side wins sooner is better.
    Time,
    /// The run whose winners have more points is better; if they are equal, the shorter one is.
    Points,
}

impl Measure {
    /// The measure defined by a scene's rules. `None` if there are no rounds, or if teams play against each other,
    /// because the winning time then depends on the opponents. The same holds if everyone plays alone and others can
    /// lose.
    pub fn of(scene: &Scene) -> Option<Measure> {
        let round = scene.rules.round.as_ref().filter(|_| scene.rules.teams.len() < 2)?;
        let ends = |won| move |rule: &RuleSpec| rule.effects.end == Some(won);
        let has = |won| scene.rules.rules.iter().any(ends(won));
        let can_lose = round.lives.is_some() || has(false);
        let is_crew = !scene.rules.teams.is_empty();
        let is_won = (round.goal.is_some() || has(true)) && (is_crew || !can_lose);
        match round.stars {
            None if is_won => Some(Measure::Time),
            _ => scene.counts_points().then_some(Measure::Points),
        }
    }

    /// The measure's name in server answers.
    pub fn name(self) -> &'static str {
        match self {
            Measure::Time => "time",
            Measure::Points => "points",
        }
    }
}

/// A round that was won.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// The measure used to compare the run with others.
    pub measure: Measure,
    /// Number of ticks in the game before the round began.
    pub begin: u32,
    /// The tick that decided the round.
    pub end: u32,
    /// The winners' points.
    pub points: i32,
    /// The state hash after that tick.
    pub hash: u64,
    /// The winners, in seat order. There is at least one.
    pub players: Vec<(Seat, Appearance)>,
}

impl Run {
    /// The round's length in ticks.
    pub fn ticks(&self) -> u32 {
        self.end - self.begin
    }

    /// The sort key; smaller is better.
    pub fn rank(&self) -> (i32, u32) {
        match self.measure {
            Measure::Time => (0, self.ticks()),
            Measure::Points => (-self.points, self.ticks()),
        }
    }
}

/// The reason why a replay proves no run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unproven {
    /// The scene's runs are not compared.
    #[error(
        "runs of this scene are not compared: it has no rounds, or teams play against each other"
    )]
    NotCompared,
    /// The replay is of a different scene, or of a different version of the scene's text.
    #[error("the scene in the replay is not the one that is played here under the name {0:?}")]
    OtherScene(String),
    /// The replay begins in the middle of a game.
    #[error("the replay begins after tick {0}; a run is recorded from the first tick of its game")]
    Midway(u32),
    /// The replay is too long.
    #[error("the replay has {0} ticks; a run has at most {RUN_TICKS_MAX}")]
    TooLong(u32),
    /// The replay is damaged or truncated.
    #[error("the replay is not whole: {0}")]
    NotWhole(ReplayError),
    /// The replay cannot be played.
    #[error("the replay cannot be played: {0}")]
    Unplayable(#[from] PlaybackError),
    /// A hash of the game differs from the recorded one.
    #[error("tick {0} does not have the recorded hash when it is played again")]
    Differs(u32),
    /// A state in the file differs from the game's.
    #[error("the keyframe of tick {0} is not the state that is played")]
    OtherState(u32),
    /// The replay has more players than a room with this scene allows.
    #[error("{0} players are in the game, more than a room of this scene takes")]
    TooMany(usize),
    /// No round in the replay was won.
    #[error("no player wins a round in this replay")]
    NoResult,
    /// The replay takes too long to play.
    #[error("the replay takes too long to play: it came to tick {0}")]
    TooSlow(u32),
}

/// Plays a replay of this scene again, and returns the replay's best run. `may_go_on` is called after each tick.
pub fn prove(
    replay: &Arc<Replay>,
    scene: &Scene,
    mut may_go_on: impl FnMut() -> bool,
) -> Result<Run, Unproven> {
    let measure = Measure::of(scene).ok_or(Unproven::NotCompared)?;
    check_outline(replay, scene)?;
    let mut playback = Playback::new(Arc::clone(replay))?;
    let mut keyframes = replay.keyframe_ticks().peekable();
    let mut watch = Watch { measure, round: None, begin: None, won: None, best: None };
    while let Some(played) = playback.step()? {
        if !played.agrees {
            return Err(Unproven::Differs(played.tick));
        }
        if keyframes.next_if_eq(&played.tick).is_some() && !has_state(&playback) {
            return Err(Unproven::OtherState(played.tick));
        }
        let members = playback.moment().members.len();
        if members > usize::from(scene.players_max) {
            return Err(Unproven::TooMany(members));
        }
        watch.see(&playback);
        if !may_go_on() {
            return Err(Unproven::TooSlow(played.tick));
        }
    }
    if replay.end_hash() != Some(playback.game().hash()) {
        return Err(Unproven::Differs(playback.tick()));
    }
    // A keyframe before the first tick, or a second one for the same tick, was not compared.
    if let Some(tick) = keyframes.next() {
        return Err(Unproven::OtherState(tick));
    }
    watch.best.ok_or(Unproven::NoResult)
}

/// Performs the checks that do not require playing.
fn check_outline(replay: &Replay, scene: &Scene) -> Result<(), Unproven> {
    let start = replay.start();
    if (start.scene_name != scene.name) || (start.scene != scene.source) {
        return Err(Unproven::OtherScene(start.scene_name.clone()));
    }
    if start.first_tick > 0 {
        return Err(Unproven::Midway(start.first_tick));
    }
    if replay.last_tick() > RUN_TICKS_MAX {
        return Err(Unproven::TooLong(replay.last_tick()));
    }
    match replay.ending() {
        Ending::Whole => Ok(()),
        Ending::Cut(error) | Ending::Damaged(error) => Err(Unproven::NotWhole(error)),
    }
}

/// Returns whether this tick's keyframe matches the game. Replay players resume from keyframes, so they must be
/// genuine.
fn has_state(playback: &Playback) -> bool {
    let (moment, game) = (playback.moment(), playback.game());
    let keyframe = playback.replay().keyframe_before(playback.tick());
    keyframe.is_some_and(|keyframe| {
        let members = keyframe.members.iter().map(|(seat, look)| (&seat.0, look));
        keyframe.hash == game.hash() && keyframe.state == game.save() && members.eq(&moment.members)
    })
}

/// Watches a game's rounds as it is played.
struct Watch {
    measure: Measure,
    round: Option<RoundInfo>,
    /// Number of ticks before the current round.
    begin: Option<u32>,
    /// The winners of the current round, the tick that decided it and the hash after that, while it goes on for others.
    won: Option<(Vec<Side>, u32, u64)>,
    best: Option<Run>,
}

impl Watch {
    fn see(&mut self, playback: &Playback) {
        playback.game().capture_round(&mut self.round);
        let Some(round) = &self.round else { return };
        match round.phase {
            RoundPhase::Running => {
                self.begin = Some(round.since);
                self.won.take_if(|won| won.0 != round.winners);
                if self.won.is_none() && !round.winners.is_empty() {
                    let (tick, hash) = (playback.tick(), playback.game().hash());
                    self.won = Some((round.winners.clone(), tick, hash));
                }
            }
            RoundPhase::Waiting | RoundPhase::Countdown => self.begin = None,
            RoundPhase::Over => {
                let won = self.won.take().filter(|won| won.0 == round.winners);
                let end = || (playback.tick(), playback.game().hash());
                let end = won.map_or_else(end, |(_, tick, hash)| (tick, hash));
                let begin = self.begin.take();
                let run = begin.and_then(|begin| result(self.measure, begin, end, round, playback));
                let is_better =
                    |run: &Run| self.best.as_ref().is_none_or(|best| run.rank() < best.rank());
                if let Some(run) = run.filter(is_better) {
                    self.best = Some(run);
                }
            }
        }
    }
}

/// Returns whether a round was won by playing rather than by reaching its time limit.
fn is_finished(measure: Measure, spec: &RoundSpec, ticks: u32, points: i32) -> bool {
    let reached = spec.goal.is_some_and(|goal| points >= goal);
    measure == Measure::Points || reached || spec.time.is_none_or(|time| ticks < time)
}

/// The run for a finished round, if a side won it.
fn result(
    measure: Measure,
    begin: u32,
    (end, hash): (u32, u64),
    round: &RoundInfo,
    playback: &Playback,
) -> Option<Run> {
    let points = round.winners.iter().filter_map(|&side| Some(round.side(side)?.score)).max()?;
    let won = |side: &Side| round.winners.contains(side);
    let seats = round.players.iter().map(|player| player.seat);
    let winners = seats.filter(|&seat| won(&round.side_of(seat)));
    let look = |seat: Seat| Some((seat, playback.moment().members.get(&seat.0)?.clone()));
    let players: Vec<(Seat, Appearance)> = winners.filter_map(look).collect();
    let spec = playback.game().scene().rules.round.as_ref()?;
    if !is_finished(measure, spec, end - begin, points) {
        return None;
    }
    (!players.is_empty()).then_some(Run { measure, begin, end, points, hash, players })
}

#[cfg(test)]
mod tests;
