//! Tests minions, marbles, platforms, and the tools that act on bodies.

use super::*;

const MINION: &str = "[[bodies]]\nkind = \"minion\"\nposition = [200, 60]\nvelocity = [5, 0]\n";

#[test]
fn h_m_and_p_select_the_same_three_bodies_each_time() {
    let mut game = built_in("bounds", 3);
    game.join(FIRST);
    let selected = |game: &Game| game.players().next().expect("a player").selected;
    let hero = selected(&game).expect("the hero is selected at the start");
    assert_eq!(game.world().position(hero), Vec2::new(20.0, 30.0));
    for _ in 0..3 {
        let mut picked = Vec::new();
        for key in [Buttons::PICK_HERO, Buttons::PICK_MINION, Buttons::PICK_PLATFORM] {
            play(&mut game, &[key], None);
            play(&mut game, &[], None);
            picked.push(selected(&game).expect("a selected body"));
        }
        let places = [Vec2::new(20.0, 30.0), Vec2::new(50.0, 50.0), Vec2::new(20.0, 30.0)];
        let kinds = [Kind::Hero, Kind::Minion, Kind::Platform];
        for ((body, place), kind) in picked.into_iter().zip(places).zip(kinds) {
            assert_eq!(game.world().position(body), place);
            assert_eq!(game.bodies().find(|info| info.id == body).expect("it").kind, kind);
        }
    }
}

#[test]
fn the_left_drag_puts_the_selected_body_at_the_pointer_and_reports_its_contacts() {
    let mut game = built_in("bounds", 3);
    game.join(FIRST);
    let hero = only_selected(&game);
    for pointer in [at(150.0, 90.0), at(20.0, 30.0), at(50.0, 50.0)] {
        play(&mut game, &[Buttons::FIRE], pointer);
        assert_eq!(Some(game.world().position(hero)), pointer);
    }
    let minion = game.roster.placed[1].expect("the minion");
    let touches = |game: &Game, other: BodyId| {
        game.world()
            .touches()
            .iter()
            .any(|touch| (touch.a, touch.b) == (hero, other) || (touch.a, touch.b) == (other, hero))
    };
    assert!(touches(&game, minion), "hero and minion share a centre");
    play(&mut game, &[], at(10.0, 10.0));
    assert_eq!(game.world().position(hero), Vec2::new(50.0, 50.0), "it stays when let go");
    play(&mut game, &[Buttons::FIRE], at(199.0, 1.0));
    assert!(!touches(&game, minion));
}

#[test]
fn a_press_on_any_body_selects_it_and_keeps_its_grip() {
    let mut game = built_in("bounds", 3);
    game.join(FIRST);
    let bodies: Vec<BodyId> = game.bodies().map(|info| info.id).collect();
    assert_eq!(bodies.len(), 15);
    let mut alone = 0;
    for &body in &bodies {
        let places = |game: &Game| bodies.iter().map(|&id| game.world().position(id)).collect();
        let before: Vec<Vec2> = places(&game);
        let grip = (game.world().position(body) + 2.0).round();
        let hits =
            |id: &&BodyId| game.world().shape(**id).contains(grip - game.world().position(**id));
        if bodies.iter().filter(hits).count() > 1 {
            continue;
        }
        alone += 1;
        play(&mut game, &[Buttons::FIRE], Some(grip));
        assert_eq!(only_selected(&game), body);
        assert_eq!(places(&game), before, "nothing moves before the pointer does");
        play(&mut game, &[Buttons::FIRE], Some(grip - Vec2::new(3.0, 1.0)));
        play(&mut game, &[Buttons::FIRE], Some(grip - Vec2::new(8.0, 2.0)));
        play(&mut game, &[], Some(grip));
        let moves = places(&game).into_iter().zip(before).zip(&bodies);
        for ((now, before), &id) in moves {
            let way = if id == body { Vec2::new(-8.0, -2.0) } else { Vec2::ZERO };
            assert!((now - before - way).length() < 1e-4, "{id:?}: {before} to {now}");
        }
    }
    assert!(alone >= 10, "{alone} bodies lie alone");
}

#[test]
fn a_press_takes_the_selected_body_of_those_under_the_pointer_else_the_hero() {
    let mut game = built_in("bounds", 3);
    game.join(FIRST);
    let place = at(20.0, 30.0);
    play(&mut game, &[Buttons::PICK_PLATFORM], None);
    let platform = only_selected(&game);
    play(&mut game, &[Buttons::FIRE], place);
    assert_eq!(only_selected(&game), platform, "it stays selected");
    play(&mut game, &[Buttons::PICK_MINION], None);
    play(&mut game, &[Buttons::FIRE], place);
    assert_eq!(
        Some(only_selected(&game)),
        game.roster.placed[0],
        "the hero lies above the platform"
    );
}

