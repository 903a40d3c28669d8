//! Tests that play the shipped scenes.

use super::players::{busy_inputs, busy_tick};
use super::*;
use crate::Phase;
use jostle_sim::Rng;
use jostle_sim::collide;
use jostle_sim::math::min;

#[test]
fn every_shipped_scene_runs_600_ticks_of_wild_play() {
    for scene in Scene::built_in() {
        let name = scene.name.clone();
        let scene = Arc::new(scene);
        let mut game = Game::new(Arc::clone(&scene), 1);
        for seat in 0..8 {
            game.join(Seat(seat));
        }
        let mut rng = Rng::new(1, 1);
        for tick in 0..600 {
            busy_tick(&mut game, &mut rng);
            assert!(game.world().is_finite(), "{name}: tick {tick}");
            assert!(game.world().body_count() <= scene.world.bodies_max);
            assert!(game.world().particles().len() <= scene.world.particles_max);
        }
        for body in game.bodies() {
            assert!(game.world().contains(body.id), "{name}: {:?}", body);
        }
        assert_eq!(game.bodies().count(), game.world().body_count(), "{name}");
    }
}

#[test]
fn nothing_leaves_a_walled_scene() {
    for name in ["arena", "impulse"] {
        let mut game = built_in(name, 2);
        for seat in 0..6 {
            game.join(Seat(seat));
        }
        let mut rng = Rng::new(2, 2);
        for tick in 0..900 {
            busy_tick(&mut game, &mut rng);
            let left = game.events().iter().find(|event| matches!(event, Event::BodyLeft { .. }));
            assert_eq!(left, None, "{name}, tick {tick}");
        }
    }
}

/// Players hold down their keys for a while, which presses heroes into corners and drags bodies against walls.
#[test]
fn no_body_moves_further_in_a_tick_than_its_speed_and_its_correction_allow() {
    for scene in Scene::built_in() {
        let (name, scene) = (scene.name.clone(), Arc::new(scene));
        let settings = scene.world_settings();
        let (dt, speed_max) = (settings.dt, settings.speed_max);
        // Gravity, and a warm start that balances up to 8 times as much.
        let gain = 9.0 * settings.gravity.length() * dt;
        let mut game = Game::new(Arc::clone(&scene), 3);
        (0..8).for_each(|seat| game.join(Seat(seat)));
        let mut rng = Rng::new(3, 3);
        let mut inputs = Vec::new();
        let mut before = Vec::new();
        for tick in 0..1800 {
            if tick % 20 == 0 {
                inputs = busy_inputs(&game, &mut rng);
            }
            game.tick_watched(&inputs, &mut |phase, world| match phase {
                Phase::Inputs => {
                    before.clear();
                    let state = |id| (id, world.position(id), world.velocity(id).length());
                    before.extend(world.ids().map(state));
                }
                Phase::Relax => {
                    for &(id, place, speed) in &before {
                        let moved = (world.position(id) - place).length();
                        let correction = min(world.shape(id).thickness(), speed_max * dt);
                        let allowed = (min(speed, speed_max) + gain) * dt + correction;
                        assert!(moved <= 1.001 * allowed, "{name} at {tick}: {moved} of {allowed}");
                    }
                }
                _ => {}
            });
        }
    }
}

#[test]
fn layouts_start_free_of_overlap_and_clear_of_spawns_for_every_seed() {
    for name in ["arena", "impulse", "particles", "emitters"] {
        let mut most = 0;
        for seed in 0..50 {
            let game = built_in(name, seed);
            let bodies: Vec<SnapshotBody> = game.bodies().collect();
            most = most.max(bodies.len());
            let place = |body: &SnapshotBody| game.world().position(body.id);
            for (index, a) in bodies.iter().enumerate() {
                for b in &bodies[..index] {
                    let met = collide(a.shape, place(a), b.shape, place(b), (0, 1));
                    let deep = met.is_some_and(|contact| contact.separation < -1e-3);
                    assert!(!deep, "{name}, seed {seed}: {a:?} {b:?}");
                }
            }
            let hero = game.scene().hero.clone().expect("heroes");
            for spawn in hero.spawns {
                for body in &bodies {
                    let met = collide(hero.body.shape, spawn, body.shape, place(body), (0, 1));
                    assert!(met.is_none(), "{name}, seed {seed}: spawn {spawn} in {body:?}");
                }
            }
        }
        let scene = built_in(name, 0).scene().clone();
        let whole =
            scene.bodies.len() + scene.layouts.iter().map(|l| l.count as usize).sum::<usize>();
        assert_eq!(most, whole, "{name}: some seed places everything");
    }
}

