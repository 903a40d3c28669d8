//! Resource limits for scenes made by strangers, checked against the [`Plan`](super::Plan) before a scene is
//! played.

use super::cost::WorstTick;
use super::error::{SceneError, locate};
use super::plan;
use super::sources::{Launcher, ScheduledEmitter};
use super::spec::Scene;
use jostle_sim::math::max;
use jostle_sim::{Solver, TICKS_PER_SECOND};

/// The largest resources that a scene may need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Maximum number of concurrent players.
    pub players: u16,
    /// Maximum number of bodies of all kinds at any time.
    pub bodies: usize,
    /// Maximum number of particles at any time.
    pub particles: usize,
    /// Width and height of the world, units.
    pub size: f32,
    /// Processor time of the worst tick ([`WorstTick`]) that the scene's limits allow, milliseconds.
    pub tick_ms: f32,
    /// Limits on the settings of its solver.
    pub solver: SolverBudget,
    /// Number of springs.
    pub springs: usize,
    /// Number of zones times number of bodies, which is the number of checks made in a tick.
    pub zone_looks: usize,
    /// Number of rules. Each one is compared with every contact.
    pub rules: usize,
    /// Total number of emitter starts per second.
    pub starts_per_s: u32,
    /// Total number of particles made by emitters per second.
    pub emitted_per_s: u32,
    /// Total number of bodies made by launchers per second.
    pub launched_per_s: u32,
}

/// The most work that a scene's settings may let its solver do in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverBudget {
    /// Number of iterations of the relaxation solver.
    pub iterations: u32,
    /// Number of sweeps of the conjugate solver.
    pub sweeps: u32,
    /// Number of the conjugate solver's visits to contacts.
    pub work: u32,
    /// Number of the conjugate solver's passes over positions.
    pub position_passes: u32,
}

impl Budget {
    /// Checks a scene. The error names the first field that asks for too much.
    pub fn check(&self, scene: &Scene) -> Result<(), SceneError> {
        self.check_limits(scene)?;
        self.solver.check(scene)?;
        self.check_rules(scene)?;
        self.check_sources(scene)?;
        self.check_tick(scene)
    }

    fn check_limits(&self, scene: &Scene) -> Result<(), SceneError> {
        let world = &scene.world;
        let players = u32::from(scene.players_max);
        at_most(scene, "limits.players", "players", players, self.players.into())?;
        let size = max(scene.size.x, scene.size.y);
        if size > self.size {
            let found = format!("a world of {} x {}", scene.size.x, scene.size.y);
            let allowed = format!("at most {} on each side", self.size);
            return Err(SceneError::in_scene(scene, "size", found, allowed));
        }
        let (bodies, allowed) = (world.bodies_max as u32, self.bodies as u32);
        at_most(scene, &bodies_field(scene), "bodies at a time", bodies, allowed)?;
        let (particles, allowed) = (world.particles_max as u32, self.particles as u32);
        at_most(scene, "limits.particles", "particles at a time", particles, allowed)
    }

    fn check_rules(&self, scene: &Scene) -> Result<(), SceneError> {
        let (springs, rules) = (scene.springs.len() as u32, scene.rules.rules.len() as u32);
        at_most(scene, "springs", "springs", springs, self.springs as u32)?;
        at_most(scene, "rules", "rules", rules, self.rules as u32)?;
        let zones = scene.rules.zones.len();
        let looks = zones * scene.world.bodies_max;
        if looks > self.zone_looks {
            let found = format!("{zones} zones and up to {} bodies", scene.world.bodies_max);
            let allowed = format!("at most {} as the product of the two", self.zone_looks);
            return Err(SceneError::in_scene(scene, "zones", found, allowed));
        }
        Ok(())
    }

