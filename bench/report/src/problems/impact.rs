//! Problems 7 and 8: two bodies that collide, and rows of equal balls.

use super::worst;
use crate::engine::{State, Trace};
use crate::reference::closed;
use crate::scene::{Body, Scene, Shape};
use crate::study::{Norm, Problem};
use glam::DVec2;

const SPEED: f64 = 10.0;
/// Distance between the rows of a scene, so that they never meet.
const APART: f64 = 30.0;
const CRADLE_SPEED: f64 = 20.0;
/// Number of balls in each row of problem 8. Each row occurs twice, with touching balls and with gaps.
const ROWS: [usize; 5] = [2, 3, 5, 10, 20];
const GAPS: [f64; 2] = [0.0, 0.01];
/// The rows of problem 8b, as number of balls and restitution.
const CASCADES: [(usize, f64); 8] =
    [(3, 0.8), (4, 0.8), (5, 0.8), (8, 0.8), (3, 0.5), (4, 0.5), (5, 0.5), (8, 0.5)];
const CASCADE_GAP: f64 = 2.0;
const CASCADE_TICKS: u32 = 480;

pub const PROBLEMS: [Problem; 3] = [
    Problem {
        id: "7",
        title: "Two bodies collide",
        about: "Pairs of discs at 10 units/s: head-on with restitution 0 to 1 and mass ratios from \
                10⁻⁶ to 10⁶, and off-centre by half a diameter with restitution 0 and 0.8 and \
                friction 0, 0.3 and 10. No gravity; velocities after 1 s.",
        reference: "momentum, restitution law and Coulomb's clamp in closed form",
        scene: collisions,
        ticks: 60,
        norms: &[
            Norm {
                name: "largest velocity error",
                unit: "units/s",
                of: |scene, trace| worst(pairs().map(|pair| pair.error(scene, trace))),
            },
            Norm {
                name: "the same, head-on pairs only",
                unit: "units/s",
                of: |scene, trace| {
                    let head_on = pairs().filter(|pair| pair.offset == 0.0);
                    worst(head_on.map(|pair| pair.error(scene, trace)))
                },
            },
            Norm {
                name: "relative momentum error",
                unit: "",
                of: |scene, trace| {
                    worst(pairs().map(|pair| {
                        let of = |tick: usize, body: usize| {
                            trace.states[tick][body].velocity * scene.bodies[body].mass
                        };
                        let sum = |tick| of(tick, pair.first()) + of(tick, pair.first() + 1);
                        let last = trace.states.len() - 1;
                        sum(last).distance(sum(0)) / sum(0).length()
                    }))
                },
            },
        ],
        magnitude: 20.0,
    },
    Problem {
        id: "8a",
        title: "Newton's cradle",
        about: "Rows of 2, 3, 5, 10 and 20 equal balls, touching or 0.01 apart, e = 1: the first one \
                is thrown at 20 units/s at the rest of its row.",
        reference: "the last ball leaves with all the speed, the others stand",
        scene: cradles,
        ticks: 120,
        norms: &[
            Norm {
                name: "largest speed error, rows apart",
                unit: "of v0",
                of: |_, t| row_error(t, 1),
            },
            Norm {
                name: "largest speed error, rows touching",
                unit: "of v0",
                of: |_, t| row_error(t, 0),
            },
        ],
        magnitude: 1.0,
    },
    Problem {
        id: "8b",
        title: "Rows of balls that lose speed",
        about: "Rows of 3, 4, 5 and 8 equal balls 2 units apart, e = 0.8 and e = 0.5, the first one \
                thrown at 20 units/s: a cascade of collisions, as in comparison 12 of ARGESIM; 8 s.",
        reference: "collision by collision in f64, without time steps",
        scene: cascades,
        ticks: CASCADE_TICKS,
        norms: &[
            Norm { name: "largest speed error", unit: "of v0", of: cascade_error },
            Norm { name: "error of the number of collisions", unit: "", of: count_error },
        ],
        magnitude: 1.0,
    },
];

/// A pair of problem 7; `index` counts from 0.
#[derive(Clone, Copy)]
struct Pair {
    index: usize,
    ratio: f64,
    restitution: f64,
    friction: f64,
    offset: f64,
}

fn pairs() -> impl Iterator<Item = Pair> {
    let ratios = [1e-6, 1e-3, 1.0, 1e3, 1e6];
    let head_on = ratios
        .into_iter()
        .flat_map(|ratio| [0.0, 0.5, 0.9, 1.0].map(|restitution| (ratio, restitution, 0.0, 0.0)));
    let oblique = [0.0, 0.8]
        .into_iter()
        .flat_map(|restitution| [0.0, 0.3, 10.0].map(|friction| (2.0, restitution, friction, 1.0)));
    head_on.chain(oblique).enumerate().map(|(index, (ratio, restitution, friction, offset))| Pair {
        index,
        ratio,
        restitution,
        friction,
        offset,
    })
}

impl Pair {
    /// Index of the pair's first body; the second one follows it.
    fn first(self) -> usize {
        2 * self.index
    }

    fn add(self, scene: &mut Scene) {
        let y = self.index as f64 * APART;
        let disc = |x: f64, y: f64| {
            let disc = Body::new(Shape::Circle { radius: 1.0 }, x, y);
            disc.of_stuff(self.friction, self.restitution)
        };
        scene.add(disc(0.0, y).of_mass(self.ratio).moving(SPEED, 0.0));
        scene.add(disc(5.03, y + self.offset).of_mass(1.0));
    }

