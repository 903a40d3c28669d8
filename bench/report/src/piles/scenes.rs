//! The piles: rain of thousands of bodies, stacks, pyramids and loads that fall on them. Gravity is
//! 50, boxes are 2 high, friction is 0.3.

use super::scripts::Script;
use super::{Bound, Figure, Pile};
use crate::scene::{Body, Mulberry, Scene, Shape};

const GRAVITY: f64 = 50.0;
/// Gap under every box of the dropped stack, and the number of its boxes.
const GAP: f64 = 0.05;
const TALL: usize = 1000;

/// Restitution of everything in the pile that bounces.
const RESTITUTION: f64 = 0.8;

const SLOP: f64 = crate::stability::SLOP;
/// An overlap of exactly the slop, as it appears high up in single precision.
const SLOP_SEEN: f64 = 1.1 * SLOP;

/// Seeds of a pile of which chance decides where its bodies lie, and distance of their numbers.
const SEEDS: u32 = 3;
pub(super) const SEEDS_APART: u32 = 7919;

/// Figures of every pile: times relative to Box2D's.
const TIMES: [(Figure, Bound); 3] = [
    (Figure::Falling, Bound::OfPeer(2.0)),
    (Figure::Slowest, Bound::OfPeer(2.0)),
    (Figure::Settled, Bound::OfPeer(1.0)),
];

/// All piles.
pub fn all() -> Vec<Pile> {
    let mut piles: Vec<Pile> = [1000, 4000].map(small_rain).into();
    piles.extend([1000, 4000].map(sleeping_rain));
    piles.extend([10_000, 20_000].map(large_rain));
    piles.extend([20, 100, TALL].map(stack));
    piles.extend([dropped(), pyramid(), capped(), thrown(), ball(), poured()]);
    piles.extend(disturbed());
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
    // With other seeds some of the 4000 stand in columns that still topple after 10 s.
    let seeds = if count > 1000 { 1 } else { SEEDS };
    seeded(&format!("rain-{count}"), &title, rains(count, seeds), 600, &bounds)
}

fn rains(count: u32, seeds: u32) -> Vec<Scene> {
    (0..seeds).map(|seed| rain(count, seed)).collect()
}

/// A rain whose bodies may sleep; the number asleep is shown.
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

/// Rain that is not left alone: the mean times are those of all steps.
fn disturbed() -> [Pile; 11] {
    let of = |id: &str, title: &str, count: u32, script: Script, mean: f64, overlap: f64| {
        let mut scenes = rains(count, SEEDS);
        scenes.iter_mut().for_each(|scene| script.prepare(scene));
        let bounds = [
            (Figure::Mean, Bound::OfPeer(mean)),
            (Figure::Spread, Bound::Value(2.5)),
            (Figure::Worst, if count > 1000 { Bound::None } else { Bound::Value(8000.0) }),
            (Figure::DeepestEver, Bound::OfPeer(overlap)),
            (Figure::Escaped, Bound::Value(0.0)),
        ];
        let title = format!("Rain of {count} {title}");
        let (id, bounds) = (format!("{id}-{count}"), bounds.into());
        Pile { id, title, scenes, script, ticks: 600, full_only: false, bounds }
    };
    let (shaken, blasts) = ("shaken twice a second", "under three blasts a second");
    let title = "that bounces, shaken twice a second";
    let mut bouncy = of("bouncy", title, 1000, Script::Shaken, 1.5, 0.5);
    for body in bouncy.scenes.iter_mut().flat_map(|scene| &mut scene.bodies) {
        body.restitution = RESTITUTION;
    }
    [
        of("shaken", shaken, 1000, Script::Shaken, 1.3, 0.5),
        of("shaken", shaken, 4000, Script::Shaken, 1.6, 0.5),
        of("turning", "whose gravity turns every 2 s", 1000, Script::Turning, 1.8, 0.5),
        of("blasts", blasts, 1000, Script::Blasts, 1.2, 0.5),
        of("blasts", blasts, 4000, Script::Blasts, 1.1, 0.5),
        of("crowd", "in which 63 heroes fly about", 1000, Script::Crowd, 1.5, 0.5),
        of(
            "slings",
            "out of which bodies are slung into the walls",
            1000,
            Script::Slings,
            1.5,
            0.5,
        ),
        of("lift", "over a lift", 1000, Script::Lift, 1.5, 0.5),
        bouncy,
        of("mixer", "in a mixer", 1000, Script::Mixer, 1.5, 0.5),
        of("plough", "that a plough stirs", 1000, Script::Plough, 1.5, 1.0),
    ]
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

/// Two stacks of alternating masses 1 and 1000 collide in the air: nothing can take their momentum.
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

/// A ball on a bed of circles, each of which it could push aside.
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

/// The seed decides where the ball falls.
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

/// 2000 discs of three sizes fall onto an open floor in a column 44 wide, each between two below
/// it, so that friction 0.5 does not hold it there.
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

/// `count` bodies in a container, four times as many columns wide as rows high.
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