    /// Checks emitters and launchers by their output per second.
    fn check_sources(&self, scene: &Scene) -> Result<(), SceneError> {
        let starts = |emitter: &ScheduledEmitter| emitter.every.map_or(0.0, per_second);
        let emitted = |emitter: &ScheduledEmitter| match emitter.every {
            // Emitters that run once are counted as if they all ran in the same second.
            None => f64::from(emitter.count),
            Some(every) => f64::from(emitter.count) * per_second(every),
        };
        let launched = |launcher: &Launcher| per_second(launcher.every);
        let (emitters, launchers) = (&scene.emitters, &scene.launchers);
        let (field, per_s) = most(emitters.iter().map(starts), "emitters", "every");
        at_most(scene, &field, "starts of emitters a second", per_s, self.starts_per_s)?;
        let (field, per_s) = most(emitters.iter().map(emitted), "emitters", "count");
        at_most(scene, &field, "particles a second", per_s, self.emitted_per_s)?;
        let (field, per_s) = most(launchers.iter().map(launched), "launchers", "every");
        at_most(scene, &field, "launches a second", per_s, self.launched_per_s)
    }

    fn check_tick(&self, scene: &Scene) -> Result<(), SceneError> {
        let worst = WorstTick::of(scene);
        if worst.ms <= self.tick_ms {
            return Ok(());
        }
        let found =
            format!("a worst tick of {:.1} ms by its limits, most of it from here", worst.ms);
        let allowed = format!(
            "at most {} ms; fewer bodies, none in each other at the start, or a cheaper solver",
            self.tick_ms
        );
        Err(SceneError::in_scene(scene, &worst.field, found, allowed))
    }
}

impl SolverBudget {
    fn check(&self, scene: &Scene) -> Result<(), SceneError> {
        match scene.world.solver {
            None => Ok(()),
            Some(Solver::Relaxation(settings)) => {
                let field = "relaxation.iterations";
                at_most(scene, field, "iterations", settings.iterations, self.iterations)
            }
            Some(Solver::Conjugate(settings)) => {
                let (sweeps, work) = ("conjugate.sweeps_max", "conjugate.work_max");
                let passes = "conjugate.position_passes";
                at_most(scene, sweeps, "sweeps", settings.sweeps_max, self.sweeps)?;
                at_most(scene, work, "units of work", settings.work_max, self.work)?;
                at_most(scene, passes, "passes", settings.position_passes, self.position_passes)
            }
        }
    }
}

/// Refuses a count above the allowed maximum.
fn at_most(
    scene: &Scene,
    field: &str,
    what: &str,
    count: u32,
    allowed: u32,
) -> Result<(), SceneError> {
    if count <= allowed {
        return Ok(());
    }
    let found = format!("{count} {what}");
    Err(SceneError::in_scene(scene, field, found, format!("at most {allowed}")))
}

/// The field that determines how many bodies there can be: the limit if the file sets one, otherwise the field that
/// adds the most.
fn bodies_field(scene: &Scene) -> String {
    let limit = "limits.bodies";
    let mut fields: Vec<(String, u32)> = Vec::new();
    for alike in plan::sources(scene) {
        let (field, total) = (alike.count_field(), alike.total(scene.players_max));
        match fields.iter_mut().find(|(known, _)| *known == field) {
            Some((_, count)) => *count += total,
            None => fields.push((field, total)),
        }
    }
    let most = fields.into_iter().max_by_key(|(_, count)| *count);
    match most {
        Some((field, _)) if !locate(&scene.source, limit).1 => field,
        _ => limit.to_owned(),
    }
}

/// The total output of a list's entries, rounded up, and the field of the entry that contributes the most.
fn most(each: impl Iterator<Item = f64>, list: &str, field: &str) -> (String, u32) {
    let (mut sum, mut largest, mut at) = (0.0, 0.0, 0);
    for (index, made) in each.enumerate() {
        sum += made;
        if made > largest {
            (largest, at) = (made, index);
        }
    }
    (format!("{list}[{at}].{field}"), sum.ceil() as u32)
}

/// Rate per second of something that happens every `every` ticks.
fn per_second(every: u32) -> f64 {
    f64::from(TICKS_PER_SECOND) / f64::from(every.max(1))
}

#[cfg(test)]
mod tests;
