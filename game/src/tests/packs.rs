//! Tests how dye packs chase, push and burst, and how heroes find cover from them.

use super::*;

/// Angle from `front` to `way`, radians, signed.
fn angle(front: Vec2, way: Vec2) -> f32 {
    jostle_sim::math::atan2(front.perp_dot(way), front.dot(way))
}

fn hits(game: &Game) -> Vec<(Seat, Option<Seat>, Vec2)> {
    let hit = |event: &Event| match *event {
        Event::PackHit { owner, victim, point, .. } => Some((owner?, victim, point)),
        _ => None,
    };
    game.events().iter().filter_map(hit).collect()
}

#[test]
fn a_click_launches_one_pack_at_the_pointer_and_it_comes_nearer() {
    let mut game = floor_with("");
    game.join(FIRST);
    idle(&mut game, 120);
    play(&mut game, &[Buttons::FIRE], at(200.0, 100.0));
    let pack = only(&game, Kind::Pack);
    assert_eq!(game.world().position(pack), Vec2::new(200.0, 100.0));
    let hero = hero_of(&game, FIRST);
    let distance =
        |game: &Game| (game.world().position(pack) - game.world().position(hero)).length();
    let mut before = distance(&game);
    for tick in 0..100 {
        play(&mut game, &[Buttons::FIRE], at(200.0, 100.0));
        assert_eq!(only(&game, Kind::Pack), pack, "held down makes no more");
        if tick > 5 {
            assert!(distance(&game) < before - 0.4, "tick {tick}: 30 units/s towards the hero");
        }
        before = distance(&game);
    }
}

#[test]
fn a_pack_turns_by_four_fifths_of_the_angle_each_tick() {
    let mut game = floor_with("");
    game.join(FIRST);
    idle(&mut game, 120);
    play(&mut game, &[Buttons::FIRE], at(150.0, 100.0));
    let (pack, hero) = (only(&game, Kind::Pack), hero_of(&game, FIRST));
    for _ in 0..3 {
        let front = game.world().velocity(pack);
        let way = game.world().position(hero) - game.world().position(pack);
        idle(&mut game, 1);
        let left = angle(game.world().velocity(pack), way);
        let expected = 0.2 * angle(front, way);
        assert!((left - expected).abs() < 1e-3, "{left} is left of {expected}");
        assert!((game.world().velocity(pack).length() - 30.0).abs() < 1e-3);
    }
}

#[test]
fn a_pack_lives_300_ticks() {
    let mut game = floor_with("");
    game.join(FIRST);
    play(&mut game, &[Buttons::FIRE], at(395.0, 195.0));
    idle(&mut game, 299);
    assert_eq!(all(&game, Kind::Pack).len(), 1);
    idle(&mut game, 1);
    assert_eq!(all(&game, Kind::Pack).len(), 0);
}

#[test]
fn a_pack_that_touches_the_hero_bursts_into_200_particles_there() {
    let mut game = built_in("emitters", 1);
    game.join(FIRST);
    idle(&mut game, 60);
    let hero = hero_of(&game, FIRST);
    let place = game.world().position(hero);
    play(&mut game, &[Buttons::FIRE], Some(place + Vec2::new(16.0, 0.0)));
    let mut made = 0;
    let mut curve = Vec::new();
    let mut touched = None;
    for _ in 0..400 {
        idle(&mut game, 1);
        if let Some(&(owner, victim, point)) = hits(&game).first() {
            assert_eq!((owner, victim), (FIRST, Some(FIRST)));
            assert!(matches!(game.events().last(), Some(Event::EmitterStarted(emitter))
                if emitter.count == 200 && emitter.source == Source::Point(point)));
            assert_eq!(all(&game, Kind::Pack).len(), 0);
            touched = Some(point);
            made = game.world().particles().len();
        }
        if touched.is_some() {
            curve.push(game.world().particles().len());
        }
    }
    let point = touched.expect("a hit");
    let away = (point - game.world().position(hero)).abs();
    assert!(away.x <= 8.01 && away.y <= 11.01, "on the hero: {away}");
    assert!(made >= 5, "emission starts in the tick of the hit");
    let peak = curve.iter().copied().max().expect("a curve");
    let peak_at = curve.iter().position(|&count| count == peak).expect("a peak");
    assert!((150..=200).contains(&peak), "{peak} particles");
    assert!((15..=60).contains(&peak_at), "rises over about 0.6 s: {peak_at} ticks");
    assert_eq!(*curve.last().expect("a curve"), 0, "and fades");
    assert_eq!(game.players().next().expect("a player").score, 0, "the own hero is no score");
}

