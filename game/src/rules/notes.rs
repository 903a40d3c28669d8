//! What rules remember of bodies: where they started, who touched them last, and whether they are held.

use crate::actor::Actor;
use crate::input::Seat;
use crate::roster::Roster;
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::{BodyId, World};

/// What rules remember of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyNote {
    pub id: BodyId,
    /// Its collision group, for who is lost.
    pub group: u8,
    /// Which body of the scene it is, if it is one.
    pub placed: Option<usize>,
    /// Where and how it started.
    pub start: BodyStart,
    /// The player whose hero or pack touched it last.
    pub touched_by: Option<Seat>,
    /// It returned to its start and rests there.
    pub rests: Option<Rest>,
    /// A blow has cracked it.
    pub is_cracked: bool,
    /// Where it was before the step; not state.
    before: Vec2,
}

/// Where and how a body started.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyStart {
    pub position: Vec2,
    pub velocity: Vec2,
}

/// A body that returned to its start and rests there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rest {
    pub ticks: u32,
    /// What it gets back then.
    pub gravity_scale: f32,
}

/// Notes by body slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyNotes(Vec<Option<BodyNote>>);

impl BodyNotes {
    /// Notes where everybody is before a step, and who is new; forgets who was gone before it, whom a saved
    /// state does not have either.
    pub fn observe(&mut self, world: &World, roster: &Roster) {
        for note in &mut self.0 {
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
        if index >= self.0.len() {
            self.0.resize(index + 1, None);
        }
        let slot = &mut self.0[index];
        if slot.is_none_or(|note| note.id != id) {
            *slot = Some(BodyNote::new(id, world));
        }
        slot.as_mut().expect("a note that was just made")
    }

    /// The note of a body that may be gone.
    pub fn get(&self, id: BodyId) -> Option<&BodyNote> {
        self.0.get(id.index as usize)?.as_ref().filter(|note| note.id == id)
    }

    /// The note of an existing body, or what it will be.
    pub fn of_existing(&self, id: BodyId, world: &World) -> BodyNote {
        self.get(id).copied().unwrap_or_else(|| BodyNote::new(id, world))
    }

    /// Where a body was before the step; one made since then is where it is now.
    pub fn position_before(&self, id: BodyId, world: &World) -> Vec2 {
        self.get(id).map_or_else(|| world.position(id), |note| note.before)
    }

    /// All notes, those of bodies that are gone too.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut BodyNote> {
        self.0.iter_mut().flatten()
    }

    /// Notes who touched whom in the step.
    pub fn follow_touches(&mut self, world: &World, roster: &Roster) {
        for touch in world.touches() {
            for (id, other) in [(touch.a, touch.b), (touch.b, touch.a)] {
                if let Some(seat) = acts(roster.actors[id.index as usize]) {
                    self.of(other, world).touched_by = Some(seat);
                }
            }
        }
    }
}

/// The player whose hero or pack a body is.
fn acts(actor: Option<Actor>) -> Option<Seat> {
    actor.filter(|actor| matches!(actor.kind, Kind::Hero | Kind::Pack))?.owner
}

impl BodyNote {
    /// A body that was just made.
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