#[test]
fn the_impulse_scene_is_the_chapters() {
    let game = built_in("impulse", 1);
    let scene = game.scene();
    assert_eq!(scene.size, Vec2::new(200.0, 112.5));
    assert_eq!(all(&game, Kind::Minion).len(), 4);
    assert!(all(&game, Kind::Platform).len() >= 7, "{}", all(&game, Kind::Platform).len());
    assert_eq!(all(&game, Kind::Wall).len(), 4);
    let hero = scene.hero.as_ref().expect("heroes");
    assert_eq!(hero.body.shape, Shape::rect(16.0, 22.0));
    assert_eq!(hero.spawns[0], Vec2::new(20.0, 30.0));
}

#[test]
fn z_sprays_one_particle_a_tick_in_the_particle_scene() {
    let mut game = built_in("particles", 1);
    game.join(FIRST);
    for count in 1..=20 {
        play(&mut game, &[Buttons::MAKE], at(100.0, 106.0));
        assert_eq!(game.world().particles().len(), count);
    }
    play(&mut game, &[], None);
    assert_eq!(game.world().particles().len(), 20);
    assert_eq!(all(&game, Kind::Marble).len(), 0);
}

#[test]
fn a_pile_of_200_rests_ten_seconds_after_a_drop_after_c_and_after_a_drag() {
    let mut game = built_in("pile", 1);
    game.join(FIRST);
    // A marble for which there is no room is made in a later tick.
    for tick in 0..800 {
        if all(&game, Kind::Marble).len() == 200 {
            break;
        }
        let (column, row) = (tick % 20, tick / 20 % 10);
        play(
            &mut game,
            &[Buttons::MAKE],
            at(20.0 + 14.5 * column as f32, 20.0 + 15.0 * row as f32),
        );
    }
    assert_eq!(all(&game, Kind::Marble).len(), 200);
    let rests = |game: &Game, after: &str| {
        let rms = rms_speed(game, Kind::Marble);
        assert!(rms < 0.05, "10 s after {after}: rms speed {rms}");
        assert!(deepest(game) < 0.05, "10 s after {after}: overlap {}", deepest(game));
    };
    idle(&mut game, 600);
    rests(&game, "the drop");
    for _ in 0..30 {
        play(&mut game, &[Buttons::AGITATE], None);
    }
    idle(&mut game, 600);
    rests(&game, "C");
    let grabbed = game.world().position(all(&game, Kind::Marble)[0]);
    for tick in 0..180 {
        let pointer = grabbed.lerp(Vec2::new(290.0, 20.0), tick as f32 / 180.0);
        play(&mut game, &[Buttons::HOLD], Some(pointer));
    }
    idle(&mut game, 600);
    rests(&game, "a drag through it");
}

#[test]
fn the_arena_burns_from_the_start_and_is_worth_a_look() {
    let mut game = built_in("arena", 1);
    game.join(FIRST);
    idle(&mut game, 300);
    let particles = game.world().particles().len();
    assert!((100..3000).contains(&particles), "{particles} particles");
    for kind in [Kind::Minion, Kind::Platform, Kind::Block, Kind::Wall, Kind::Hero] {
        assert!(!all(&game, kind).is_empty(), "{}", kind.name());
    }
}

#[test]
fn minions_of_the_bounds_scene_are_half_circles_half_boxes() {
    let mut counts = [0, 0];
    for seed in 0..100 {
        let game = built_in("bounds", seed);
        let laid_out = game.scene().bodies.len();
        for body in game.bodies().skip(laid_out).filter(|body| body.kind == Kind::Minion) {
            match body.shape {
                Shape::Circle { radius } => {
                    assert_eq!(radius, 7.0);
                    counts[0] += 1;
                }
                Shape::Box { half } => {
                    assert_eq!(half, Vec2::new(8.5, 7.0));
                    counts[1] += 1;
                }
            }
        }
    }
    assert!(counts[0] > 140 && counts[1] > 140, "{counts:?}");
}

/// Particles slide along platforms (A3.23) and heroes (A4.10, C24n).
#[test]
fn particles_stay_outside_of_platforms_and_heroes() {
    let mut game = built_in("emitters", 4);
    game.join(FIRST);
    idle(&mut game, 120);
    let platform = all(&game, Kind::Platform)[0];
    let over_platform = game.world().position(platform) + Vec2::new(0.0, 4.0);
    let over_hero = game.world().position(hero_of(&game, FIRST)) + Vec2::new(0.0, 15.0);
    for tick in 0..200 {
        let aim = if tick % 2 == 0 { over_platform } else { over_hero };
        play(&mut game, &[Buttons::MAKE], Some(aim));
        let solid = |body: &SnapshotBody| matches!(body.kind, Kind::Platform | Kind::Hero);
        for body in game.bodies().filter(solid) {
            let center = Vec2::new(body.quanta[0] as f32, body.quanta[1] as f32) / 64.0;
            let inside = |place: &&Vec2| body.shape.contains((**place - center) * 1.0001);
            let found = game.world().particles().positions().iter().find(inside);
            assert_eq!(found, None, "in {body:?}");
        }
    }
    assert!(game.world().particles().len() > 50);
}
