//! Tests heroes: thrust, the fall to the floor (A2.30), and spawn positions.

use super::*;

#[test]
fn wasd_changes_the_velocity_by_the_thrust_of_a_tick() {
    let mut game = floor_with("");
    game.join(FIRST);
    let hero = hero_of(&game, FIRST);
    for tick in 1..=20 {
        play(&mut game, &[Buttons::RIGHT], None);
        let velocity = game.world().velocity(hero);
        assert!((velocity.x - tick as f32).abs() < 1e-4, "60 units/s^2: {velocity}");
    }
    let before = game.world().velocity(hero);
    play(&mut game, &[Buttons::UP, Buttons::LEFT], None);
    let gain = game.world().velocity(hero) - before;
    assert!((gain - Vec2::new(-1.0, 2.0 - 50.0 / 60.0)).length() < 1e-4, "{gain}");
    let before = game.world().velocity(hero);
    play(&mut game, &[Buttons::LEFT, Buttons::RIGHT], None);
    assert_eq!(game.world().velocity(hero).x, before.x, "opposite keys cancel");
}

#[test]
fn thrust_adds_nothing_past_the_speed_cap_but_a_faster_hero_is_not_braked() {
    let mut game = floor_with("");
    game.join(FIRST);
    let hero = hero_of(&game, FIRST);
    for _ in 0..120 {
        play(&mut game, &[Buttons::UP], None);
        assert!(game.world().velocity(hero).length() <= 80.0 + 1.0);
    }
    game.world.set_velocity(hero, Vec2::new(120.0, 0.0));
    game.world.set_gravity_scale(hero, 0.0);
    play(&mut game, &[Buttons::RIGHT], None);
    assert!((game.world().velocity(hero).x - 120.0).abs() < 1e-3);
}

/// The hero makes contact in ticks 47, 75 and 83, and is at rest from tick 90 on (A2.30, with uniform gravity: C18).
#[test]
fn the_hero_falls_bounces_twice_and_rests() {
    let mut game = floor_with("");
    game.join(FIRST);
    let hero = hero_of(&game, FIRST);
    let mut began = Vec::new();
    let mut velocity_after_first = 0.0;
    for tick in 1..=600 {
        idle(&mut game, 1);
        let touch = game.world().touches().iter().find(|touch| touch.began);
        let velocity = game.world().velocity(hero).y;
        let bounced = touch.is_some_and(|touch| touch.closing > 2.0);
        if bounced {
            began.push(tick);
        }
        if began.len() == 1 && bounced {
            velocity_after_first = velocity;
        }
        if tick >= 90 {
            assert!(velocity.abs() < 1e-3, "tick {tick}: still moves at {velocity}");
            let y = game.world().position(hero).y;
            assert!((y - 14.495).abs() < 1e-3, "tick {tick}: y = {y}");
        }
    }
    assert_eq!(began, [47, 75, 83]);
    assert!((velocity_after_first - 11.75).abs() < 0.005, "leaves at {velocity_after_first}");
}

#[test]
fn a_sliding_hero_stops_where_coulomb_says() {
    let mut game = floor_with("");
    game.join(FIRST);
    let hero = hero_of(&game, FIRST);
    idle(&mut game, 120);
    for _ in 0..60 {
        play(&mut game, &[Buttons::RIGHT], None);
    }
    let (start, speed) = (game.world().position(hero).x, game.world().velocity(hero).x);
    assert!((speed - 45.0).abs() < 0.5, "60 of thrust less 15 of friction: {speed}");
    idle(&mut game, 300);
    assert!(game.world().velocity(hero).length() < 1e-3, "it stands");
    let slid = game.world().position(hero).x - start;
    let expected = speed * speed / (2.0 * 0.3 * 50.0);
    assert!((slid / expected - 1.0).abs() < 0.01, "slid {slid} of {expected}");
}

#[test]
fn a_hero_appears_at_the_next_clear_spawn_point() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"minion\"\nposition = [62, 30]\nvelocity = [0, 0]");
    game.join(FIRST);
    assert_eq!(game.world().position(hero_of(&game, FIRST)), Vec2::new(100.0, 30.0));
}

