//! Tests particles (A3.7 to A3.18), emitters (A4.2 to A4.7), and that both avoid the chapter's defects (C17, C24a to
//! C24k).

use super::*;
use crate::Shape;

const QUANTUM: f32 = 1.0 / 256.0;

fn flame() -> Recipe {
    Recipe::default()
}

fn still(life: u16) -> Recipe {
    Recipe {
        life_ticks: [life, life],
        velocity: [Vec2::ZERO, Vec2::ZERO],
        acceleration: Vec2::ZERO,
        ..Recipe::default()
    }
}

fn started(recipe: Recipe, count: u16) -> Particles {
    let mut particles = Particles::new(vec![recipe], 100_000);
    let source = Source::Point(Vec2::new(50.0, 40.0));
    particles.start(EmitterDef { recipe: 0, count, seed: 7, source });
    particles
}

fn step(particles: &mut Particles) {
    particles.step(&[], |_| None);
}

#[test]
fn a_particle_falls_to_its_terminal_speed() {
    let recipe = Recipe { acceleration: Vec2::new(0.0, -50.0), ..still(2000) };
    let mut particles = started(recipe, 1);
    for _ in 0..600 {
        step(&mut particles);
    }
    // The limit of v = (v - 50/60) * 0.95 is -0.95 * 50/60 / 0.05.
    assert!((particles.velocities()[0].y + 15.8333).abs() < 1e-3);
}

#[test]
fn the_first_steps_of_a_particle_are_those_of_the_textbook() {
    let recipe = Recipe { acceleration: Vec2::new(0.0, -50.0), ..still(100) };
    let mut particles = started(recipe, 1);
    step(&mut particles);
    assert_eq!(particles.positions(), [Vec2::new(50.0, 40.0)], "born where the emitter is");
    let (mut y, mut v) = (40.0_f32, 0.0_f32);
    for _ in 0..20 {
        step(&mut particles);
        v = (v - 50.0 / 60.0) * 0.95;
        y += v / 60.0;
        assert!((particles.positions()[0].y - y).abs() < 1e-4);
    }
}

#[test]
fn a_lifetime_of_l_ticks_is_l_moves_and_ends_exactly_on_its_targets() {
    for life in [1, 2, 30, 230] {
        let mut particles = started(Recipe { color_end: [[4.0; 4]; 2], ..still(life) }, 1);
        step(&mut particles);
        for _ in 0..life {
            assert_eq!(particles.len(), 1);
            step(&mut particles);
        }
        assert_eq!(particles.age(0), (life, life));
        assert_eq!(particles.appearance(0).color, [4.0; 4], "C24b");
        step(&mut particles);
        assert_eq!(particles.len(), 0);
    }
}

#[test]
fn colour_at_half_life_is_the_mean_and_size_shrinks_by_its_factor() {
    let recipe = Recipe { color_end: [[4.0, 0.5, 0.3, 0.6]; 2], size: [6.0, 6.0], ..still(120) };
    let mut particles = started(recipe, 1);
    for _ in 0..61 {
        step(&mut particles);
    }
    let look = particles.appearance(0);
    for (found, mean) in look.color.iter().zip([2.5, 0.25, 0.15, 0.8]) {
        assert!((found - mean).abs() < 1e-5, "{:?}", look.color);
    }
    assert!((look.size / 6.0 - 0.2976).abs() < 1e-4, "size {}", look.size);
}

#[test]
fn particles_of_one_lifetime_expire_together() {
    let mut particles = started(still(20), 5);
    step(&mut particles);
    assert_eq!(particles.len(), 5);
    for _ in 0..20 {
        step(&mut particles);
    }
    assert_eq!(particles.len(), 5);
    step(&mut particles);
    assert_eq!(particles.len(), 0, "C24d");
}

#[test]
fn recipes_stay_in_their_ranges_and_no_two_particles_are_alike() {
    let mut particles = started(Recipe { life_ticks: [200, 230], ..flame() }, 1000);
    while particles.emitter_count() > 0 {
        step(&mut particles);
    }
    assert_eq!(particles.len(), 1000);
    let recipe = flame();
    for index in 0..particles.len() {
        let birth = Birth::draw(&recipe, particles.seed[index]);
        assert!((30..=230).contains(&birth.life));
        assert!((5.5..6.0).contains(&birth.size));
        assert!((-10.0..10.0).contains(&birth.velocity.x));
        assert!((0.0..10.0).contains(&birth.velocity.y));
        assert!((3.5..4.5).contains(&birth.color_end[0]));
        assert!((0.4..0.5).contains(&birth.color_end[1]));
    }
    let mut seeds = particles.seed.clone();
    seeds.sort_unstable();
    seeds.dedup();
    assert_eq!(seeds.len(), 1000);
}