#[test]
fn a_pack_slides_along_a_platform_and_stays_outside() {
    let mut game =
        floor_with("[[bodies]]\nkind = \"platform\"\nposition = [140, 50]\nsize = [60, 3]");
    game.join(FIRST);
    game.join(Seat(1));
    idle(&mut game, 120);
    game.leave(Seat(1));
    play(&mut game, &[Buttons::FIRE], at(165.0, 70.0));
    let (pack, platform) = (only(&game, Kind::Pack), only(&game, Kind::Platform));
    let mut on_top = 0;
    for _ in 0..280 {
        idle(&mut game, 1);
        if !game.world().contains(pack) {
            break;
        }
        let place = game.world().position(pack) - game.world().position(platform);
        assert!(deepest(&game) < 0.02, "inside the platform: {}", deepest(&game));
        on_top += u32::from(place.x.abs() < 31.5 && (2.9..3.1).contains(&place.y));
    }
    assert!(on_top > 10, "it skirts the edge: {on_top} ticks");
}

#[test]
fn one_pack_moves_a_minion_a_little_and_three_move_it_more() {
    let shift = |packs: usize| {
        let mut game =
            floor_with("[[bodies]]\nkind = \"minion\"\nposition = [200, 100]\nvelocity = [0, 0]");
        game.join(FIRST);
        game.world.set_gravity_scale(hero_of(&game, FIRST), 0.0);
        game.world.set_position(hero_of(&game, FIRST), Vec2::new(360.0, 100.0));
        for index in 0..packs {
            play(&mut game, &[Buttons::FIRE], at(170.0, 96.0 + 4.0 * index as f32));
            play(&mut game, &[], None);
        }
        idle(&mut game, 80);
        game.world().position(only(&game, Kind::Minion)).x - 200.0
    };
    let (one, three) = (shift(1), shift(3));
    assert!(one > 0.0 && three > 1.5 * one, "one pack: {one}, three: {three}");
    assert!(one < 10.0, "a pack is light: {one}");
}

/// The scores for hitting a player who sends inputs and one who sends none.
fn points_for_a_hit(rules: &str) -> [u16; 2] {
    [true, false].map(|is_there| {
        let mut game = floor_with(rules);
        for seat in 0..3 {
            game.join(Seat(seat));
        }
        let rest = [Seat(1), Seat(2)].map(|seat| (seat, Input::default()));
        let mut tick = |buttons: &[Buttons], pointer| {
            let all = [&[(FIRST, input(buttons, pointer))], &rest[..]].concat();
            game.tick(if is_there { &all } else { &all[..1] });
            hits(&game).len()
        };
        (0..120).for_each(|_| _ = tick(&[], None));
        tick(&[Buttons::FIRE], at(75.0, 40.0));
        assert_eq!((0..299).map(|_| tick(&[], None)).sum::<usize>(), 1);
        game.players().next().expect("a player").score
    })
}

#[test]
fn a_hit_on_an_absent_player_scores_nothing() {
    assert_eq!(points_for_a_hit(""), [1, 0]);
    assert_eq!(
        points_for_a_hit(
            "[round]\ncountdown = 0\n[[rules]]\nburst = true\nscore = 3\nto = \"by\"\n"
        ),
        [3, 0]
    );
}

#[test]
fn packs_chase_the_nearest_hero_of_another_player() {
    let mut game = floor_with("");
    for seat in 0..3 {
        game.join(Seat(seat));
    }
    idle(&mut game, 120);
    let [own, near] = [0, 1].map(|seat| game.world().position(hero_of(&game, Seat(seat))));
    assert!(own.x < near.x);
    play(&mut game, &[Buttons::FIRE], Some(own + Vec2::new(0.0, 12.0)));
    let mut struck = Vec::new();
    for _ in 0..299 {
        idle(&mut game, 1);
        struck.extend(hits(&game));
    }
    assert_eq!(struck.len(), 1);
    assert_eq!((struck[0].0, struck[0].1), (FIRST, Some(Seat(1))));
}

