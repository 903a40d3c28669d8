//! A scene's [`Plan`] for eyes and scripts: what is in, what is left out, and which field decides.

use jostle_game::scene::{Bodies, Part, Per, Plan};
use jostle_game::{Scene, Tools};
use jostle_sim::Motion;
use serde::Serialize;
use std::fmt;

/// What is printed of a scene.
#[derive(Debug, Serialize)]
pub struct Told {
    scene: String,
    title: String,
    /// World units.
    size: [f32; 2],
    /// Units/s^2.
    gravity: [f32; 2],
    /// `None`: contacts are found and not solved.
    solver: Option<Solver>,
    /// Groups with bodies in them.
    groups: Vec<String>,
    /// Groups that collide and both have bodies.
    pairs: Vec<[String; 2]>,
    /// Bodies by kind, group, motion and shape.
    bodies: Vec<ToldBodies>,
    /// What a scene can lack, whether this one needs it, and why.
    parts: Vec<ToldPart>,
    tools: Vec<&'static str>,
    limits: Limits,
}

#[derive(Debug, Serialize)]
#[serde(tag = "method", rename_all = "lowercase")]
enum Solver {
    Relaxation {
        iterations: u32,
        correction: f32,
        slop: f32,
        bounce_threshold: f32,
        warm_start: bool,
    },
    Conjugate {
        tolerance: f32,
        sweeps_max: u32,
        work_max: u32,
        bounce_threshold: f32,
        slop: f32,
        correction: f32,
        correction_max: f32,
        position_passes: u32,
    },
}

impl Solver {
    fn of(solver: jostle_sim::Solver) -> Solver {
        match solver {
            jostle_sim::Solver::Relaxation(settings) => Solver::Relaxation {
                iterations: settings.iterations,
                correction: settings.correction,
                slop: settings.slop,
                bounce_threshold: settings.bounce_threshold,
                warm_start: settings.warm_start,
            },
            jostle_sim::Solver::Conjugate(settings) => Solver::Conjugate {
                tolerance: settings.tolerance,
                sweeps_max: settings.sweeps_max,
                work_max: settings.work_max,
                bounce_threshold: settings.bounce_threshold,
                slop: settings.slop,
                correction: settings.correction,
                correction_max: settings.correction_max,
                position_passes: settings.position_passes,
            },
        }
    }
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Solver::Relaxation { iterations, correction, slop, bounce_threshold, warm_start } => {
                let start = if *warm_start { "warm" } else { "cold" };
                write!(
                    f,
                    "{iterations} iterations, correction {correction}, slop {slop}, \
                     bounce from {bounce_threshold}, {start} start"
                )
            }
            Solver::Conjugate { tolerance, sweeps_max, bounce_threshold, slop, .. } => write!(
                f,
                "conjugate to {tolerance}, at most {sweeps_max} sweeps, slop {slop}, \
                 bounce from {bounce_threshold}"
            ),
        }
    }
}

#[derive(Debug, Serialize)]
struct ToldBodies {
    kind: &'static str,
    group: String,
    motion: &'static str,
    /// `circle`, `box`, or `circle or box` where the seed decides.
    shape: &'static str,
    count: u32,
    /// What `count` counts: `scene`, `player` or `tool`.
    per: &'static str,
    /// The first entry of the file that brings them.
    field: String,
}

#[derive(Debug, Serialize)]
struct ToldPart {
    name: &'static str,
    used: bool,
    why: String,
    costs: &'static str,
}

#[derive(Debug, Serialize)]
struct Limits {
    players: u16,
    bodies: usize,
    particles: usize,
}

