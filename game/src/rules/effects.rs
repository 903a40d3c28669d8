//! Effects: what rules do.

use super::book::{Rules, Table};
use super::notes::{BodyNote, BodyStart, Rest};
use super::occasions::Occurrence;
use crate::actor::Rule;
use crate::event::Event;
use crate::input::Seat;
use crate::scene::{Effects, Levels, RuleSpec, To};
use crate::side::{Side, Standing};
use crate::{emitters, placing};
use glam::Vec2;
use jostle_sim::{BodyId, EmitterDef, Motion, Source};

/// Occurrences on which rules act in a tick, those of the first rules; further ones have no effect. A heap in which all
/// bodies touch has as many for each rule as the square of its bodies.
const OCCURRENCES_MAX: usize = 4096;
/// Particles of a splash.
const SPLASH_PARTICLES: u16 = 40;

impl Rules {
    /// Goes over the rules in file order; `before` are the levels of the last tick. What happened is listed
    /// before anything acts on it, so that no rule takes an occasion from another.
    pub(super) fn apply(&mut self, before: Levels, table: &mut Table) {
        self.scratch.claims.won.clear();
        self.scratch.claims.lost.clear();
        let scene = table.scene;
        let (mut found, mut of_rule) = (Vec::new(), Vec::new());
        let has_laps = !self.scratch.laps.is_empty();
        let may_act = |rule: &RuleSpec| has_laps || rule.condition.all(self.levels);
        for (index, rule) in (0..).zip(&scene.rules.rules).filter(|(_, rule)| may_act(rule)) {
            of_rule.clear();
            self.list_occurrences(rule.occasion, before, table, &mut of_rule);
            of_rule.retain(|of| {
                let side = of.player.map(|seat| table.roster.side_of(seat));
                rule.team.is_none_or(|team| side == Some(Side::Team(team)))
                    && rule.condition.all(self.levels_of(of.player, table.roster))
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
        let players = table.roster.players.iter_mut().map(|player| &mut player.standing);
        self.teams.iter_mut().chain(players).for_each(Standing::settle);
    }

    fn act(&mut self, rule: &RuleSpec, occurrence: &Occurrence, table: &mut Table) {
        let effects = &rule.effects;
        self.act_on_sides(rule, occurrence, table);
        if let Some(it) = occurrence.it {
            self.act_on_body(effects, it, occurrence.other, table);
        }
        for &body in &effects.reset {
            self.reset(body, effects.back.unwrap_or(0), table);
        }
    }

    fn act_on_sides(&mut self, rule: &RuleSpec, occurrence: &Occurrence, table: &mut Table) {
        let Effects { score, life, end, .. } = rule.effects;
        if score == 0 && life == 0 && end.is_none() {
            return;
        }
        for side in self.concerned(rule.to, occurrence, table) {
            let Some(standing) = self.standing(side, table) else { continue };
            standing.add_score(score);
            standing.add_lives(life);
            match end {
                Some(true) => self.scratch.claims.won.push(side),
                Some(false) => self.scratch.claims.lost.push(side),
                None => {}
            }
        }
    }

    /// The sides that an effect concerns.
    fn concerned(&self, to: To, occurrence: &Occurrence, table: &Table) -> Vec<Side> {
        let side = |seat| table.roster.side_of(seat);
        let of = |player: Option<Seat>| player.map(side).into_iter().collect();
        match to {
            To::It if occurrence.it.is_none() => self.sides(table.roster),
            To::It => of(occurrence.player),
            To::By => of(occurrence.by),
            To::All => self.sides(table.roster),
            To::Team(team) => vec![Side::Team(team)],
            To::Holder(zone) => self.zones[usize::from(zone)].holder.into_iter().collect(),
            To::Others => {
                let mut sides = self.sides(table.roster);
                let own = occurrence.player.map(side);
                sides.retain(|&side| Some(side) != own);
                sides
            }
        }
    }

    fn act_on_body(
        &mut self,
        effects: &Effects,
        it: BodyId,
        other: Option<BodyId>,
        table: &mut Table,
    ) {
        let exists = table.world.contains(it);
        if let Some(recipe) = effects.splash.filter(|_| exists) {
            splash(recipe, it, table);
        }
        if let Some(player) = table.roster.players.iter_mut().find(|player| player.hero == Some(it))
        {
            player.stun = player.stun.max(effects.stun);
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
            self.send_back(it, ticks, table);
        }
        if effects.remove && table.world.contains(it) {
            table.roster.remove(table.world, it);
        }
    }

    /// Puts a body of the scene back to its start, where it rests for so many ticks.
    pub(super) fn reset(&mut self, body: usize, ticks: u32, table: &mut Table) {
        match table.roster.placed[body] {
            Some(id) => self.send_back(id, ticks, table),
            None => self.bring_back(body, ticks, table),
        }
    }

    /// Puts a body back to its start; one that is gone is made again if it is the scene's.
    fn send_back(&mut self, id: BodyId, ticks: u32, table: &mut Table) {
        if !table.world.contains(id) {
            let placed = self.notes.get(id).and_then(|note| note.placed);
            if let Some(body) = placed.filter(|&body| table.roster.placed[body].is_none()) {
                self.bring_back(body, ticks, table);
            }
            return;
        }
        if table.world.motion(id) == Motion::Static {
            return;
        }
        let Table { world, roster, .. } = table;
        let home = roster.players.iter().find(|player| player.hero == Some(id));
        let home = home.map(|player| player.checkpoint.unwrap_or(player.home));
        for player in &mut roster.players {
            player.let_go_of(id, world);
        }
        let note = self.notes.of(id, world);
        if let Some(position) = home {
            note.start = BodyStart { position, velocity: Vec2::ZERO };
        }
        world.set_position(id, note.start.position);
        // Who carries it or scored with it is no longer who touched it last.
        note.touched_by = None;
        if ticks > 0 && note.rests.is_none() {
            note.rests = Some(Rest { ticks, gravity_scale: world.gravity_scale(id) });
        } else if ticks == 0 {
            let note = *note;
            set_off(id, &note, table);
        }
    }

    /// Makes a body of the scene that is gone, at its start.
    fn bring_back(&mut self, body: usize, ticks: u32, table: &mut Table) {
        let Table { scene, world, roster, rngs, .. } = table;
        if !self.came[body] {
            return;
        }
        let id = placing::place_body(world, roster, &scene.bodies[body], &mut rngs.spawn);
        roster.placed[body] = id;
        let Some(id) = id else { return };
        let note = self.notes.of(id, world);
        note.placed = Some(body);
        if ticks > 0 && world.motion(id) != Motion::Static {
            note.rests = Some(Rest { ticks, gravity_scale: world.gravity_scale(id) });
        }
    }

    /// Before the step: holds bodies that rest at their start, and lets those go whose time is up.
    pub fn hold_resting(&mut self, table: &mut Table) {
        for note in self.notes.iter_mut() {
            let Some(Rest { ticks, gravity_scale }) = note.rests else { continue };
            let (id, start) = (note.id, note.start.position);
            if !table.world.contains(id) {
                note.rests = None;
            } else if ticks == 0 {
                note.rests = None;
                table.world.set_gravity_scale(id, gravity_scale);
                set_off(id, note, table);
            } else {
                note.rests = Some(Rest { ticks: ticks - 1, gravity_scale });
                table.world.set_gravity_scale(id, 0.0);
                table.world.set_position(id, start);
                table.world.set_velocity(id, Vec2::ZERO);
            }
        }
    }

    /// The standing of a side that is there and not out.
    pub(super) fn standing<'a>(
        &'a mut self,
        side: Side,
        table: &'a mut Table,
    ) -> Option<&'a mut Standing> {
        let standing = match side {
            Side::Team(team) => self.teams.get_mut(usize::from(team)),
            Side::Player(seat) => {
                let mut players = table.roster.players.iter_mut();
                players.find(|player| player.seat == seat).map(|player| &mut player.standing)
            }
        };
        standing.filter(|standing| !standing.out)
    }
}

/// Particles at a body.
pub(super) fn splash(recipe: u8, body: BodyId, table: &mut Table) {
    let source = Source::Point(table.world.position(body));
    let seed = table.rngs.emit.next_u32();
    let emitter = EmitterDef { recipe, count: SPLASH_PARTICLES, seed, source };
    emitters::start(table.world, emitter, table.events);
}

/// A body sets off from its start; one that began to either side does so again.
fn set_off(id: BodyId, note: &BodyNote, table: &mut Table) {
    let start_speed = note.placed.map_or(0.0, |body| table.scene.bodies[body].start_speed);
    let velocity = match start_speed > 0.0 {
        true => placing::either_side(start_speed, &mut table.rngs.spawn),
        false => note.start.velocity,
    };
    table.world.set_velocity(id, velocity);
    let speed = velocity.length();
    if let Some(actor) = &mut table.roster.actors[id.index as usize]
        && let Rule::Wander { heading, speed: wander, .. } = &mut actor.rule
        && speed > 0.0
    {
        (*heading, *wander) = (velocity / speed, speed);
    }
}
