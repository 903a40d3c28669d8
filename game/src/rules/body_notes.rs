//! Facts about bodies that rules remember, such as where they started, who touched them last, and whether they rest.
//! The scene's bodies come and go depending on conditions, and return to their starts.

use super::context::RuleContext;
use crate::input::Seat;
use crate::placing;
use crate::roster::{Actor, Roster, Rule};
use crate::scene::{Kind, Levels, Scene};
use glam::Vec2;
use jostle_sim::{BodyId, Motion, World};

/// Facts about a body for the rules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyNote {
    pub id: BodyId,
    /// Collision group of the body, which rules about lost bodies need.
    pub group: u8,
    /// Index of the body in the scene file, if it comes from there.
    pub placed: Option<usize>,
    /// Position and velocity at the start.
    pub start: BodyStart,
    /// The last player who touched it with a hero or pack.
    pub touched_by: Option<Seat>,
    /// Set while the body rests at its start after returning there.
    pub rests: Option<BodyRest>,
    /// Whether a blow has cracked it.
    pub is_cracked: bool,
    /// Position before the step; not state.
    before: Vec2,
}

/// Position and velocity of a body at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyStart {
    pub position: Vec2,
    pub velocity: Vec2,
}

/// A body's rest at its start after returning there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyRest {
    pub ticks: u32,
    /// Gravity scale to restore afterwards.
    pub gravity_scale: f32,
}

/// The notes on all bodies.
#[derive(Clone, Debug)]
pub(crate) struct BodyNotes {
    /// Notes by body slot.
    notes: Vec<Option<BodyNote>>,
    /// For each of the scene's bodies, whether it has appeared since its condition began to hold.
    pub(super) came: Vec<bool>,
    /// Number of ticks for which each of the scene's bodies has been stopped on its path.
    pub(super) stood: Vec<u32>,
}

impl BodyNotes {
    pub fn new(came: Vec<bool>, stood: Vec<u32>) -> BodyNotes {
        BodyNotes { notes: Vec::new(), came, stood }
    }

    /// Determines which of the scene's bodies are present at the start of a round.
    pub fn settle(&mut self, scene: &Scene, levels: Levels) {
        let bodies = scene.bodies.iter().zip(&mut self.came);
        bodies.for_each(|(body, came)| *came = body.presence.all(levels));
        self.stood.fill(0);
    }

    /// Creates notes for the scene's bodies that were placed.
    pub fn note_placed(&mut self, world: &World, roster: &Roster) {
        for (body, &id) in roster.placed.iter().enumerate() {
            if let Some(id) = id {
                self.of(id, world).placed = Some(body);
            }
        }
    }

    /// Lets bodies come and go according to the levels of the previous tick, before the tick of the round that `clock`
    /// counts. A body that should appear waits until nothing that can move is in its place, so that a door never closes
    /// on anyone.
    pub fn update_presence(
        &mut self,
        levels: Levels,
        clock: u32,
        stands_still: bool,
        table: &mut RuleContext,
    ) {
        let RuleContext { scene, world, roster, rngs, .. } = table;
        for (index, body) in scene.bodies.iter().enumerate() {
            if !stands_still && !body.runs.is_none() && !body.runs.all(levels) {
                self.stood[index] += 1;
            }
            if body.presence.is_none() {
                continue;
            }
            if !body.presence.all(levels) {
                self.came[index] = false;
                if let Some(id) = roster.placed[index] {
                    roster.remove(world, id);
                }
                continue;
            }
            if self.came[index] {
                continue;
            }
            let mut def = body.def;
            if let Some(path) = &body.path {
                def.position = path.at((clock - self.stood[index]).saturating_sub(1));
            }
            let movable = world.ids().filter(|&id| world.motion(id) == Motion::Dynamic);
            if placing::is_clear(world, scene, &def, def.position, movable) {
                self.came[index] = true;
                let id = placing::place_body(world, roster, body, &mut rngs.spawn);
                roster.placed[index] = id;
                if let Some(id) = id {
                    world.set_position(id, def.position);
                    self.of(id, world).placed = Some(index);
                }
            }
        }
    }

    /// Records the positions of all bodies before a step, and adds new bodies. Forgets bodies that were already gone,
    /// since a saved state does not contain them either.
    pub fn observe(&mut self, world: &World, roster: &Roster) {
        for note in &mut self.notes {
            note.take_if(|note| !world.contains(note.id));
        }
        for actor in roster.actors() {
            let position = world.position(actor.id);
            self.of(actor.id, world).before = position;
        }
    }

    /// The note of an existing body.
    pub fn of(&mut self, id: BodyId, world: &World) -> &mut BodyNote {
        let index = id.index as usize;
        if index >= self.notes.len() {
            self.notes.resize(index + 1, None);
        }
        let slot = &mut self.notes[index];
        if slot.is_none_or(|note| note.id != id) {
            *slot = Some(BodyNote::new(id, world));
        }
        slot.as_mut().expect("a note that was just made")
    }

