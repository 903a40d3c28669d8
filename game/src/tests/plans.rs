//! Tests that a World plays the same without the parts that a plan leaves out, and that no scene ever uses such
//! parts.

use super::players::busy_tick;
use super::*;
use crate::scene::Plan;
use jostle_sim::state::bytes::{StateReader, StateWriter};
use jostle_sim::{BodyDef, Conjugate, EmitterDef, Features, Rng, Solver, World, WorldSettings};

const TICKS: u32 = 90;
/// Ticks played in a scene with thousands of bodies, which meet in the first tick.
const TICKS_LARGE: u32 = 30;

/// The shipped scenes and the scenes of the golden replays.
fn scenes() -> Vec<Scene> {
    let more = [
        ("explosions.toml", include_str!("../../../tests/scenes/explosions.toml")),
        ("gas.toml", include_str!("../../../tests/scenes/gas.toml")),
        ("heap.toml", include_str!("../../../tests/scenes/heap.toml")),
        ("pyramid.toml", include_str!("../../../tests/scenes/pyramid.toml")),
        ("springs.toml", include_str!("../../../tests/scenes/springs.toml")),
    ];
    let parsed = more.map(|(file, text)| Scene::parse(file, text).expect("a good scene"));
    let mut scenes = Scene::built_in();
    scenes.extend(parsed);
    scenes
}

/// Variants of a scene without friction, without bounces, with only circles or with only boxes.
fn barer(scene: &Scene) -> Vec<Scene> {
    let changed = |change: &dyn Fn(&mut BodyDef)| {
        let mut scene = scene.clone();
        scene.bodies.iter_mut().for_each(|body| change(&mut body.def));
        for layout in &mut scene.layouts {
            let shapes = layout.shapes.iter().map(|&shape| {
                let mut def = BodyDef { shape, ..layout.def };
                change(&mut def);
                def.shape
            });
            layout.shapes = shapes.collect();
            change(&mut layout.def);
        }
        scene.hero.iter_mut().for_each(|hero| change(&mut hero.body));
        scene.pack.iter_mut().for_each(|pack| change(&mut pack.body));
        scene.marble.iter_mut().for_each(|marble| change(&mut marble.body));
        scene
    };
    let round = |def: &mut BodyDef| def.shape = Shape::circle(def.shape.half_extent().y);
    let square = |def: &mut BodyDef| {
        let half = def.shape.half_extent();
        def.shape = Shape::rect(2.0 * half.x, 2.0 * half.y);
    };
    let smooth = changed(&|def| def.friction = 0.0);
    let dull = changed(&|def| def.restitution = 0.0);
    let bare = changed(&|def| {
        square(def);
        (def.friction, def.restitution) = (0.0, 0.0);
    });
    vec![changed(&round), changed(&square), smooth, dull, bare]
}

/// Makes a world's steps handle all features.
fn widen(world: &mut World) {
    let mut saved = StateWriter::default();
    world.save(&mut saved);
    let settings = WorldSettings { features: Features::ALL, ..world.settings().clone() };
    *world = World::restore(settings, &mut StateReader::new(&saved.0)).expect("its own state");
}

/// Plays a busy game, and returns its hashes and the features of its world at the end.
fn played(scene: &Scene, widened: bool) -> (Vec<u64>, Features) {
    let mut game = Game::new(Arc::new(scene.clone()), 3);
    if widened {
        widen(&mut game.world);
    }
    (0..4).for_each(|seat| game.join(Seat(seat)));
    let mut rng = Rng::new(5, 1);
    let mut hashes = Vec::new();
    let ticks = if game.world().body_count() > 1000 { TICKS_LARGE } else { TICKS };
    for _ in 0..ticks {
        busy_tick(&mut game, &mut rng);
        hashes.push(game.hash());
    }
    (hashes, game.world.settings().features)
}