    fn error(self, scene: &Scene, trace: &Trace) -> f64 {
        let normal = DVec2::new((4.0 - self.offset * self.offset).sqrt(), self.offset) / 2.0;
        let bodies = [scene.bodies[self.first()], scene.bodies[self.first() + 1]];
        let exact = closed::collision(
            bodies.map(|body| body.mass),
            bodies.map(|body| body.velocity),
            normal,
            self.restitution,
            self.friction,
        );
        let last = trace.last();
        worst((0..2).map(|i| last[self.first() + i].velocity.distance(exact[i])))
    }
}

fn collisions() -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    pairs().for_each(|pair| pair.add(&mut scene));
    scene
}

fn cradles() -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    let mut y = 0.0;
    for gap in GAPS {
        for count in ROWS {
            for ball in 0..count {
                let x = if ball == 0 { -4.0 } else { ball as f64 * (1.0 + gap) };
                let body = Body::new(Shape::Circle { radius: 0.5 }, x, y).of_stuff(0.0, 1.0);
                let speed = if ball == 0 { CRADLE_SPEED } else { 0.0 };
                scene.add(body.moving(speed, 0.0));
            }
            y += APART;
        }
    }
    scene
}

/// Returns the error over all rows with the given gap.
fn row_error(trace: &Trace, gap: usize) -> f64 {
    let mut first = gap * ROWS.iter().sum::<usize>();
    let mut largest = 0.0;
    for count in ROWS {
        let errors = (0..count).map(|ball| {
            let exact = if ball + 1 == count { CRADLE_SPEED } else { 0.0 };
            trace.last()[first + ball].velocity.distance(DVec2::new(exact, 0.0)) / CRADLE_SPEED
        });
        largest = worst([largest, worst(errors)].into_iter());
        first += count;
    }
    largest
}

fn cascades() -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    for (row, (count, restitution)) in CASCADES.into_iter().enumerate() {
        for ball in 0..count {
            let x = ball as f64 * (1.0 + CASCADE_GAP);
            let body = Body::new(Shape::Circle { radius: 0.5 }, x, row as f64 * APART);
            let speed = if ball == 0 { CRADLE_SPEED } else { 0.0 };
            scene.add(body.of_stuff(0.0, restitution).moving(speed, 0.0));
        }
    }
    scene
}

/// Returns the final velocities in a row, and the number of collisions.
fn cascade(count: usize, restitution: f64) -> (Vec<f64>, usize) {
    // Treat balls as points, since their sizes take up none of the gaps.
    let mut positions: Vec<f64> = (0..count).map(|ball| ball as f64 * CASCADE_GAP).collect();
    let mut speeds = vec![0.0; count];
    speeds[0] = CRADLE_SPEED;
    let (mut left, mut collisions) = (f64::from(CASCADE_TICKS) / 60.0, 0);
    loop {
        let meeting = |i: usize| {
            let closing = speeds[i] - speeds[i + 1];
            let gap = (positions[i + 1] - positions[i]).max(0.0);
            (if closing > 1e-12 { gap / closing } else { f64::INFINITY }, i)
        };
        let next = (0..count - 1).map(meeting).min_by(|a, b| a.0.total_cmp(&b.0));
        let (time, i) = next.filter(|next| next.0 < left).unwrap_or((left, usize::MAX));
        positions.iter_mut().zip(&speeds).for_each(|(position, speed)| *position += speed * time);
        left -= time;
        if i == usize::MAX {
            return (speeds, collisions);
        }
        let (mean, half) = ((speeds[i] + speeds[i + 1]) / 2.0, (speeds[i] - speeds[i + 1]) / 2.0);
        speeds[i] = mean - restitution * half;
        speeds[i + 1] = mean + restitution * half;
        collisions += 1;
    }
}

fn cascade_error(_: &Scene, trace: &Trace) -> f64 {
    let mut first = 0;
    let mut largest = 0.0;
    for (count, restitution) in CASCADES {
        let (exact, _) = cascade(count, restitution);
        let errors = (0..count).map(|ball| {
            let exact = DVec2::new(exact[ball], 0.0);
            trace.last()[first + ball].velocity.distance(exact) / CRADLE_SPEED
        });
        largest = worst([largest, worst(errors)].into_iter());
        first += count;
    }
    largest
}

/// The error in the number of collisions, which are counted by changes in two balls' speeds. Two collisions of one ball
/// in the same tick would count as one, but do not occur in the reference.
fn count_error(_: &Scene, trace: &Trace) -> f64 {
    let changes = trace.states.windows(2).map(|pair| {
        let changed = |(a, b): (&State, &State)| a.velocity.distance(b.velocity) > 1e-6;
        pair[0].iter().zip(&pair[1]).filter(|&states| changed(states)).count()
    });
    let found = changes.sum::<usize>() as f64 / 2.0;
    let exact: usize = CASCADES.into_iter().map(|(count, e)| cascade(count, e).1).sum();
    (found - exact as f64).abs()
}

#[cfg(test)]
mod tests {
    use super::{CRADLE_SPEED, cascade};

    #[test]
    fn a_cascade_keeps_momentum() {
        for (count, restitution) in super::CASCADES {
            let (speeds, collisions) = cascade(count, restitution);
            assert!((speeds.iter().sum::<f64>() - CRADLE_SPEED).abs() < 1e-9);
            assert!(collisions >= count - 1);
        }
        assert_eq!(cascade(3, 1.0), (vec![0.0, 0.0, CRADLE_SPEED], 2));
    }
}
