//! Tests players in a round, who change teams, continue to the next round, and read the lines of rules.

use super::*;
use crate::player::Player;
use crate::rules::{OrderProgress, RoundPhase, Taking};
use crate::side::Side;

const ROUND: &str = r#"
title = "Round"
size = [400, 200]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero", "ball"]
pairs = [["hero", "ball"]]
[round]
task = "Be first"
goal = 5
countdown = 1
pause = 10
[hero]
spawns = [[40, 40], [80, 40], [120, 40], [160, 40]]
"#;
const TEAMS: &str = r#"
[[teams]]
name = "red"
spawns = [[40, 100], [40, 130], [40, 160]]
[[teams]]
name = "green"
spawns = [[200, 100], [200, 130]]
players = 2
[[teams]]
name = "blue"
spawns = [[360, 100], [360, 130], [360, 160]]
"#;
const BALL: &str = r#"
[[bodies]]
kind = "block"
group = "ball"
name = "ball"
position = [300, 40]
radius = 4
"#;

fn round_of(more: &str, players: u16) -> Game {
    let mut game = game_of(&format!("{ROUND}{more}"));
    (0..players).for_each(|seat| game.join(Seat(seat)));
    game
}

fn phase(game: &Game) -> RoundPhase {
    game.round().expect("a round").phase
}

fn team_of(game: &Game, seat: u16) -> Option<u8> {
    game.round().expect("a round").player(Seat(seat)).expect("a player").team
}

/// Plays a tick in which each of the first `players` players holds down these buttons.
fn all_hold(game: &mut Game, players: u16, buttons: Buttons) {
    let inputs = (0..players).map(|seat| (Seat(seat), Input::new(buttons, None)));
    game.tick(&inputs.collect::<Vec<_>>());
}

fn player(game: &Game, seat: u16) -> &Player {
    &game.roster.players[usize::from(seat)]
}

#[test]
fn a_press_changes_the_team_once_and_the_hero_comes_back_there() {
    let mut game = round_of(TEAMS, 3);
    assert_eq!([0, 1, 2].map(|seat| team_of(&game, seat)), [Some(0), Some(1), Some(2)]);
    idle(&mut game, 70);
    let before = hero_of(&game, FIRST);
    for _ in 0..3 {
        play(&mut game, &[Buttons::TEAM], None);
        assert_eq!(team_of(&game, 0), Some(1), "held, it changes nothing more");
    }
    assert!(!game.world().contains(before));
    assert_eq!(player(&game, 0).hero, None, "it takes a moment");
    idle(&mut game, 40);
    let hero = hero_of(&game, FIRST);
    assert_eq!(game.world().position(hero), Vec2::new(200.0, 100.0));
    play(&mut game, &[Buttons::TEAM], None);
    assert_eq!(team_of(&game, 0), Some(2));
    idle(&mut game, 1);
    play(&mut game, &[Buttons::TEAM], None);
    assert_eq!(team_of(&game, 0), Some(0), "after the last one comes the first");
}

#[test]
fn a_team_that_is_not_in_the_round_is_passed_over() {
    let mut game = round_of(TEAMS, 2);
    idle(&mut game, 70);
    for team in [1, 0, 1] {
        play(&mut game, &[Buttons::TEAM], None);
        idle(&mut game, 1);
        assert_eq!(team_of(&game, 0), Some(team), "blue had no players");
    }
}

#[test]
fn a_full_team_is_passed_over_and_a_change_is_possible_in_a_countdown() {
    let mut game = round_of(TEAMS, 6);
    let teams = |game: &Game| -> Vec<u8> {
        (0..6).map(|seat| team_of(game, seat).expect("a team")).collect()
    };
    assert_eq!(teams(&game), [0, 1, 2, 0, 1, 2]);
    idle(&mut game, 3);
    assert_eq!(phase(&game), RoundPhase::Countdown, "everybody stands");
    play(&mut game, &[Buttons::TEAM, Buttons::RIGHT], None);
    assert_eq!(teams(&game), [2, 1, 2, 0, 1, 2], "the second team is full");
    let copy = Game::restore(Arc::clone(game.scene()), &game.save()).expect("what it saved");
    assert_eq!(game.first_difference(&copy), None);
}