fn only_selected(game: &Game) -> BodyId {
    game.players().next().and_then(|player| player.selected).expect("a selected body")
}

#[test]
fn z_drops_one_marble_a_tick_near_the_pointer() {
    let mut game = floor_with("");
    game.join(FIRST);
    play(&mut game, &[Buttons::MAKE], at(200.0, 100.0));
    let first = game.world().position(only(&game, Kind::Marble));
    assert!((first - Vec2::new(200.0, 100.0)).length() < 6.5, "at the pointer: {first}");
    for count in 2..=8 {
        play(&mut game, &[Buttons::MAKE], at(200.0, 100.0));
        let marbles = all(&game, Kind::Marble);
        assert_eq!(marbles.len(), count);
        let newest = game.world().position(marbles[count - 1]);
        assert!((newest - Vec2::new(200.0, 100.0)).length() < 60.0, "near it: {newest}");
    }
    let other_side = game.world().velocity(all(&game, Kind::Marble)[7]).x.abs();
    assert_eq!(other_side, 5.0);
}

#[test]
fn z_stops_at_the_cap_and_makes_nothing_inside_a_wall() {
    let mut game = floor_with("");
    game.join(FIRST);
    play(&mut game, &[Buttons::MAKE], at(200.0, 0.0));
    assert!(all(&game, Kind::Marble).is_empty(), "inside the floor");
    for tick in 0..900 {
        let x = 20.0 + (tick % 25) as f32 * 15.0;
        play(&mut game, &[Buttons::MAKE], at(x, 180.0));
    }
    assert_eq!(all(&game, Kind::Marble).len(), 250);
    assert!(game.world().is_finite());
}

#[test]
fn x_holds_the_grabbed_body_however_fast_the_pointer_is() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"dumb\"\nposition = [200, 60]\nvelocity = [0, 0]");
    game.join(FIRST);
    let marble = only(&game, Kind::Marble);
    play(&mut game, &[Buttons::HOLD], at(203.0, 61.0));
    assert_eq!(game.players().next().expect("a player").held, Some(marble));
    for _ in 0..120 {
        play(&mut game, &[Buttons::HOLD], at(320.0, 150.0));
    }
    let near = game.world().position(marble) - Vec2::new(320.0, 150.0);
    assert!(near.length() < 0.05, "follows the pointer: {near}");
    for _ in 0..600 {
        play(&mut game, &[Buttons::HOLD], at(320.0, 150.0));
    }
    play(&mut game, &[], None);
    let speed = game.world().velocity(marble).length();
    assert!(speed < 2.0, "gravity loads nothing while held (C44): {speed}");
    idle(&mut game, 30);
    assert!(game.world().velocity(marble).y < -10.0, "it falls again");
}

#[test]
fn x_takes_no_minion_and_nothing_that_another_player_holds() {
    let mut game = floor_with(&format!(
        "{MINION}[[bodies]]\nkind = \"dumb\"\nposition = [300, 60]\nvelocity = [0, 0]"
    ));
    game.join(FIRST);
    game.join(Seat(1));
    play(&mut game, &[Buttons::HOLD], at(200.0, 60.0));
    assert_eq!(game.players().next().expect("a player").held, None);
    let grab = |buttons: &[Buttons]| input(buttons, at(300.0, 60.0));
    game.tick(&[(FIRST, grab(&[Buttons::HOLD])), (Seat(1), grab(&[Buttons::HOLD]))]);
    let held: Vec<_> = game.players().map(|player| player.held.is_some()).collect();
    assert_eq!(held, [true, false]);
    game.leave(FIRST);
    game.tick(&[(Seat(1), grab(&[Buttons::HOLD]))]);
    assert!(game.players().next().expect("a player").held.is_some(), "free once more");
}

#[test]
fn c_adds_up_to_5_to_each_component_a_tick_while_held() {
    let mut game = floor_with("");
    game.join(FIRST);
    for x in 0..10 {
        play(&mut game, &[Buttons::MAKE], at(20.0 + 30.0 * x as f32, 150.0));
    }
    let velocities = |game: &Game| -> Vec<Vec2> {
        all(game, Kind::Marble).iter().map(|&id| game.world().velocity(id)).collect()
    };
    let before = velocities(&game);
    play(&mut game, &[Buttons::AGITATE], None);
    let gravity = Vec2::new(0.0, -25.0 / 60.0);
    let gains: Vec<Vec2> = velocities(&game)
        .iter()
        .zip(&before)
        .map(|(after, before)| *after - *before - gravity)
        .collect();
    assert!(gains.iter().all(|gain| gain.x.abs() <= 5.001 && gain.y.abs() <= 5.001));
    assert!(gains.iter().any(|gain| gain.x > 1.0) && gains.iter().any(|gain| gain.x < -1.0));
    let after_one = rms_speed(&game, Kind::Marble);
    for _ in 0..20 {
        play(&mut game, &[Buttons::AGITATE], None);
    }
    assert!(rms_speed(&game, Kind::Marble) > after_one, "holding adds more");
}

