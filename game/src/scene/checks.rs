//! Checks that involve more than one field of a scene. They run once the scene has been read without errors.

use super::bodies::{Layout, Placed};
use super::limits::{MASS_RATIO_MAX, QUANTA_MAX, ZONE_LOOKS_MAX};
use super::spec::Scene;
use super::table::{Field, Table};
use super::tools::Tools;
use jostle_sim::collide;
use jostle_sim::math::max;
use jostle_sim::{Aabb, BodyDef, Motion};

/// Checks a scene and reports the first contradiction.
pub(super) fn check(root: &Table, scene: &Scene) {
    let [bodies, layouts] = ["bodies", "layouts"].map(|name| root.get(name).items());
    let hero = root.get("hero");
    let spawns = if hero.is_given() { hero.inner("spawns").items() } else { Vec::new() };
    if !scene.has_drag() {
        let allowed = "nothing: no body has drag, by which it would feel the wind";
        root.get("wind").refuse_if_given(allowed);
    }
    check_quanta(root, scene);
    check_tools(&root.get("tools"), scene);
    check_positions(scene, &bodies, &spawns, &layouts);
    check_pack_speed(root, scene);
    check_masses(root, scene, &bodies, &layouts);
    check_starts(scene, &bodies, &layouts, &spawns);
    check_zones(root, scene);
    check_walk(root, scene);
    check_players(root, scene);
}

/// Checks that the scene admits enough players for a round to begin.
fn check_players(root: &Table, scene: &Scene) {
    let Some(round) = &scene.rules.round else { return };
    if round.players_min > scene.players_max {
        let field = root.get("round").inner("players_min");
        let allowed = format!("at most limits.players = {}", scene.players_max);
        field.refuse_as(round.players_min.to_string(), allowed);
    }
}

/// Checks that a walking hero has something to keep it on the ground.
fn check_walk(root: &Table, scene: &Scene) {
    let Some(hero) = scene.hero.as_ref().filter(|hero| hero.walk.is_some()) else { return };
    let fall = scene.world.gravity.y * hero.body.gravity_scale;
    if fall >= 0.0 {
        let allowed = "a walk only where gravity pulls the hero down";
        root.get("hero").inner("walk").refuse_as(format!("gravity of {fall} on y"), allowed);
    }
}

/// Limits the work done by zones, which check every body of their groups in every tick.
fn check_zones(root: &Table, scene: &Scene) {
    let zones = scene.rules.zones.len();
    let looks = zones * scene.world.bodies_max;
    if looks > ZONE_LOOKS_MAX {
        let found = format!("{zones} zones and up to {} bodies", scene.world.bodies_max);
        let allowed = format!("at most {ZONE_LOOKS_MAX} as the product of zones and limits.bodies");
        root.get("zones").refuse_as(found, allowed);
    }
}

/// Checks that positions fit into [`QUANTA_MAX`] quanta, the most that messages can express. Bodies stay inside
/// the kill zone.
fn check_quanta(root: &Table, scene: &Scene) {
    let Aabb { low, high } = scene.world.kill_zone;
    let furthest = max(max(low.x.abs(), low.y.abs()), max(high.x.abs(), high.y.abs()));
    let quantum = scene.world.quantum;
    let reach = QUANTA_MAX as f32 * quantum;
    if furthest > reach {
        let zone = root.get("kill_zone");
        let field = if zone.is_given() { zone } else { root.get("size") };
        let allowed = format!(
            "at most {reach}: {QUANTA_MAX} quanta of {quantum}, which is what messages carry; a \
             larger quantum reaches further"
        );
        field.refuse_as(format!("a kill zone that reaches to {furthest}"), allowed);
    }
}

/// Refuses tools that share a key, and tools that have nothing to act on.
fn check_tools(field: &Field, scene: &Scene) {
    let has = |tool| scene.tools.contains(tool);
    if has(Tools::MARBLE) && has(Tools::SPRAY) {
        field.refuse_as("dumb and spray, which are both on Z", "one of them");
    }
    if has(Tools::LAUNCH) && has(Tools::SELECT) {
        field.refuse_as("launch and select, which both use the left button", "one of them");
    }
    if has(Tools::STEER) && scene.hero.is_none() {
        let allowed = "steer only where players have heroes";
        field.refuse_as("steer, but no [hero] table", allowed);
    }
}

