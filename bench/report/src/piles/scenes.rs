//! The piles: rain of thousands of bodies, stacks, pyramids, and loads falling on them. Gravity is 50, boxes are 2
//! high, and friction is 0.3.

use super::hard::hard;
use super::scripts::Script;
use super::{Bound, Figure, Pile};
use crate::scene::{Body, Mulberry, Scene, Shape};
use glam::DVec2;

pub(super) const GRAVITY: f64 = 50.0;
/// The gap under each box of the dropped stack, and the number of boxes.
const GAP: f64 = 0.05;
const TALL: usize = 1000;

/// Restitution of all bodies in the piles that bounce.
const RESTITUTION: f64 = 0.7;

const SLOP: f64 = crate::stability::SLOP;
/// An overlap of exactly the slop, as it appears in single precision high above the origin.
const SLOP_SEEN: f64 = 1.1 * SLOP;

/// Number of seeds for a pile with random positions, and the difference between successive seeds.
pub(super) const SEEDS: u32 = 3;
pub(super) const SEEDS_APART: u32 = 7919;

/// Figures measured for every pile: times relative to Box2D's.
const TIMES: [(Figure, Bound); 3] = [
    (Figure::Falling, Bound::OfPeer(2.0)),
    (Figure::Slowest, Bound::OfPeer(2.0)),
    (Figure::Settled, Bound::OfPeer(1.0)),
];

pub fn all() -> Vec<Pile> {
    let mut piles: Vec<Pile> = [1000, 4000].map(small_rain).into();
    piles.extend([1000, 4000].map(sleeping_rain));
    piles.extend([10_000, 20_000].map(large_rain));
    piles.extend([20, 100, TALL].map(stack));
    piles.extend([dropped(), pyramid(), capped(), thrown(), ball(), poured()]);
    piles.extend(disturbed());
    piles.extend(hard());
    piles
}

fn pile(id: &str, title: &str, scene: Scene, ticks: usize, bounds: &[(Figure, Bound)]) -> Pile {
    seeded(id, title, vec![scene], ticks, bounds)
}

fn seeded(
    id: &str,
    title: &str,
    scenes: Vec<Scene>,
    ticks: usize,
    bounds: &[(Figure, Bound)],
) -> Pile {
    let bounds = TIMES.iter().chain(bounds).copied().collect();
    let (id, title, script) = (id.into(), title.into(), Script::Still);
    Pile { id, title, scenes, script, ticks, full_only: false, bounds }
}

fn small_rain(count: u32) -> Pile {
    let bounds = [
        (Figure::DeepestEver, Bound::Value(0.02)),
        (Figure::DeepestAtEnd, Bound::Value(0.01)),
        (Figure::RmsAtEnd, Bound::Value(0.01)),
    ];
    let title = format!("Rain of {count}, half circles and half boxes, for 10 s");
    // With other seeds, some of the 4000 bodies form columns that are still toppling after 10 s.
    let seeds = if count > 1000 { 1 } else { SEEDS };
    seeded(&format!("rain-{count}"), &title, rains(count, seeds), 600, &bounds)
}

pub(super) fn rains(count: u32, seeds: u32) -> Vec<Scene> {
    (0..seeds).map(|seed| rain(count, seed)).collect()
}

/// Rain whose bodies may sleep; the number still awake at the end is shown.
fn sleeping_rain(count: u32) -> Pile {
    let title = format!("Rain of {count} that may sleep, for 20 s");
    let bounds = [(Figure::Awake, Bound::None), (Figure::RmsAtEnd, Bound::None)];
    let scene = Scene { sleeping: true, ..rain(count, 0) };
    pile(&format!("rain-{count}-sleep"), &title, scene, 1200, &bounds)
}

fn large_rain(count: u32) -> Pile {
    let bounds = [
        (Figure::DeepestEver, Bound::None),
        (Figure::DeepestAtEnd, Bound::None),
        (Figure::RmsAtEnd, Bound::Value(0.05)),
        (Figure::CalmAfter, Bound::Value(29.9)),
    ];
    let title = format!("Rain of {count} for 30 s");
    let seeds = if count > 10_000 { 2 } else { 5 };
    let large = seeded(&format!("rain-{count}"), &title, rains(count, seeds), 1800, &bounds);
    Pile { full_only: true, ..large }
}

