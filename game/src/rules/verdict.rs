//! The verdict: whether the round is over, and who won it.

use super::book::{Rules, Table};
use super::clock::RoundPhase;
use crate::roster::Roster;
use crate::scene::{AtTime, RoundSpec};
use crate::side::{Side, Standing};
use jostle_sim::short_sort::sort_few;

impl Rules {
    /// Ends the round if something decides it: a claim, the goal, lives, then time. No order of rules or
    /// sides matters: who decides it in the same tick shares it. Sides that are out have no part in it.
    pub(super) fn judge(&mut self, table: &mut Table) {
        let Some(spec) = &table.scene.rules.round else { return };
        let mut standings = std::mem::take(&mut self.scratch.standings);
        standings.clear();
        standings.extend(self.standings(table.roster).filter(|(_, standing)| !standing.out));
        let winners = self
            .by_claims(spec, &standings)
            .or_else(|| by_goal(spec, &standings))
            .or_else(|| self.by_lives(spec, &standings))
            .or_else(|| self.by_time(spec, &standings));
        self.scratch.standings = standings;
        if let Some(winners) = winners {
            self.reward_spare_shots(&winners, table);
            self.winners = winners;
            self.round.enter(RoundPhase::Over, 0);
        }
        self.take_out(spec, table);
    }

    /// Each shot that is left is worth something to who won.
    fn reward_spare_shots(&mut self, winners: &[Side], table: &mut Table) {
        let (Some(spec), Some(sling)) = (table.scene.sling, self.sling) else { return };
        for &side in winners {
            if let Some(standing) = self.standing(side, table) {
                standing.add_score(spec.spare.saturating_mul(i32::from(sling.shots)));
                standing.settle();
            }
        }
    }

    /// Sides that take part, in order.
    pub(super) fn sides(&self, roster: &Roster) -> Vec<Side> {
        self.standings(roster).map(|(side, _)| side).collect()
    }

    /// Sides that take part and how they stand, in order.
    pub(super) fn standings(&self, roster: &Roster) -> impl Iterator<Item = (Side, Standing)> {
        let teams = (0..).zip(&self.teams).map(|(index, team)| (Side::Team(index), *team));
        let players = roster.players.iter().filter(|player| player.team.is_none());
        let players = players.map(|player| (Side::Player(player.seat), player.standing));
        teams.chain(players).filter(|(_, standing)| standing.plays)
    }

    /// A win beats a loss; where somebody lost, the others won.
    fn by_claims(&mut self, spec: &RoundSpec, standings: &[(Side, Standing)]) -> Option<Vec<Side>> {
        let claims = &mut self.scratch.claims;
        if !claims.won.is_empty() {
            sort_few(&mut claims.won, |one, other| one < other);
            claims.won.dedup();
            return Some(claims.won.clone());
        }
        let others = alive(spec, standings).map(|(side, _)| *side);
        let others = others.filter(|side| !claims.lost.contains(side));
        (!claims.lost.is_empty()).then(|| others.collect())
    }

    /// The last side with lives; those who lost their last one in the same tick share. A side alone
    /// loses.
    fn by_lives(&self, spec: &RoundSpec, standings: &[(Side, Standing)]) -> Option<Vec<Side>> {
        spec.lives?;
        let alive: Vec<Side> = alive(spec, standings).map(|(side, _)| *side).collect();
        match (self.contested, alive.len()) {
            (true, 0) => Some(standings.iter().map(|(side, _)| *side).collect()),
            (true, 1) => Some(alive),
            (false, 0) => Some(Vec::new()),
            _ => None,
        }
    }

    fn by_time(&self, spec: &RoundSpec, standings: &[(Side, Standing)]) -> Option<Vec<Side>> {
        if self.round.ticks < spec.time? {
            return None;
        }
        Some(match spec.at_time {
            AtTime::Lose => Vec::new(),
            AtTime::Win => alive(spec, standings).map(|(side, _)| *side).collect(),
            AtTime::Score => best(alive(spec, standings)),
        })
    }

    /// Sides that lost their last life are out.
    fn take_out(&mut self, spec: &RoundSpec, table: &mut Table) {
        if spec.lives.is_none() {
            return;
        }
        let players = table.roster.players.iter_mut().map(|player| &mut player.standing);
        for standing in self.teams.iter_mut().chain(players) {
            standing.out |= standing.lives == 0;
        }
        self.update_teams();
    }
}

/// The sides that have lives left at the end of this tick, where lives count.
fn alive<'a>(
    spec: &RoundSpec,
    standings: &'a [(Side, Standing)],
) -> impl Iterator<Item = &'a (Side, Standing)> + Clone {
    let lives_count = spec.lives.is_some();
    standings.iter().filter(move |(_, standing)| !lives_count || standing.lives > 0)
}

/// Most points at the goal; equals share.
fn by_goal(spec: &RoundSpec, standings: &[(Side, Standing)]) -> Option<Vec<Side>> {
    let goal = spec.goal?;
    let winners = best(standings.iter().filter(|(_, standing)| standing.score >= goal));
    (!winners.is_empty()).then_some(winners)
}

/// The sides with most points.
fn best<'a>(standings: impl Iterator<Item = &'a (Side, Standing)> + Clone) -> Vec<Side> {
    let most = standings.clone().map(|(_, standing)| standing.score).max();
    standings.filter(|(_, standing)| Some(standing.score) == most).map(|(side, _)| *side).collect()
}
