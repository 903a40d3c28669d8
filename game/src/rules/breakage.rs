//! Bodies that break under a hard blow.

use super::book::{Rules, Table};
use super::effects;
use super::memory::Broken;
use crate::input::Seat;
use crate::scene::Breakable;
use jostle_sim::{BodyId, Touch, World};

impl Rules {
    /// Breaks what was hit too hard in the step, in the order of contacts, and cracks what was hit half as
    /// hard.
    pub(super) fn break_bodies(&mut self, table: &mut Table) {
        self.scratch.broken.clear();
        if !self.has_breakables {
            return;
        }
        let mut broken: Vec<(Broken, Breakable)> = Vec::new();
        for touch in table.world.touches() {
            let blow = blow(table.world, touch);
            for (it, other) in [(touch.a, touch.b), (touch.b, touch.a)] {
                let placed = self.notes.get(it).and_then(|note| note.placed);
                let breaks = placed.and_then(|body| table.scene.bodies[body].breaks);
                let Some(breaks) = breaks.filter(|breaks| blow > 0.5 * breaks.strength) else {
                    continue;
                };
                self.notes.of(it, table.world).is_cracked = true;
                let is_known = broken.iter().any(|(known, _)| known.body == it);
                if blow > breaks.strength && !is_known {
                    let group = table.world.group(it);
                    let by = self.who_hit(it, other, table);
                    broken.push((Broken { body: it, group, by }, breaks));
                }
            }
        }
        for (Broken { body, by, .. }, breaks) in &broken {
            let side = by.map(|seat| table.roster.side_of(seat));
            if let Some(standing) = side.and_then(|side| self.standing(side, table)) {
                standing.add_score(breaks.points);
            }
            if let Some(recipe) = breaks.splash {
                effects::splash(recipe, *body, table);
            }
            table.roster.remove(table.world, *body);
        }
        self.scratch.broken.extend(broken.into_iter().map(|(broken, _)| broken));
    }

    /// Who made `other` hit `it`: whose it is, who touched it last, or who shot last.
    fn who_hit(&self, it: BodyId, other: BodyId, table: &Table) -> Option<Seat> {
        let touched = |id| self.notes.get(id).and_then(|note| note.touched_by);
        let owner = table.roster.owner_of(other).or_else(|| touched(other));
        owner.or_else(|| touched(it)).or_else(|| self.sling?.shooter)
    }
}

/// The impulse that stops two bodies along their normal, units of mass times units/s. What presses slowly
/// breaks nothing.
fn blow(world: &World, touch: &Touch) -> f32 {
    let inverse_mass = world.inverse_mass(touch.a) + world.inverse_mass(touch.b);
    if inverse_mass > 0.0 { touch.closing / inverse_mass } else { 0.0 }
}
