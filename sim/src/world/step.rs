//! The steps of a world, one for each solver.

use super::{Departed, StepPhase, World, awake};
use crate::body::BodyId;
use crate::forces::{Forces, Move, Surroundings};
use crate::integrate;
use crate::solver::settings::{Conjugate, Relaxation};
use crate::solver::step_context::StepContext;
use crate::solver::{Solver, as_listed};
use crate::world::settings::WorldSettings;

impl World {
    pub(super) fn advance(&mut self, watch: &mut dyn FnMut(StepPhase, &mut World)) {
        self.release_scratch();
        self.pairs.listed = 0;
        match self.settings.solver {
            _ if self.is_over_budget() => {}
            Some(Solver::Conjugate(settings)) => self.step_conjugate(&settings, watch),
            Some(Solver::Relaxation(settings)) if self.listed => self.step_listed(&settings, watch),
            Some(Solver::Relaxation(settings)) => self.step_relaxation(Some(&settings), watch),
            None => self.step_relaxation(None, watch),
        }
        if self.is_over_budget() {
            self.touches.now.clear();
        }
        self.remove_departed();
        if self.settings.sleeping && !self.is_over_budget() {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            let constraints = &self.conjugate.contacts.constraints;
            let springs = self.forces.as_ref().map_or(&[][..], Forces::springs);
            self.sleep.fall_asleep(&mut awake, constraints, springs, &self.settings);
        }
    }

    /// Releases the scratch of the solvers where it is far larger than the last steps needed: a heap that came apart or
    /// to rest once had many constraints.
    fn release_scratch(&mut self) {
        let (relaxed, solved) =
            (&self.relaxation.constraints, &self.conjugate.contacts.constraints);
        let capacity = relaxed.capacity() + solved.capacity();
        if self.scratch_use.is_small(relaxed.len() + solved.len(), capacity) {
            self.relaxation.release();
            self.conjugate.release();
            self.touches.release();
        }
    }