#[test]
fn an_emitter_makes_exactly_its_count_and_at_least_five_a_tick() {
    for count in [1, 4, 5, 6, 64, 200, 1000] {
        let mut particles = started(still(2000), count);
        let mut before = 0;
        let mut ticks = 0;
        while particles.emitter_count() > 0 {
            step(&mut particles);
            let made = particles.len() - before;
            let left_before = usize::from(count) - before;
            assert!(made >= left_before.min(5), "{made} of {left_before} left (C24f)");
            assert!(made <= 5.max(left_before / 5), "{made} of {left_before} left (A4.4)");
            before = particles.len();
            ticks += 1;
        }
        assert_eq!(particles.len(), usize::from(count), "C24e");
        assert!(ticks <= 60, "{count} took {ticks} ticks");
    }
}

#[test]
fn the_seeds_of_an_emitter_are_those_of_its_particles() {
    let mut particles = Particles::new(vec![still(1000)], 10_000);
    let source = Source::Point(Vec2::ZERO);
    let emitter = EmitterDef { recipe: 0, count: 150, seed: 9, source };
    particles.start(emitter);
    for _ in 0..200 {
        step(&mut particles);
    }
    assert_eq!(particles.seeds(), emitter.seeds());
}

#[test]
fn an_explosion_takes_about_half_a_second() {
    let mut total = 0;
    for seed in 0..50 {
        let mut particles = Particles::new(vec![still(2000)], 1000);
        let source = Source::Point(Vec2::ZERO);
        particles.start(EmitterDef { recipe: 0, count: 200, seed, source });
        while particles.emitter_count() > 0 {
            step(&mut particles);
            total += 1;
        }
    }
    assert!((20..=40).contains(&(total / 50)), "{} ticks on average", total / 50);
}

#[test]
fn an_emitter_follows_its_body_and_stays_when_it_is_gone() {
    let mut particles = Particles::new(vec![still(500)], 1000);
    let id = BodyId { index: 3, generation: 1 };
    particles.start(EmitterDef { recipe: 0, count: 15, seed: 1, source: Source::Body(id) });
    particles.step(&[], |_| Some(Vec2::new(1.0, 2.0)));
    particles.step(&[], |wanted| (wanted == id).then_some(Vec2::new(5.0, 6.0)));
    particles.step(&[], |_| None);
    assert_eq!(particles.positions()[0], Vec2::new(1.0, 2.0));
    assert_eq!(particles.positions()[5], Vec2::new(5.0, 6.0));
    assert_eq!(particles.positions()[10], Vec2::new(5.0, 6.0));
}

#[test]
fn the_limit_holds_and_the_emitter_still_ends() {
    let mut particles = Particles::new(vec![still(500)], 20);
    let source = Source::Point(Vec2::ZERO);
    particles.start(EmitterDef { recipe: 0, count: 300, seed: 1, source });
    for _ in 0..100 {
        step(&mut particles);
        assert!(particles.len() <= 20);
    }
    assert_eq!(particles.emitter_count(), 0);
}

#[test]
fn a_round_recipe_fills_the_ellipse_between_its_corners() {
    let velocity = [Vec2::new(-30.0, -10.0), Vec2::new(30.0, 30.0)];
    let recipe = Recipe { velocity, round: true, ..still(10) };
    let (middle, half) = (Vec2::new(0.0, 10.0), Vec2::new(30.0, 20.0));
    let mut quadrants = [0; 4];
    for seed in 0..1000 {
        let offset = (Birth::draw(&recipe, seed).velocity - middle) / half;
        assert!(offset.length() < 1.0001, "{offset}");
        quadrants[usize::from(offset.x > 0.0) + 2 * usize::from(offset.y > 0.0)] += 1;
    }
    assert!(quadrants.iter().all(|&count| count > 200), "{quadrants:?}");
}

#[test]
fn the_number_of_running_emitters_is_limited() {
    let mut particles = Particles::new(vec![still(500)], 10);
    let def = EmitterDef { recipe: 0, count: 6, seed: 1, source: Source::Point(Vec2::ZERO) };
    for _ in 0..EMITTERS_RUNNING_MAX {
        assert!(particles.start(def));
    }
    assert!(!particles.start(def));
}

#[test]
fn a_growing_particle_stays_finite() {
    let recipe = Recipe { size_factor: 1.1, ..still(3600) };
    let mut particles = started(recipe, 1);
    for _ in 0..3600 {
        step(&mut particles);
    }
    assert!(particles.appearance(0).size <= 256.0);
}