/// Rain with disturbances; mean times cover all steps.
fn disturbed() -> Vec<Pile> {
    use Script::{Blasts, Crowd, Lift, Mixer, Plough, Pull, Shaken, Slings, Turning};
    let of = |id: &str, title: &str, count: u32, script: Script| {
        let title = format!("Rain of {count} {title}");
        moving(&format!("{id}-{count}"), &title, rains(count, SEEDS), script)
    };
    let (shaken, blasts) = ("shaken twice a second", "under three blasts a second");
    let pulled = "without gravity, pulled to a point that jumps";
    vec![
        of("shaken", shaken, 1000, Shaken),
        of("shaken", shaken, 4000, Shaken),
        of("turning", "whose gravity turns every 2 s", 1000, Turning),
        of("blasts", blasts, 1000, Blasts),
        of("blasts", blasts, 4000, Blasts),
        of("crowd", "in which 63 heroes fly about", 1000, Crowd),
        of("slings", "out of which bodies are slung into the walls", 1000, Slings),
        of("lift", "over a lift", 1000, Lift),
        of("mixer", "in a mixer", 1000, Mixer),
        allow(
            allow(of("plough", "that a plough stirs", 1000, Plough), Figure::MeanDeepest, 1.0),
            Figure::DeepestEver,
            1.0,
        ),
        bouncy(of("bouncy", "that bounces, shaken twice a second", 1000, Shaken)),
        allow(
            bouncy(of("bouncy", "that bounces, shaken twice a second", 4000, Shaken)),
            Figure::Mean,
            1.15,
        ),
        heavy(of("heavy", "with one in 50 a thousand times as heavy, shaken", 1000, Shaken)),
        heavy(of("heavy", "with one in 50 a thousand times as heavy, shaken", 4000, Shaken)),
        weightless(of("pull", pulled, 1000, Pull)),
        allow(weightless(of("pull", pulled, 2000, Pull)), Figure::Mean, 1.15),
        allow(weightless(of("pull", pulled, 4000, Pull)), Figure::Mean, 1.15),
        hourglass(2000),
    ]
}

/// A pile whose bodies keep moving. The worst step may take 4 ms with 1000 bodies and 16 ms with 4000.
pub(super) fn moving(id: &str, title: &str, mut scenes: Vec<Scene>, script: Script) -> Pile {
    scenes.iter_mut().for_each(|scene| script.prepare(scene));
    let worst_us = if scenes[0].bodies.len() > 1100 { 16_000.0 } else { 4000.0 };
    let bounds = vec![
        (Figure::Mean, Bound::OfPeer(1.0)),
        (Figure::Spread, Bound::Value(2.5)),
        (Figure::Worst, Bound::Value(worst_us)),
        (Figure::MeanDeepest, Bound::OfPeer(0.5)),
        (Figure::DeepestEver, Bound::OfPeer(0.5)),
        (Figure::Escaped, Bound::Value(0.0)),
    ];
    let (id, title) = (id.into(), title.into());
    Pile { id, title, scenes, script, ticks: 600, full_only: false, bounds }
}

/// Returns the pile with a different bound for a figure, relative to Box2D's.
fn allow(mut pile: Pile, figure: Figure, factor: f64) -> Pile {
    for bound in pile.bounds.iter_mut().filter(|(bounded, _)| *bounded == figure) {
        bound.1 = Bound::OfPeer(factor);
    }
    pile
}

fn bouncy(mut pile: Pile) -> Pile {
    for body in pile.scenes.iter_mut().flat_map(|scene| &mut scene.bodies) {
        body.restitution = RESTITUTION;
    }
    pile
}

fn heavy(mut pile: Pile) -> Pile {
    for scene in &mut pile.scenes {
        let movable: Vec<usize> = scene.dynamic().collect();
        for &body in movable.iter().skip(7).step_by(50) {
            scene.bodies[body].mass *= 1000.0;
        }
    }
    pile
}

fn weightless(mut pile: Pile) -> Pile {
    pile.scenes.iter_mut().for_each(|scene| scene.gravity = DVec2::ZERO);
    pile
}

/// Discs that flow through an opening 8 wide between two flights of steps, for 15 s.
fn hourglass(count: usize) -> Pile {
    let scenes = (0..SEEDS).map(|seed| sand(count, seed)).collect();
    let title = format!("{count} discs in an hourglass");
    Pile { ticks: 900, ..moving(&format!("hourglass-{count}"), &title, scenes, Script::Still) }
}

