//! Bodies that break under a hard blow.

use super::body_notes::BodyNotes;
use super::context::RuleContext;
use super::verdict::Teams;
use crate::input::Seat;
use crate::scene::Breakable;
use jostle_sim::{BodyId, Touch, World};

/// The bodies that broke in this tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Breakage {
    /// Whether anything in the scene can break.
    pub is_on: bool,
    pub(super) broken: Vec<Broken>,
}

/// A body that broke in this tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Broken {
    pub body: BodyId,
    pub group: u8,
    pub by: Option<Seat>,
    breaks: Breakable,
}

impl Breakage {
    /// Breaks bodies that were hit too hard in the step, in the order of contacts, and cracks those hit more than half
    /// as hard. A blow from something that no player touched is credited to the `shooter`.
    pub fn update(
        &mut self,
        notes: &mut BodyNotes,
        teams: &mut Teams,
        shooter: Option<Seat>,
        table: &mut RuleContext,
    ) {
        self.broken.clear();
        if !self.is_on {
            return;
        }
        for touch in table.world.touches() {
            let blow = blow(table.world, touch);
            for (body, other) in [(touch.a, touch.b), (touch.b, touch.a)] {
                let placed = notes.get(body).and_then(|note| note.placed);
                let breaks = placed.and_then(|placed| table.scene.bodies[placed].breaks);
                let Some(breaks) = breaks.filter(|breaks| blow > 0.5 * breaks.strength) else {
                    continue;
                };
                notes.of(body, table.world).is_cracked = true;
                let is_known = self.broken.iter().any(|known| known.body == body);
                if blow > breaks.strength && !is_known {
                    let group = table.world.group(body);
                    let by = who_hit(body, other, notes, table).or(shooter);
                    self.broken.push(Broken { body, group, by, breaks });
                }
            }
        }
        for &Broken { body, by, breaks, .. } in &self.broken {
            let side = by.map(|seat| table.roster.side_of(seat));
            if let Some(standing) = side.and_then(|side| teams.standing(side, table.roster)) {
                standing.add_score(breaks.points);
            }
            if let Some(recipe) = breaks.splash {
                table.splash(recipe, body);
            }
            table.roster.remove(table.world, body);
        }
    }
}

/// The player who made `other` hit `it`: the owner of `other`, or the last one to touch either.
fn who_hit(it: BodyId, other: BodyId, notes: &BodyNotes, table: &RuleContext) -> Option<Seat> {
    let touched = |id| notes.get(id).and_then(|note| note.touched_by);
    table.roster.owner_of(other).or_else(|| touched(other)).or_else(|| touched(it))
}

/// The impulse that stops two bodies along their normal, in mass times units/s. Slow pressure breaks nothing.
fn blow(world: &World, touch: &Touch) -> f32 {
    let inverse_mass = world.inverse_mass(touch.a) + world.inverse_mass(touch.b);
    if inverse_mass > 0.0 { touch.closing / inverse_mass } else { 0.0 }
}