#[test]
fn v_removes_all_marbles_and_nothing_else() {
    let mut game = floor_with(MINION);
    game.join(FIRST);
    for _ in 0..30 {
        play(&mut game, &[Buttons::MAKE], at(200.0, 150.0));
    }
    play(&mut game, &[Buttons::CLEAR], None);
    assert_eq!(all(&game, Kind::Marble).len(), 0);
    assert_eq!(all(&game, Kind::Minion).len(), 1);
    assert_eq!(all(&game, Kind::Hero).len(), 1);
}

#[test]
fn minions_wander_at_their_speed_and_get_it_back_after_a_bounce() {
    let mut game = floor_with(&format!(
        "{MINION}[[bodies]]\nkind = \"platform\"\nposition = [220, 60]\nsize = [4, 40]\n\
         [[bodies]]\nkind = \"platform\"\nposition = [180, 60]\nsize = [4, 40]"
    ));
    let minion = only(&game, Kind::Minion);
    let mut turns = 0;
    let mut before = game.world().velocity(minion).x;
    for _ in 0..3600 {
        idle(&mut game, 1);
        let now = game.world().velocity(minion).x;
        turns += u32::from(now * before < 0.0);
        before = now;
        assert!(deepest(&game) < 0.1, "no visible overlap: {}", deepest(&game));
    }
    assert!(turns >= 10, "it goes to and fro: {turns} turns in a minute");
    idle(&mut game, 20);
    let speed = game.world().velocity(minion).length();
    assert!((4.0..5.01).contains(&speed), "speed {speed}");
}

#[test]
fn a_minion_pinned_by_a_hero_wanders_on_when_the_hero_is_gone() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"minion\"\nposition = [60, 10.1]\nvelocity = [0, -5]");
    game.join(FIRST);
    idle(&mut game, 240);
    game.leave(FIRST);
    idle(&mut game, 120);
    let minion = only(&game, Kind::Minion);
    let speed = game.world().velocity(minion).length();
    assert!((speed - 5.0).abs() < 0.1, "speed {speed}");
}

#[test]
fn a_hero_and_a_minion_exchange_momentum() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"minion\"\nposition = [140, 60]\nvelocity = [-5, 0]");
    game.join(FIRST);
    let (hero, minion) = (hero_of(&game, FIRST), only(&game, Kind::Minion));
    game.world.set_gravity_scale(hero, 0.0);
    game.world.set_position(hero, Vec2::new(100.0, 60.0));
    game.world.set_velocity(hero, Vec2::new(40.0, 0.0));
    let momentum =
        |game: &Game| game.world().velocity(hero) * 0.7 + game.world().velocity(minion) * 2.0;
    let before = momentum(&game);
    let mut met = false;
    for _ in 0..60 {
        idle(&mut game, 1);
        if game.world().touches().iter().any(|touch| touch.began) {
            assert!((momentum(&game) - before).length() < 1e-3, "{} {before}", momentum(&game));
            assert!(game.world().velocity(hero).x < 20.0);
            assert!(game.world().velocity(minion).x > -1.0);
            met = true;
            break;
        }
    }
    assert!(met);
}

#[test]
fn marbles_fall_through_heroes_minions_and_packs_onto_the_floor() {
    let mut game = floor_with(
        "[[bodies]]\nkind = \"dumb\"\nposition = [60, 60]\nvelocity = [0, 0]\n\
         [[bodies]]\nkind = \"minion\"\nposition = [60, 45]\nvelocity = [0, 0]",
    );
    game.join(FIRST);
    let marble = only(&game, Kind::Marble);
    for _ in 0..1500 {
        idle(&mut game, 1);
        assert_eq!(game.world().position(marble).x, 60.0, "nothing but the floor is met");
    }
    let y = game.world().position(marble).y;
    assert!((y - 10.0).abs() < 0.1, "on the floor: {y}");
    assert_eq!(game.world().gravity_scale(marble), 0.5);
}