fn sand(count: usize, seed: u32) -> Scene {
    const WIDTH: f64 = 160.0;
    let mut scene = Scene::new(GRAVITY);
    scene.contain(WIDTH, FLIGHT_TOP + STEP * count.div_ceil(40) as f64, 0.3, 0.0);
    add_flights(&mut scene, WIDTH);
    let mut draws = Mulberry(0x4067_1A55 ^ (SEEDS_APART * seed));
    for index in 0..count {
        let radius = 0.7 + 0.8 * draws.unit();
        let (column, row) = ((index % 40) as f64, (index / 40) as f64);
        let x = STEP * (column + 0.5) + draws.range(-0.3, 0.3);
        scene.add(Body::new(Shape::Circle { radius }, x, FLIGHT_TOP + 2.0 + STEP * (row + 0.5)));
    }
    scene
}

/// Height of a funnel's flights of steps, and the height and width of each step.
const FLIGHT_TOP: f64 = 140.0;
const STEP: f64 = 4.0;

/// Adds a flight of steps at each wall, leaving an opening 8 wide in a container 160 wide.
pub(super) fn add_flights(scene: &mut Scene, width: f64) {
    const STEPS: u32 = 19;
    for step in 0..STEPS {
        let half = STEP * f64::from(step + 1) / 2.0;
        let y = FLIGHT_TOP - STEP * (f64::from(step) + 0.5);
        let shape = Shape::rect(half, STEP / 2.0);
        scene.add(Body::fixed(shape, half, y));
        scene.add(Body::fixed(shape, width - half, y));
    }
}

fn stack(count: usize) -> Pile {
    let mut scene = floor(100.0);
    for row in 0..count {
        scene.add(block(0.0, 1.0 + 2.0 * row as f64));
    }
    pile(&format!("stack-{count}"), &format!("Stack of {count}"), scene, 600, &AT_REST)
}

const AT_REST: [(Figure, Bound); 3] = [
    (Figure::DeepestEver, Bound::Value(SLOP_SEEN)),
    (Figure::HeightLost, Bound::Value(SLOP_SEEN)),
    (Figure::RmsAtEnd, Bound::Value(1e-5)),
];

fn dropped() -> Pile {
    let mut scene = floor(100.0);
    for row in 0..TALL {
        let gaps = (row + 1) as f64 * GAP;
        scene.add(block(0.0, 1.0 + 2.0 * row as f64 + gaps));
    }
    let free_fall = (2.0 * GAP * TALL as f64 / GRAVITY).sqrt();
    let bounds = [
        (Figure::DeepestEver, Bound::Value(SLOP_SEEN)),
        (Figure::SettledAfter, Bound::Value(free_fall + 0.05)),
        (Figure::Rising, Bound::Value(0.01)),
    ];
    let title = format!("Stack of {TALL} dropped with gaps of {GAP} (free fall {free_fall:.3} s)");
    pile("dropped-1000", &title, scene, 600, &bounds)
}

fn pyramid() -> Pile {
    let mut scene = floor(150.0);
    add_pyramid(&mut scene, 50, 1.0);
    pile("pyramid-50", "Pyramid with a base of 50", scene, 600, &AT_REST)
}

fn capped() -> Pile {
    let mut scene = floor(84.0);
    add_pyramid(&mut scene, 20, 1000.0);
    pile(
        "capped-20",
        "Pyramid with a base of 20, its cap 1000 times as heavy",
        scene,
        600,
        &AT_REST,
    )
}

/// Two stacks of alternating masses 1 and 1000 that collide in the air, where nothing else can absorb momentum.
fn thrown() -> Pile {
    let mut scene = Scene::new(0.0);
    for row in 0..50 {
        let (gap, speed) = if row < 25 { (0.0, 10.0) } else { (1.0, -10.0) };
        let mass = if row % 2 == 0 { 1.0 } else { 1000.0 };
        let body = block(0.0, 1.0 + 2.0 * f64::from(row) + gap).of_mass(mass);
        scene.add(body.moving(0.0, speed));
    }
    let bounds =
        [(Figure::Momentum, Bound::Value(1e-5)), (Figure::DeepestEver, Bound::Value(SLOP_SEEN))];
    let title = "Two stacks of 25 thrown together without gravity, 1:1000 in turns";
    pile("thrown-50", title, scene, 600, &bounds)
}

/// A ball dropped onto a bed of circles, any of which it could push aside.
fn ball() -> Pile {
    let bounds = [
        (Figure::Mean, Bound::OfPeer(1.5)),
        (Figure::DeepestEver, Bound::None),
        (Figure::DeepestAtEnd, Bound::Value(0.01)),
        (Figure::RmsAtEnd, Bound::Value(0.01)),
    ];
    let title = "Ball 1000 times as heavy dropped on 360 circles";
    seeded("ball-360", title, (0..SEEDS).map(ball_on_bed).collect(), 600, &bounds)
}

