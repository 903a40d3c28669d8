//! The shipped games, played by simulated players who react to what they see. Each game can be won, and a player who
//! does nothing loses.

use super::*;
use crate::roster::Rule;
use crate::rules::RoundPhase;
use crate::side::Side;

/// Number of ticks within which every game must end.
const TICKS_MAX: u32 = 20_000;

/// The keys that take a hero to a position, moving only as fast as it can still stop there.
fn keys_to(game: &Game, hero: BodyId, place: Vec2) -> Buttons {
    let away = place - game.world().position(hero);
    let velocity = game.world().velocity(hero);
    let fall = if game.world().gravity_scale(hero) == 0.0 { 0.0 } else { 8.0 };
    let wanted = away * 2.5 - velocity + Vec2::new(0.0, fall);
    let key = |wanted: f32, more, less| match wanted {
        _ if wanted > 4.0 => more,
        _ if wanted < -4.0 => less,
        _ => Buttons::default(),
    };
    let across = key(wanted.x, Buttons::RIGHT, Buttons::LEFT);
    Buttons(across.0 | key(wanted.y, Buttons::UP, Buttons::DOWN).0)
}

/// Plays a game with this many players to the end of its first round and returns the winners. `place` returns the
/// position to which each player wants to go, if any.
fn winners(
    name: &str,
    players: u16,
    mut place: impl FnMut(&Game, Seat, BodyId) -> Option<Vec2>,
) -> Vec<Side> {
    let mut game = built_in(name, 5);
    (0..players).for_each(|seat| game.join(Seat(seat)));
    for _ in 0..TICKS_MAX {
        let heroes: Vec<(Seat, Option<BodyId>)> =
            game.players().map(|player| (player.seat, player.hero)).collect();
        let inputs = heroes.iter().map(|&(seat, hero)| {
            let goal = hero.and_then(|hero| Some((hero, place(&game, seat, hero)?)));
            let buttons = goal.map_or(Buttons::default(), |(hero, at)| keys_to(&game, hero, at));
            (seat, Input::new(buttons, None))
        });
        let inputs: Vec<(Seat, Input)> = inputs.collect();
        game.tick(&inputs);
        let round = game.round().expect("a round");
        if round.phase == RoundPhase::Over {
            return round.winners;
        }
    }
    panic!("{name} has no end: {:?}", game.round());
}

fn puck(game: &Game) -> Vec2 {
    let id = game.roster.placed[0].expect("a puck");
    game.world().position(id)
}

#[test]
fn hockey_is_won_by_who_goes_for_the_puck() {
    let won = winners("hockey", 2, |game, seat, hero| {
        let (puck, here) = (puck(game), game.world().position(hero));
        if seat == Seat(1) || puck.x > 146.0 {
            return None;
        }
        // Get behind the puck and push it towards the goal.
        let aim = (Vec2::new(265.0, 60.0) - puck).normalize();
        let behind = puck - aim * 16.0;
        let is_behind = (here - puck).normalize().dot(aim) < -0.9;
        Some(if is_behind { puck + aim * 60.0 } else { behind })
    });
    assert_eq!(won, [Side::Team(0)]);
}

#[test]
fn pong_is_won_by_who_follows_the_ball() {
    let won = winners("pong", 2, |game, seat, hero| {
        let ball = puck(game);
        let here = game.world().position(hero);
        (seat == Seat(1)).then_some(Vec2::new(here.x, ball.y))
    });
    assert_eq!(won, [Side::Team(1)]);
}

#[test]
fn four_play_pong_and_the_last_one_wins() {
    let won = winners("pong", 4, |game, seat, hero| {
        let (ball, here) = (puck(game), game.world().position(hero));
        // Where the ball will be soon.
        let ball = ball + game.world().velocity(game.roster.placed[0].expect("a ball")) * 0.15;
        let place = if seat.0 < 2 { Vec2::new(here.x, ball.y) } else { Vec2::new(ball.x, here.y) };
        (seat == Seat(2)).then_some(place)
    });
    assert_eq!(won, [Side::Team(2)]);
}

