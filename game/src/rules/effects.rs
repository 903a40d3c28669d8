//! The occasions that trigger rules, and the effects of rules.

use super::body_notes::BodyNotes;
use super::context::RuleContext;
use super::core::Rules;
use super::signals::Lap;
use crate::event::Event;
use crate::input::Seat;
use crate::roster::Roster;
use crate::scene::{Condition, Effects, Levels, RuleSpec, To, Trigger};
use crate::side::{Side, SideState};
use jostle_sim::BodyId;

/// Maximum number of occurrences on which rules act in a tick, in rule order; any more have no effect. In a heap
/// where all bodies touch, the number of occurrences for each rule grows with the square of the number of bodies.
const OCCURRENCES_MAX: usize = 4096;

/// A single occasion on which a rule applies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Occurrence {
    /// The body that the rule is about. It may be gone.
    pub it: Option<BodyId>,
    /// The other body of a touch.
    pub other: Option<BodyId>,
    /// The owner of the body, or the last player to touch it.
    pub player: Option<Seat>,
    /// The player who caused the occurrence.
    pub by: Option<Seat>,
}

impl Rules {
    /// Applies the rules in file order; `before` holds the levels of the previous tick. All occurrences are listed
    /// before anything acts on them, so that no rule can take an occurrence away from another.
    pub(super) fn apply(&mut self, before: Levels, table: &mut RuleContext) {
        self.claims.clear();
        let scene = table.scene;
        let (mut found, mut of_rule) = (Vec::new(), Vec::new());
        let has_laps = !self.signals.laps.is_empty();
        let may_act = |rule: &RuleSpec| has_laps || rule.condition.all(self.levels);
        for (index, rule) in (0..).zip(&scene.rules.rules).filter(|(_, rule)| may_act(rule)) {
            of_rule.clear();
            self.list_occurrences(rule.occasion, before, table, &mut of_rule);
            of_rule.retain(|of| {
                let side = of.player.map(|seat| table.roster.side_of(seat));
                rule.team.is_none_or(|team| side == Some(Side::Team(team)))
                    && rule.condition.all(self.signals.levels_of(
                        self.levels,
                        of.player,
                        table.roster,
                    ))
            });
            if let Some(&Occurrence { player, by, .. }) = of_rule.first()
                && rule.effects.say.is_some()
            {
                table.events.push(Event::Said { rule: index, it: player, by });
            }
            let left = OCCURRENCES_MAX - found.len();
            found.extend(of_rule.iter().take(left).map(|&occurrence| (rule, occurrence)));
        }
        for (rule, occurrence) in &found {
            self.act(rule, occurrence, table);
        }
        self.teams.all(table.roster).for_each(SideState::settle);
    }

    fn act(&mut self, rule: &RuleSpec, occurrence: &Occurrence, table: &mut RuleContext) {
        let effects = &rule.effects;
        self.act_on_sides(rule, occurrence, table);
        if let Some(it) = occurrence.it {
            act_on_body(effects, it, occurrence.other, &mut self.notes, table);
        }
        for &body in &effects.reset {
            self.notes.reset(body, effects.back.unwrap_or(0), table);
        }
    }

    fn act_on_sides(&mut self, rule: &RuleSpec, occurrence: &Occurrence, table: &mut RuleContext) {
        let Effects { score, life, end, .. } = rule.effects;
        if score == 0 && life == 0 && end.is_none() {
            return;
        }
        let round = table.scene.rules.round.as_ref();
        for side in self.concerned(rule.to, occurrence, table) {
            let Some(standing) = self.teams.standing(side, table.roster) else { continue };
            if !round.is_some_and(|round| round.is_finished(standing.score)) {
                standing.add_score(score);
            }
            standing.add_lives(life);
            match end {
                Some(true) => self.claims.won.push(side),
                Some(false) => self.claims.lost.push(side),
                None => {}
            }
        }
    }

    /// The sides affected by an effect.
    fn concerned(&self, to: To, occurrence: &Occurrence, table: &RuleContext) -> Vec<Side> {
        let side = |seat| table.roster.side_of(seat);
        let of = |player: Option<Seat>| player.map(side).into_iter().collect();
        match to {
            To::It if occurrence.it.is_none() => self.teams.sides(table.roster),
            To::It => of(occurrence.player),
            To::By => of(occurrence.by),
            To::All => self.teams.sides(table.roster),
            To::Team(team) => vec![Side::Team(team)],
            To::Holder(zone) => self.zones.states[usize::from(zone)].holder.into_iter().collect(),
            To::Others => {
                let mut sides = self.teams.sides(table.roster);
                let own = occurrence.player.map(side);
                sides.retain(|&side| Some(side) != own);
                sides
            }
        }
    }

