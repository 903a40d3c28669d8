//! Touches are pairs of bodies in contact at the end of a step.

use crate::bodies::Bodies;
use crate::body::BodyId;
use crate::broad_phase::pairs;
use crate::growth::reserve;
use crate::steady::Steady;
use glam::Vec2;

/// Two bodies that overlap at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The body with the lower index.
    pub a: BodyId,
    /// The body with the higher index.
    pub b: BodyId,
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap, world units; positive.
    pub depth: f32,
    /// Largest closing speed along the normal in this step, units/s, not negative.
    pub closing: f32,
    /// Whether the two did not touch at the end of the previous step.
    pub began: bool,
}

/// A touch found by a solver, with the bodies given as slots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub a: u32,
    pub b: u32,
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap, world units; not negative.
    pub depth: f32,
    /// Largest closing speed in the step, units/s, not negative.
    pub closing: f32,
}

/// The touches of the latest step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touches {
    /// Touches in (a, b) order.
    pub now: Vec<Touch>,
    /// Scratch for slots that touched in the previous step.
    before: Vec<[u32; 2]>,
}

/// Placeholder that fills the list of touches while it grows.
const NO_TOUCH: Touch = Touch {
    a: BodyId { index: 0, generation: 0 },
    b: BodyId { index: 0, generation: 0 },
    normal: Vec2::ZERO,
    depth: 0.0,
    closing: 0.0,
    began: false,
};

/// Sorts touches by (a, b) as plain numbers, since sorting this type would add 3 kB to the page's program.
pub(crate) fn sort(touches: &mut Vec<Touch>) {
    let key = |touch: &Touch| pairs::key(touch.a.index, touch.b.index);
    let mut keys: Vec<u64> = touches.iter().map(key).collect();
    keys.sort_unstable();
    let mut sorted = touches.clone();
    for touch in touches.iter() {
        sorted[keys.binary_search(&key(touch)).expect("every key is listed")] = *touch;
    }
    *touches = sorted;
}

impl Touches {
    /// Releases memory that the current touches do not need.
    pub fn release(&mut self) {
        self.now.shrink_to_fit();
        self.before = Vec::new();
    }

    /// Lists a step's touches, found in (a, b) order. The touches of steady bodies are kept.
    pub fn report(
        &mut self,
        bodies: &Bodies,
        found: impl DoubleEndedIterator<Item = Found> + Clone,
        steady: &Steady,
    ) {
        let (mut from, mut to) = self.begin(found.clone().count(), steady);
        // Merges the found touches from the back, so that each touch moves once.
        let Touches { now, before } = self;
        let mut before = before.iter().rev().peekable();
        for Found { a, b, normal, depth, closing } in found.rev() {
            while from > 0 && slots(&now[from - 1]) > [a, b] {
                (from, to) = (from - 1, to - 1);
                now[to] = now[from];
            }
            while before.next_if(|&&old| old > [a, b]).is_some() {}
            let began = before.next_if_eq(&&[a, b]).is_none();
            to -= 1;
            now[to] = Touch { a: bodies.id(a), b: bodies.id(b), normal, depth, closing, began };
        }
    }

    /// Keeps the touches of steady bodies and makes room for others. Returns how many were kept and the total.
    #[inline(never)]
    fn begin(&mut self, found: usize, steady: &Steady) -> (usize, usize) {
        let Touches { now, before } = self;
        before.clear();
        reserve(before, now.len());
        before.extend(now.iter().map(slots));
        now.retain_mut(|touch| {
            touch.began = false;
            steady.has(touch.a.index) || steady.has(touch.b.index)
        });
        let (staying, all) = (now.len(), now.len() + found);
        reserve(now, all);
        now.resize(all, NO_TOUCH);
        (staying, all)
    }
}

/// The slots of both bodies. A removed body's touches are removed with it, so that no other body inherits them.
fn slots(touch: &Touch) -> [u32; 2] {
    [touch.a.index, touch.b.index]
}