#[test]
fn a_ball_between_two_walls_of_pong_comes_back_after_eight_seconds() {
    let mut game = built_in("pong", 5);
    (0..2).for_each(|seat| game.join(Seat(seat)));
    let start = game.scene.bodies[0].def.position;
    while game.round().is_none_or(|round| round.phase != RoundPhase::Running) {
        game.tick(&[]);
    }
    let ball = game.roster.placed[0].expect("a ball");
    game.world.set_position(ball, Vec2::new(65.0, 100.0));
    game.world.set_velocity(ball, Vec2::new(0.0, 80.0));
    let actor = game.roster.actors[ball.index as usize].as_mut().expect("it heads somewhere");
    actor.rule = Rule::Wander { heading: Vec2::Y, speed: 80.0, is_pushed: false };
    let ticks = (1..=600).find(|_| {
        game.tick(&[]);
        game.roster.placed[0].is_none_or(|ball| (game.world().position(ball).x - 65.0).abs() > 5.0)
    });
    assert!((480..=482).contains(&ticks.expect("it comes back")), "after {ticks:?} ticks");
    for _ in 0..61 {
        game.tick(&[]);
    }
    let way = puck(&game) - start;
    assert!(way.length() < 5.0, "it starts where it began, not {way} from there");
}

#[test]
fn the_hill_is_won_by_who_stands_on_it() {
    let won = winners("hill", 3, |game, seat, hero| {
        let here = game.world().position(hero);
        // Go around the shelf, not up through it.
        let place = match (here.x > 116.0, here.y > 98.0) {
            (true, true) | (false, true) => Vec2::new(140.0, 97.0),
            (true, false) if here.y > 92.0 => Vec2::new(140.0, 97.0),
            (true, false) => Vec2::new(106.0, 70.0),
            (false, false) => Vec2::new(108.0, 108.0),
        };
        (seat == Seat(2)).then_some(place)
    });
    assert_eq!(won, [Side::Player(Seat(2))]);
}

#[test]
fn the_race_is_won_by_who_makes_three_laps() {
    let way = [
        (120.0, 62.0),
        (205.0, 62.0),
        (212.0, 20.0),
        (250.0, 24.0),
        (312.0, 40.0),
        (314.0, 95.0),
        (312.0, 145.0),
        (258.0, 142.0),
        (222.0, 142.0),
        (195.0, 176.0),
        (150.0, 180.0),
        (85.0, 160.0),
        (60.0, 110.0),
        (60.0, 60.0),
    ];
    let mut next = 0;
    let won = winners("race", 2, |game, seat, hero| {
        if seat == Seat(1) {
            return None;
        }
        let (x, y) = way[next % way.len()];
        let place = Vec2::new(x, y);
        if (game.world().position(hero) - place).length() < 16.0 {
            next += 1;
        }
        Some(place)
    });
    assert_eq!(won, [Side::Player(Seat(0))]);
}

/// Position that a hero must reach to shove a robot to a given place.
fn shoving(here: Vec2, robot: Vec2, to: Vec2) -> Vec2 {
    let aim = (to - robot).normalize();
    let behind = robot - aim * 15.0;
    let is_behind = (here - robot).normalize().dot(aim) < -0.9;
    // Go around the robot, not through it.
    let side = aim.perp() * if aim.perp_dot(here - robot) < 0.0 { -15.0 } else { 15.0 };
    let is_before = (here - robot).dot(aim) > 0.0;
    match (is_behind, is_before) {
        (true, _) => robot + aim * 20.0,
        (_, true) => robot + side - aim * 4.0,
        _ => behind,
    }
}

/// A position from which to shove a robot that is outside the pen into it. Each player takes a different robot.
fn herd(game: &Game, seat: Seat, hero: BodyId, pen: [Vec2; 2]) -> Option<Vec2> {
    let here = game.world().position(hero);
    let [low, high] = pen;
    let outside = |at: &Vec2| at.cmplt(low).any() || at.cmpgt(high).any();
    let robots = all(game, Kind::Minion).into_iter().map(|id| game.world().position(id));
    let robots: Vec<Vec2> = robots.filter(outside).collect();
    let robot = *robots.get(usize::from(seat.0) % robots.len().max(1))?;
    Some(shoving(here, robot, (low + high) * 0.5))
}

#[test]
fn the_herd_is_penned_by_who_shoves_it() {
    let won = winners("herd", 3, |game, seat, hero| {
        herd(game, seat, hero, [Vec2::new(136.0, 0.0), Vec2::new(200.0, 62.0)])
    });
    assert_eq!(won, [Side::Team(0)]);
}

