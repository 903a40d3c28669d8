//! Bodies that are there only while a condition holds, and paths that run only while one does.

use super::book::{Rules, Table};
use crate::placing;
use jostle_sim::Motion;

impl Rules {
    /// Bodies come and go by the levels of the last tick. One that should come waits until nothing that
    /// can move is in its place: a door closes on nobody.
    pub fn update_presence(&mut self, table: &mut Table) {
        let Table { scene, world, roster, rngs, .. } = table;
        let stands_still = self.stands_still();
        for (index, body) in scene.bodies.iter().enumerate() {
            if !stands_still && !body.runs.is_none() && !body.runs.all(self.levels) {
                self.stood[index] += 1;
            }
            if body.presence.is_none() {
                continue;
            }
            if !body.presence.all(self.levels) {
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
                def.position = path.at(self.path_tick(index).saturating_sub(1));
            }
            let movable = world.ids().filter(|&id| world.motion(id) == Motion::Dynamic);
            if placing::is_clear(world, scene, &def, def.position, movable) {
                self.came[index] = true;
                let id = placing::place_body(world, roster, body, &mut rngs.spawn);
                roster.placed[index] = id;
                if let Some(id) = id {
                    world.set_position(id, def.position);
                    self.notes.of(id, world).placed = Some(index);
                }
            }
        }
    }
}
