//! Touches: pairs of bodies in contact at the end of a step.

use crate::bodies::Bodies;
use crate::body::BodyId;
use glam::Vec2;

/// Two bodies that overlap at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The body with the lower index.
    pub a: BodyId,
    /// The other body.
    pub b: BodyId,
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap, world units, positive.
    pub depth: f32,
    /// Largest closing speed along the normal in this step, units/s, not negative.
    pub closing: f32,
    /// Whether the two did not touch at the end of the previous step.
    pub began: bool,
}

/// A touch found by a solver, by slots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// Lower slot.
    pub a: u32,
    pub b: u32,
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap, world units, not negative.
    pub depth: f32,
    /// Largest closing speed in the step, units/s, not negative.
    pub closing: f32,
}

/// The touches of the last step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touches {
    /// In (a, b) order.
    pub now: Vec<Touch>,
    /// Scratch: who touched in the step before.
    before: Vec<[BodyId; 2]>,
}

/// Sorts touches by (a, b): plain numbers, since a sort for this type would take 3 kB of the page's program.
pub(crate) fn sort(touches: &mut Vec<Touch>) {
    let key = |touch: &Touch| u64::from(touch.a.index) << 32 | u64::from(touch.b.index);
    let mut keys: Vec<u64> = touches.iter().map(key).collect();
    keys.sort_unstable();
    let mut sorted = touches.clone();
    for touch in touches.iter() {
        sorted[keys.binary_search(&key(touch)).expect("every key is listed")] = *touch;
    }
    *touches = sorted;
}

impl Touches {
    /// Lists the touches of a step, and those that `stay` as they were; both come in (a, b) order.
    pub fn report(&mut self, bodies: &Bodies, found: impl Iterator<Item = Found>, stay: &[Touch]) {
        self.before.clear();
        self.before.extend(self.now.drain(..).map(|touch| [touch.a, touch.b]));
        let mut before = self.before.iter().peekable();
        let slots = |touch: &Touch| (touch.a.index, touch.b.index);
        let mut stay = stay.iter().peekable();
        for Found { a, b, normal, depth, closing } in found {
            while let Some(touch) = stay.next_if(|touch| slots(touch) < (a, b)) {
                self.now.push(*touch);
            }
            let (id_a, id_b) = (bodies.id(a), bodies.id(b));
            while before.next_if(|[old_a, old_b]| (old_a.index, old_b.index) < (a, b)).is_some() {}
            let began = before.next_if_eq(&&[id_a, id_b]).is_none();
            self.now.push(Touch { a: id_a, b: id_b, normal, depth, closing, began });
        }
        self.now.extend(stay);
    }
}