#[test]
fn packs_of_a_player_are_capped() {
    let mut game = floor_with("");
    game.join(FIRST);
    game.join(Seat(1));
    for _ in 0..20 {
        play(&mut game, &[Buttons::FIRE], at(390.0, 190.0));
        play(&mut game, &[], None);
    }
    assert_eq!(all(&game, Kind::Pack).len(), 8);
}

/// All packs that burst in the same tick are handled (C24d), each at its own contact point (C24j).
#[test]
fn two_packs_that_hit_in_one_tick_burst_at_two_points() {
    let mut game = built_in("emitters", 1);
    game.join(FIRST);
    idle(&mut game, 120);
    let place = game.world().position(hero_of(&game, FIRST));
    for side in [-12.0, 12.0] {
        play(&mut game, &[Buttons::FIRE], Some(place + Vec2::new(side, 0.0)));
        play(&mut game, &[], None);
    }
    let packs = all(&game, Kind::Pack);
    assert_eq!(packs.len(), 2);
    for (&pack, side) in packs.iter().zip([-8.5, 8.5]) {
        game.world.set_position(pack, place + Vec2::new(side, 0.0));
    }
    idle(&mut game, 1);
    let points: Vec<f32> = hits(&game).iter().map(|(_, _, point)| point.x - place.x).collect();
    assert_eq!(points.len(), 2);
    assert!((points[0] + 8.0).abs() < 0.6 && (points[1] - 8.0).abs() < 0.6, "{points:?}");
    assert_eq!(game.world().particles().emitter_count(), 2);
}

#[test]
fn packs_of_one_age_wear_out_together() {
    let mut game = floor_with("");
    game.join(FIRST);
    game.join(Seat(1));
    let click = input(&[Buttons::FIRE], at(390.0, 190.0));
    game.tick(&[(FIRST, click), (Seat(1), click)]);
    idle(&mut game, 299);
    assert_eq!(all(&game, Kind::Pack).len(), 2);
    idle(&mut game, 1);
    assert_eq!(all(&game, Kind::Pack).len(), 0);
}

/// In the chapter, the minion continues at 4.57 of its 5 units/s. Here the pack's own motion also strikes it,
/// which briefly slows it down to 2 units/s.
#[test]
fn one_pack_turns_no_minion_round() {
    for height in [98.0, 100.0, 103.0] {
        let mut game =
            floor_with("[[bodies]]\nkind = \"minion\"\nposition = [200, 100]\nvelocity = [-5, 0]");
        game.join(FIRST);
        game.world.set_gravity_scale(hero_of(&game, FIRST), 0.0);
        game.world.set_position(hero_of(&game, FIRST), Vec2::new(360.0, 100.0));
        let minion = only(&game, Kind::Minion);
        play(&mut game, &[Buttons::FIRE], at(170.0, height));
        for tick in 0..290 {
            idle(&mut game, 1);
            let speed = game.world().velocity(minion).x;
            assert!((-6.0..-1.99).contains(&speed), "{height}, tick {tick}: {speed}");
        }
        assert!((game.world().velocity(minion).length() - 5.0).abs() < 0.5, "it recovers");
    }
}

/// A minion at (200, 100), and a floating hero far to its right.
fn chased_past_a_minion(solver: &str, minion: &str, velocity: Vec2) -> Game {
    let mut game = game_of(&format!(
        "solver = \"{solver}\"\n{FLOOR}\n[[bodies]]\nkind = \"minion\"\nposition = [200, 100]\n\
         velocity = [{}, {}]\n{minion}",
        velocity.x, velocity.y
    ));
    game.join(FIRST);
    let hero = hero_of(&game, FIRST);
    game.world.set_gravity_scale(hero, 0.0);
    game.world.set_position(hero, Vec2::new(380.0, 100.0));
    game
}

/// Launches packs to the left of the minion, one above the other, and lets them push until shortly before they wear
/// out. Returns the minion's distance from its undisturbed path.
fn push(game: &mut Game, velocity: Vec2, packs: usize) -> f32 {
    let minion = only(game, Kind::Minion);
    let lowest = 100.0 - 2.0 * (packs - 1) as f32;
    for index in 0..packs {
        play(game, &[Buttons::FIRE], at(170.0, lowest + 4.0 * index as f32));
        play(game, &[], None);
    }
    while game.tick_count() < 299 {
        idle(game, 1);
        assert_eq!(all(game, Kind::Pack).len(), packs, "none bursts");
        let copy = Game::restore(Arc::clone(game.scene()), &game.save()).expect("what it saved");
        assert_eq!((game.hash(), game.first_difference(&copy)), (copy.hash(), None));
    }
    let way = velocity * (game.tick_count() as f32 * jostle_sim::DT);
    (game.world().position(minion) - Vec2::new(200.0, 100.0) - way).length()
}

