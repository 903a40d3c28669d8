//! The table of methods: every engine configuration that is measured, with its knob. Each new solver, knob or peer is
//! one more entry.

use crate::engine::{Build, Engine};
use crate::integrators::{FreeFlight, Precision, Scheme};
use crate::jostle::{Jostle, ParticleFlight};
use crate::scene::Scene;
use jostle_sim::Conjugate;
use jostle_sim::Relaxation;
use jostle_sim::Solver;

/// Origin of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    Jostle,
    /// A textbook scheme in this crate, used as a reference.
    Yardstick,
    Peer,
}

/// The scenes in which a method is meaningful.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// All scenes that the engine can simulate.
    All,
    /// Only scenes with contacts, because the knob has no effect without them.
    Contacts,
    /// Scenes with contacts and with gravity as strong as in Jostle's scenes, for a configuration designed for these.
    StrongGravity,
    /// Only scenes without contacts, because the method cannot handle them.
    FreeFlight,
}

/// One curve: an engine, and the knob that is varied along it.
#[derive(Clone, Copy)]
pub struct Method {
    pub name: &'static str,
    /// Where the method comes from.
    pub family: Family,
    /// The meaning of the settings.
    pub knob: &'static str,
    /// Settings for the curve's points, from cheap to expensive.
    pub settings: &'static [f64],
    /// The default setting, used for the stability cases.
    pub default: Option<f64>,
    /// Whether the knob divides the step, so that an order of convergence is defined.
    pub divides_step: bool,
    /// The scenes that the method takes part in; it is silently omitted from others.
    pub field: Field,
    /// Whether the stability cases include the method; true for one entry per solver.
    pub in_stability: bool,
    /// Creates the engine with a given setting.
    pub build: Build,
}

/// The solvers that scene files can choose: "relaxation", the default, and "conjugate".
pub const SOLVERS: [&str; 2] = ["Jostle relaxation, 15 passes", "Jostle conjugate"];

/// Steps or sub-steps per tick.
pub const STEPS: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
const PASSES: &[f64] = &[1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0];
const TOLERANCES: &[f64] = &[0.5, 0.1, 0.02, 0.005, 1e-3, 1e-4];
const SWEEPS: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0, 60.0, 240.0];
const SHARES: &[f64] = &[0.1, 0.2, 0.4, 0.6, 0.8, 1.0];

