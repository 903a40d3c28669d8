//! A step of the World by the conjugate solver: pairs, impacts and rows, velocities, places.

use super::{Phase, Touch, World};
use crate::conjugate::{Bounces, Conjugate, Frame, STRAYS_MAX};
use crate::features::CAN;
use crate::math::max;

/// How often a step may find that bounces sped bodies up beyond their reach.
const MEETINGS_MAX: u32 = 16;

impl World {
    /// The step, shown to `watch` after each phase.
    pub(super) fn step_conjugate(
        &mut self,
        settings: Conjugate,
        watch: &mut impl FnMut(Phase, &mut World),
    ) {
        self.remember();
        self.meet(&settings);
        while self.wake_touched() {
            self.meet(&settings);
        }
        watch(Phase::Pairs, self);
        self.find_velocities(&settings);
        while self.wake_touched() {
            self.meet(&settings);
            self.find_velocities(&settings);
        }
        let frame = self.frame(&settings);
        self.workspace.store(&self.bodies, &mut self.pairs.pairs, &frame);
        self.passes = self.workspace.sweeps;
        watch(Phase::Relax, self);
        let frame = self.frame(&settings);
        self.workspace.go(&mut self.bodies, &self.pairs.pairs, &frame);
        watch(Phase::Integrate, self);
        self.report_presses();
    }

    fn frame<'a>(&self, settings: &'a Conjugate) -> Frame<'a> {
        let super::WorldSettings { gravity, dt, speed_max, .. } = self.settings;
        let features = self.features.in_this_build();
        Frame { settings, gravity, dt, speed_max, features }
    }

    /// Finds the rows, once nothing bounces any more.
    fn meet(&mut self, settings: &Conjugate) {
        let frame = self.frame(settings);
        self.workspace.begin(&self.bodies);
        let mut lively = self.look_around(&frame, true);
        for round in 1..=MEETINGS_MAX {
            let (bodies, pairs) = (&mut self.bodies, &self.pairs.pairs);
            if !lively {
                break;
            }
            let bounces = self.workspace.bounce(bodies, pairs, &frame, round == MEETINGS_MAX);
            if bounces == Bounces::None {
                break;
            }
            lively = self.look_around(&frame, bounces == Bounces::Ahead);
        }
        self.workspace.meet(&self.bodies, &self.pairs.pairs, &frame);
    }

    /// Makes the pair list complete for the speeds that bodies have; whether any may bounce.
    fn look_around(&mut self, frame: &Frame, bounces: bool) -> bool {
        let lively = self.workspace.reach(&mut self.bodies, frame, bounces);
        self.refresh_pairs();
        lively
    }

    fn find_velocities(&mut self, settings: &Conjugate) {
        self.find_moves();
        let frame = self.frame(settings);
        let moves = match &self.forces {
            Some(forces) if CAN.forces => forces.moves.as_slice(),
            _ => &[],
        };
        self.workspace.solve(&mut self.bodies, &self.pairs.pairs, moves, &frame);
        self.catch_strays(settings);
    }

    /// Solves again as long as the speeds that were found bring new pairs together.
    fn catch_strays(&mut self, settings: &Conjugate) {
        let frame = self.frame(settings);
        for _ in 0..STRAYS_MAX {
            if !self.workspace.reach_out(&mut self.bodies, &frame) {
                return;
            }
            if self.refresh_pairs() {
                self.workspace.find_again(&self.pairs.pairs);
            }
            if !self.workspace.catch_strays(&mut self.bodies, &self.pairs.pairs, &frame) {
                return;
            }
        }
    }

    /// Lists who pressed, bounced or overlaps, in (a, b) order.
    fn report_presses(&mut self) {
        if !CAN.touches {
            return;
        }
        std::mem::swap(&mut self.touches, &mut self.touches_before);
        self.touches.clear();
        let mut before = self.touches_before.iter().peekable();
        for (row, facts) in self.workspace.rows.iter().zip(&self.workspace.facts) {
            if row.press <= 0.0 && !facts.struck && facts.left >= 0.0 {
                continue;
            }
            let (a, b) = (self.bodies.id(row.a), self.bodies.id(row.b));
            while before.next_if(|old| (old.a.index, old.b.index) < (row.a, row.b)).is_some() {}
            let began = before.next_if(|old| (old.a, old.b) == (a, b)).is_none();
            let depth = max(-facts.left, 0.0);
            let (normal, closing) = (row.normal, facts.closing);
            self.touches.push(Touch { a, b, normal, depth, closing, began });
        }
    }
}