#[test]
fn a_pile_settles_and_settles_again_after_c_and_after_a_drag() {
    let mut game = built_in("impulse", 5);
    game.join(FIRST);
    for tick in 0..40 {
        play(&mut game, &[Buttons::MAKE], at(40.0 + 3.0 * tick as f32, 100.0));
    }
    idle(&mut game, 600);
    let settled = rms_speed(&game, Kind::Marble);
    assert!(settled < 0.05, "10 s after the drop: {settled}");
    for _ in 0..30 {
        play(&mut game, &[Buttons::AGITATE], None);
    }
    assert!(rms_speed(&game, Kind::Marble) > 2.0);
    idle(&mut game, 600);
    let settled = rms_speed(&game, Kind::Marble);
    assert!(settled < 0.05, "10 s after C: {settled}");
    let grabbed = game.world().position(all(&game, Kind::Marble)[0]);
    play(&mut game, &[Buttons::HOLD], Some(grabbed));
    for tick in 0..120 {
        let x = 20.0 + 1.3 * tick as f32;
        play(&mut game, &[Buttons::HOLD], at(x, 20.0));
    }
    idle(&mut game, 600);
    let settled = rms_speed(&game, Kind::Marble);
    assert!(settled < 0.05, "10 s after a drag: {settled}");
    assert!(deepest(&game) < 0.1, "{}", deepest(&game));
}

#[test]
fn a_lift_is_at_its_turning_points_at_the_very_tick_and_carries_a_rider() {
    let mut game = floor_with(
        "[[bodies]]\nkind = \"platform\"\nsize = [60, 3]\n\
         path = [[60, 12], [60, 52], [80, 52]]\nperiod = 6",
    );
    game.join(FIRST);
    let lift = only(&game, Kind::Platform);
    idle(&mut game, 120);
    let gap = |place: Vec2, x: f32, y: f32| (place - Vec2::new(x, y)).length();
    assert!(gap(game.world().position(lift), 60.0, 52.0) < 1e-4);
    let hero = hero_of(&game, FIRST);
    let stand = 52.0 + 1.5 + 11.0;
    assert!((game.world().position(hero).y - stand).abs() < 1.0, "the hero rides");
    idle(&mut game, 60);
    assert!(gap(game.world().position(lift), 80.0, 52.0) < 1e-4);
    idle(&mut game, 180 + 360 * 9);
    assert!(gap(game.world().position(lift), 60.0, 12.0) < 1e-4, "after ten rounds");
}

#[test]
fn hard_contacts_are_reported_once() {
    let mut game = game_of(&format!("impact_speed = 30\n{FLOOR}"));
    game.join(FIRST);
    let mut speeds = Vec::new();
    for _ in 0..200 {
        idle(&mut game, 1);
        speeds.extend(game.events().iter().filter_map(|event| match *event {
            Event::Impact { speed, point, .. } => Some((speed, point)),
            _ => None,
        }));
    }
    assert_eq!(speeds.len(), 1, "{speeds:?}");
    assert!((speeds[0].0 - 39.17).abs() < 0.1, "47 ticks of fall: {speeds:?}");
    assert!((speeds[0].1.y - 3.5).abs() < 0.5, "on the floor: {speeds:?}");
}

#[test]
fn marbles_are_made_where_they_touch_nothing() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"platform\"\nposition = [200, 60]\nsize = [200, 1]");
    game.join(FIRST);
    let mut count = 0;
    for _ in 0..120 {
        play(&mut game, &[Buttons::MAKE], at(200.0, 61.0));
        let marbles = all(&game, Kind::Marble);
        if marbles.len() > count {
            count = marbles.len();
            let newest = marbles[count - 1];
            let place = game.world().position(newest);
            assert!(place.y > 67.0, "above the platform, as the pointer is: {place}");
            for &other in &marbles[..count - 1] {
                let distance = (game.world().position(other) - place).length();
                assert!(distance > 12.9, "{distance} from another one");
            }
        }
    }
    assert!(count > 15, "they pour out: {count}");
}

#[test]
fn marbles_made_in_a_corner_stay_in_the_world() {
    for (number, corner) in [(6.0, 6.0), (314.0, 6.0), (6.0, 174.0), (314.0, 174.0), (4.5, 90.0)]
        .into_iter()
        .enumerate()
    {
        for agitated in [false, true] {
            let mut game = built_in("pile", number as u64);
            game.join(FIRST);
            for tick in 0..900 {
                let mut buttons = vec![Buttons::MAKE];
                if agitated && tick % 3 == 0 {
                    buttons.push(Buttons::AGITATE);
                }
                play(&mut game, &buttons, at(corner.0, corner.1));
                for marble in all(&game, Kind::Marble) {
                    let place = game.world().position(marble);
                    let inside = (4.0..316.0).contains(&place.x) && (4.0..176.0).contains(&place.y);
                    assert!(inside, "{corner:?}, {agitated}, tick {tick}: {place}");
                }
            }
        }
    }
}