#[test]
fn what_a_player_carried_stays_when_the_team_changes() {
    let carrying = "[[rules]]\ntouch = [\"hero\", \"ball\"]\ncarry = true\n";
    let ball = BALL.replace("[300, 40]", "[40, 126]");
    let mut game = round_of(&format!("{TEAMS}{ball}{carrying}"), 2);
    idle(&mut game, 62);
    let to_the_ball = |game: &mut Game| play(game, &[Buttons::UP], None);
    while player(&game, 0).carried.is_none() {
        to_the_ball(&mut game);
        assert!(game.tick_count() < 200, "the hero meets the ball");
    }
    play(&mut game, &[Buttons::TEAM], None);
    assert_eq!(player(&game, 0).carried, None);
    let ball = game.roster.placed[0].expect("the ball");
    assert_eq!(game.world().gravity_scale(ball), 1.0);
}

#[test]
fn players_without_teams_have_none_to_change_to() {
    let mut game = round_of("", 1);
    idle(&mut game, 70);
    let hero = hero_of(&game, FIRST);
    play(&mut game, &[Buttons::TEAM], None);
    assert_eq!((hero_of(&game, FIRST), team_of(&game, 0)), (hero, None));
}

#[test]
fn the_next_round_begins_when_all_who_are_there_go_on() {
    let mut game = round_of("[[rules]]\nevery = 1\nend = \"win\"\n", 3);
    while phase(&game) != RoundPhase::Over {
        all_hold(&mut game, 3, Buttons::AGAIN);
        assert!(game.tick_count() < 200, "it ends after a second");
    }
    let over = game.tick_count();
    // The third player is away and sends no input.
    while game.tick_count() < over + 59 {
        all_hold(&mut game, 2, Buttons::AGAIN);
        assert_eq!(phase(&game), RoundPhase::Over, "the result stands for a second");
    }
    all_hold(&mut game, 2, Buttons::default());
    assert!(game.round().expect("a round").players.iter().all(|player| !player.goes_on));
    for _ in 0..30 {
        game.tick(&[(FIRST, input(&[Buttons::AGAIN], None)), (Seat(1), Input::default())]);
        assert_eq!(phase(&game), RoundPhase::Over, "the other does not");
    }
    let players = game.round().expect("a round").players;
    assert_eq!([players[0].goes_on, players[1].goes_on], [true, false]);
    let restored = Game::restore(Arc::clone(game.scene()), &game.save()).expect("what it saved");
    let mut games = [game, restored];
    for game in &mut games {
        all_hold(game, 2, Buttons::AGAIN);
        all_hold(game, 2, Buttons::AGAIN);
        assert_eq!(phase(game), RoundPhase::Countdown);
    }
    assert_eq!(
        games[0].first_difference(&games[1]),
        None,
        "nobody waits for the third there either"
    );
}

#[test]
fn a_result_that_nobody_reads_stands_for_its_pause() {
    let mut game = round_of("[[rules]]\nevery = 1\nend = \"win\"\n", 1);
    while phase(&game) != RoundPhase::Over {
        idle(&mut game, 1);
    }
    idle(&mut game, 600);
    assert_eq!(phase(&game), RoundPhase::Over);
    idle(&mut game, 1);
    assert_eq!(phase(&game), RoundPhase::Countdown);
}

/// The lines said by rules in the latest tick.
fn said(game: &Game) -> Vec<(u8, Option<Seat>, Option<Seat>)> {
    let said = |event: &Event| match *event {
        Event::Said { rule, it, by } => Some((rule, it, by)),
        _ => None,
    };
    game.events().iter().filter_map(said).collect()
}

#[test]
fn a_rule_says_its_line_once_a_tick_and_names_who_did_it() {
    let zone =
        "[[zones]]\nname = \"box\"\narea = [[0, 0], [400, 200]]\nwho = [\"hero\", \"ball\"]\n";
    let rules =
        "[[rules]]\nenter = \"box\"\nsay = \"{it} is in\"\n[[rules]]\nevery = 1\nsay = \"Tick\"\n";
    let mut game = round_of(&format!("{BALL}{zone}{rules}"), 2);
    while phase(&game) != RoundPhase::Running {
        idle(&mut game, 1);
    }
    assert_eq!(said(&game), [(0, None, None)], "three bodies enter: one line, about the first");
    idle(&mut game, 59);
    assert_eq!(said(&game), [(1, None, None)], "about nobody");
    let scene = game.scene();
    let line = scene.rules.rules[0].effects.say.clone().expect("a line");
    assert_eq!((line.first.is_some(), line.text.as_str(), line.last), (true, " is in", None));
}

#[test]
fn lines_with_wrong_names_are_refused() {
    let refused = |rule: &str| {
        let text = format!("{ROUND}[[rules]]\n{rule}\n");
        Scene::parse("test.toml", &text).expect_err("a wrong line").to_string()
    };
    let nobody = refused("every = 1\nsay = \"{it} was late\"");
    assert!(nobody.contains("a text without names: this occasion is about no body"), "{nobody}");
    for wrong in ["\"a {it} b\"", "\"{who} won\"", "\"{it}\"", "\"\"", "7"] {
        let error = refused(&format!("burst = true\nsay = {wrong}"));
        assert!(error.contains("rules[0].say"), "{error}");
    }
}

