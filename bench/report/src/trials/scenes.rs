//! Extreme scenes, each a closed container with random bodies. The exponent of each quantity is drawn from the whole
//! range that the simulation accepts. At the start the bodies take up at most 60 % of the container ([`CELL_MIN`]),
//! since bodies that do not fit cannot stay inside.
//!
//! After every step all numbers must be finite, every centre must be inside, and the energy may be at most 0.1 % above
//! its initial value. A centre is inside if it is no further than twice the slop plus rounding beyond the face of a
//! wall; bodies that are merely pressed into a wall are counted separately. Energy is measured from the floor, E = sum
//! m (v^2 / 2 + g y), so that it is never negative. It may additionally grow by rounding: positions are only exact to
//! [`ROUNDING`] of the container, and bodies that overlap by up to the slop may be pushed up again, together sum m g (2
//! slop + L [`ROUNDING`]). Likewise, [`ROUNDING`] of the energy that bodies could have at their fastest is ignored. The
//! relaxation solver only has to stay finite.

use super::{Failure, Verdict};
use jostle_sim::Conjugate;
use jostle_sim::Relaxation;
use jostle_sim::Rng;
use jostle_sim::WorldSettings;
use jostle_sim::{Aabb, BodyDef, BodyId, Motion, Shape, Solver, Vec2, World};

const STEPS: u32 = 60;
const BODIES_MAX: u32 = 30;
/// Relative rounding error of a few dozen f32 operations.
const ROUNDING: f64 = 4e-6;
const GAIN_MAX: f64 = 1e-3;
const SLOP: f64 = 0.005;
/// Side length of a body's cell relative to the largest body: 1.3^-2 is 59 %.
const CELL_MIN: f32 = 1.3;

const KINDS: [&str; 4] = ["apart", "apart, no gravity", "at one point, no gravity", "relaxation"];

pub fn trial(seed: u64, number: u64) -> Verdict {
    let mut rng = Rng::new(seed, number);
    let kind = match rng.below(10) {
        0..5 => 0,
        5..7 => 1,
        7..9 => 2,
        _ => 3,
    };
    let mut container = Container::new(&mut rng, kind);
    let failure = container.play(kind == 3);
    Verdict { kind: KINDS[kind], failure, pressed: container.pressed }
}

/// A random number with a uniformly distributed exponent.
fn spread(rng: &mut Rng, low: f32, high: f32) -> f32 {
    10f32.powf(rng.range(low.log10(), high.log10()))
}

struct Container {
    world: World,
    bodies: Vec<BodyId>,
    /// Side length of the container, whose lower left corner is the origin.
    side: f32,
    gravity: f32,
    /// Deepest penetration of a wall beyond the allowed depth, in half-sizes.
    pressed: f64,
}

impl Container {
    fn new(rng: &mut Rng, kind: usize) -> Container {
        let count = 1 + rng.below(BODIES_MAX);
        let largest = spread(rng, 1e-3, 1e6);
        let smallest = spread(rng, (largest * 1e-3).max(1e-3), largest);
        let columns = f32::ceil((count as f32).sqrt());
        let cell = largest * rng.range(CELL_MIN, 2.0);
        let side = columns * cell;
        let gravity = if kind == 0 || kind == 3 { spread(rng, 1.0, 1e3) } else { 0.0 };
        let bounce_threshold = if rng.below(4) == 0 { 0.0 } else { 2.0 };
        let solver = match kind {
            3 => Solver::Relaxation(Relaxation::default()),
            _ => Solver::Conjugate(Conjugate { bounce_threshold, ..Conjugate::default() }),
        };
        let settings = WorldSettings {
            dt: spread(rng, 1e-3, 0.05),
            gravity: Vec2::new(0.0, -gravity),
            solver: Some(solver),
            kill_zone: Aabb { low: Vec2::splat(-1e9), high: Vec2::splat(1e9) },
            ..WorldSettings::default()
        };
        let mut it = Container {
            world: World::new(settings),
            bodies: Vec::new(),
            side,
            gravity,
            pressed: 0.0,
        };
        it.close(rng);
        let speed_max = spread(rng, 1e-3, 1e4);
        for place in 0..count {
            let (column, row) = (place % columns as u32, place / columns as u32);
            let at = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) * cell;
            let position = if kind == 2 { Vec2::splat(side / 2.0) } else { at };
            let def = body(rng, smallest, largest, speed_max);
            let id = it.world.add(&BodyDef { position, ..def });
            it.bodies.push(id.expect("a container has few bodies"));
        }
        it
    }

    /// Adds four walls as thick as the container is wide.
    fn close(&mut self, rng: &mut Rng) {
        let (side, def) = (self.side, body(rng, 1.0, 1.0, 0.0));
        for (x, y) in [(-0.5, 0.5), (1.5, 0.5), (0.5, -0.5), (0.5, 1.5)] {
            let size = if y == 0.5 { Vec2::new(side, 3.0 * side) } else { Vec2::splat(side) };
            let shape = Shape::rect(size.x, size.y);
            let position = Vec2::new(x, y) * side;
            let motion = Motion::Static;
            let wall = BodyDef { shape, position, motion, velocity: Vec2::ZERO, ..def };
            self.world.add(&wall).expect("a container has few bodies");
        }
    }

    fn play(&mut self, only_finite: bool) -> Option<Failure> {
        let start = self.energy();
        let allowed = start * (1.0 + GAIN_MAX) + self.floor();
        for step in 1..=STEPS {
            self.world.step();
            let fail = |sort, detail: String| {
                Some(Failure { sort, detail: format!("step {step}: {detail}") })
            };
            if !self.world.departed().quarantined.is_empty() || !self.world.is_finite() {
                return fail("not finite", format!("{:?}", self.world.departed().quarantined));
            }
            if only_finite {
                continue;
            }
            if let Some(&id) = self.bodies.iter().find(|&&id| !self.holds(id)) {
                let place = self.world.contains(id).then(|| self.world.position(id));
                return fail("outside", format!("body {} at {place:?} of {}", id.index, self.side));
            }
            self.measure();
            let energy = self.energy();
            if energy > allowed {
                return fail(
                    "energy gained",
                    format!("{start:e} became {energy:e}, may {allowed:e}"),
                );
            }
        }
        None
    }

    fn holds(&self, id: BodyId) -> bool {
        self.world.contains(id) && self.beyond(id, Vec2::ZERO).max_element() <= self.counts()
    }

    /// Measures how deeply bodies penetrate the walls.
    fn measure(&mut self) {
        for &id in &self.bodies {
            let half = self.world.shape(id).half_extent();
            let depth = self.beyond(id, half);
            for axis in 0..2 {
                if depth[axis] > self.counts() {
                    self.pressed = self.pressed.max(f64::from(depth[axis] / half[axis]));
                }
            }
        }
    }

    /// Penetration depth, in world units, that slop and rounding cannot explain.
    fn counts(&self) -> f32 {
        (2.0 * SLOP + f64::from(self.side) * ROUNDING) as f32
    }

    /// How far a body of this half-size extends beyond the faces of the walls, on each axis.
    fn beyond(&self, id: BodyId, half: Vec2) -> Vec2 {
        let place = self.world.position(id);
        (half - place).max(place + half - Vec2::splat(self.side))
    }

    fn energy(&self) -> f64 {
        let alive = self.bodies.iter().filter(|&&id| self.world.contains(id));
        alive
            .map(|&id| {
                let mass = 1.0 / f64::from(self.world.inverse_mass(id));
                let height = f64::from(self.world.position(id).y);
                let square = self.world.velocity(id).as_dvec2().length_squared();
                mass * (square / 2.0 + f64::from(self.gravity) * height)
            })
            .sum()
    }

    /// The energy that rounding may add.
    fn floor(&self) -> f64 {
        let masses = self.bodies.iter().map(|&id| 1.0 / f64::from(self.world.inverse_mass(id)));
        let height = 2.0 * SLOP + f64::from(self.side) * ROUNDING;
        masses.sum::<f64>() * f64::from(self.gravity) * height
    }
}

