use super::{STEPS, Setting};
use crate::engine::{Engine, State};
use crate::methods::{METHODS, SOLVERS};

/// Numbers of scenes with seed 1, and the visits and predictions that a step of each may take, a quarter above what was
/// seen: the ten whose slowest step was longest beside Box2D's mean, of a thousand, and three that took up to 125 ms a
/// step before very unequal masses had a limit.
const SLOWEST: [(u64, u64); 13] = [
    (912, 55_000),
    (238, 80_000),
    (370, 141_000),
    (957, 393_000),
    (398, 168_000),
    (444, 166_000),
    (345, 80_000),
    (213, 80_000),
    (60, 151_000),
    (732, 16_000),
    (1, 285_000),
    (26, 137_000),
    (616, 139_000),
];

#[test]
fn the_slowest_scenes_take_bounded_work_and_keep_their_bodies() {
    let method = METHODS.iter().find(|method| method.name == SOLVERS[1]).expect("in the table");
    for (number, most) in SLOWEST {
        let setting = Setting::new(1, number);
        let mut engine = (method.build)(&setting.scene, 1.0).expect("a scene can be played");
        let mut driver = setting.driver();
        let mut before = 0;
        let mut seen = 0;
        for step in 0..STEPS {
            driver.act(engine.as_mut());
            engine.tick();
            let solves = engine.pair_solves().expect("it counts them");
            seen = seen.max(solves - before);
            before = solves;
            let states = states(engine.as_ref(), setting.scene.bodies.len());
            assert_eq!(setting.outside(&states), 0, "scene {number}, step {step}");
        }
        assert!(seen <= most, "scene {number}: {seen} visits in a step");
    }
}

#[test]
fn a_scene_is_a_function_of_its_seed_and_number() {
    let scene = |seed, number| format!("{:?}", Setting::new(seed, number).scene);
    assert_eq!(scene(1, 7), scene(1, 7));
    assert_ne!(scene(1, 7), scene(1, 8));
    assert_ne!(scene(1, 7), scene(2, 7));
}

fn states(engine: &dyn Engine, count: usize) -> Vec<State> {
    (0..count).map(|body| engine.state(body)).collect()
}
