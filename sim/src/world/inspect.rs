//! Access for tests to the inside of a world.

use super::{World, awake};
use crate::bodies::Bodies;
use crate::broad_phase::pairs::PairList;

impl World {
    pub(crate) fn body_arrays(&self) -> &Bodies {
        &self.bodies
    }

    pub(crate) fn asleep_count(&self) -> usize {
        self.sleep.islands.iter().map(|island| island.bodies.len()).sum()
    }

    pub(crate) fn steady_count(&self) -> usize {
        self.steady.count()
    }

    pub(crate) fn leave_nothing_out(&mut self) {
        self.steady.is_off = true;
        self.steady.readmit_all(&mut self.bodies);
    }

    pub(crate) fn pair_list(&self) -> &PairList {
        &self.pairs
    }

    pub(crate) fn constraint_count(&self) -> usize {
        self.conjugate.contacts.constraints.len()
    }

    pub(crate) fn refresh_pairs(&mut self) {
        self.pairs.refresh(&self.bodies, self.settings.filter());
    }

    pub(crate) fn wake_all(&mut self) {
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.wake_all(&mut awake);
    }

    pub(crate) fn invalidate_pairs(&mut self) {
        self.pairs.invalidate();
    }
}
