//! The verdict says how the sides stand, whether the round is over, and who won it.

use crate::roster::Roster;
use crate::scene::{AtTime, RoundSpec, Scene};
use crate::side::{Side, SideState};
use jostle_sim::short_sort::sort_few;

/// The teams of a scene. Players without a team have their standing in the roster.
#[derive(Clone, Debug, Default)]
pub(crate) struct Teams {
    pub standings: Vec<SideState>,
    /// Whether the round began with at least two sides.
    pub(super) contested: bool,
}

impl Teams {
    pub fn new(scene: &Scene) -> Teams {
        let set = &scene.rules;
        let standing = SideState::at_start(set.lives(), set.round.is_none());
        Teams { standings: vec![standing; set.teams.len()], contested: false }
    }

    /// One bit for each team that is in.
    pub fn levels(&self) -> u8 {
        let teams = self.standings.iter().enumerate().filter(|(_, team)| team.is_in());
        teams.fold(0, |all, (index, _)| all | 1 << index)
    }

    /// Enters all sides that currently have players into the round that is about to begin, without points.
    pub fn count_in(&mut self, scene: &Scene, roster: &mut Roster) {
        let lives = scene.rules.lives();
        let has_players = |team| roster.players.iter().any(|player| player.team == Some(team));
        for (index, team) in (0u8..).zip(&mut self.standings) {
            *team = SideState::at_start(lives, has_players(index));
        }
        for player in &mut roster.players {
            player.standing = SideState::at_start(lives, true);
        }
        let sides = self.standings.iter().filter(|team| team.plays).count();
        self.contested = if self.standings.is_empty() { roster.players.len() } else { sides } > 1;
    }

    /// Sides that take part in the round, in order.
    pub fn sides(&self, roster: &Roster) -> Vec<Side> {
        self.playing(roster).map(|(side, _)| side).collect()
    }

    /// Sides that take part in the round with their standings, in order.
    pub fn playing(&self, roster: &Roster) -> impl Iterator<Item = (Side, SideState)> {
        let teams = (0..).zip(&self.standings).map(|(index, team)| (Side::Team(index), *team));
        let players = roster.players.iter().filter(|player| player.team.is_none());
        let players = players.map(|player| (Side::Player(player.seat), player.standing));
        teams.chain(players).filter(|(_, standing)| standing.plays)
    }

    /// The standing of a side that takes part and is not out.
    pub fn standing<'a>(
        &'a mut self,
        side: Side,
        roster: &'a mut Roster,
    ) -> Option<&'a mut SideState> {
        let standing = match side {
            Side::Team(team) => self.standings.get_mut(usize::from(team)),
            Side::Player(seat) => {
                let mut players = roster.players.iter_mut();
                players.find(|player| player.seat == seat).map(|player| &mut player.standing)
            }
        };
        standing.filter(|standing| !standing.out)
    }

    /// The standings of all teams and players.
    pub fn all<'a>(
        &'a mut self,
        roster: &'a mut Roster,
    ) -> impl Iterator<Item = &'a mut SideState> {
        let players = roster.players.iter_mut().map(|player| &mut player.standing);
        self.standings.iter_mut().chain(players)
    }
}

/// A tick's claims that the round is won or lost.
#[derive(Clone, Debug, Default)]
pub(super) struct Claims {
    pub won: Vec<Side>,
    pub lost: Vec<Side>,
    /// Scratch memory for the sides that are not out.
    standings: Vec<(Side, SideState)>,
}

impl Claims {
    pub fn clear(&mut self) {
        self.won.clear();
        self.lost.clear();
    }

