//! Piles that were designed to be hard: long rows of impacts, mass ratios up to 1 : 10^6 between moving arms, and fast
//! bodies among dense ones.

use super::scenes::{GRAVITY, SEEDS, SEEDS_APART, add_flights, moving, rains};
use super::scripts::Script;
use super::{Bound, Figure, Pile};
use crate::scene::{Body, Hook, Mulberry, Scene, Shape, Spring};
use glam::DVec2;

/// All hard piles, each with three seeds.
pub fn hard() -> Vec<Pile> {
    let seeded = |of: fn(u32) -> Scene| (0..SEEDS).map(of).collect::<Vec<Scene>>();
    let mut row = moving("cradle-500", CRADLE, seeded(cradle), Script::Still);
    row.bounds.extend([(Figure::EnergyError, Bound::Value(0.01)), (Figure::Momentum, Bound::None)]);
    vec![
        row,
        moving("sweepers-1000", SWEEPERS, seeded(funnel), Script::Sweepers),
        moving("gas-1000", GAS, seeded(gas), Script::Still),
        moving("struck-1000", STRUCK, seeded(struck), Script::Still),
        moving(
            "springs-1000",
            SPRINGS,
            rains(1000, SEEDS).into_iter().map(tied).collect(),
            Script::Lift,
        ),
        moving("volley-1000", VOLLEY, seeded(dense), Script::Volley),
    ]
}

const CRADLE: &str = "Row of 500 elastic balls between walls, hit at its end";
const SWEEPERS: &str = "1000 discs of masses to 1 : 10⁶ in a funnel with two arms that sweep";
const GAS: &str = "Gas of 500 that bounces falls into a heap of 500";
const STRUCK: &str = "Tower of 1000 boxes that a heavy ball hits";
const SPRINGS: &str = "Rain of 1000 over a lift, every fourth body on a spring to the next";
const VOLLEY: &str = "300 small fast bodies among 700 that are dense and heavy";

/// Balls of radius 1 with gaps of up to 0.2, hit by the first ball at a speed of 100 units/s.
fn cradle(seed: u32) -> Scene {
    const COUNT: usize = 500;
    let mut scene = Scene::new(0.0);
    let width = 2.2 * COUNT as f64 + 40.0;
    scene.contain(width, 20.0, 0.0, 1.0);
    let mut draws = Mulberry(0x0C0A_D1E5 + SEEDS_APART * seed);
    let mut x = 10.0;
    for ball in 0..COUNT {
        let speed = if ball == 0 { 100.0 } else { 0.0 };
        let ball = Body::new(Shape::Circle { radius: 1.0 }, x, 10.0).of_stuff(0.0, 1.0);
        scene.add(ball.moving(speed, 0.0));
        x += 2.0 + draws.range(0.0, 0.2);
    }
    scene
}

/// Discs of different masses above two flights of steps, as in the hourglass.
fn funnel(seed: u32) -> Scene {
    const COUNT: usize = 1000;
    const WIDTH: f64 = 160.0;
    let mut scene = Scene::new(GRAVITY);
    scene.contain(WIDTH, 140.0 + 4.0 * COUNT.div_ceil(40) as f64, 0.3, 0.0);
    add_flights(&mut scene, WIDTH);
    let mut draws = Mulberry(0x05EE_9E25 + SEEDS_APART * seed);
    for index in 0..COUNT {
        let shape = Shape::Circle { radius: 0.7 + 0.8 * draws.unit() };
        let (column, row) = ((index % 40) as f64, (index / 40) as f64);
        let x = 4.0 * (column + 0.5) + draws.range(-0.3, 0.3);
        let body = Body::new(shape, x, 142.0 + 4.0 * (row + 0.5));
        scene.add(body.of_mass(10f64.powf(6.0 * draws.unit())));
    }
    scene
}

/// Rain in which everything bounces and the upper half flies about.
fn gas(seed: u32) -> Scene {
    let mut scene = rains(1000, seed + 1).swap_remove(seed as usize);
    let mut draws = Mulberry(0x006A_5000 + SEEDS_APART * seed);
    let movable: Vec<usize> = scene.dynamic().collect();
    for body in &mut scene.bodies {
        body.restitution = 0.9;
    }
    for &body in &movable[movable.len() / 2..] {
        let velocity = DVec2::new(draws.range(-150.0, 150.0), draws.range(-150.0, 0.0));
        scene.bodies[body].velocity = velocity;
    }
    scene
}

/// Rows of ten boxes, with every other row shifted by half a box.
fn struck(seed: u32) -> Scene {
    const ROWS: usize = 100;
    let mut scene = Scene::new(GRAVITY);
    scene.contain(500.0, 260.0, 0.3, 0.0);
    for row in 0..ROWS {
        let shift = if row % 2 == 0 { 0.0 } else { 1.0 };
        for column in 0..10 {
            let x = 240.0 + shift + 2.0 * f64::from(column);
            scene.add(Body::new(Shape::rect(1.0, 1.0), x, 1.0 + 2.0 * row as f64));
        }
    }
    let shape = Shape::Circle { radius: 8.0 };
    let ball = Body::new(shape, 100.0, 60.0 + 35.0 * f64::from(seed));
    scene.add(ball.of_mass(20.0 * shape.area()).moving(200.0, 40.0));
    scene
}

/// Ties every fourth body to the next one with a spring of 3 Hz.
fn tied(mut scene: Scene) -> Scene {
    const DAMPING: f64 = 0.2;
    let movable: Vec<usize> = scene.dynamic().collect();
    for pair in movable.chunks_exact(4) {
        let (body, other) = (pair[0], pair[1]);
        let length = scene.bodies[body].position.distance(scene.bodies[other].position);
        let mut spring =
            Spring { body, to: Hook::Body(other), length, stiffness: 0.0, damping: 0.0 };
        let (mass, turn) = (scene.swinging_mass(&spring), std::f64::consts::TAU * 3.0);
        (spring.stiffness, spring.damping) = (mass * turn * turn, 2.0 * DAMPING * mass * turn);
        scene.springs.push(spring);
    }
    scene
}

/// Three out of ten bodies are discs of radius 0.4; the others are a hundred times as dense.
fn dense(seed: u32) -> Scene {
    const COUNT: u32 = 1000;
    const CELL: f64 = 6.0;
    let mut scene = Scene::new(0.0);
    scene.contain(40.0 * CELL, 25.0 * CELL, 0.3, 0.0);
    let mut draws = Mulberry(0x0B01_1E70 + SEEDS_APART * seed);
    for index in 0..COUNT {
        let (x, y) = (f64::from(index % 40) + 0.5, f64::from(index / 40) + 0.5);
        let (x, y) = (CELL * x, CELL * y);
        if index % 10 < 3 {
            scene.add(Body::new(Shape::Circle { radius: 0.4 }, x, y));
            continue;
        }
        let (a, b) = (1.6 + 1.3 * draws.unit(), 1.6 + 1.3 * draws.unit());
        let shape =
            if draws.unit() < 0.5 { Shape::Circle { radius: a } } else { Shape::rect(a, b) };
        scene.add(Body::new(shape, x, y).of_mass(100.0 * shape.area()));
    }
    scene
}
