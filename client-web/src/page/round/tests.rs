//! Tests of the round view with rounds constructed for each case.

use super::*;
use jostle_protocol::Appearance;

const GAME: &str = r#"
title = "Game"
size = [100, 100]
tools = ["steer"]
groups = ["hero"]
[round]
task = "Be first"
time = 90
goal = 3
lives = 3
stars = [1, 2, 3]
[hero]
spawns = [[10, 10]]
[[rules]]
every = 1
score = 1
"#;
const TEAMS: &str = "[[teams]]\nname = \"red\"\ncolor = 5\n[[teams]]\nname = \"blue\"\ncolor = 1\n";

fn scene(more: &str) -> Scene {
    Scene::parse("game.toml", &format!("{GAME}{more}")).unwrap_or_else(|error| panic!("{error}"))
}

fn player(seat: u16, name: &str) -> PlayerState {
    PlayerState {
        seat: Seat(seat),
        appearance: Appearance::new(name, seat as u8).expect("a name"),
        connected: true,
        input_seq: 0,
        hero: None,
        selected: None,
        held: None,
        score: 0,
        pointer: None,
    }
}

/// A round with two players, on separate teams if there are teams.
fn round(phase: RoundPhase, teams: usize, scores: [i32; 2]) -> RoundInfo {
    let info = |score| SideInfo { score, lives: 2, is_in: true };
    let players = [0, 1].map(|index: u16| jostle_game::RoundPlayer {
        seat: Seat(index),
        team: (teams > 0).then_some(index as u8 % teams.max(1) as u8),
        side: info(scores[usize::from(index)]),
        is_stunned: false,
        goes_on: false,
    });
    RoundInfo {
        phase,
        since: 100,
        teams: (0..teams).map(|team| info(scores[team])).collect(),
        players: players.to_vec(),
        winners: Vec::new(),
        holders: Vec::new(),
        zones: 0,
        resting: 0,
        takings: Vec::new(),
        orders: Vec::new(),
        sling: None,
        cracked: Vec::new(),
    }
}

fn view(scene: &Scene, round: &RoundInfo, own: u16, tick: f64) -> RoundView {
    let players = [player(0, "Ann"), player(1, "Bob")];
    let players = &players[..round.players.len()];
    RoundContext { scene, round, players, own: Seat(own), tick, race: None }
        .view()
        .expect("a scene with rounds")
}

#[test]
fn the_clock_runs_down_to_the_last_second() {
    let (scene, round) = (scene(""), round(RoundPhase::Running, 0, [0, 0]));
    let clock = |tick: f64| {
        let view = view(&scene, &round, 0, tick);
        (view.clock, view.is_late)
    };
    assert_eq!(clock(100.0), ("1:30".to_owned(), false));
    assert_eq!(clock(101.0), ("1:30".to_owned(), false));
    assert_eq!(clock(160.0), ("1:29".to_owned(), false));
    assert_eq!(clock(100.0 + 80.0 * 60.0), ("0:10".to_owned(), true));
    assert_eq!(clock(100.0 + 90.0 * 60.0), ("0:00".to_owned(), true));
    assert_eq!(clock(90.0), ("1:30".to_owned(), false), "a tick before the phase");
}

#[test]
fn the_countdown_is_large_and_go_follows() {
    let scene = scene("");
    let large = |phase, tick: f64| view(&scene, &round(phase, 0, [0, 0]), 0, tick).large;
    assert_eq!(large(RoundPhase::Countdown, 100.0), "3");
    assert_eq!(large(RoundPhase::Countdown, 100.0 + 150.0), "1");
    assert_eq!(large(RoundPhase::Countdown, 100.0 + 181.0), "1", "the last tick is late");
    assert_eq!(large(RoundPhase::Running, 130.0), "Go!");
    assert_eq!(large(RoundPhase::Running, 200.0), "");
}

#[test]
fn a_board_has_the_teams_or_the_player_alone() {
    let alone = view(&scene(""), &round(RoundPhase::Running, 0, [2, 1]), 1, 200.0);
    let names: Vec<&str> = alone.sides.iter().map(|side| side.name.as_str()).collect();
    assert_eq!(
        (names, alone.sides[0].score, alone.sides[0].lives),
        (vec!["Bob"], Some(1), Some(2))
    );
    let teams = view(&scene(TEAMS), &round(RoundPhase::Running, 2, [2, 1]), 1, 200.0);
    let sides: Vec<_> =
        teams.sides.iter().map(|side| (side.name.as_str(), side.color, side.is_own)).collect();
    assert_eq!(sides, [("Red", 5, false), ("Blue", 1, true)]);
    assert_eq!(teams.spoken, "Red 2 points 2 lives, Blue 1 point 2 lives");
}

#[test]
fn the_result_says_who_won_to_whom() {
    let (plain, teams) = (scene(""), scene(TEAMS));
    let title = |scene: &Scene, count: usize, winners: &[Side], own: u16| {
        let mut over = round(RoundPhase::Over, count, [2, 3]);
        over.winners = winners.to_vec();
        let result = view(scene, &over, own, 160.0).result.expect("a result");
        [result.title, result.detail].join("|")
    };
    let players = [Side::Player(Seat(0)), Side::Player(Seat(1))];
    assert_eq!(title(&plain, 0, &players[1..], 1), "You won!|");
    assert_eq!(title(&plain, 0, &players[1..], 0), "You lost|Bob won");
    assert_eq!(title(&plain, 0, &players, 0), "A draw|");
    assert_eq!(title(&plain, 0, &[], 0), "Nobody won|");
    assert_eq!(title(&teams, 2, &[Side::Team(0)], 0), "You won!|Red won");
    assert_eq!(title(&teams, 2, &[Side::Team(0)], 1), "You lost|Red won");
    assert_eq!(title(&plain, 0, &players[1..], 7), "Bob won|", "to a spectator");
}

#[test]
fn the_result_ranks_and_gives_stars_to_one_side() {
    let mut over = round(RoundPhase::Over, 0, [1, 3]);
    over.winners = vec![Side::Player(Seat(1))];
    let result = view(&scene(""), &over, 0, 160.0).result.expect("a result");
    let names: Vec<&str> = result.sides.iter().map(|side| side.name.as_str()).collect();
    assert_eq!((names, result.stars, result.next_s), (vec!["Bob", "Ann"], None, 5));
    over.players.truncate(1);
    over.players[0].side.score = 2;
    over.winners = vec![Side::Player(Seat(0))];
    let result = view(&scene(""), &over, 0, 160.0).result.expect("a result");
    assert_eq!((result.title.as_str(), result.stars), ("Done!", Some(2)));
    over.winners.clear();
    let title = |over: &RoundInfo| view(&scene(""), over, 0, 160.0).result.expect("a result").title;
    assert_eq!(title(&over), "Lost");
    over.sling = Some(jostle_game::SlingInfo { shots: 0, is_flying: false });
    assert_eq!(title(&over), "Out of shots");
    over.players[0].side.lives = 0;
    assert_eq!(title(&over), "Out of lives");
}

#[test]
fn who_waits_is_told_for_whom() {
    let scene = scene("").source.replace("task =", "players_min = 3\ntask =");
    let scene = Scene::parse("game.toml", &scene).expect("a good scene");
    let waiting = view(&scene, &round(RoundPhase::Waiting, 0, [0, 0]), 0, 160.0);
    assert_eq!(
        (waiting.task.as_str(), waiting.clock.as_str()),
        ("Waiting for players: 2 of 3. Send the link to a friend", "1:30")
    );
}
