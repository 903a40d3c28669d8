//! `jostle scene plan` shows a scene's [`Plan`] as text and as JSON: the parts it includes, the parts it leaves out,
//! and the fields that decide this.

use jostle_game::scene::{Bodies, Per, Plan, WorstTick};
use jostle_game::{Scene, Tools};
use jostle_sim::{Motion, Solver};
use serde_json::{Value, json};

/// The plan as a JSON object, along with the slowest tick of a trial. Lengths are in world units. If there is no
/// solver, the value is `null`.
pub fn as_json(scene: &Scene, tried: &WorstTick) -> Value {
    let plan = Plan::of(scene);
    let [worst, by_limits] = [tried, &WorstTick::of(scene)]
        .map(|tick| json!({ "ms": decimal(tick.ms), "rooms_per_core": tick.rooms_per_core() }));
    let bodies = plan.bodies.iter().map(|bodies| {
        json!({
            "kind": bodies.kind.name(),
            "group": group(scene, bodies.def.group),
            "motion": motion(bodies),
            "shape": shape(bodies),
            "count": bodies.count,
            "per": match bodies.per {
                Per::Scene => "scene",
                Per::Player => "player",
                Per::Tool => "tool",
            },
            "field": bodies.field,
        })
    });
    let parts = plan.parts.iter().map(|part| {
        json!({ "name": part.name, "used": part.used, "why": part.why, "costs": part.costs })
    });
    json!({
        "scene": scene.name,
        "title": scene.title,
        "size": scene.size.to_array().map(decimal),
        "gravity": scene.world.gravity.to_array().map(decimal),
        "solver": scene.world.solver.map(solver_json),
        "groups": groups(scene, &plan),
        "pairs": pairs(scene, &plan),
        "bodies": bodies.collect::<Vec<_>>(),
        "parts": parts.collect::<Vec<_>>(),
        "tools": tools(scene),
        "limits": {
            "players": scene.players_max,
            "bodies": scene.world.bodies_max,
            "particles": scene.world.particles_max,
        },
        "worst_tick": worst,
        "worst_tick_by_limits": by_limits,
    })
}

/// The plan as text for people to read.
pub fn as_text(scene: &Scene, tried: &WorstTick) -> String {
    let plan = Plan::of(scene);
    let ([width, height], [x, y]) = (scene.size.to_array(), scene.world.gravity.to_array());
    let mut lines = vec![
        format!("{}: {}", scene.name, scene.title),
        format!("world        {width} x {height}, gravity ({x}, {y})"),
        format!("solver       {}", solver_text(scene.world.solver)),
    ];
    lines.extend(plan.bodies.iter().map(|bodies| {
        let per = match bodies.per {
            Per::Scene => "",
            Per::Player => " a player",
            Per::Tool => " at most, by Z",
        };
        let (motion, shape, count) = (motion(bodies), shape(bodies), bodies.count);
        let (kind, group) = (bodies.kind.name(), group(scene, bodies.def.group));
        format!("bodies       {count} {motion} {kind} ({shape}, group {group}){per}")
    }));
    let pairs: Vec<_> = pairs(scene, &plan).iter().map(|pair| pair.join("-")).collect();
    let (players, bodies, particles) =
        (scene.players_max, scene.world.bodies_max, scene.world.particles_max);
    lines.push(format!("pairs        {}", listed(&pairs)));
    lines.push(format!("tools        {}", listed(&tools(scene))));
    lines.push(format!("limits       {players} players, {bodies} bodies, {particles} particles"));
    lines.push(format!("worst tick   {}", tried.sentence()));
    lines.push(format!("by limits    {}", WorstTick::of(scene).sentence()));
    lines.push(String::new());
    for (heading, used) in [("in", true), ("left out", false)] {
        let parts = plan.parts.iter().filter(|part| part.used == used);
        lines.extend(parts.map(|part| format!("{heading:<9} {:<21} {}", part.name, part.why)));
    }
    lines.join("\n")
}

fn group(scene: &Scene, index: u8) -> &str {
    &scene.groups[usize::from(index)]
}

/// Names of the groups that contain bodies.
fn groups<'a>(scene: &'a Scene, plan: &Plan) -> Vec<&'a str> {
    let mut groups: Vec<u8> = plan.bodies.iter().map(|bodies| bodies.def.group).collect();
    groups.sort_unstable();
    groups.dedup();
    groups.into_iter().map(|index| group(scene, index)).collect()
}

