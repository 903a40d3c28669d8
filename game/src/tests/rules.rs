//! Tests the semantics of rules with a table of small cases. For each one, `rules.toml` has a scene, the moves of
//! its bodies and players, and the expected values by tick. Each case is played twice, the second time restoring it
//! from its saved state in every tick.

use super::*;
use crate::rules::RoundPhase;
use crate::scene::SignalKind;
use crate::side::Side;
use jostle_sim::World;
use std::fmt::Write;
use toml::{Table, Value};

/// Beginning of every case's scene, in which bodies do not fall.
const HEAD: &str = r#"
title = "Case"
size = [400, 200]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero", "ball", "wall", "pack"]
"#;
const HEROES: &str = r#"
[hero]
spawns = [[300, 100], [320, 100], [340, 100], [360, 100]]
"#;

/// A move made by a player or body before a tick.
struct Move {
    tick: u32,
    what: String,
    x: f32,
    y: f32,
}

#[test]
fn every_case_of_the_table_plays_as_it_says() {
    let table: Table = include_str!("rules.toml").parse().expect("TOML");
    let cases = table["cases"].as_array().expect("cases");
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let mut failures = String::new();
    for case in cases {
        let name = case["name"].as_str().expect("a name");
        for restored in [false, true] {
            let found = play_case(case, restored);
            let wanted = case["expect"].as_table().expect("what is expected");
            for ((key, wanted), found) in wanted.iter().zip(found) {
                let wanted = wanted.as_str().expect("runs of ticks");
                if wanted != found {
                    let how = if restored { "restored in every tick" } else { "played through" };
                    writeln!(failures, "{name}, {how}: {key}: {found:?}, not {wanted:?}").unwrap();
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// An error in rules names its location and the allowed values.
#[test]
fn wrong_rules_are_refused_where_they_stand() {
    let cases = [
        (
            "[[signals]]\nname = \"one\"\nwhen = \"two\"\n[[signals]]\nname = \"two\"\nany = \"!one\"",
            "12: signals[0].when: found \"two\"; allowed: zones, and signals above it: ; ! before a name for not",
        ),
        (
            "[[zones]]\nname = \"a\"\n[[rules]]\nenter = \"a\"\nevery = 1\nscore = 1",
            "14: rules[0].every: found 1; allowed: one occasion a rule",
        ),
        (
            "[[zones]]\nname = \"a\"\n[[rules]]\nenter = \"b\"\nscore = 1",
            "13: rules[0].enter: found \"b\"; allowed: one of a",
        ),
        (
            "[[zones]]\nname = \"a\"\n[[rules]]\nenter = \"a\"",
            "12: rules[0].score: found nothing; allowed: an effect: one of score, life, end, back, reset, \
             remove, stun, checkpoint, carry, drop, splash, say",
        ),
        (
            "[[rules]]\nevery = 1\nback = true",
            "12: rules[0].back: found true; allowed: nothing: this occasion is about no body",
        ),
        (
            "[[zones]]\nname = \"a\"\n[[teams]]\nname = \"a\"",
            "11: zones[0].name: found \"a\"; allowed: a name that nothing else has",
        ),
        (
            "[[zones]]\nname = \"it\"",
            "11: zones[0].name: found \"it\"; allowed: a name that nothing else has",
        ),
        (
            "[[zones]]\nname = \"a\"\n[[rules]]\nenter = \"a\"\nend = \"win\"",
            "14: rules[0].end: found \"win\"; allowed: an end only in a scene with [round]",
        ),
        (
            "[round]\nplayers_min = 20",
            "11: round.players_min: found 20; allowed: at most limits.players = 16",
        ),
        (
            "[[rules]]\nevery = 1\nscore = 1.5",
            "12: rules[0].score: found 1.5; allowed: a whole number from -1000000 to 1000000",
        ),
        (
            "[round]\nstars = [3, 2, 1]",
            "11: round.stars: found [3, 2, 1]; allowed: three numbers of points, the least first",
        ),
        (
            "[[zones]]\nname = \"a\"\nkeep = true",
            "12: zones[0].keep: found true; allowed: nothing: only a zone that can be taken has it",
        ),
    ];
    for (more, wanted) in cases {
        let text = format!("{HEAD}pairs = []{HEROES}{more}");
        let error = Scene::parse("case.toml", &text).expect_err(more);
        assert_eq!(error.to_string(), format!("case.toml:{wanted}"));
    }
}

/// Plays the game from the guide, in which the ball is pushed over the edge and comes back.
#[test]
fn the_guides_game_is_won_by_pushing() {
    let guide = include_str!("../../../docs/scenes.md");
    let start = guide.find("title = \"Push\"").expect("the example");
    let text = guide[start..].split("```").next().expect("its end");
    let mut game = game_of(text);
    game.join(Seat(0));
    let mut scores = Vec::new();
    for _ in 0..2400 {
        play(&mut game, &[Buttons::RIGHT], None);
        let rules = game.rules.as_ref().expect("rules");
        let score = game.roster.players[0].standing.score;
        if rules.round.is_running() && scores.last() != Some(&score) {
            scores.push(score);
        }
        if !rules.winners.is_empty() {
            assert_eq!(rules.winners, [Side::Player(Seat(0))]);
            return;
        }
    }
    panic!("nobody won: scores {scores:?}");
}

/// Plays a case, and returns the runs of values for each key about which it has an expectation.
fn play_case(case: &Value, restored: bool) -> Vec<String> {
    // Nothing collides unless the case says so.
    let root = case.get("root").and_then(Value::as_str).unwrap_or("pairs = []");
    let text = format!("{HEAD}{root}{HEROES}{}", case["scene"].as_str().expect("a scene"));
    let file = Scene::parse("case.toml", &text);
    let scene = Arc::new(file.unwrap_or_else(|error| panic!("{}: {error}", case["name"])));
    let whole = |key, default| case.get(key).and_then(Value::as_integer).unwrap_or(default) as u32;
    let ticks = whole("ticks", 20);
    let keys: Vec<&String> = case["expect"].as_table().expect("a table").keys().collect();
    let [moves, ways] = ["moves", "ways"].map(|key| moves_of(case, key));
    let mut game = Game::new(Arc::clone(&scene), 7);
    (0..whole("players", 1)).for_each(|seat| game.join(Seat(seat as u16)));
    let mut values = vec![Vec::new(); keys.len()];
    for tick in 1..=ticks {
        let due: Vec<&Move> = moves.iter().filter(|step| step.tick == tick).collect();
        for step in &due {
            match step.what.as_str() {
                "join" => game.join(Seat(step.x as u16)),
                "leave" => game.leave(Seat(step.x as u16)),
                _ => {}
            }
        }
        for (id, place) in places_of(&due, &game) {
            game.world.set_position(id, place);
        }
        let ways: Vec<&Move> = ways.iter().filter(|step| step.tick == tick).collect();
        let places = places_of(&ways, &game);
        let at_rest = Input::default();
        let inputs: Vec<(Seat, Input)> =
            game.players().map(|player| (player.seat, at_rest)).collect();
        game.tick_watched(&inputs, &mut |phase, world: &mut World| {
            if phase == crate::Phase::Inputs {
                places.iter().for_each(|&(id, place)| world.set_position(id, place));
            }
        });
        if restored {
            let saved = game.save();
            let again = Game::restore(Arc::clone(&scene), &saved).expect("what was saved");
            assert_eq!(again.hash(), game.hash(), "{} at tick {tick}", case["name"]);
            game = again;
        }
        for (key, values) in keys.iter().zip(&mut values) {
            values.push(value_of(key, &game));
        }
    }
    values.iter().map(|values| runs(values)).collect()
}

fn moves_of(case: &Value, key: &str) -> Vec<Move> {
    let steps = case.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    let read = |step: &Value| {
        let number = |index: usize| match &step[index] {
            Value::Integer(whole) => *whole as f32,
            other => other.as_float().expect("a number") as f32,
        };
        let what = step[1].as_str().expect("a body").to_owned();
        let y = if step.as_array().expect("a step").len() > 3 { number(3) } else { 0.0 };
        Move { tick: number(0) as u32, what, x: number(2), y }
    };
    steps.iter().map(read).collect()
}

/// Bodies to be moved, with their new positions.
fn places_of(due: &[&Move], game: &Game) -> Vec<(BodyId, Vec2)> {
    let placed = |step: &&&Move| {
        let id = match step.what.strip_prefix("hero ") {
            Some(seat) => {
                let seat = Seat(seat.parse().expect("a seat"));
                game.players().find(|player| player.seat == seat)?.hero
            }
            None => body_named(game, &step.what),
        };
        Some((id?, Vec2::new(step.x, step.y)))
    };
    due.iter().filter_map(|step| placed(&step)).collect()
}

fn body_named(game: &Game, name: &str) -> Option<BodyId> {
    let bodies = &game.scene.bodies;
    let index = bodies.iter().position(|body| body.name.as_deref() == Some(name));
    index.and_then(|index| game.roster.placed[index])
}

/// The value of a key after a tick, as a word; empty for the default value.
fn value_of(key: &str, game: &Game) -> String {
    let (what, name) = key.split_once(' ').unwrap_or((key, ""));
    let rules = game.rules.as_ref().expect("rules");
    let set = &game.scene.rules;
    let zone = || set.zones.iter().position(|zone| zone.name == name).expect("a zone");
    let on = |bits: u64, index: usize| {
        if bits >> index & 1 == 1 { "on".to_owned() } else { String::new() }
    };
    let number = |value: i32| if value == 0 { String::new() } else { value.to_string() };
    let standing = || match set.teams.iter().position(|team| team.name == name) {
        Some(team) => rules.teams.standings[team],
        None => {
            let seat = Seat(name.parse().expect("a team or a seat"));
            let mut players = game.roster.players.iter();
            players.find(|player| player.seat == seat).expect("a player").standing
        }
    };
    match what {
        "zone" => on(rules.levels.zones, zone()),
        "signal" => {
            let signals = &set.signals;
            let index = signals.iter().position(|signal| signal.name == name).expect("a signal");
            assert!(matches!(signals[index].kind, SignalKind::Relay(_) | SignalKind::Order(_)));
            on(rules.levels.signals, index)
        }
        "holder" => {
            let holder = rules.zones.holders().nth(zone()).expect("a zone");
            holder.map_or(String::new(), |side| side_name(game, side))
        }
        "score" => number(standing().score),
        "lives" => number(standing().lives),
        "there" => {
            if body_named(game, name).is_some() {
                "on".to_owned()
            } else {
                String::new()
            }
        }
        "stunned" => number(game.roster.players[0].controls.stun as i32),
        "place" => match body_named(game, name) {
            None => "gone".to_owned(),
            Some(id) => {
                let at = game.world.position(id);
                format!("{},{}", at.x.round(), at.y.round())
            }
        },
        "hero" => {
            let seat = Seat(name.parse().expect("a seat"));
            let player = game.players().find(|player| player.seat == seat);
            match player.and_then(|player| player.hero) {
                None => "gone".to_owned(),
                Some(id) => {
                    let at = game.world.position(id);
                    format!("{},{}", at.x.round(), at.y.round())
                }
            }
        }
        "carries" => {
            let player = &game.roster.players[name.parse::<usize>().expect("a slot")];
            let names = game.scene.bodies.iter().map(|body| body.name.clone().unwrap_or_default());
            let carried = player.carried.map(|carried| Some(carried.body));
            let mut named = names.zip(&game.roster.placed);
            named.find(|(_, id)| carried == Some(**id)).map_or(String::new(), |(name, _)| name)
        }
        "phase" => match rules.round.phase {
            RoundPhase::Waiting => "waiting",
            RoundPhase::Countdown => "countdown",
            RoundPhase::Running => "",
            RoundPhase::Over => "over",
        }
        .to_owned(),
        "winners" => {
            let winners = rules.winners.iter().map(|&side| side_name(game, side));
            winners.collect::<Vec<_>>().join("+")
        }
        other => panic!("unknown key {other}"),
    }
}

fn side_name(game: &Game, side: Side) -> String {
    match side {
        Side::Team(team) => game.scene.rules.teams[usize::from(team)].name.clone(),
        Side::Player(seat) => seat.0.to_string(),
    }
}

/// Runs of equal values, like "3-7 on, 9 on". Empty values are left out.
fn runs(values: &[String]) -> String {
    let mut text = String::new();
    let mut start = 0;
    for end in 1..=values.len() {
        if end < values.len() && values[end] == values[start] {
            continue;
        }
        if !values[start].is_empty() {
            let comma = if text.is_empty() { "" } else { ", " };
            let (first, last) = (start + 1, end);
            let range = if first == last { first.to_string() } else { format!("{first}-{last}") };
            write!(text, "{comma}{range} {}", values[start]).unwrap();
        }
        start = end;
    }
    text
}