fn pushed(shape: Shape, offset: Vec2, velocity: Vec2) -> (Vec2, Vec2) {
    let center = Vec2::new(10.0, 20.0);
    let obstacle = Obstacle { shape, center };
    let (mut position, mut velocity) = (center + offset, velocity);
    obstacle.push_out(&mut position, &mut velocity);
    (position - center, velocity)
}

#[test]
fn a_particle_in_a_circle_moves_to_the_border_and_slides() {
    let circle = Shape::circle(2.0);
    for angle in 0..16 {
        let direction = crate::math::rotate(Vec2::X, angle as f32 * 0.4);
        let (position, velocity) =
            pushed(circle, direction * 0.5, direction * -3.0 + direction.perp());
        assert!((position - direction * 2.0).length() < 1e-4);
        assert!((velocity - direction.perp()).length() < 1e-4, "C24k");
    }
    let (position, velocity) = pushed(circle, Vec2::ZERO, Vec2::new(1.0, -5.0));
    assert_eq!((position, velocity), (Vec2::new(0.0, 2.0), Vec2::new(1.0, 0.0)), "C17");
    let outside = Vec2::new(2.0, 0.0);
    assert_eq!(pushed(circle, outside, Vec2::NEG_X), (outside, Vec2::NEG_X), "the rim is outside");
}

#[test]
fn a_particle_in_a_box_leaves_by_the_nearest_side() {
    let platform = Shape::rect(30.0, 3.0);
    let falling = Vec2::new(2.0, -9.0);
    let cases = [
        (Vec2::new(3.0, 1.4), Vec2::new(3.0, 1.5), Vec2::new(2.0, 0.0)),
        (Vec2::new(3.0, -1.4), Vec2::new(3.0, -1.5), falling),
        (Vec2::new(14.9, 0.0), Vec2::new(15.0, 0.0), falling),
        (Vec2::new(-14.9, 0.0), Vec2::new(-15.0, 0.0), Vec2::new(0.0, -9.0)),
    ];
    for (offset, position, velocity) in cases {
        let (found, found_velocity) = pushed(platform, offset, falling);
        assert!((found - position).length() < 1e-5, "{offset} went to {found} (C02)");
        assert!(
            (found_velocity - velocity).length() < 1e-5,
            "{offset} goes on at {found_velocity}"
        );
    }
}

#[test]
fn the_grid_finds_every_obstacle_at_a_point() {
    let mut rng = Rng::new(4, 0);
    let obstacles: Vec<Obstacle> = (0..300)
        .map(|index| Obstacle {
            shape: if index % 2 == 0 {
                Shape::circle(rng.range(0.1, 9.0))
            } else {
                Shape::rect(rng.range(0.1, 90.0), rng.range(0.1, 9.0))
            },
            center: Vec2::new(rng.range(-100.0, 300.0), rng.range(-50.0, 90.0)),
        })
        .collect();
    let mut grid = ObstacleGrid::default();
    grid.fill(&obstacles);
    for _ in 0..20_000 {
        let point = Vec2::new(rng.range(-150.0, 350.0), rng.range(-80.0, 120.0));
        let inside = |index: &u32| {
            let obstacle = &obstacles[*index as usize];
            obstacle.shape.contains(point - obstacle.center)
        };
        let all: Vec<u32> = (0..300).filter(inside).collect();
        let found: Vec<u32> = grid.candidates(point).iter().copied().filter(inside).collect();
        assert_eq!(found, all, "at {point}");
    }
}

#[test]
fn two_ends_of_a_stream_agree_bit_for_bit() {
    let obstacles =
        [Obstacle::new(Shape::rect(30.0, 3.0), quantise(Vec2::new(50.0, 35.0), QUANTUM), QUANTUM)];
    let (mut here, mut there) = (started(flame(), 200), started(flame(), 200));
    for _ in 0..120 {
        here.step(&obstacles, |_| None);
        there.step(&obstacles, |_| None);
        assert_eq!(here.digest(), there.digest());
    }
    assert!(!here.is_empty());
}

#[test]
fn quanta_round_to_the_nearest_and_come_back_exactly() {
    assert_eq!(quantise(Vec2::new(1.0, -1.0), QUANTUM), [256, -256]);
    assert_eq!(quantise(Vec2::new(0.4999 * QUANTUM, 0.5001 * QUANTUM), QUANTUM), [0, 1]);
    for quanta in [[0, 1], [-77, 51_200], [1 << 23, -(1 << 23)]] {
        assert_eq!(quantise(dequantise(quanta, QUANTUM), QUANTUM), quanta);
    }
}