/// The scene of [`ball`]; the seed decides where the ball falls.
fn ball_on_bed(seed: u32) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.contain(60.5, 100.0, 0.3, 0.0);
    for row in 0..12 {
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        for column in 0..30 {
            let x = 1.0 + 2.0 * f64::from(column) + shift;
            let y = 1.0 + f64::from(row) * 3.3f64.sqrt();
            scene.add(Body::new(Shape::Circle { radius: 0.98 }, x, y));
        }
    }
    let ball = Body::new(Shape::Circle { radius: 5.0 }, 30.0 + 0.137 * f64::from(seed), 45.0);
    scene.add(ball.of_mass(1000.0 * Shape::Circle { radius: 0.98 }.area()));
    scene
}

/// 2000 discs of three sizes fall onto an open floor in a column 44 wide. Each lands between two others, so that the
/// column does not stay upright despite a friction of 0.5.
fn poured() -> Pile {
    let bounds = [
        (Figure::Mean, Bound::OfPeer(1.1)),
        (Figure::DeepestEver, Bound::OfPeer(0.5)),
        (Figure::DeepestAtEnd, Bound::Value(0.01)),
        (Figure::RmsAtEnd, Bound::Value(0.05)),
        (Figure::MeanHeight, Bound::None),
        (Figure::SpeedLeft, Bound::None),
        (Figure::CalmAfter, Bound::None),
    ];
    let title = "2000 discs of three sizes poured onto an open floor, friction 0.5, for 10 s";
    seeded("poured-2000", title, (0..SEEDS).map(column).collect(), 600, &bounds)
}

fn column(seed: u32) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.floor(400.0, 0.5, 0.0);
    let mut draws = Mulberry(0x2000 + SEEDS_APART * seed);
    for i in 0..2000 {
        let radius = [0.7, 0.85, 1.0][i % 3];
        let (column, row) = ((i % 20) as f64, (i / 20) as f64);
        let shift = if i / 20 % 2 == 0 { 0.0 } else { 0.5 };
        let (x, y) = (2.2 * (column + shift) - 21.0, 1.1 + 2.2 * row);
        let (jitter_x, jitter_y) = (draws.range(-0.09, 0.09), draws.range(-0.09, 0.09));
        let disc = Body::new(Shape::Circle { radius }, x + jitter_x, y + jitter_y);
        scene.add(disc.of_stuff(0.5, 0.0));
    }
    scene
}

fn floor(half_width: f64) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.floor(half_width, 0.3, 0.0);
    scene
}

fn block(x: f64, y: f64) -> Body {
    Body::new(Shape::rect(1.0, 1.0), x, y)
}

fn add_pyramid(scene: &mut Scene, base: usize, cap: f64) {
    for row in 0..base {
        let count = base - row;
        for k in 0..count {
            let x = (k as f64 - (count - 1) as f64 / 2.0) * 2.2;
            let body = block(x, 1.0 + 2.0 * row as f64);
            let factor = if count == 1 { cap } else { 1.0 };
            scene.add(body.of_mass(body.mass * factor));
        }
    }
}

/// A scene with `count` bodies in a container, in four times as many columns as rows.
fn rain(count: u32, seed: u32) -> Scene {
    let columns = f64::from(4 * count).sqrt().ceil() as u32;
    let rows = count.div_ceil(columns);
    let mut scene = Scene::new(GRAVITY);
    scene.contain(8.0 * f64::from(columns), 8.0 * f64::from(rows) + 40.0, 0.3, 0.0);
    let mut draws = Mulberry(0x5EED_0000 + count + SEEDS_APART * seed);
    for i in 0..count {
        let kind = draws.unit();
        let (a, b) = (1.0 + 2.5 * draws.unit(), 1.0 + 2.5 * draws.unit());
        let (jitter_x, jitter_y) = (draws.range(-0.45, 0.45), draws.range(-0.45, 0.45));
        let shape = if kind < 0.5 { Shape::Circle { radius: a } } else { Shape::rect(a, b) };
        let x = 8.0 * (f64::from(i % columns) + 0.5) + jitter_x;
        let y = 8.0 * (f64::from(i / columns) + 0.5) + jitter_y;
        scene.add(Body::new(shape, x, y));
    }
    scene
}