/// All methods except the peers, in the order of the legends.
pub const METHODS: [Method; 12] = [
    Method {
        name: "Jostle relaxation, 15 passes",
        family: Family::Jostle,
        knob: "steps a tick",
        settings: STEPS,
        default: Some(1.0),
        divides_step: true,
        field: Field::All,
        in_stability: true,
        build: |scene, steps| boxed(Jostle::new(scene, steps as u32, relaxation(scene, |_| {}))),
    },
    Method {
        name: "Jostle relaxation, 4 passes",
        family: Family::Jostle,
        knob: "steps a tick",
        settings: STEPS,
        default: None,
        divides_step: true,
        field: Field::Contacts,
        in_stability: false,
        build: |scene, steps| {
            boxed(Jostle::new(scene, steps as u32, relaxation(scene, |r| r.iterations = 4)))
        },
    },
    Method {
        name: "Jostle relaxation, 1 step",
        family: Family::Jostle,
        knob: "passes",
        settings: PASSES,
        default: Some(15.0),
        divides_step: false,
        field: Field::Contacts,
        in_stability: false,
        build: |scene, passes| {
            boxed(Jostle::new(scene, 1, relaxation(scene, |r| r.iterations = passes as u32)))
        },
    },
    Method {
        name: "Jostle relaxation, 1 step, 15 passes",
        family: Family::Jostle,
        knob: "correction",
        settings: SHARES,
        default: Some(0.8),
        divides_step: false,
        field: Field::Contacts,
        in_stability: false,
        build: |scene, share| {
            boxed(Jostle::new(scene, 1, relaxation(scene, |r| r.correction = share as f32)))
        },
    },
    Method {
        name: "Jostle conjugate",
        family: Family::Jostle,
        knob: "steps a tick",
        settings: STEPS,
        default: Some(1.0),
        divides_step: true,
        field: Field::All,
        in_stability: true,
        build: |scene, steps| boxed(Jostle::new(scene, steps as u32, conjugate(scene, |_| {}))),
    },
    Method {
        name: "Jostle conjugate, 1 step",
        family: Family::Jostle,
        knob: "tolerance",
        settings: TOLERANCES,
        default: Some(0.005),
        divides_step: false,
        field: Field::Contacts,
        in_stability: false,
        build: |scene, share| {
            boxed(Jostle::new(scene, 1, conjugate(scene, |c| c.tolerance = share as f32)))
        },
    },
    Method {
        name: "Jostle conjugate, 1 step, tolerance 0.001",
        family: Family::Jostle,
        knob: "sweeps at most",
        settings: SWEEPS,
        default: None,
        divides_step: false,
        field: Field::Contacts,
        in_stability: false,
        build: |scene, sweeps| {
            let tune = |c: &mut Conjugate| (c.tolerance, c.sweeps_max) = (1e-3, sweeps as u32);
            boxed(Jostle::new(scene, 1, conjugate(scene, tune)))
        },
    },
    Method {
        name: "Jostle particles",
        family: Family::Jostle,
        knob: "steps a tick",
        settings: STEPS,
        default: Some(1.0),
        divides_step: true,
        field: Field::FreeFlight,
        in_stability: false,
        build: |scene, steps| boxed(ParticleFlight::new(scene, steps as u32)),
    },
    yardstick("explicit Euler, f64", |scene, steps| {
        flight(scene, Scheme::ExplicitEuler, Precision::Double, steps)
    }),
    yardstick("symplectic Euler, f64", |scene, steps| {
        flight(scene, Scheme::SymplecticEuler, Precision::Double, steps)
    }),
    yardstick("kick-drift-kick, f64", |scene, steps| {
        flight(scene, Scheme::KickDriftKick, Precision::Double, steps)
    }),
    yardstick("kick-drift-kick, f32 state", |scene, steps| {
        flight(scene, Scheme::KickDriftKick, Precision::Single, steps)
    }),
];

const fn yardstick(name: &'static str, build: Build) -> Method {
    Method {
        name,
        family: Family::Yardstick,
        knob: "steps a tick",
        settings: STEPS,
        default: None,
        divides_step: true,
        field: Field::FreeFlight,
        in_stability: false,
        build,
    }
}

/// The relaxation solver with its defaults and the scene's threshold, adjusted by `tune`.
fn relaxation(scene: &Scene, tune: impl Fn(&mut Relaxation)) -> Solver {
    let bounce_threshold = scene.bounce_threshold as f32;
    let mut settings = Relaxation { bounce_threshold, ..Relaxation::default() };
    tune(&mut settings);
    Solver::Relaxation(settings)
}

/// The conjugate solver, configured in the same way.
fn conjugate(scene: &Scene, tune: impl Fn(&mut Conjugate)) -> Solver {
    let bounce_threshold = scene.bounce_threshold as f32;
    let mut settings = Conjugate { bounce_threshold, ..Conjugate::default() };
    tune(&mut settings);
    Solver::Conjugate(settings)
}

fn flight(
    scene: &Scene,
    scheme: Scheme,
    precision: Precision,
    steps: f64,
) -> Result<Box<dyn Engine>, String> {
    boxed(FreeFlight::new(scene, scheme, precision, steps as u32))
}

/// Boxes an engine for [`Method::build`].
pub fn boxed<E: Engine + 'static>(made: Result<E, String>) -> Result<Box<dyn Engine>, String> {
    made.map(|engine| Box::new(engine) as Box<dyn Engine>)
}