#[test]
fn progress_is_shown_while_a_zone_is_taken_and_orders_are_walked() {
    let zones = r#"
[[zones]]
name = "one"
area = [[0, 0], [60, 60]]
take = 1
color = 1
[[zones]]
name = "two"
area = [[200, 0], [260, 60]]
[[signals]]
name = "together"
order = ["one", "two"]
[[signals]]
name = "lap"
order = ["one", "two"]
each = "player"
[[rules]]
on = "lap"
score = 1
"#;
    let mut game = round_of(zones, 1);
    while phase(&game) != RoundPhase::Running {
        idle(&mut game, 1);
    }
    let since = game.tick_count() - 1;
    let own = Side::Player(FIRST);
    for _ in 0..60 {
        let round = game.round().expect("a round");
        assert_eq!(round.takings, [Taking { zone: 0, side: own, since }]);
        let progress = [(0, None), (1, Some(own))];
        let progress = progress.map(|(signal, side)| OrderProgress { signal, side, steps: 1 });
        assert_eq!(round.orders, progress);
        assert_eq!((round.steps(1, Some(own)), round.steps(0, None)), (1, 1));
        idle(&mut game, 1);
    }
    let round = game.round().expect("a round");
    assert_eq!((round.takings, round.holders[0]), (vec![], Some(own)), "it is taken");
    let hero = hero_of(&game, FIRST);
    game.world.set_position(hero, Vec2::new(230.0, 30.0));
    idle(&mut game, 1);
    let round = game.round().expect("a round");
    assert_eq!((round.steps(1, Some(own)), round.steps(0, None)), (0, 2), "a lap starts over");
}

/// Every lap counts, whether players complete their laps in the same tick, in consecutive ticks, or further apart.
#[test]
fn every_lap_counts_however_close_the_laps_are() {
    for (each, players, gap) in (0..40).map(|number| {
        let each = if number % 2 == 0 { "player" } else { "side" };
        (each, 2 + number / 2 % 5, number / 10)
    }) {
        let lap = format!(
            "[[zones]]\nname = \"a\"\narea = [[200, 0], [220, 60]]\n\
             [[zones]]\nname = \"b\"\narea = [[300, 0], [320, 60]]\n\
             [[signals]]\nname = \"lap\"\norder = [\"a\", \"b\"]\neach = \"{each}\"\n\
             [[rules]]\non = \"lap\"\nscore = 1\nback = true\n"
        );
        let mut game = round_of(&lap, players);
        while phase(&game) != RoundPhase::Running {
            idle(&mut game, 1);
        }
        let homes: Vec<Vec2> = (0..players).map(|seat| player(&game, seat).home).collect();
        for lap in 1..=3 {
            for tick in 0..=gap * players + 1 {
                for seat in 0..players {
                    let x = match tick.checked_sub(gap * seat) {
                        Some(0) => 210.0,
                        Some(1) => 310.0,
                        _ => continue,
                    };
                    let hero = hero_of(&game, Seat(seat));
                    game.world.set_position(hero, Vec2::new(x, 30.0));
                }
                idle(&mut game, 1);
            }
            for seat in 0..players {
                let (score, hero) =
                    (player(&game, seat).standing.score, hero_of(&game, Seat(seat)));
                let facts = (score, game.world().position(hero));
                let wanted = (lap, homes[usize::from(seat)]);
                assert_eq!(facts, wanted, "{each}, seat {seat} of {players}, {gap} ticks apart");
            }
            assert_eq!(game.round().expect("a round").orders, []);
        }
    }
}

#[test]
fn what_left_before_a_countdown_is_reported_once() {
    let round = ROUND.replace("countdown = 1", "countdown = 1\nplayers_min = 2");
    let scene = format!("{round}{}velocity = [140, 0]\n", BALL);
    let mut joined_then = false;
    for joins_at in 90..140 {
        let mut game = game_of(&scene);
        game.join(FIRST);
        let left = |game: &Game| {
            let is_left = |event: &&Event| matches!(event, Event::BodyLeft { .. });
            game.events().iter().filter(is_left).count()
        };
        idle(&mut game, joins_at);
        joined_then |= left(&game) == 1;
        game.join(Seat(1));
        for _ in 0..50 {
            idle(&mut game, 1);
            assert_eq!(phase(&game), RoundPhase::Countdown);
            assert_eq!(left(&game), 0, "the second player joined in tick {joins_at}");
        }
    }
    assert!(joined_then, "the ball left in one of these ticks");
}