/// Names of the pairs of groups that collide and both contain bodies.
fn pairs<'a>(scene: &'a Scene, plan: &Plan) -> Vec<[&'a str; 2]> {
    plan.pairs.iter().map(|pair| pair.map(|index| group(scene, index))).collect()
}

fn motion(bodies: &Bodies) -> &'static str {
    match bodies.def.motion {
        Motion::Static => "static",
        Motion::Kinematic => "kinematic",
        Motion::Dynamic => "dynamic",
    }
}

/// The bodies' shape, or both shapes if the seed decides.
fn shape(bodies: &Bodies) -> &'static str {
    match (bodies.circles(), bodies.boxes()) {
        (true, true) => "circle or box",
        (true, false) => "circle",
        _ => "box",
    }
}

fn tools(scene: &Scene) -> Vec<&'static str> {
    let tools = Tools::NAMES.iter().filter(|(_, tool)| scene.tools.contains(*tool));
    tools.map(|(name, _)| *name).collect()
}

fn solver_json(solver: Solver) -> Value {
    match solver {
        Solver::Relaxation(settings) => json!({
            "method": "relaxation",
            "iterations": settings.iterations,
            "correction": decimal(settings.correction),
            "slop": decimal(settings.slop),
            "bounce_threshold": decimal(settings.bounce_threshold),
            "warm_start": settings.warm_start,
        }),
        Solver::Conjugate(settings) => json!({
            "method": "conjugate",
            "tolerance": decimal(settings.tolerance),
            "sweeps_max": settings.sweeps_max,
            "work_max": settings.work_max,
            "bounce_threshold": decimal(settings.bounce_threshold),
            "slop": decimal(settings.slop),
            "correction": decimal(settings.correction),
            "correction_max": decimal(settings.correction_max),
            "position_passes": settings.position_passes,
        }),
    }
}

fn solver_text(solver: Option<Solver>) -> String {
    match solver {
        Some(Solver::Relaxation(settings)) => format!(
            "{} iterations, correction {}, slop {}, bounce from {}, {} start",
            settings.iterations,
            settings.correction,
            settings.slop,
            settings.bounce_threshold,
            if settings.warm_start { "warm" } else { "cold" }
        ),
        Some(Solver::Conjugate(settings)) => format!(
            "conjugate to {}, at most {} sweeps, slop {}, bounce from {}",
            settings.tolerance, settings.sweeps_max, settings.slop, settings.bounce_threshold
        ),
        None => "none: contacts are only found".to_owned(),
    }
}

/// A number with the digits of the `f32` rather than those of its conversion to an `f64` for a JSON value.
fn decimal(value: f32) -> Option<f64> {
    value.to_string().parse().ok()
}

fn listed(words: &[impl AsRef<str>]) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_scene_has_a_plan() {
        for scene in Scene::built_in() {
            let limits = WorstTick::of(&scene);
            let tried = WorstTick { ms: 0.5 * limits.ms, ..limits.clone() };
            let (name, plan) = (&scene.name, as_json(&scene, &tried));
            let list = |field: &str| plan[field].as_array().expect("a list").clone();
            assert!(!list("bodies").is_empty(), "{name}");
            assert_eq!(list("tools").is_empty(), scene.tools == Tools::default(), "{name}");
            let text = as_text(&scene, &tried);
            assert!(text.starts_with(name));
            assert!(text.contains(&format!("\nworst tick   {}\n", tried.sentence())), "{name}");
            assert!(text.contains(&format!("\nby limits    {}\n", limits.sentence())), "{name}");
            for (field, tick) in [("worst_tick", &tried), ("worst_tick_by_limits", &limits)] {
                assert_eq!(plan[field]["rooms_per_core"], tick.rooms_per_core(), "{name}");
            }
            for part in Plan::of(&scene).parts {
                let said = if part.used { "in" } else { "left out" };
                let line = format!("\n{said:<9} {:<21} {}", part.name, part.why);
                assert!(text.contains(&line), "{name}: {line}");
            }
        }
    }

    #[test]
    fn numbers_keep_the_digits_of_the_file() {
        for value in [0.1, 180.0, 1e-7, 5e30, -2.5e-3] {
            let typed = serde_json::to_string(&value).expect("a number");
            assert_eq!(json!(decimal(value)).to_string(), typed);
        }
    }
}