#[test]
fn the_roundup_is_won_by_who_herds() {
    let won = winners("roundup", 6, |game, seat, hero| {
        let pen = [Vec2::new(0.0, 0.0), Vec2::new(60.0, 56.0)];
        if seat.0.is_multiple_of(2) { herd(game, Seat(seat.0 / 2), hero, pen) } else { None }
    });
    assert_eq!(won, [Side::Team(0)]);
}

#[test]
fn flags_are_won_by_who_fetches_them() {
    let way =
        [(60.0, 90.0), (292.0, 92.0), (298.0, 62.0), (284.0, 92.0), (60.0, 92.0), (26.0, 64.0)];
    let mut next = 0;
    let won = winners("flags", 2, |game, seat, hero| {
        let (x, y) = way[next % way.len()];
        let place = Vec2::new(x, y);
        if seat == Seat(0) && (game.world().position(hero) - place).length() < 9.0 {
            next += 1;
        }
        (seat == Seat(0)).then_some(place)
    });
    assert_eq!(won, [Side::Team(0)]);
}

#[test]
fn a_herd_that_nobody_herds_is_lost_when_its_time_is_up() {
    let (file, source) = BUILT_IN.iter().find(|(name, _)| *name == "herd.toml").expect("a scene");
    // Dye packs would end the game sooner.
    let quiet = source.replace("every = 12", "every = 3600").replace("start = ", "start = 30");
    let mut game = Game::new(Arc::new(Scene::parse(file, &quiet).expect("a good scene")), 5);
    game.join(FIRST);
    idle(&mut game, 179 + 90 * 60);
    assert_eq!(game.round().expect("a round").phase, RoundPhase::Running);
    idle(&mut game, 1);
    let round = game.round().expect("a round");
    assert_eq!((round.phase, round.winners.len(), lives(&game)), (RoundPhase::Over, 0, 5));
}

/// Players who do nothing do not win. The round is decided when time runs out, and all share the result.
#[test]
fn a_game_in_which_nobody_moves_ends_at_its_time() {
    for (name, ticks) in [("hockey", 180 * 60), ("hill", 240 * 60), ("race", 180 * 60)] {
        let mut game = built_in(name, 5);
        (0..2).for_each(|seat| game.join(Seat(seat)));
        // A countdown of three seconds comes first.
        idle(&mut game, ticks + 179);
        assert_eq!(game.round().expect("a round").phase, RoundPhase::Running, "{name}");
        idle(&mut game, 1);
        let round = game.round().expect("a round");
        assert_eq!((round.phase, round.winners.len()), (RoundPhase::Over, 2), "{name}");
    }
}

/// Puts the first player's hero at rest at a position.
fn put(game: &mut Game, x: f32, y: f32) {
    let hero = hero_of(game, FIRST);
    game.world.set_position(hero, Vec2::new(x, y));
    game.world.set_velocity(hero, Vec2::ZERO);
}

/// A single-player game of `lock`, after its countdown.
fn lock() -> Game {
    let mut game = built_in("lock", 5);
    game.join(FIRST);
    idle(&mut game, 240);
    assert_eq!(game.round().expect("a round").phase, RoundPhase::Running);
    game
}

/// Whether a signal of the scene is on.
fn is_on(game: &Game, signal: &str) -> bool {
    let index = game.scene.rules.signals.iter().position(|spec| spec.name == signal);
    let levels = game.rules.as_ref().expect("rules").levels;
    levels.signals >> index.expect("a signal") & 1 == 1
}

fn lives(game: &Game) -> i32 {
    game.round().expect("a round").teams[0].lives
}

/// Touches shapes in `lock` in the given order, with a pause in between.
fn touch_shapes(game: &mut Game, shapes: &[&str]) {
    for shape in shapes {
        let (x, y) = match *shape {
            "top-right" => (185.0, 96.0),
            "bottom-right" => (185.0, 18.0),
            _ => (15.0, 96.0),
        };
        put(game, x, y);
        idle(game, 2);
        put(game, 45.0, 52.0);
        idle(game, 2);
    }
}