impl Told {
    /// Reads a scene.
    pub fn of(scene: Scene) -> Told {
        let plan = Plan::of(&scene);
        let name = |index: u8| scene.groups[usize::from(index)].clone();
        let mut groups: Vec<u8> = plan.bodies.iter().map(|bodies| bodies.def.group).collect();
        groups.sort_unstable();
        groups.dedup();
        let tools = Tools::NAMES.iter().filter(|(_, tool)| scene.tools.contains(*tool));
        Told {
            size: scene.size.to_array(),
            gravity: scene.world.gravity.to_array(),
            solver: scene.world.solver.map(Solver::of),
            groups: groups.into_iter().map(name).collect(),
            pairs: plan.pairs.iter().map(|pair| pair.map(name)).collect(),
            bodies: plan.bodies.iter().map(|bodies| told_bodies(bodies, &scene)).collect(),
            parts: plan.parts.into_iter().map(told_part).collect(),
            tools: tools.map(|(name, _)| *name).collect(),
            limits: Limits {
                players: scene.players_max,
                bodies: scene.world.bodies_max,
                particles: scene.world.particles_max,
            },
            scene: scene.name,
            title: scene.title,
        }
    }
}

fn told_bodies(bodies: &Bodies, scene: &Scene) -> ToldBodies {
    ToldBodies {
        kind: bodies.kind.name(),
        group: scene.groups[usize::from(bodies.def.group)].clone(),
        motion: match bodies.def.motion {
            Motion::Static => "static",
            Motion::Kinematic => "kinematic",
            Motion::Dynamic => "dynamic",
        },
        shape: match (bodies.circles(), bodies.boxes()) {
            (true, true) => "circle or box",
            (true, false) => "circle",
            _ => "box",
        },
        count: bodies.count,
        per: match bodies.per {
            Per::Scene => "scene",
            Per::Player => "player",
            Per::Tool => "tool",
        },
        field: bodies.field.clone(),
    }
}

fn told_part(part: Part) -> ToldPart {
    let Part { name, costs, used, why } = part;
    ToldPart { name, used, why, costs }
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [width, height] = self.size;
        let [gravity_x, gravity_y] = self.gravity;
        writeln!(f, "{}: {}", self.scene, self.title)?;
        writeln!(f, "world        {width} x {height}, gravity ({gravity_x}, {gravity_y})")?;
        match &self.solver {
            Some(solver) => writeln!(f, "solver       {solver}")?,
            None => writeln!(f, "solver       none: contacts are only found")?,
        }
        for bodies in &self.bodies {
            let per = match bodies.per {
                "player" => " a player",
                "tool" => " at most, by Z",
                _ => "",
            };
            let ToldBodies { kind, group, motion, shape, count, .. } = bodies;
            writeln!(f, "bodies       {count} {motion} {kind} ({shape}, group {group}){per}")?;
        }
        let pairs: Vec<_> = self.pairs.iter().map(|pair| pair.join("-")).collect();
        writeln!(f, "pairs        {}", listed(&pairs))?;
        writeln!(f, "tools        {}", listed(&self.tools))?;
        let Limits { players, bodies, particles } = self.limits;
        writeln!(f, "limits       {players} players, {bodies} bodies, {particles} particles")?;
        for (heading, used) in [("in", true), ("left out", false)] {
            for part in self.parts.iter().filter(|part| part.used == used) {
                write!(f, "\n{heading:<9} {:<21} {}", part.name, part.why)?;
            }
        }
        Ok(())
    }
}

fn listed<T: AsRef<str>>(words: &[T]) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_scene_has_a_plan() {
        for scene in Scene::built_in() {
            let (name, tools) = (scene.name.clone(), scene.tools);
            let told = Told::of(scene);
            assert!(!told.bodies.is_empty(), "{name}");
            assert_eq!(told.tools.is_empty(), tools == Tools::default(), "{name}");
            let text = told.to_string();
            assert!(text.starts_with(&name));
            for part in &told.parts {
                let said = if part.used { "in" } else { "left out" };
                let line = format!("\n{said:<9} {:<21} {}", part.name, part.why);
                assert!(text.contains(&line), "{name}: {line}");
            }
        }
    }
}
