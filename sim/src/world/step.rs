//! A world's steps, one for each solver.

use super::{StepPhase, World, awake};
use crate::body::BodyId;
use crate::integrate;
use crate::solver::settings::{Conjugate, Relaxation};
use crate::solver::step_context::StepContext;
use crate::solver::{Solver, as_listed};
use crate::world::settings::WorldSettings;

impl World {
    pub(super) fn advance(&mut self, watch: &mut dyn FnMut(StepPhase, &mut World)) {
        if self.solvers.release() {
            self.touches.release();
        }
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
        self.departed.find(&self.bodies, &self.settings.kill_zone);
        let departed: Vec<BodyId> = self.departed.bodies.iter().map(|&(id, _)| id).collect();
        self.remove_all(&departed);
        if self.settings.sleeping && !self.is_over_budget() {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            let constraints = &self.solvers.conjugate.contacts.constraints;
            self.sleep.fall_asleep(&mut awake, constraints, &self.forces.springs, &self.settings);
        }
    }

    /// Takes a step of symplectic Euler, followed by passes over all overlapping pairs. Without solver settings,
    /// contacts are only detected.
    fn step_relaxation(
        &mut self,
        settings: Option<&Relaxation>,
        watch: &mut dyn FnMut(StepPhase, &mut World),
    ) {
        self.forces.begin(&self.bodies);
        self.find_moves();
        if self.forces.has_springs() {
            // The reach from the previous step is not state.
            integrate::reach_paths(&mut self.bodies, self.settings.dt);
        }
        if self.forces.extend_reach(&mut self.bodies) {
            self.pairs.refresh(&self.bodies, self.settings.filter());
            if self.pairs.is_over() {
                return;
            }
            let around = self.settings.surroundings();
            self.forces.meet_obstacles(&mut self.bodies, &self.pairs.pairs, around);
        }
        let solver = &mut self.solvers.relaxation;
        let (bodies, pairs, moves) = (&mut self.bodies, &mut self.pairs.pairs, &self.forces.moves);
        solver.start(bodies, pairs, moves, settings, &self.settings);
        solver.advance(bodies, moves, self.settings.dt);
        watch(StepPhase::Integrate, self);
        self.pairs.refresh(&self.bodies, self.settings.filter());
        if self.pairs.is_over() {
            self.forces.respond(&mut self.bodies, false, self.settings.speed_max);
            return;
        }
        let solver = &mut self.solvers.relaxation;
        solver.gather(&self.bodies, &self.pairs.pairs, self.settings.features);
        solver.limit_bounces(&self.bodies, &self.forces, self.settings.dt);
        watch(StepPhase::Pairs, self);
        let solver = &mut self.solvers.relaxation;
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs.pairs);
        solver.solve(bodies, pairs, settings, &self.settings);
        self.forces.respond(bodies, false, self.settings.speed_max);
        watch(StepPhase::Relax, self);
        let solver = &mut self.solvers.relaxation;
        self.touches.report(&self.bodies, solver.overlaps(&self.bodies), &self.steady);
        self.forces.limit_energy(&mut self.bodies, solver.contacts(), self.settings.gravity);
    }

    /// Takes the same step as printed in the chapter.
    fn step_listed(&mut self, settings: &Relaxation, watch: &mut dyn FnMut(StepPhase, &mut World)) {
        let WorldSettings { gravity, dt, speed_max, .. } = self.settings;
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs.pairs);
        let solver = &mut self.solvers.relaxation;
        solver.start(bodies, pairs, &[], None, &self.settings);
        as_listed::weigh(bodies, gravity * dt, speed_max);
        solver.advance(bodies, &[], dt);
        watch(StepPhase::Integrate, self);
        self.pairs.refresh(&self.bodies, self.settings.filter());
        if self.pairs.is_over() {
            return;
        }
        let solver = &mut self.solvers.relaxation;
        solver.gather(&self.bodies, &self.pairs.pairs, self.settings.features);
        watch(StepPhase::Pairs, self);
        let solver = &mut self.solvers.relaxation;
        solver.drop_non_finite(&self.bodies);
        let (constraints, pairs) = (&mut solver.constraints, &mut self.pairs.pairs);
        solver.passes = as_listed::solve(&mut self.bodies, constraints, pairs, settings);
        watch(StepPhase::Relax, self);
        let overlaps = self.solvers.relaxation.overlaps(&self.bodies);
        self.touches.report(&self.bodies, overlaps, &self.steady);
    }

    /// Handles impacts in chronological order, then finds velocities that satisfy all contacts, then positions.
    fn step_conjugate(
        &mut self,
        settings: &Conjugate,
        watch: &mut dyn FnMut(StepPhase, &mut World),
    ) {
        self.sleep.save_step_start(&self.bodies);
        self.forces.begin(&self.bodies);
        // Sleep counts the steps for which bodies rest, and forces may change by themselves.
        let leaves_out = !self.settings.sleeping && self.settings.forces.is_none();
        let work_max = self.settings.budget.work;
        self.solvers.conjugate.begin(&mut self.bodies, &mut self.steady, leaves_out, work_max);
        self.find_contacts(settings);
        while self.wake_touched() {
            self.find_contacts(settings);
        }
        if self.is_over_budget() {
            return;
        }
        watch(StepPhase::Pairs, self);
        self.find_velocities(settings);
        while self.wake_touched() {
            self.find_contacts(settings);
            self.find_velocities(settings);
        }
        if self.is_over_budget() {
            return;
        }
        let solver = &mut self.solvers.conjugate;
        solver.store(&self.bodies, &mut self.pairs.pairs, &self.steady);
        watch(StepPhase::Relax, self);
        let context = StepContext::new(settings, &self.settings);
        let (solver, moves) = (&mut self.solvers.conjugate, &self.forces.moves);
        solver.find_positions(&mut self.bodies, &self.pairs.pairs, moves, &context);
        watch(StepPhase::Integrate, self);
        let solver = &self.solvers.conjugate;
        self.touches.report(&self.bodies, solver.touching(), &self.steady);
        let contacts = solver.touching().map(|found| [found.a, found.b]);
        self.forces.limit_energy(&mut self.bodies, contacts, self.settings.gravity);
        if self.steady.is_on {
            let context = StepContext::new(settings, &self.settings);
            let kill_zone = &self.settings.kill_zone;
            solver.leave_out(&mut self.bodies, &mut self.steady, kill_zone, &context);
        }
    }

    fn find_contacts(&mut self, settings: &Conjugate) {
        if self.forces.has_springs() {
            self.find_moves();
        }
        let context = StepContext::new(settings, &self.settings);
        let (bodies, pairs) = (&mut self.bodies, &mut self.pairs);
        self.solvers.conjugate.find_contacts(bodies, pairs, &self.steady, &self.forces, &context);
    }

    fn find_velocities(&mut self, settings: &Conjugate) {
        if self.is_over_budget() {
            return;
        }
        if !self.forces.has_springs() || self.solvers.conjugate.has_bounced() {
            self.find_moves();
        }
        let context = StepContext::new(settings, &self.settings);
        let solver = &mut self.solvers.conjugate;
        if self.forces.extend_reach(&mut self.bodies) {
            solver.refresh(&self.bodies, &mut self.pairs, &context);
            if self.pairs.is_over() {
                return;
            }
            let around = self.settings.surroundings();
            self.forces.meet_obstacles(&mut self.bodies, &self.pairs.pairs, around);
        }
        solver.find_velocities(&mut self.bodies, &mut self.pairs, &self.forces.moves, &context);
        self.forces.respond(&mut self.bodies, true, self.settings.speed_max);
    }

    /// Wakes or readmits the islands that a moving body met, and returns whether the step must be repeated.
    fn wake_touched(&mut self) -> bool {
        if self.is_over_budget() {
            return false;
        }
        let (moving, pairs) = (self.bodies.moving.len(), self.pairs.pairs.len());
        let solver = &mut self.solvers.conjugate;
        let mut has_woken = self.steady.readmit_met(&mut self.bodies, solver.contacting_pairs());
        if !has_woken {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            has_woken = self.sleep.wake_touched(&mut awake, solver.contacting_pairs());
        }
        if has_woken {
            solver.try_again(moving, pairs);
        }
        has_woken
    }

    /// Finds the moves of bodies under drag, wind and springs.
    fn find_moves(&mut self) {
        self.forces.find_moves(&self.bodies, self.settings.surroundings());
        self.forces.moves.retain(|found| !self.sleep.has(found.slot));
    }
}