    /// Symplectic Euler, then passes over all overlapping pairs; without settings contacts are only
    /// detected.
    fn step_relaxation(
        &mut self,
        settings: Option<&Relaxation>,
        watch: &mut dyn FnMut(StepPhase, &mut World),
    ) {
        self.begin_forces();
        self.find_moves();
        if self.has_springs() {
            // The reach of the last step is not state.
            integrate::reach_paths(&mut self.bodies, self.settings.dt);
        }
        if self.extend_reach() {
            self.pairs.refresh(&self.bodies, self.settings.filter());
            if self.pairs.is_over() {
                return;
            }
            self.meet_obstacles();
        }
        let moves = moves(&self.forces);
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs.pairs);
        self.relaxation.start(bodies, pairs, moves, settings, &self.settings);
        self.relaxation.advance(&mut self.bodies, moves, self.settings.dt);
        watch(StepPhase::Integrate, self);
        self.pairs.refresh(&self.bodies, self.settings.filter());
        if self.pairs.is_over() {
            self.respond(false);
            return;
        }
        self.relaxation.gather(&self.bodies, &self.pairs.pairs, self.features);
        if let Some(forces) = &self.forces {
            self.relaxation.limit_bounces(&self.bodies, forces, self.settings.dt);
        }
        watch(StepPhase::Pairs, self);
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs.pairs);
        self.relaxation.solve(bodies, pairs, settings, self.features, &self.settings);
        self.respond(false);
        watch(StepPhase::Relax, self);
        self.touches.report(&self.bodies, self.relaxation.overlaps(&self.bodies), &self.steady);
        if let Some(forces) = &mut self.forces {
            let contacts = self.relaxation.contacts();
            forces.limit_energy(&mut self.bodies, contacts, self.settings.gravity);
        }
    }

    /// The same, as the chapter lists it.
    fn step_listed(&mut self, settings: &Relaxation, watch: &mut dyn FnMut(StepPhase, &mut World)) {
        let WorldSettings { gravity, dt, speed_max, .. } = self.settings;
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs.pairs);
        self.relaxation.start(bodies, pairs, &[], None, &self.settings);
        as_listed::weigh(&mut self.bodies, gravity * dt, speed_max);
        self.relaxation.advance(&mut self.bodies, &[], dt);
        watch(StepPhase::Integrate, self);
        self.pairs.refresh(&self.bodies, self.settings.filter());
        if self.pairs.is_over() {
            return;
        }
        self.relaxation.gather(&self.bodies, &self.pairs.pairs, self.features);
        watch(StepPhase::Pairs, self);
        self.relaxation.drop_non_finite(&self.bodies);
        let (constraints, pairs) = (&mut self.relaxation.constraints, &mut self.pairs.pairs);
        self.relaxation.passes = as_listed::solve(&mut self.bodies, constraints, pairs, settings);
        watch(StepPhase::Relax, self);
        self.touches.report(&self.bodies, self.relaxation.overlaps(&self.bodies), &self.steady);
    }

    /// Impacts in the order of their times, velocities that satisfy all contacts, then positions.
    fn step_conjugate(
        &mut self,
        settings: &Conjugate,
        watch: &mut dyn FnMut(StepPhase, &mut World),
    ) {
        self.sleep.save_step_start(&self.bodies);
        self.begin_forces();
        let leaves_out = self.leaves_out();
        let work_max = self.settings.budget.work;
        self.conjugate.begin(&mut self.bodies, &mut self.steady, leaves_out, work_max);
        self.find_contacts(settings);
        while !self.is_over_budget() && self.wake_touched() {
            self.find_contacts(settings);
        }
        if self.is_over_budget() {
            return;
        }
        watch(StepPhase::Pairs, self);
        self.find_velocities(settings);
        while !self.is_over_budget() && self.wake_touched() {
            self.find_contacts(settings);
            if !self.is_over_budget() {
                self.find_velocities(settings);
            }
        }
        if self.is_over_budget() {
            return;
        }
        self.conjugate.store(&self.bodies, &mut self.pairs.pairs, &self.steady);
        watch(StepPhase::Relax, self);
        let context = StepContext::new(settings, &self.settings, self.features);
        let moves = moves(&self.forces);
        self.conjugate.find_positions(&mut self.bodies, &self.pairs.pairs, moves, &context);
        watch(StepPhase::Integrate, self);
        self.report_touches(settings);
    }

    fn find_contacts(&mut self, settings: &Conjugate) {
        if self.has_springs() {
            self.find_moves();
        }
        let context = StepContext::new(settings, &self.settings, self.features);
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs);
        self.conjugate.find_contacts(bodies, pairs, &self.steady, &self.forces, &context);
    }

    fn find_velocities(&mut self, settings: &Conjugate) {
        if !self.has_springs() || self.conjugate.has_bounced() {
            self.find_moves();
        }
        if self.extend_reach() {
            let context = StepContext::new(settings, &self.settings, self.features);
            self.conjugate.refresh(&self.bodies, &mut self.pairs, &context);
            if self.pairs.is_over() {
                return;
            }
            self.meet_obstacles();
        }
        let context = StepContext::new(settings, &self.settings, self.features);
        let moves = moves(&self.forces);
        self.conjugate.find_velocities(&mut self.bodies, &mut self.pairs, moves, &context);
        self.respond(true);
    }

    /// Whether steps leave steady islands out: sleep counts the steps of bodies at rest, and forces may change by
    /// themselves.
    fn leaves_out(&self) -> bool {
        !(self.settings.sleeping || self.forces.is_some())
    }

    /// Reports the touches of a step, and leaves what it has not changed out of the next one.
    fn report_touches(&mut self, settings: &Conjugate) {
        self.touches.report(&self.bodies, self.conjugate.touching(), &self.steady);
        if let Some(forces) = &mut self.forces {
            let contacts = self.conjugate.touching().map(|found| [found.a, found.b]);
            forces.limit_energy(&mut self.bodies, contacts, self.settings.gravity);
        }
        if self.steady.is_on {
            let context = StepContext::new(settings, &self.settings, self.features);
            let kill_zone = &self.settings.kill_zone;
            let (bodies, steady) = (&mut self.bodies, &mut self.steady);
            self.conjugate.leave_out(bodies, steady, kill_zone, &context);
        }
    }

    /// Wakes or readmits the islands that a moving body met; returns whether the step has to be repeated.
    fn wake_touched(&mut self) -> bool {
        let (moving, pairs) = (self.bodies.moving.len(), self.pairs.pairs.len());
        let mut has_woken =
            self.steady.readmit_met(&mut self.bodies, self.conjugate.contacting_pairs());
        if !has_woken {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            has_woken = self.sleep.wake_touched(&mut awake, self.conjugate.contacting_pairs());
        }
        if has_woken {
            self.conjugate.try_again(moving, pairs);
        }
        has_woken
    }

    /// Finds the moves of bodies under drag, wind and springs.
    fn find_moves(&mut self) {
        let around = self.surroundings();
        if let Some(forces) = &mut self.forces {
            forces.find_moves(&self.bodies, around);
            forces.moves.retain(|found| !self.sleep.has(found.slot));
        }
    }

    fn has_springs(&self) -> bool {
        self.forces.as_ref().is_some_and(Forces::has_springs)
    }

    fn begin_forces(&mut self) {
        if let Some(forces) = &mut self.forces {
            forces.begin(&self.bodies);
        }
    }

    /// Extends the reach of bodies on stiff springs; returns whether there are any.
    fn extend_reach(&mut self) -> bool {
        self.forces.as_ref().is_some_and(|forces| forces.extend_reach(&mut self.bodies))
    }

    /// Ends the effect of contacts on bodies on stiff springs.
    fn respond(&mut self, is_free: bool) {
        if let Some(forces) = &mut self.forces {
            forces.respond(&mut self.bodies, is_free, self.settings.speed_max);
        }
    }

    /// Finds the moves of stiff springs again where something is in the way.
    fn meet_obstacles(&mut self) {
        let around = self.surroundings();
        if let Some(forces) = &mut self.forces {
            forces.meet_obstacles(&mut self.bodies, &self.pairs.pairs, around);
        }
    }

    fn surroundings(&self) -> Surroundings {
        let WorldSettings { gravity, dt, speed_max, meets, .. } = self.settings;
        Surroundings { gravity, dt, speed_max, meets }
    }

    fn remove_departed(&mut self) {
        let Departed { bodies: departed, quarantined } = &mut self.departed;
        departed.clear();
        quarantined.clear();
        for &slot in &self.bodies.moving {
            let center = self.bodies.center[slot as usize];
            // A body that is not finite is removed before it can touch anything (C03).
            if !self.bodies.is_finite(slot as usize) {
                let last = if center.is_finite() { center } else { self.settings.kill_zone.low };
                quarantined.push(self.bodies.id(slot));
                departed.push((self.bodies.id(slot), last));
            } else if !self.settings.kill_zone.contains(center) {
                departed.push((self.bodies.id(slot), center));
            }
        }
        let ids: Vec<BodyId> = departed.iter().map(|&(id, _)| id).collect();
        self.remove_all(&ids);
    }
}

fn moves(forces: &Option<Forces>) -> &[Move] {
    forces.as_ref().map_or(&[], |forces| &forces.moves)
}