    /// Lists an occasion's occurrences in this tick, in the order in which they are found.
    fn list_occurrences(
        &self,
        occasion: Trigger,
        before: Levels,
        table: &RuleContext,
        found: &mut Vec<Occurrence>,
    ) {
        let (notes, roster) = (&self.notes, &*table.roster);
        let of = |zones: u64| move |&&(zone, _): &&(u8, BodyId)| zones >> zone & 1 == 1;
        match occasion {
            Trigger::Enter(zones) => {
                let entered = self.zones.entered.iter().filter(of(zones));
                found.extend(entered.map(|&(_, id)| about(id, notes, roster)));
            }
            Trigger::Leave(zones) => {
                let left = self.zones.left.iter().filter(of(zones));
                found.extend(left.map(|&(_, id)| about(id, notes, roster)));
            }
            Trigger::On(condition) => self.list_edge(condition, before, table, found),
            Trigger::Every(ticks) => {
                if self.round.ticks.is_multiple_of(ticks) {
                    found.push(Occurrence::default());
                }
            }
            Trigger::Touch(first, second) => list_touches(first, second, notes, table, found),
            Trigger::Burst => {
                for event in table.events.iter() {
                    if let Event::PackHit { owner, victim, hero, .. } = *event
                        && !roster.is_away(victim)
                    {
                        found.push(Occurrence { by: owner, ..about(hero, notes, roster) });
                    }
                }
            }
            Trigger::Lost(group) => {
                for event in table.events.iter() {
                    if let Event::BodyLeft { body, .. } = *event
                        && let Some(note) = notes.get(body)
                        && note.group == group
                    {
                        found.push(about_gone(body, notes, roster));
                    }
                }
            }
            Trigger::Breaks(group) => {
                for broken in self.breakage.broken.iter().filter(|broken| broken.group == group) {
                    let (it, by) = (Some(broken.body), broken.by);
                    found.push(Occurrence { it, other: None, player: by, by });
                }
            }
        }
    }

    /// Lists the edge of a condition that began to hold. A condition that names a lap applies once to each player or
    /// side that completes it, regardless of the previous tick. If it names several laps, the last one counts.
    fn list_edge(
        &self,
        condition: Condition,
        before: Levels,
        table: &RuleContext,
        found: &mut Vec<Occurrence>,
    ) {
        let named = |lap: &&Lap| condition.on.signals >> lap.signal & 1 == 1;
        let laps = self.signals.laps.iter().filter(named);
        let Some(last) = laps.clone().map(|lap| lap.signal).max() else {
            if !condition.all(before) && condition.all(self.levels) {
                found.push(Occurrence::default());
            }
            return;
        };
        let completed = laps
            .filter(|lap| lap.signal == last)
            .map(|lap| about(lap.body, &self.notes, table.roster));
        let holds = |of: &Occurrence| {
            condition.all(self.signals.levels_of(self.levels, of.player, table.roster))
        };
        found.extend(completed.filter(holds));
    }
}

fn list_touches(
    first: u8,
    second: u8,
    notes: &BodyNotes,
    table: &RuleContext,
    found: &mut Vec<Occurrence>,
) {
    let world = &*table.world;
    for touch in world.touches().iter().filter(|touch| touch.began) {
        let groups = [touch.a, touch.b].map(|id| world.contains(id).then(|| world.group(id)));
        let [Some(group_a), Some(group_b)] = groups else { continue };
        let (it, other) = if (group_a, group_b) == (first, second) {
            (touch.a, touch.b)
        } else if (group_b, group_a) == (first, second) {
            (touch.b, touch.a)
        } else {
            continue;
        };
        found.push(Occurrence { other: Some(other), ..about(it, notes, table.roster) });
    }
}

/// An occurrence about a body, caused by its owner or by the last player to touch it.
fn about(id: BodyId, notes: &BodyNotes, roster: &Roster) -> Occurrence {
    let owner = roster.owner_of(id);
    let touched_by = notes.get(id).and_then(|note| note.touched_by);
    let player = owner.or(touched_by);
    Occurrence { it: Some(id), other: None, player, by: player }
}

/// An occurrence about a body that left the world, caused by the last player to touch it.
fn about_gone(id: BodyId, notes: &BodyNotes, roster: &Roster) -> Occurrence {
    let touched_by = notes.get(id).and_then(|note| note.touched_by);
    let owner = roster.players.iter().find(|player| player.lost == Some(id));
    let player = owner.map(|player| player.seat).or(touched_by);
    Occurrence { it: Some(id), other: None, player, by: touched_by }
}

fn act_on_body(
    effects: &Effects,
    it: BodyId,
    other: Option<BodyId>,
    notes: &mut BodyNotes,
    table: &mut RuleContext,
) {
    let exists = table.world.contains(it);
    if let Some(recipe) = effects.splash.filter(|_| exists) {
        table.splash(recipe, it);
    }
    if let Some(player) = table.roster.players.iter_mut().find(|player| player.hero == Some(it)) {
        player.controls.stun = player.controls.stun.max(effects.stun);
        if effects.checkpoint {
            player.checkpoint = Some(table.world.position(it));
        }
        if effects.drop || effects.stun > 0 {
            player.drop_carried(table.world);
        }
        if let Some(other) = other.filter(|_| effects.carry) {
            player.carry(other, table.world);
        }
    }
    if let Some(ticks) = effects.back {
        notes.send_back(it, ticks, table);
    }
    if effects.remove && table.world.contains(it) {
        table.roster.remove(table.world, it);
    }
}