    /// The winners of the round, if it is decided, which can be by a claim, the goal, lives or time, in that
    /// order. The order of rules and sides does not matter: those who decide the round in the same tick
    /// share the win. Sides that are out have no part in it.
    pub fn winners(
        &mut self,
        spec: &RoundSpec,
        ticks: u32,
        teams: &Teams,
        roster: &Roster,
    ) -> Option<Vec<Side>> {
        self.standings.clear();
        self.standings.extend(teams.playing(roster).filter(|(_, standing)| !standing.out));
        self.by_claims(spec)
            .or_else(|| by_goal(spec, &self.standings))
            .or_else(|| by_lives(spec, &self.standings, teams.contested))
            .or_else(|| by_time(spec, &self.standings, ticks))
    }

    /// Whether a round that was won after `won_at` ticks goes on, because sides are still on their way to the goal and
    /// have time left. Uses the standings of the latest call of [`Claims::winners`].
    pub fn goes_on(&self, spec: &RoundSpec, ticks: u32, won_at: u32) -> bool {
        let has_time = spec.finish.is_some_and(|finish| ticks - won_at < finish)
            && spec.time.is_none_or(|time| ticks < time);
        let is_home = |(_, standing): &(Side, SideState)| spec.is_finished(standing.score);
        let home = self.standings.iter().filter(|side| is_home(side)).count();
        let is_claimed = !self.won.is_empty() || !self.lost.is_empty();
        has_time && !is_claimed && (1..self.standings.len()).contains(&home)
    }

    /// Decides by claims. A win takes precedence over a loss, and if a side lost, the others won.
    fn by_claims(&mut self, spec: &RoundSpec) -> Option<Vec<Side>> {
        let Claims { won, lost, standings } = self;
        if !won.is_empty() {
            sort_few(won, |one, other| one < other);
            won.dedup();
            return Some(won.clone());
        }
        let others = alive(spec, standings).map(|(side, _)| *side);
        (!lost.is_empty()).then(|| others.filter(|side| !lost.contains(side)).collect())
    }
}

/// Decides by lives. The last side that has lives wins, and sides that lose their last lives in the same tick
/// share the win. A side that plays alone loses.
fn by_lives(
    spec: &RoundSpec,
    standings: &[(Side, SideState)],
    contested: bool,
) -> Option<Vec<Side>> {
    spec.lives?;
    let alive: Vec<Side> = alive(spec, standings).map(|(side, _)| *side).collect();
    match (contested, alive.len()) {
        (true, 0) => Some(standings.iter().map(|(side, _)| *side).collect()),
        (true, 1) => Some(alive),
        (false, 0) => Some(Vec::new()),
        _ => None,
    }
}

fn by_time(spec: &RoundSpec, standings: &[(Side, SideState)], ticks: u32) -> Option<Vec<Side>> {
    if ticks < spec.time? {
        return None;
    }
    Some(match spec.at_time {
        AtTime::Lose => Vec::new(),
        AtTime::Win => alive(spec, standings).map(|(side, _)| *side).collect(),
        AtTime::Score => best(alive(spec, standings)),
    })
}

/// The sides that have lives left at the end of this tick, or all sides if lives do not count.
fn alive<'a>(
    spec: &RoundSpec,
    standings: &'a [(Side, SideState)],
) -> impl Iterator<Item = &'a (Side, SideState)> + Clone {
    let lives_count = spec.lives.is_some();
    standings.iter().filter(move |(_, standing)| !lives_count || standing.lives > 0)
}

/// Decides by the goal. Once any side has reached it, the side with the most points wins; in a tie, sides share the
/// win.
fn by_goal(spec: &RoundSpec, standings: &[(Side, SideState)]) -> Option<Vec<Side>> {
    let goal = spec.goal?;
    let winners = best(standings.iter().filter(|(_, standing)| standing.score >= goal));
    (!winners.is_empty()).then_some(winners)
}

/// The sides with the most points.
fn best<'a>(standings: impl Iterator<Item = &'a (Side, SideState)> + Clone) -> Vec<Side> {
    let most = standings.clone().map(|(_, standing)| standing.score).max();
    standings.filter(|(_, standing)| Some(standing.score) == most).map(|(side, _)| *side).collect()
}