#[test]
fn one_pack_hardly_moves_a_minion_at_rest_slow_or_fast() {
    let ways = [
        Vec2::ZERO,
        Vec2::new(0.2, 0.0),
        Vec2::new(-0.2, 0.0),
        Vec2::new(1.0, 0.0),
        Vec2::new(-1.0, 0.0),
        Vec2::new(0.0, 1.0),
        Vec2::new(-2.0, 1.0),
        Vec2::new(5.0, 0.0),
        Vec2::new(-5.0, 0.0),
        Vec2::new(20.0, 0.0),
        Vec2::new(-20.0, 0.0),
    ];
    for solver in ["relaxation", "conjugate"] {
        for minion in ["", "mass = 10", "size = [10, 14]", "restitution = 0"] {
            for velocity in ways {
                let mut game = chased_past_a_minion(solver, minion, velocity);
                let way = push(&mut game, velocity, 1);
                let most = if solver == "relaxation" { 2.0 } else { 2.5 };
                assert!(way > 0.0 && way < most, "{solver}, {minion}, {velocity}: {way}");
                idle(&mut game, 60);
                let after = game.world().velocity(only(&game, Kind::Minion));
                assert!((after - velocity).length() < 1e-3, "{velocity} became {after}");
            }
        }
    }
}

#[test]
fn many_packs_move_a_minion_which_then_rests_again() {
    for solver in ["relaxation", "conjugate"] {
        for (packs, least, most) in [(2, 0.8, 3.0), (3, 1.5, 10.0), (8, 15.0, 90.0)] {
            let mut game = chased_past_a_minion(solver, "size = [10, 40]", Vec2::ZERO);
            let way = push(&mut game, Vec2::ZERO, packs);
            assert!((least..most).contains(&way), "{solver}, {packs} packs: {way}");
            idle(&mut game, 60);
            assert_eq!(game.world().velocity(only(&game, Kind::Minion)), Vec2::ZERO);
        }
    }
}

#[test]
fn a_minion_that_starts_at_rest_and_has_weight_falls_freely() {
    let mut game = chased_past_a_minion("relaxation", "gravity_scale = 1", Vec2::ZERO);
    idle(&mut game, 30);
    let velocity = game.world().velocity(only(&game, Kind::Minion));
    assert!((velocity - Vec2::new(0.0, -25.0)).length() < 0.01, "{velocity}");
}

#[test]
fn a_pack_that_meets_a_platform_almost_squarely_skirts_it_too() {
    for aside in [5.0, 12.0] {
        let mut game =
            floor_with("[[bodies]]\nkind = \"platform\"\nposition = [140, 50]\nsize = [90, 3]");
        game.join(FIRST);
        let hero = hero_of(&game, FIRST);
        idle(&mut game, 120);
        let under = game.world().position(hero);
        game.world.set_position(hero, Vec2::new(140.0 + aside, under.y));
        play(&mut game, &[Buttons::FIRE], at(140.0, 70.0));
        let pack = only(&game, Kind::Pack);
        idle(&mut game, 280);
        let left = game.world().position(pack).x - game.world().position(hero).x;
        assert!(left.abs() < aside / 8.0, "{aside}: {left} from the point nearest to the hero");
    }
}

/// A game of [`FLOOR`] in which players throw packs.
fn throwing() -> Game {
    let mut game = floor_with("[pack]\nthrow_every = 0.5\npush = 40\nturn = 0.1");
    game.join(FIRST);
    game.join(Seat(1));
    idle(&mut game, 120);
    game
}