/// A dash to the right, after whose first player the others have this many seconds.
fn dash(players: u16, finish: u32) -> Game {
    let post = "[[zones]]\nname = \"post\"\narea = [[300, 0], [400, 200]]\n\
                [[rules]]\nenter = \"post\"\nscore = 1\n";
    let text =
        format!("{ROUND}{post}").replace("goal = 5", &format!("goal = 1\nfinish = {finish}"));
    let mut game = game_of(&text);
    (0..players).for_each(|seat| game.join(Seat(seat)));
    game
}

fn score(game: &Game, seat: u16) -> Option<i32> {
    game.round()?.side(Side::Player(Seat(seat))).map(|side| side.score)
}

#[test]
fn points_count_without_a_round() {
    let post = "[[zones]]\nname = \"post\"\narea = [[0, 0], [100, 100]]\n\
                [[rules]]\nenter = \"post\"\nscore = 3\n";
    let (before, rest) = ROUND.split_once("[round]").expect("a round");
    let (_, hero) = rest.split_once("[hero]").expect("a hero");
    let mut game = game_of(&format!("{before}[hero]{hero}{post}"));
    game.join(Seat(0));
    game.tick(&[]);
    assert_eq!(game.players().next().expect("a player").score, 3);
}

/// Flies these players to the right until `is_there`.
fn dash_until(game: &mut Game, seats: &[u16], is_there: impl Fn(&Game) -> bool) {
    let right = input(&[Buttons::RIGHT], None);
    let inputs: Vec<_> = seats.iter().map(|&seat| (Seat(seat), right)).collect();
    while !is_there(game) {
        game.tick(&inputs);
        assert!(game.tick_count() < 1800, "it ends");
    }
}

#[test]
fn a_round_with_a_finish_goes_on_until_all_are_there() {
    let mut game = dash(3, 30);
    dash_until(&mut game, &[2], |game| score(game, 2) == Some(1));
    let first = [Side::Player(Seat(2))];
    let round = game.round().expect("a round");
    assert_eq!((round.phase, &round.winners[..]), (RoundPhase::Running, &first[..]));
    let copy = Game::restore(Arc::clone(game.scene()), &game.save()).expect("what it saved");
    assert_eq!(game.first_difference(&copy), None);
    // The winner gets nothing more for entering once more.
    for _ in 0..40 {
        game.tick(&[(Seat(2), input(&[Buttons::LEFT], None))]);
    }
    let mut games = [game, copy];
    for _ in 0..40 {
        games[1].tick(&[(Seat(2), input(&[Buttons::LEFT], None))]);
    }
    for game in &mut games {
        dash_until(game, &[0, 1, 2], |game| phase(game) == RoundPhase::Over);
        let round = game.round().expect("a round");
        assert_eq!(round.winners, first);
        assert_eq!([0, 1, 2].map(|seat| score(game, seat)), [Some(1); 3]);
    }
    assert_eq!(games[0].first_difference(&games[1]), None);
}

#[test]
fn a_finish_ends_when_its_time_is_up_and_with_a_single_player_at_once() {
    let mut game = dash(2, 3);
    dash_until(&mut game, &[0], |game| score(game, 0) == Some(1));
    let won = game.tick_count();
    dash_until(&mut game, &[0], |game| phase(game) == RoundPhase::Over);
    assert_eq!(game.tick_count() - won, 180);
    let mut alone = dash(1, 3);
    dash_until(&mut alone, &[0], |game| score(game, 0) == Some(1));
    assert_eq!(phase(&alone), RoundPhase::Over);
}

#[test]
fn a_winner_who_leaves_before_the_others_finish_has_not_won() {
    let mut game = dash(3, 3);
    dash_until(&mut game, &[0], |game| score(game, 0) == Some(1));
    game.leave(Seat(0));
    game.join(Seat(0));
    idle(&mut game, 200);
    let round = game.round().expect("a round");
    assert_eq!((round.phase, round.winners), (RoundPhase::Running, Vec::new()));
    dash_until(&mut game, &[1], |game| score(game, 1) == Some(1));
    idle(&mut game, 180);
    let round = game.round().expect("a round");
    assert_eq!((round.phase, round.winners), (RoundPhase::Over, vec![Side::Player(Seat(1))]));
}

#[test]
fn a_finish_needs_a_goal() {
    let text = ROUND.replace("goal = 5", "finish = 3");
    let error = Scene::parse("test.toml", &text).expect_err("no goal").to_string();
    assert!(error.contains("round.finish"), "{error}");
}