fn body(rng: &mut Rng, smallest: f32, largest: f32, speed_max: f32) -> BodyDef {
    let size = |rng: &mut Rng| spread(rng, smallest, largest);
    let shape = match rng.below(2) {
        0 => Shape::circle(0.5 * size(rng)),
        _ => Shape::rect(size(rng), size(rng)),
    };
    let restitution = [0.0, 1.0, rng.unit()][rng.below(3) as usize];
    let friction = [0.0, 10.0, rng.unit()][rng.below(3) as usize];
    let angle = rng.range(0.0, std::f32::consts::TAU);
    let velocity = Vec2::from_angle(angle) * speed_max * rng.unit();
    let mass = spread(rng, 1e-6, 1e6);
    BodyDef { shape, velocity, mass, restitution, friction, ..BodyDef::default() }
}

#[cfg(test)]
mod tests {
    use super::super::{Arguments, run};
    use super::*;

    /// Regression test: none of the first 300 scenes fails. It does not measure the failure rate, which is at most a
    /// few in 100,000 (docs/development.md).
    #[test]
    fn of_the_first_300_none_escapes_or_gains_or_stops_being_a_number() {
        let tallies = run("scenes", &Arguments { seed: 1, from: 0, count: 300 }, trial);
        assert_eq!(tallies.len(), KINDS.len());
        for (kind, tally) in &tallies {
            assert!(tally.failures.is_empty(), "{kind}: {tally:?}");
        }
    }

    /// Numbers of scenes that once failed, for seeds 1 and 2. In nearly all of them the container is small compared
    /// with the speed that gravity adds per step.
    const FAILED_ONCE: [(u64, &[u64]); 2] = [
        (
            1,
            &[
                668, 880, 1272, 2286, 2585, 2991, 3212, 4182, 6041, 7046, 7811, 7984, 8321, 8538,
                8574, 8901, 9173, 9394, 9965, 10191, 10220, 10467, 10894, 11611, 11675, 12320,
                13781, 13893, 13969, 14378, 14480, 14633, 14775, 24374, 29089,
            ],
        ),
        (
            2,
            &[
                264, 561, 1695, 1719, 1902, 2245, 2448, 2713, 3202, 3430, 3976, 4855, 5611, 5649,
                5936, 6044, 7589, 7612, 8037, 8235, 8713, 8728, 9384, 9923, 10608, 12102, 12344,
                12644, 13479, 13508,
            ],
        ),
    ];

    #[test]
    fn scenes_that_failed_once_pass() {
        for (seed, numbers) in FAILED_ONCE {
            for &number in numbers {
                let failure = trial(seed, number).failure;
                assert_eq!(failure, None, "scenes --seed {seed} --from {number} --count 1");
            }
        }
    }

    #[test]
    fn a_container_is_at_most_60_percent_full() {
        for number in 0..300 {
            let container = Container::new(&mut Rng::new(3, number), 0);
            let area = |&id: &BodyId| match container.world.shape(id) {
                Shape::Circle { radius } => std::f32::consts::PI * radius * radius,
                Shape::Box { half } => 4.0 * half.x * half.y,
            };
            let share = container.bodies.iter().map(area).sum::<f32>() / container.side.powi(2);
            assert!(share < 0.6, "{number}: {share}");
        }
    }
}
