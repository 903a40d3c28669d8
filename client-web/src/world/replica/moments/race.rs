//! The progress of a race over laps: who passed which gate when. It is derived from rounds, so that a replica and a
//! ghost have it alike.

use jostle_game::scene::{Each, RoundSpec};
use jostle_game::{RoundInfo, RoundPhase, Scene, Seat, Side};

/// Maximum number of gates remembered for each player, over all laps.
const MARKS_MAX: usize = 512;

/// A race, from its start to the start of the next one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Race {
    /// Index of the order of the gates.
    order: u8,
    /// Number of gates in a lap.
    gates: usize,
    /// Number of laps.
    pub laps: usize,
    /// Number of ticks before the race began.
    since: Option<u32>,
    /// Ticks after the start at which the race was won.
    pub won_at: Option<u32>,
    /// Ticks after the start at which the race was over.
    over_at: Option<u32>,
    /// Ticks after the start at which each player passed each gate.
    runners: Vec<(Seat, Vec<u32>)>,
}

/// The length of a running round, ticks, which ends sooner once a race has a winner; `None` if it has no end.
pub fn round_length(spec: &RoundSpec, race: Option<&Race>) -> Option<u32> {
    let won_at = race.and_then(|race| race.won_at);
    let finish = spec.finish.zip(won_at).map(|(finish, won_at)| won_at + finish);
    spec.time.into_iter().chain(finish).min()
}

impl Race {
    /// The race of a scene; `None` in a scene in which players do not fly laps.
    pub fn of(scene: &Scene) -> Option<Race> {
        let rules = &scene.rules;
        let laps = rules.round.as_ref()?.goal.filter(|_| rules.teams.is_empty())? as usize;
        let mut orders = (0..).zip(&rules.signals);
        let (order, gates) = orders.find_map(|(index, signal)| {
            let order = signal.order().filter(|order| order.each != Each::All)?;
            Some((index, order.steps.len()))
        })?;
        let fits = (1..=MARKS_MAX / gates.max(1)).contains(&laps) && gates > 0;
        let (since, won_at, over_at, runners) = (None, None, None, Vec::new());
        let race = Race { order, gates, laps, since, won_at, over_at, runners };
        fits.then_some(race)
    }

    /// Notes the round after a tick.
    pub fn note(&mut self, round: &RoundInfo, tick: u32) {
        let tick = match round.phase {
            RoundPhase::Running if self.since == Some(round.since) => tick,
            RoundPhase::Running => {
                let Race { order, gates, laps, .. } = *self;
                let (since, won_at, over_at) = (Some(round.since), None, None);
                *self = Race { order, gates, laps, since, won_at, over_at, runners: Vec::new() };
                tick
            }
            // The phase began with the tick that decided the race.
            RoundPhase::Over => tick.min(round.since),
            RoundPhase::Waiting | RoundPhase::Countdown => return,
        };
        let Some(since) = self.since else { return };
        let elapsed = tick.saturating_sub(since);
        if round.phase == RoundPhase::Over {
            self.over_at.get_or_insert(elapsed);
        }
        if !round.winners.is_empty() {
            self.won_at.get_or_insert(elapsed);
        }
        self.runners.retain(|(seat, _)| round.player(*seat).is_some());
        for player in &round.players {
            let steps = round.steps(self.order, Some(Side::Player(player.seat)));
            let passed = player.side.score.max(0) as usize * self.gates + usize::from(steps);
            let known = self.runners.iter().position(|(seat, _)| *seat == player.seat);
            let index = known.unwrap_or_else(|| {
                self.runners.push((player.seat, Vec::new()));
                self.runners.len() - 1
            });
            // Progress that shrinks is another player's.
            self.runners[index].1.resize(passed.min(self.laps * self.gates), elapsed);
        }
    }

    /// Ticks after the start at which a player passed each gate so far.
    pub fn marks(&self, seat: Seat) -> &[u32] {
        let runner = self.runners.iter().find(|(known, _)| *known == seat);
        runner.map_or(&[], |(_, marks)| marks)
    }

    /// Ticks for each completed lap of a player.
    pub fn lap_times(&self, seat: Seat) -> impl Iterator<Item = u32> + '_ {
        let ends = self.marks(seat).chunks_exact(self.gates).map(|lap| lap[lap.len() - 1]);
        ends.scan(0, |begin, end| Some(end.saturating_sub(std::mem::replace(begin, end))))
    }

    /// Ticks from the start to a player's last gate, once it has been passed.
    pub fn finish(&self, seat: Seat) -> Option<u32> {
        self.marks(seat).get(self.laps * self.gates - 1).copied()
    }

    /// Ticks from the start to this moment, or to the end.
    pub fn elapsed(&self, tick: f64) -> Option<f64> {
        let over_at = self.over_at.map_or(f64::MAX, f64::from);
        Some((tick - f64::from(self.since?)).clamp(0.0, over_at))
    }

    /// A player's place, from 1, and the number of players.
    pub fn place(&self, seat: Seat) -> (usize, usize) {
        let own = self.marks(seat);
        let is_ahead = |marks: &[u32]| match marks.len() == own.len() {
            true => marks.last() < own.last(),
            false => marks.len() > own.len(),
        };
        let ahead = self.runners.iter().filter(|(_, marks)| is_ahead(marks)).count();
        (ahead + 1, self.runners.len())
    }

    /// The fastest lap of all players, ticks, and whose it is.
    pub fn fastest_lap(&self) -> Option<(u32, Seat)> {
        let laps = self
            .runners
            .iter()
            .flat_map(|&(seat, _)| self.lap_times(seat).map(move |ticks| (ticks, seat)));
        laps.min()
    }
}

/// How much later than another one a runner passed the last gate that both have passed, ticks.
pub fn split(own: &[u32], other: &[u32]) -> Option<i64> {
    let (own, other) = own.iter().zip(other).next_back()?;
    Some(i64::from(*own) - i64::from(*other))
}