/// Plays all scenes with specialised and with general steps, and compares the results.
fn compare(scenes: &[Scene]) {
    let mut left_out = 0;
    for scene in scenes.iter().flat_map(|scene| [vec![scene.clone()], barer(scene)].concat()) {
        let plan = Plan::of(&scene);
        let particles = plan.parts.iter().find(|part| part.name == "particles");
        assert!(particles.is_some_and(|part| part.used == plan.features.particles));
        let (special, dealt_with) = played(&scene, false);
        let (general, _) = played(&scene, true);
        let at = special.iter().zip(&general).position(|(one, other)| one != other);
        assert_eq!(at, None, "{} with {:?}: first tick", scene.name, plan.features);
        assert_eq!(dealt_with, plan.features, "{}: a tool brought more", scene.name);
        left_out += u32::from(plan.features != Features::ALL);
    }
    assert!(left_out > 40, "only {left_out} games had something left out");
}

#[test]
fn specialised_steps_give_the_same_bits_as_general_ones() {
    compare(&scenes());
}

#[test]
fn specialised_steps_of_the_conjugate_solver_do_too() {
    let solver = Some(Solver::Conjugate(Conjugate::default()));
    let mut scenes = scenes();
    for scene in &mut scenes {
        (scene.world.solver, scene.world.sleeping) = (solver, true);
    }
    compare(&scenes);
}

#[test]
fn a_body_beyond_the_plan_widens_the_world() {
    let scene =
        Scene::built_in().into_iter().find(|scene| scene.name == "bridge").expect("a scene");
    let bare = barer(&scene).remove(4);
    let mut games = [true, false].map(|widened| {
        let mut game = Game::new(Arc::new(bare.clone()), 3);
        if widened {
            widen(&mut game.world);
        }
        game
    });
    for game in &mut games {
        assert!(
            game.world.settings().features == Features::ALL
                || !game.world.settings().features.circles
        );
        let center = bare.size * 0.5;
        for place in 0..20u8 {
            let def = BodyDef {
                shape: Shape::circle(4.0),
                position: center + Vec2::new(f32::from(place), f32::from(place % 5) * 9.0),
                restitution: 0.9,
                friction: 0.7,
                ..BodyDef::default()
            };
            let added = game.roster.add(&mut game.world, &def, Kind::Marble, None, Rule::Still);
            assert!(added.is_some(), "there is room");
        }
        let (seed, source) = (game.rngs.emit.next_u32(), Source::Point(center));
        game.world.start_emitter(EmitterDef { recipe: 0, count: 50, seed, source });
        (0..200).for_each(|_| game.tick(&[]));
    }
    assert!(
        games[1].world.settings().features == Features::ALL,
        "{:?}",
        games[1].world.settings().features
    );
    assert!(!games[1].world.particles().is_empty(), "particles came");
    assert_eq!(games[0].hash(), games[1].hash());
    let restored = Game::restore(Arc::new(bare), &games[1].save()).expect("its own state");
    assert_eq!(restored.world.settings().features, Features::ALL, "what the bytes bring");
}

#[test]
fn plans_list_the_parts_that_shipped_scenes_lack() {
    let plan = |name: &str| {
        let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
        Plan::of(&scene.expect("a shipped scene"))
    };
    let lacks = [
        "box-box",
        "kinematic bodies",
        "continuous collision",
        "forces",
        "as listed",
        "sleeping",
        "particles",
        "particles pushed out",
        "emitters",
        "marks",
        "launchers",
        "rounds",
        "zones",
        "signals",
        "rules",
        "breakage",
        "sling",
        "pack events",
    ];
    let uses = |plan: &Plan, name: &str| {
        plan.parts.iter().find(|part| part.name == name).expect("a part").used
    };
    let pile = plan("pile");
    let found = pile.parts.iter().filter(|part| !part.used).map(|part| part.name);
    assert!(found.eq(lacks), "{:#?}", pile.parts);
    assert!(uses(&plan("arena"), "particles") && uses(&plan("arena"), "kinematic bodies"));
    assert!(!plan("impulse").features.particles, "its packs burst into nothing");
    assert!(plan("particles").features.particles, "Z sprays");
    assert!(!uses(&plan("bounds"), "impact events"), "contacts are only found");
    assert!(pile.parts.iter().all(|part| !part.why.is_empty() && !part.costs.is_empty()));
}