/// Checks that everything starts inside the kill zone, that nothing exceeds the largest speed, and that names are
/// unique.
fn check_positions(scene: &Scene, bodies: &[Field], spawns: &[Field], layouts: &[Field]) {
    let zone = scene.world.kill_zone;
    let inside = "a place inside the kill zone";
    for (field, body) in bodies.iter().zip(&scene.bodies) {
        let (name, is_inside, fastest) = match &body.path {
            Some(path) => {
                let is_inside = path.points().iter().all(|&point| zone.contains(point));
                ("path", is_inside, path.speed_max())
            }
            None => ("position", zone.contains(body.def.position), 0.0),
        };
        if !is_inside {
            field.inner(name).refuse(inside);
        }
        if body.def.velocity.length() > scene.world.speed_max {
            let allowed = format!("a speed of at most speed_max = {}", scene.world.speed_max);
            field.inner("velocity").refuse(allowed);
        }
        if fastest > scene.world.speed_max {
            let found = format!("a speed of {fastest} on the fastest leg");
            let allowed =
                format!("a period that needs at most speed_max = {}", scene.world.speed_max);
            field.inner("period").refuse_as(found, allowed);
        }
        let alike = |other: &&Placed| other.name.is_some() && other.name == body.name;
        if scene.bodies.iter().filter(alike).count() > 1 {
            field.inner("name").refuse("each name once");
        }
    }
    let hero_spawns = scene.hero.iter().flat_map(|hero| &hero.spawns);
    for (field, _) in spawns.iter().zip(hero_spawns).filter(|(_, spawn)| !zone.contains(**spawn)) {
        field.refuse(inside);
    }
    for (field, layout) in layouts.iter().zip(&scene.layouts) {
        if !zone.contains(layout.area.low) || !zone.contains(layout.area.high) {
            field.inner("area").refuse(inside);
        }
    }
}

/// Checks that packs do not exceed the largest speed.
fn check_pack_speed(root: &Table, scene: &Scene) {
    let speed = scene.pack.as_ref().map_or(0.0, |pack| pack.speed);
    if speed <= scene.world.speed_max {
        return;
    }
    let (pack, speed_max) = (root.get("pack"), scene.world.speed_max);
    if pack.is_given() {
        let allowed = format!("at most speed_max = {speed_max}");
        pack.inner("speed").refuse_as(format!("a speed of {speed}"), allowed);
    } else {
        root.get("speed_max").refuse_as(speed_max.to_string(), format!("at least {speed}"));
    }
}

/// Checks that mass ratios do not exceed [`MASS_RATIO_MAX`], the limit of the conjugate solver.
fn check_masses(root: &Table, scene: &Scene, bodies: &[Field], layouts: &[Field]) {
    if !scene.world.is_conjugate() {
        return;
    }
    let kinds = ["hero", "dumb", "pack"].map(|name| root.get(name));
    let mut all = Vec::new();
    all.extend(bodies.iter().zip(&scene.bodies).map(|(field, body)| (field, &body.def)));
    all.extend(layouts.iter().zip(&scene.layouts).map(|(field, body)| (field, &body.def)));
    all.extend(scene.hero.as_ref().map(|hero| (&kinds[0], &hero.body)));
    all.extend(scene.marble.as_ref().map(|marble| (&kinds[1], &marble.body)));
    all.extend(scene.pack.as_ref().map(|pack| (&kinds[2], &pack.body)));
    all.retain(|(_, def)| def.motion == Motion::Dynamic);
    let mass_of = |(_, def): &(&Field, &BodyDef)| def.mass;
    let Some(&(lightest_field, lightest)) =
        all.iter().min_by(|a, b| mass_of(a).total_cmp(&mass_of(b)))
    else {
        return;
    };
    for (field, def) in all {
        if def.mass / lightest.mass > MASS_RATIO_MAX {
            let given = if field.is_given() { field.inner("mass") } else { root.get("solver") };
            let (heavy, light) = (def.mass, lightest.mass);
            let found =
                format!("a mass of {heavy} beside one of {light} in {}", lightest_field.path());
            let allowed = format!("at most {MASS_RATIO_MAX} times the least mass");
            return given.refuse_as(found, allowed);
        }
    }
}

/// Checks that dynamic bodies and heroes start clear of the immovable bodies with which they collide.
fn check_starts(scene: &Scene, bodies: &[Field], layouts: &[Field], spawns: &[Field]) {
    if scene.world.solver.is_none() {
        return;
    }
    let clear = "a place clear of it";
    for (field, body) in bodies.iter().zip(&scene.bodies) {
        if body.def.motion == Motion::Dynamic
            && let Some(other) = blocking(scene, &body.def)
        {
            field.inner("position").refuse_as(format!("a start inside bodies[{other}]"), clear);
        }
    }
    let is_exact = |layout: &Layout| layout.exact && layout.def.motion == Motion::Dynamic;
    for (field, layout) in layouts.iter().zip(&scene.layouts).filter(|(_, of)| is_exact(of)) {
        let mut starts = (0..layout.count).flat_map(|number| {
            let position = layout.cell_center(number);
            layout.shapes.iter().map(move |&shape| BodyDef { shape, position, ..layout.def })
        });
        if let Some(other) = starts.find_map(|def| blocking(scene, &def)) {
            field.inner("area").refuse_as(format!("a start inside bodies[{other}]"), clear);
        }
    }
    let Some(hero) = &scene.hero else { return };
    for (field, &position) in spawns.iter().zip(&hero.spawns) {
        if let Some(other) = blocking(scene, &BodyDef { position, ..hero.body }) {
            field.refuse_as(format!("a hero inside bodies[{other}]"), clear);
        }
    }
}

/// Returns the first immovable body that overlaps and collides with `def`.
fn blocking(scene: &Scene, def: &BodyDef) -> Option<usize> {
    scene.bodies.iter().position(|other| {
        other.def.motion != Motion::Dynamic
            && scene.groups_meet(def.group, other.def.group)
            && collide(def.shape, def.position, other.def.shape, other.def.position, (0, 1))
                .is_some()
    })
}