#[test]
fn the_lock_opens_by_its_shapes_in_order_only() {
    for (shapes, opens) in [
        (&["top-right", "bottom-right", "top-left"][..], true),
        (&["bottom-right", "top-right", "top-left"][..], false),
        (&["top-right", "top-left", "bottom-right", "top-left"][..], false),
        (&["top-left", "top-right", "bottom-right", "top-left"][..], true),
    ] {
        let mut game = lock();
        put(&mut game, 67.0, 69.6);
        idle(&mut game, 2);
        touch_shapes(&mut game, shapes);
        assert_eq!(is_on(&game, "open"), opens, "{shapes:?}");
        put(&mut game, 12.0, 17.6);
        idle(&mut game, 2);
        assert_eq!(lives(&game), 5, "the field is off");
        put(&mut game, 28.0, 17.6);
        (0..240).for_each(|_| play(&mut game, &[Buttons::LEFT], None));
        let is_over = game.round().expect("a round").phase == RoundPhase::Over;
        assert!(!opens || is_over, "the barrier is gone");
    }
}

#[test]
fn the_field_is_back_45_seconds_after_the_bulb_was_touched_and_shapes_are_forgotten() {
    let mut game = lock();
    assert!(is_on(&game, "field"));
    put(&mut game, 67.0, 69.6);
    idle(&mut game, 1);
    assert!(!is_on(&game, "field"));
    put(&mut game, 185.0, 96.0);
    idle(&mut game, 1);
    put(&mut game, 185.0, 18.0);
    let mut off = 1;
    while !is_on(&game, "field") {
        idle(&mut game, 1);
        off += 1;
    }
    assert_eq!(off, 45 * 60 + 1, "and then the tick in which it comes on");
    put(&mut game, 67.0, 69.6);
    idle(&mut game, 1);
    touch_shapes(&mut game, &["bottom-right", "top-left"]);
    assert!(!is_on(&game, "open"), "the first shape no longer counts");
}

#[test]
fn the_lift_takes_its_rider_into_the_field() {
    let mut game = lock();
    let lift = game.roster.placed[9].expect("a lift");
    let above = game.world().position(lift).y + 8.0;
    put(&mut game, 100.0, above);
    let mut furthest = 0.0f32;
    let mut ticks = 0;
    while lives(&game) == 5 {
        let away = game.world().position(hero_of(&game, FIRST)) - game.world().position(lift);
        furthest = max(furthest, (away - Vec2::new(0.0, 7.0)).length());
        idle(&mut game, 1);
        ticks += 1;
        assert!(ticks < 600, "it never costs a life");
    }
    assert_eq!(lives(&game), 4);
    assert!(furthest < 1.5, "{furthest}: the rider follows the lift");
    let place = game.world().position(hero_of(&game, FIRST));
    assert!((place - Vec2::new(45.0, 17.6)).length() < 1.0, "{place}: back at the start");
}

/// The next level is too high to reach by jumping.
#[test]
fn without_the_lift_nobody_gets_up() {
    let file = "lock.toml";
    let (_, source) = BUILT_IN.iter().find(|(name, _)| *name == file).expect("a scene");
    let stopped =
        source.replace("path = [[100, 8.5], [100, 90.5]]\nperiod = 8", "position = [100, 8.5]");
    assert_ne!(*source, stopped);
    let scene = Arc::new(Scene::parse(file, &stopped).expect("a good scene"));
    let mut rng = jostle_sim::Rng::new(11, 3);
    for seed in 0..12 {
        let mut game = Game::new(Arc::clone(&scene), seed);
        game.join(FIRST);
        let mut down = Buttons::default();
        for tick in 0..2000 {
            if tick % (1 + rng.below(20)) == 0 {
                down = Buttons(rng.below(16) as u16);
            }
            game.tick(&[(FIRST, Input::new(down, None))]);
            let hero = game.players().next().and_then(|player| player.hero);
            let feet = hero.map_or(0.0, |hero| game.world().position(hero).y - 5.5);
            assert!(feet < 28.0 || tick < 200, "{feet} in tick {tick} of {seed}");
        }
    }
}

