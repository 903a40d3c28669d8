//! What a scene contains, so that one can see what it will cost and what it will not.

use jostle_sim::scene::Place;
use jostle_sim::{BodyDef, Kind, Motion, Scene, Shape, Tools};
use serde::Serialize;
use std::fmt;

/// Everything that a scene uses; what is absent costs nothing.
#[derive(Debug, Serialize)]
pub struct Plan {
    scene: String,
    title: String,
    /// World units.
    size: [f32; 2],
    /// Units/s^2.
    gravity: [f32; 2],
    /// `None`: contacts are found and not solved.
    solver: Option<Solver>,
    /// Groups with bodies in them.
    groups: Vec<Group>,
    /// Groups that collide and both have bodies.
    pairs: Vec<[String; 2]>,
    /// Kinds of contact that these pairs can make.
    shape_pairs: Vec<String>,
    /// Bodies by kind, group, motion and shape.
    bodies: Vec<Bodies>,
    /// Names of the recipes that something emits.
    recipes: Vec<String>,
    /// Emitters that run by themselves.
    emitters: Vec<Emitter>,
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
struct Group {
    name: String,
    /// Whether particles are pushed out of its bodies.
    particles: bool,
}

#[derive(Debug, Serialize)]
struct Bodies {
    kind: &'static str,
    #[serde(skip)]
    group_index: u8,
    group: String,
    motion: &'static str,
    /// `circle`, `box`, or `circle or box` where the seed decides.
    shape: &'static str,
    count: u32,
    /// What `count` counts.
    per: Per,
}

/// Where bodies come from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Per {
    /// There from the start, for good or until something removes them.
    Scene,
    /// At most so many for each player.
    Player,
    /// At most so many made with a tool.
    Tool,
}

#[derive(Debug, Serialize)]
struct Emitter {
    recipe: String,
    count: u16,
    start: u32,
    /// Ticks; `None` runs once.
    every: Option<u32>,
    follows_body: bool,
}

#[derive(Debug, Serialize)]
struct Limits {
    players: u8,
    bodies: usize,
    particles: usize,
}

impl Plan {
    /// Reads a scene.
    pub fn of(scene: Scene) -> Plan {
        let bodies = bodies(&scene);
        let holds = |index: usize| bodies.iter().any(|b| usize::from(b.group_index) == index);
        let groups = scene.groups.iter().enumerate().filter(|(index, _)| holds(*index));
        let groups = groups.map(|(index, name)| Group {
            name: name.clone(),
            particles: scene.meets_particles >> index & 1 == 1,
        });
        let tools = Tools::NAMES.iter().filter(|(_, tool)| scene.tools.contains(*tool));
        Plan {
            size: scene.size.to_array(),
            gravity: scene.gravity.to_array(),
            solver: scene.solver.map(Solver::of),
            groups: groups.collect(),
            pairs: pairs(&scene, &bodies),
            shape_pairs: shape_pairs(&scene, &bodies),
            recipes: recipes(&scene),
            emitters: emitters(&scene),
            tools: tools.map(|(name, _)| *name).collect(),
            limits: Limits {
                players: scene.players_max,
                bodies: scene.bodies_max,
                particles: scene.particles_max,
            },
            bodies,
            scene: scene.name,
            title: scene.title,
        }
    }
}

fn bodies(scene: &Scene) -> Vec<Bodies> {
    let mut bodies = Vec::new();
    let mut add = |kind: Kind, def: &BodyDef, shapes: &[Shape], count: u32, per: Per| {
        let entry = Bodies {
            kind: kind.name(),
            group_index: def.group,
            group: scene.groups[usize::from(def.group)].clone(),
            motion: motion_name(def.motion),
            shape: shape_name(shapes),
            count,
            per,
        };
        match bodies.iter().position(|known: &Bodies| known.is_like(&entry)) {
            Some(index) => bodies[index].count += count,
            None => bodies.push(entry),
        }
    };
    for placed in &scene.bodies {
        add(placed.kind, &placed.def, &[placed.def.shape], 1, Per::Scene);
    }
    for layout in &scene.layouts {
        add(layout.kind, &layout.def, &layout.shapes, layout.count, Per::Scene);
    }
    if let Some(hero) = &scene.hero {
        add(Kind::Hero, &hero.body, &[hero.body.shape], 1, Per::Player);
    }
    if let Some(pack) = scene.pack.as_ref().filter(|_| scene.tools.contains(Tools::LAUNCH)) {
        add(Kind::Pack, &pack.body, &[pack.body.shape], scene.packs_max as u32, Per::Player);
    }
    if let Some(dumb) = &scene.dumb {
        add(Kind::Dumb, dumb, &[dumb.shape], scene.dumb_max as u32, Per::Tool);
    }
    bodies
}