    /// The note of a body that may be gone.
    pub fn get(&self, id: BodyId) -> Option<&BodyNote> {
        self.notes.get(id.index as usize)?.as_ref().filter(|note| note.id == id)
    }

    /// The note of an existing body, or a new note if it has none yet.
    pub fn of_existing(&self, id: BodyId, world: &World) -> BodyNote {
        self.get(id).copied().unwrap_or_else(|| BodyNote::new(id, world))
    }

    /// Position of a body before the step, or its current position if it was made since then.
    pub fn position_before(&self, id: BodyId, world: &World) -> Vec2 {
        self.get(id).map_or_else(|| world.position(id), |note| note.before)
    }

    /// Records who touched which body in the step.
    pub fn follow_touches(&mut self, world: &World, roster: &Roster) {
        for touch in world.touches() {
            for (id, other) in [(touch.a, touch.b), (touch.b, touch.a)] {
                if let Some(seat) = acts(roster.actors[id.index as usize]) {
                    self.of(other, world).touched_by = Some(seat);
                }
            }
        }
    }

    /// Returns one of the scene's bodies to its start, where it rests for this many ticks.
    pub fn reset(&mut self, body: usize, ticks: u32, table: &mut RuleContext) {
        match table.roster.placed[body] {
            Some(id) => self.send_back(id, ticks, table),
            None => self.bring_back(body, ticks, table),
        }
    }

    /// Returns a body to its start. If it is gone and comes from the scene file, it is recreated.
    pub fn send_back(&mut self, id: BodyId, ticks: u32, table: &mut RuleContext) {
        if !table.world.contains(id) {
            let placed = self.get(id).and_then(|note| note.placed);
            if let Some(body) = placed.filter(|&body| table.roster.placed[body].is_none()) {
                self.bring_back(body, ticks, table);
            }
            return;
        }
        if table.world.motion(id) == Motion::Static {
            return;
        }
        let RuleContext { world, roster, .. } = table;
        let home = roster.players.iter().find(|player| player.hero == Some(id));
        let home = home.map(|player| player.checkpoint.unwrap_or(player.home));
        for player in &mut roster.players {
            player.let_go_of(id, world);
        }
        let note = self.of(id, world);
        if let Some(position) = home {
            note.start = BodyStart { position, velocity: Vec2::ZERO };
        }
        world.set_position(id, note.start.position);
        // The player who carried it or scored with it no longer counts as the last to touch it.
        note.touched_by = None;
        if ticks > 0 && note.rests.is_none() {
            note.rests = Some(BodyRest { ticks, gravity_scale: world.gravity_scale(id) });
        } else if ticks == 0 {
            let note = *note;
            set_off(id, &note, table);
        }
    }

    /// Recreates one of the scene's bodies at its start after it is gone.
    fn bring_back(&mut self, body: usize, ticks: u32, table: &mut RuleContext) {
        let RuleContext { scene, world, roster, rngs, .. } = table;
        if !self.came[body] {
            return;
        }
        let id = placing::place_body(world, roster, &scene.bodies[body], &mut rngs.spawn);
        roster.placed[body] = id;
        let Some(id) = id else { return };
        let note = self.of(id, world);
        note.placed = Some(body);
        if ticks > 0 && world.motion(id) != Motion::Static {
            note.rests = Some(BodyRest { ticks, gravity_scale: world.gravity_scale(id) });
        }
    }

    /// Before the step, holds bodies that rest at their start, and releases those whose time is up.
    pub fn hold_resting(&mut self, table: &mut RuleContext) {
        for note in self.notes.iter_mut().flatten() {
            let Some(BodyRest { ticks, gravity_scale }) = note.rests else { continue };
            let (id, start) = (note.id, note.start.position);
            if !table.world.contains(id) {
                note.rests = None;
            } else if ticks == 0 {
                note.rests = None;
                table.world.set_gravity_scale(id, gravity_scale);
                set_off(id, note, table);
            } else {
                note.rests = Some(BodyRest { ticks: ticks - 1, gravity_scale });
                table.world.set_gravity_scale(id, 0.0);
                table.world.set_position(id, start);
                table.world.set_velocity(id, Vec2::ZERO);
            }
        }
    }
}

/// Sets a body in motion from its start. One that first set off to a random side does so again.
fn set_off(id: BodyId, note: &BodyNote, table: &mut RuleContext) {
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

/// The owner of a body, if it is a hero or pack.
fn acts(actor: Option<Actor>) -> Option<Seat> {
    actor.filter(|actor| matches!(actor.kind, Kind::Hero | Kind::Pack))?.owner
}

impl BodyNote {
    /// Creates the note for a body that was just made.
    pub fn new(id: BodyId, world: &World) -> BodyNote {
        let start = BodyStart { position: world.position(id), velocity: world.velocity(id) };
        let group = world.group(id);
        BodyNote {
            id,
            group,
            placed: None,
            start,
            touched_by: None,
            rests: None,
            is_cracked: false,
            before: start.position,
        }
    }
}