/// Keys with which a hero uses the lift to reach a position on a level of `lock`; `None` once it is there.
/// `boards` tells whether it is heading for the lift.
fn keys_by_lift(game: &Game, x: f32, top: f32, boards: &mut bool) -> Option<Buttons> {
    let hero = hero_of(game, FIRST);
    let at = game.world().position(hero);
    let lift = game.world().position(game.roster.placed[9].expect("a lift")).y + 1.5;
    let feet = at.y - 5.5;
    let walk = |to: f32| match to - at.x {
        away if away > 1.5 => Buttons::RIGHT,
        away if away < -1.5 => Buttons::LEFT,
        _ => Buttons::default(),
    };
    let jump = |keys: Buttons| Buttons(keys.0 | Buttons::UP.0);
    let is_at = |level: f32| (feet - level).abs() < 0.6;
    let side = |x: f32| if x < 100.0 { -1.0 } else { 1.0 };
    let on_ledge = is_at(64.0) && (58.0..76.0).contains(&at.x);
    let on_level = [12.0, 46.0, 90.0].into_iter().any(is_at) && (at.x - 100.0).abs() > 36.0;
    if (on_ledge || on_level) && is_at(top) && side(at.x) == side(x) {
        return (walk(x) != Buttons::default()).then(|| walk(x));
    }
    Some(if (at.x - 100.0).abs() < 19.0 && (feet - lift).abs() < 1.5 {
        // Jump off the lift at its edge, where the level is within reach but the field is not.
        let edge = 100.0 + side(x) * 16.0;
        let reach = (top - 13.0..top + 3.0).contains(&lift) && lift < 94.0;
        *boards = false;
        match walk(edge) {
            keys if keys != Buttons::default() => keys,
            _ if reach => jump(walk(x)),
            keys => keys,
        }
    } else if on_ledge || on_level {
        // Jump onto the lift as it passes.
        *boards = true;
        let edge = 100.0 + side(at.x) * if on_ledge { 31.0 } else { 43.0 };
        let passes = (feet - 10.0..feet + 6.0).contains(&lift);
        if passes && walk(edge) == Buttons::default() { jump(walk(100.0)) } else { walk(edge) }
    } else {
        walk(if *boards { 100.0 } else { x })
    })
}

#[test]
fn the_lock_is_opened_by_who_takes_the_lift() {
    let mut game = lock();
    let way = [(67.0, 64.0), (185.0, 90.0), (185.0, 12.0), (15.0, 90.0), (12.0, 12.0)];
    let (mut next, mut boards) = (0, false);
    for _ in 0..60 * 120 {
        let round = game.round().expect("a round");
        if round.phase == RoundPhase::Over {
            assert_eq!(round.winners, [Side::Team(0)]);
            return;
        }
        let Some(&(x, top)) = way.get(next) else { break };
        let keys = keys_by_lift(&game, x, top, &mut boards);
        next += usize::from(keys.is_none());
        game.tick(&[(FIRST, Input::new(keys.unwrap_or_default(), None))]);
    }
    panic!("not opened: on the way to {next}");
}

/// Positions of the plates of Lamp, in the order of their dots, followed by that of the treasure.
fn plates(game: &Game) -> Vec<Vec2> {
    let mut marks = game.scene.marks.clone();
    marks.sort_by_key(|mark| mark.dots);
    let treasure = Vec2::new(221.0, 113.0);
    marks.iter().map(|mark| mark.position).chain([treasure]).collect()
}

#[test]
fn the_dark_room_is_left_by_who_touches_the_plates_in_order() {
    let mut next = 0;
    let won = winners("lamp", 1, |game, _, hero| {
        let plates = plates(game);
        if game.world().position(hero).distance(plates[next]) < 6.0 && next + 1 < plates.len() {
            next += 1;
        }
        Some(plates[next])
    });
    assert_eq!((won, next), (vec![Side::Team(0)], 5));
}

#[test]
fn another_order_opens_no_bar_of_the_dark_room() {
    let mut game = built_in("lamp", 1);
    game.join(Seat(0));
    (0..200).for_each(|_| game.tick(&[]));
    let bodies = game.bodies().count();
    let hero = game.roster.players[0].hero.expect("a hero");
    for plate in [4, 3, 2, 1] {
        let place = plates(&game)[plate];
        game.world.set_position(hero, place);
        (0..3).for_each(|_| game.tick(&[]));
        assert_eq!(game.bodies().count(), bodies, "plate {}", plate + 1);
    }
    for plate in 0..5 {
        let place = plates(&game)[plate];
        game.world.set_position(hero, place);
        (0..3).for_each(|_| game.tick(&[]));
        assert_eq!(game.bodies().count(), bodies - plate - 1, "plate {}", plate + 1);
    }
}