#[test]
fn a_thrown_pack_starts_at_the_hero_and_a_click_on_somebody_far_away_hits_nobody() {
    let mut game = throwing();
    let (thrower, other) = (hero_of(&game, FIRST), hero_of(&game, Seat(1)));
    let (from, target) = (game.world().position(thrower), game.world().position(other));
    play(&mut game, &[Buttons::FIRE], Some(target));
    let pack = only(&game, Kind::Pack);
    let way = game.world().position(pack) - from;
    assert!((way - Vec2::new(9.5, 0.0)).length() < 0.01, "{way}: beside the hero");
    assert!(hits(&game).is_empty());
    let distance = target.x - from.x - 9.5 - 9.5;
    let mut ticks = 0;
    while hits(&game).is_empty() {
        play(&mut game, &[], None);
        ticks += 1;
        assert!(ticks < 200, "it hits nobody");
    }
    assert!((ticks as f32 * 0.5 - distance).abs() < 2.0, "{ticks} ticks for {distance} units");
    assert!(game.world().velocity(other).x > 35.0, "the hero is pushed");
}

#[test]
fn throws_have_a_pause_between_them_also_when_restored() {
    let mut game = throwing();
    let mut thrown = Vec::new();
    for tick in 0..100 {
        play(&mut game, &[Buttons::FIRE], at(60.0, 190.0));
        let scene = Arc::clone(game.scene());
        let restored = Game::restore(scene, &game.save()).expect("its own state");
        assert_eq!(restored.hash(), game.hash());
        game = restored;
        let young = |game: &Game| game.roster.players[0].throw_wait == 30;
        if young(&game) {
            thrown.push(tick);
        }
    }
    assert_eq!(thrown, [0, 30, 60, 90]);
}

#[test]
fn nobody_is_hit_by_a_pack_that_they_threw() {
    let mut game = floor_with("[pack]\nthrow_every = 0.5");
    game.join(FIRST);
    for _ in 0..400 {
        play(&mut game, &[Buttons::FIRE], at(60.0, 190.0));
        assert!(hits(&game).is_empty());
    }
}

#[test]
fn a_launcher_makes_packs_of_nobody_that_chase_every_hero() {
    let mut game = floor_with(
        "[[launchers]]\nposition = [160, 60]\nevery = 0.5\nstart = 0.1\nlimit = 3\nvelocity = [0, 1]",
    );
    idle(&mut game, 6);
    assert!(all(&game, Kind::Pack).is_empty(), "the first comes after a tenth of a second");
    idle(&mut game, 1);
    let pack = only(&game, Kind::Pack);
    assert_eq!(game.world().velocity(pack), Vec2::new(0.0, 30.0), "it sets off upwards");
    idle(&mut game, 200);
    assert_eq!(all(&game, Kind::Pack).len(), 3, "its limit");
    game.join(FIRST);
    let (mut found, mut score) = (0, 0);
    for _ in 0..400 {
        idle(&mut game, 1);
        let hit = |event: &&Event| {
            matches!(event, Event::PackHit { owner: None, victim: Some(FIRST), .. })
        };
        found += game.events().iter().filter(hit).count();
        score += game.players().map(|player| player.score).sum::<u16>();
    }
    assert!(found >= 3, "{found} hits");
    assert_eq!(score, 0, "nobody scores with them");
}

#[test]
fn a_launcher_of_marbles_skips_its_turn_while_its_place_is_taken() {
    let mut game =
        floor_with("[[launchers]]\nposition = [260, 11]\nevery = 0.1\nwhat = \"dumb\"\nlimit = 20");
    idle(&mut game, 60);
    assert_eq!(all(&game, Kind::Marble).len(), 1, "the first one lies there");
}

#[test]
fn a_hit_in_splash_throws_a_standing_hero_aside() {
    let mut game = built_in("splash", 1);
    game.join(FIRST);
    game.join(Seat(1));
    // Past the countdown, until both stand.
    idle(&mut game, 300);
    let hero = hero_of(&game, FIRST);
    let stands = game.world().position(hero);
    let fire = Input::new(Buttons::FIRE, Some(stands + Vec2::new(16.0, 0.0)));
    game.tick(&[(Seat(1), fire)]);
    let mut ticks = 0;
    while !hits(&game).iter().any(|(_, victim, _)| *victim == Some(FIRST)) {
        game.tick(&[]);
        ticks += 1;
        assert!(ticks < 300, "a pack that chases the hero hits it");
    }
    let hit = game.world().position(hero);
    idle(&mut game, 15);
    let moved = (game.world().position(hero) - hit).length();
    assert!(moved > 3.0, "{moved} world units in a quarter of a second");
}