#[test]
fn heroes_beyond_the_spawn_points_find_free_positions() {
    let mut game = floor_with("");
    for seat in 0..12 {
        game.join(Seat(seat));
    }
    idle(&mut game, 30);
    let heroes = all(&game, Kind::Hero);
    assert_eq!(heroes.len(), 12);
    let mut game = floor_with("");
    for seat in 0..12 {
        game.join(Seat(seat));
    }
    game.tick(&[]);
    assert!(deepest(&game) < 0.1, "no hero starts inside another: {}", deepest(&game));
}

#[test]
fn a_hero_that_leaves_the_world_is_reported_and_comes_back() {
    let mut game = floor_with("");
    game.join(FIRST);
    let lost = hero_of(&game, FIRST);
    game.world.set_position(lost, Vec2::new(60.0, -120.0));
    game.tick(&[]);
    let left = game.events().iter().find_map(|event| match *event {
        Event::BodyLeft { kind, body, point } => Some((kind, body, point)),
        _ => None,
    });
    let (kind, body, point) = left.expect("an event");
    assert_eq!((kind, body), (Kind::Hero, lost));
    assert!((point - Vec2::new(60.0, -120.0)).length() < 1.0);
    assert_eq!(game.players().next().expect("a player").hero, None);
    idle(&mut game, crate::heroes::RESPAWN_TICKS + 1);
    assert_ne!(hero_of(&game, FIRST), lost);
}

/// A game with a walking hero on the floor of [`FLOOR`], and a lift.
fn walker(more: &str) -> Game {
    let text =
        FLOOR.replace("[hero]\n", "[hero]\nsize = [8, 11]\nwalk = { speed = 25, jump = 40 }\n");
    game_of(&format!("{text}\n{more}"))
}

#[test]
fn a_hero_that_walks_runs_at_its_speed_and_stops() {
    let mut game = walker("");
    game.join(FIRST);
    idle(&mut game, 120);
    let hero = hero_of(&game, FIRST);
    (0..30).for_each(|_| play(&mut game, &[Buttons::RIGHT], None));
    let speed = game.world().velocity(hero).x;
    assert!((speed - 25.0).abs() < 0.5, "{speed}");
    idle(&mut game, 30);
    assert_eq!(game.world().velocity(hero).x, 0.0);
}

#[test]
fn a_hero_jumps_only_off_what_it_stands_on_and_16_high() {
    let mut game = walker("");
    game.join(FIRST);
    idle(&mut game, 120);
    let hero = hero_of(&game, FIRST);
    let ground = game.world().position(hero).y;
    let (mut top, mut jumps, mut rising) = (0.0f32, 0, false);
    for _ in 0..250 {
        play(&mut game, &[Buttons::UP], None);
        top = max(top, game.world().position(hero).y - ground);
        let rises = game.world().velocity(hero).y > 0.0;
        jumps += u32::from(rises && !rising);
        rising = rises;
    }
    assert!((15.0..16.5).contains(&top), "{top}");
    assert_eq!(jumps, 3, "each jump takes 1.6 s");
}

#[test]
fn a_hero_is_carried_by_what_it_stands_on() {
    let lift =
        "[[bodies]]\nkind = \"platform\"\nsize = [30, 3]\npath = [[60, 22], [120, 22]]\nperiod = 6";
    let mut game = walker(lift);
    game.join(FIRST);
    let away = |game: &Game| {
        let lift = game.roster.placed[1].expect("a lift");
        game.world().position(hero_of(game, FIRST)).x - game.world().position(lift).x
    };
    idle(&mut game, 100);
    let before = away(&game);
    idle(&mut game, 500);
    // Where the lift turns around, the hero slips while catching up, once to each side.
    assert!((away(&game) - before).abs() < 3.0, "{before} became {}", away(&game));
}

#[test]
fn a_restored_hero_stays_on_its_lane_without_rules() {
    let lane = FLOOR.replace("[hero]", "[hero]\nlane = \"x\"\nthrust = [300, 300]");
    let mut game = game_of(&lane);
    game.join(FIRST);
    idle(&mut game, 70);
    let mut restored =
        Game::restore(Arc::clone(game.scene()), &game.save()).expect("its own state");
    for game in [&mut game, &mut restored] {
        (0..30).for_each(|_| play(game, &[Buttons::RIGHT, Buttons::UP], None));
    }
    assert_eq!(game.first_difference(&restored), None);
    let place = game.world().position(hero_of(&game, FIRST));
    assert!((place.y - 30.0).abs() < 0.1 && place.x > 65.0, "{place}");
}