impl Bodies {
    /// Whether only the counts may differ.
    fn is_like(&self, other: &Bodies) -> bool {
        self.kind == other.kind
            && self.group_index == other.group_index
            && self.motion == other.motion
            && self.shape == other.shape
            && self.per == other.per
    }

    fn circles(&self) -> bool {
        self.shape != "box"
    }

    fn boxes(&self) -> bool {
        self.shape != "circle"
    }
}

fn shape_name(shapes: &[Shape]) -> &'static str {
    let circle = shapes.iter().any(|shape| matches!(shape, Shape::Circle { .. }));
    let rect = shapes.iter().any(|shape| matches!(shape, Shape::Box { .. }));
    match (circle, rect) {
        (true, true) => "circle or box",
        (true, false) => "circle",
        _ => "box",
    }
}

fn motion_name(motion: Motion) -> &'static str {
    match motion {
        Motion::Static => "static",
        Motion::Kinematic => "kinematic",
        Motion::Dynamic => "dynamic",
    }
}

/// Entries whose bodies can collide: their groups meet, and one of them can be pushed.
fn meeting<'a>(
    scene: &'a Scene,
    bodies: &'a [Bodies],
) -> impl Iterator<Item = (&'a Bodies, &'a Bodies)> {
    let all = (0..bodies.len()).flat_map(move |a| (a..bodies.len()).map(move |b| (a, b)));
    let pairs = all.map(move |(a, b)| (&bodies[a], &bodies[b]));
    pairs.filter(move |(a, b)| {
        scene.groups_meet(a.group_index, b.group_index)
            && (a.motion == "dynamic" || b.motion == "dynamic")
    })
}

fn pairs(scene: &Scene, bodies: &[Bodies]) -> Vec<[String; 2]> {
    let mut pairs: Vec<[u8; 2]> = meeting(scene, bodies)
        .map(|(a, b)| [a.group_index.min(b.group_index), a.group_index.max(b.group_index)])
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let name = |index: u8| scene.groups[usize::from(index)].clone();
    pairs.into_iter().map(|pair| pair.map(name)).collect()
}

fn shape_pairs(scene: &Scene, bodies: &[Bodies]) -> Vec<String> {
    let mut found = [false; 3];
    for (a, b) in meeting(scene, bodies) {
        found[0] |= a.circles() && b.circles();
        found[1] |= a.circles() && b.boxes() || a.boxes() && b.circles();
        found[2] |= a.boxes() && b.boxes();
    }
    let names = ["circle-circle", "circle-box", "box-box"];
    names.iter().zip(found).filter(|(_, found)| *found).map(|(name, _)| name.to_string()).collect()
}

/// Recipes that an emitter, a pack's burst or the spray tool uses.
fn recipes(scene: &Scene) -> Vec<String> {
    let mut used: Vec<u8> = scene.emitters.iter().map(|emitter| emitter.recipe).collect();
    used.extend(scene.pack.as_ref().map(|pack| pack.recipe));
    used.extend(scene.spray);
    used.sort_unstable();
    used.dedup();
    used.into_iter().map(|index| scene.recipes[usize::from(index)].name.clone()).collect()
}

fn emitters(scene: &Scene) -> Vec<Emitter> {
    let emitters = scene.emitters.iter();
    emitters
        .map(|emitter| Emitter {
            recipe: scene.recipes[usize::from(emitter.recipe)].name.clone(),
            count: emitter.count,
            start: emitter.start,
            every: emitter.every,
            follows_body: matches!(emitter.place, Place::Body(_)),
        })
        .collect()
}

impl fmt::Display for Plan {
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
                Per::Scene => "",
                Per::Player => " a player",
                Per::Tool => " at most, by Z",
            };
            let Bodies { kind, group, motion, shape, count, .. } = bodies;
            writeln!(f, "bodies       {count} {motion} {kind} ({shape}, group {group}){per}")?;
        }
        let pairs: Vec<_> = self.pairs.iter().map(|pair| pair.join("-")).collect();
        writeln!(f, "pairs        {}", listed(&pairs))?;
        writeln!(f, "shape pairs  {}", listed(&self.shape_pairs))?;
        let pushed: Vec<_> =
            self.groups.iter().filter(|g| g.particles).map(|g| g.name.clone()).collect();
        writeln!(f, "particles    {}; pushed out of {}", listed(&self.recipes), listed(&pushed))?;
        writeln!(f, "emitters     {}", self.emitters.len())?;
        writeln!(f, "tools        {}", listed(&self.tools))?;
        let Limits { players, bodies, particles } = self.limits;
        write!(f, "limits       {players} players, {bodies} bodies, {particles} particles")
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
            let plan = Plan::of(scene);
            assert!(!plan.bodies.is_empty(), "{name}");
            assert_eq!(plan.tools.is_empty(), tools == Tools::default(), "{name}");
            assert!(plan.to_string().starts_with(&name));
        }
    }
}
