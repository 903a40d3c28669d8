//! Tests in which bots come and go with people, and play whole matches.

use super::*;
use crate::Room;
use crate::divergence;
use crate::log::GameLog;
use jostle_game::{RoundPhase, Scene};
use jostle_protocol::replay::{Change, Replay, Start, header};
use std::sync::Arc;

const SECOND: u32 = 60;

fn scene(name: &str) -> Arc<Scene> {
    let found = Scene::built_in().into_iter().find(|scene| scene.name == name);
    Arc::new(found.expect("a shipped scene"))
}

fn look(name: &str) -> Appearance {
    Appearance::new(name, 0).expect("a good name")
}

fn join(room: &mut Room) -> Seat {
    room.join(look("Ann"), None).expect("a seat").claim.seat
}

fn ticks(room: &mut Room, count: u32) {
    (0..count).for_each(|_| room.tick());
}

/// The teams of the players in the game, in seat order.
fn teams(room: &Room) -> Vec<Option<u8>> {
    let round = room.game().round().expect("a round");
    round.players.iter().map(|player| player.team).collect()
}

#[test]
fn bots_come_with_the_first_player_and_go_with_the_last() {
    let mut room = Room::new("test", scene("hockey"), 1);
    ticks(&mut room, 10);
    assert_eq!(room.bots(), 0, "nobody plays with nobody");
    let ann = join(&mut room);
    ticks(&mut room, 1);
    assert_eq!((room.players(), room.bots(), room.connected()), (1, 3, 1));
    ticks(&mut room, 5 * SECOND);
    room.leave(ann);
    ticks(&mut room, 1);
    assert_eq!((room.players(), room.bots(), room.snapshot().players.len()), (0, 0, 0));
}

#[test]
fn bots_play_whenever_they_come() {
    let mut room = Room::new("test", scene("hockey"), 1);
    for empty in [0, 500, 5000] {
        ticks(&mut room, empty);
        let ann = join(&mut room);
        ticks(&mut room, 120);
        let bots = room.snapshot().players.iter().filter(|player| player.seat != ann);
        let played: Vec<u32> = bots.map(|bot| bot.input_seq).collect();
        assert_eq!(played.len(), 3);
        assert!(played.iter().all(|played| *played > 100), "after {empty} ticks: {played:?}");
        room.leave(ann);
    }
}

#[test]
fn a_room_is_filled_with_as_many_bots_as_are_asked_for() {
    let bots = |name: &str, fill| {
        let mut room = Room::filled("test", scene(name), 1, fill);
        join(&mut room);
        ticks(&mut room, 1);
        room.bots()
    };
    assert_eq!([bots("hockey", 0), bots("hockey", 1), bots("hockey", 3)], [0, 0, 2]);
    assert_eq!(bots("hockey", 500), 7, "as many as there are seats");
    assert_eq!(bots("arena", 3), 2, "its file asks for none");
    assert_eq!(bots("bounds", 3), 0, "its players have no heroes");
}

#[test]
fn a_room_filled_as_its_scene_says_plays_the_same_game() {
    let play = |mut room: Room| {
        join(&mut room);
        ticks(&mut room, 20 * SECOND);
        room.game().hash()
    };
    let asked = Room::filled("test", scene("hill"), 5, 4);
    assert_eq!(play(Room::new("test", scene("hill"), 5)), play(asked));
}

#[test]
fn a_bot_gives_up_the_colour_that_a_player_chose() {
    let mut room = Room::new("test", scene("hill"), 1);
    room.record("test", 0);
    join(&mut room);
    ticks(&mut room, 30);
    let colors = |room: &Room| -> Vec<(Seat, u8)> {
        room.snapshot().players.iter().map(|p| (p.seat, p.appearance.color)).collect()
    };
    for _ in 0..2 {
        let bot = colors(&room)
            .into_iter()
            .find(|(seat, _)| room.idle_ticks(*seat).is_none())
            .expect("a bot");
        let bob = Appearance::new("Bob", bot.1).expect("a good name");
        let seat = room.join(bob, None).expect("a seat").claim.seat;
        ticks(&mut room, 30);
        assert!(colors(&room).contains(&(seat, bot.1)), "{bot:?}: {:?}", colors(&room));
        let mut worn: Vec<u8> = colors(&room).iter().map(|(_, color)| *color).collect();
        worn.sort_unstable();
        worn.dedup();
        assert_eq!(worn.len(), 4, "four colours");
    }
    let mut bytes = header();
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    verify(bytes);
}

#[test]
fn bots_make_room_in_the_team_that_needs_a_player() {
    for name in ["hockey", "flags", "roundup"] {
        let mut room = Room::new("test", scene(name), 1);
        for people in 1..=6usize {
            join(&mut room);
            ticks(&mut room, 3);
            assert_eq!(room.bots(), 4usize.saturating_sub(people), "{name}, beside {people}");
            let teams = teams(&room);
            let left = teams.iter().filter(|team| **team == Some(0)).count();
            assert!(teams.len() - left <= left && left <= teams.len() - left + 1, "{teams:?}");
        }
    }
}

#[test]
fn a_game_of_teams_waits_for_nobody() {
    for name in ["flags", "roundup", "pong"] {
        let mut room = Room::new("test", scene(name), 1);
        join(&mut room);
        ticks(&mut room, 4 * SECOND);
        let round = room.game().round().expect("a round");
        assert_eq!(round.phase, RoundPhase::Running, "{name}");
    }
}

#[test]
fn bots_keep_no_seat_from_anybody() {
    let text =
        scene("pong").source.replace("players = 8", "players = 2").replace("fill = 2", "fill = 9");
    let few = Arc::new(Scene::parse("few.toml", &text).unwrap_or_else(|error| panic!("{error}")));
    let mut room = Room::new("test", few, 1);
    join(&mut room);
    ticks(&mut room, 2);
    assert_eq!((room.players(), room.bots()), (1, 1));
    let bob = join(&mut room);
    ticks(&mut room, 2);
    assert_eq!((room.players(), room.bots()), (2, 0));
    assert!(room.join(look("Eve"), None).is_err(), "full of people");
    room.leave(bob);
    ticks(&mut room, 2);
    assert_eq!((room.players(), room.bots()), (1, 1), "a bot is back");
}

#[test]
fn nobody_makes_a_bot_leave() {
    let mut room = Room::new("test", scene("pong"), 1);
    join(&mut room);
    ticks(&mut room, 2);
    let before = room.snapshot().players.len();
    (0..8).map(Seat).filter(|&seat| seat != Seat(0)).for_each(|seat| room.leave(seat));
    ticks(&mut room, 2);
    assert_eq!((room.snapshot().players.len(), room.bots()), (before, 1));
}

#[test]
fn a_bot_that_the_host_removes_stays_away() {
    let mut room = Room::new("test", scene("hockey"), 1);
    let ann = join(&mut room);
    ticks(&mut room, 2);
    assert!(!room.dismiss_bot(ann), "no bot");
    assert!(room.dismiss_bot(Seat(2)));
    ticks(&mut room, 2);
    assert_eq!((room.bots(), room.snapshot().players.len()), (2, 3));
    room.leave(ann);
    ticks(&mut room, 2);
    join(&mut room);
    ticks(&mut room, 2);
    assert_eq!(room.bots(), 2, "the room keeps to it");
}

#[test]
fn a_bot_changes_over_where_a_player_left_a_team_too_small() {
    let mut room = Room::new("test", scene("hockey"), 1);
    let people = [join(&mut room), join(&mut room)];
    ticks(&mut room, 2);
    assert_eq!(teams(&room), [Some(0), Some(1), Some(0), Some(1)]);
    let mut seq = 0;
    let mut hold = |room: &mut Room, buttons| {
        seq += 1;
        room.input(people[0], seq, Input::new(buttons, None));
        ticks(room, 1);
    };
    hold(&mut room, Buttons::TEAM);
    hold(&mut room, Buttons::default());
    assert_eq!(teams(&room), [Some(1), Some(1), Some(0), Some(1)]);
    ticks(&mut room, 2 * SURVEY_TICKS);
    assert_eq!(teams(&room), [Some(1), Some(1), Some(0), Some(0)], "the bot of three, once");
}

#[test]
fn bots_keep_nobody_from_the_next_round() {
    let mut room = Room::new("test", scene("splash"), 1);
    let ann = join(&mut room);
    let phase = |room: &Room| room.game().round().expect("a round").phase;
    let mut seq = 0;
    let mut hold = |room: &mut Room, buttons| {
        seq += 1;
        room.input(ann, seq, Input::new(buttons, None));
        ticks(room, 1);
    };
    while phase(&room) != RoundPhase::Over {
        hold(&mut room, Buttons::default());
    }
    (0..70).for_each(|_| hold(&mut room, Buttons::default()));
    assert_eq!(phase(&room), RoundPhase::Over, "not before the player is done with the result");
    (0..3).for_each(|_| hold(&mut room, Buttons::AGAIN));
    assert_ne!(phase(&room), RoundPhase::Over);
}

#[test]
fn a_recording_with_bots_verifies_and_the_same_inputs_give_the_same_bytes() {
    let played = || {
        let mut room = Room::new("test", scene("splash"), 9);
        room.record("test", 0);
        for tick in 0..900u32 {
            if tick == 100 || tick == 400 {
                join(&mut room);
            }
            if tick == 600 {
                room.leave(Seat(0));
            }
            room.tick();
        }
        let mut bytes = header();
        room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
        bytes
    };
    let bytes = played();
    assert_eq!(bytes, played());
    verify(bytes);
}

fn verify(bytes: Vec<u8>) {
    let replay = Arc::new(Replay::read(bytes).expect("a replay"));
    let found = divergence::verify(&replay, |_| {}).expect("it can be played");
    assert!(found.is_none(), "it differs");
}

/// The result of a match between bots.
struct Match {
    ticks: u32,
    winners: Vec<Side>,
    /// The points of each player.
    scores: Vec<i32>,
    bytes: Vec<u8>,
}

/// Lets bots play a round to its end, and records the round.
fn play_match(name: &str, players: u16, seed: u64) -> Match {
    let scene = scene(name);
    let mut game = Game::new(Arc::clone(&scene), seed);
    let mut bots = Bots::filling(&game, seed, usize::from(players)).expect("a scene with bots");
    let (scene_name, source) = (scene.name.clone(), scene.source.clone());
    let start = Start { scene_name, scene: source, seed, ..Start::default() };
    let mut log = GameLog::new(start, false, &game, Vec::new());
    log.record(0, &game, Vec::new());
    let mut changes = Vec::new();
    for seat in (0..players).map(Seat) {
        changes.push(Change::Join(seat, bots.look()));
        bots.add(seat);
        game.join(seat);
    }
    loop {
        bots.survey(&game, |_| None);
        let mut inputs = Vec::new();
        bots.play(&game, |seat, input| inputs.push((seat, input)));
        game.tick(&inputs);
        log.tick(std::mem::take(&mut changes), &inputs, &game, Vec::new);
        let round = game.round().expect("a round");
        if round.phase == RoundPhase::Over {
            let mut bytes = header();
            log.recording_end(&game).iter().for_each(|record| bytes.extend(record.seal()));
            let scores = round.players.iter().map(|player| player.side.score).collect();
            return Match { ticks: game.tick_count(), winners: round.winners, scores, bytes };
        }
        assert!(game.tick_count() < 1200 * SECOND, "{name} has no end");
    }
}

/// Number of rounds, of ten, that bots win where all players are one crew.
fn rounds_won(name: &str, players: u16) -> usize {
    (0..10).filter(|&seed| !play_match(name, players, seed).winners.is_empty()).count()
}

#[test]
fn bots_win_what_a_crew_plays() {
    for (name, players, least) in
        [("lamp", 1, 9), ("lock", 1, 8), ("lock", 3, 5), ("slingshot", 1, 3), ("herd", 2, 5)]
    {
        let won = rounds_won(name, players);
        println!("{name}: {players} bots won {won} rounds of 10");
        assert!(won >= least, "{name}: {players} bots won only {won} rounds");
    }
}

/// A stranger's scene: a plate takes a door away for a while, and behind it lies what is worth a point.
const CELLAR: &str = r#"
title = "Cellar"
size = [200, 100]
tools = ["steer"]
groups = ["hero", "platform", "coin"]
pairs = [["hero", "platform"], ["hero", "coin"]]

[round]
goal = 2
countdown = 0
fill = 2

[hero]
size = [8, 10]
spawns = [[20, 20], [35, 20]]

[[bodies]]
kind = "wall"
position = [100, -6]
size = [240, 20]

[[bodies]]
kind = "wall"
position = [120, 52]
size = [6, 96]
while = "!open"

[[bodies]]
kind = "block"
group = "coin"
position = [180, 30]
radius = 4

[[zones]]
name = "plate"
area = [[50, 60], [70, 80]]

[[zones]]
name = "cell"
area = [[150, 40], [170, 60]]

[[signals]]
name = "open"
when = "plate"
stays = 20

[[rules]]
touch = ["hero", "coin"]
score = 1

[[rules]]
enter = "cell"
score = 1
"#;

#[test]
fn bots_play_a_scene_that_they_do_not_know() {
    let scene = Scene::parse("cellar.toml", CELLAR).unwrap_or_else(|error| panic!("{error}"));
    let mut room = Room::new("test", Arc::new(scene), 1);
    let ann = join(&mut room);
    let phase = |room: &Room| room.game().round().expect("a round").phase;
    for _ in 0..60 * SECOND {
        ticks(&mut room, 1);
        if phase(&room) == RoundPhase::Over {
            break;
        }
    }
    let round = room.game().round().expect("a round");
    assert_eq!(round.phase, RoundPhase::Over);
    assert!(!round.winners.contains(&Side::Player(ann)), "{:?}", round.winners);
}

/// Number of matches for each game; `--nocapture` prints each side's wins.
const MATCHES: u64 = if cfg!(debug_assertions) { 1 } else { 100 };

#[test]
fn bots_play_every_game_to_its_end_and_their_replays_verify() {
    for (name, players) in [("pong", 2), ("hockey", 4), ("hill", 4), ("race", 4), ("splash", 4)] {
        let (mut ticks, mut won) = (0, vec![0; usize::from(players)]);
        for seed in 0..MATCHES {
            let played = play_match(name, players, seed);
            ticks += u64::from(played.ticks);
            for side in played.winners {
                let number = match side {
                    Side::Team(team) => usize::from(team),
                    Side::Player(seat) => usize::from(seat.0),
                };
                won[number] += 1;
            }
            verify(played.bytes);
        }
        let seconds = ticks / MATCHES / u64::from(SECOND);
        println!("{name}: {MATCHES} matches, {seconds} s each, won {won:?}");
    }
}

#[test]
fn bots_finish_a_race_after_the_first() {
    let played = play_match("race", 4, 3);
    let home = played.scores.iter().filter(|&&laps| laps == 3).count();
    assert!(played.winners.len() == 1 && home >= 3, "{:?}", played.scores);
}

/// A game as the editor writes it: heroes that run and jump, a ball on the floor, and a goal for each of two teams.
const KICKABOUT: &str = r#"
title = "Kickabout"
size = [320, 180]
tools = ["steer"]
groups = ["hero", "platform", "block"]
pairs = [["hero", "platform"], ["hero", "hero"], ["hero", "block"], ["block", "platform"]]

[round]
goal = 5
time = 180
fill = 2

[[teams]]
name = "orange"

[[teams]]
name = "sky"

[hero]
size = [9, 12]
walk = { speed = 40, jump = 50 }
spawns = [[40, 16]]

[[bodies]]
kind = "wall"
position = [160, 2]
size = [320, 4]

[[bodies]]
kind = "wall"
position = [2, 92]
size = [4, 176]

[[bodies]]
kind = "wall"
position = [318, 92]
size = [4, 176]

[[bodies]]
kind = "block"
position = [160, 60]
radius = 4

[[zones]]
name = "goal-1"
area = [[32, 4], [48, 44]]
who = ["block"]

[[zones]]
name = "goal-2"
area = [[272, 4], [288, 44]]
who = ["block"]

[[rules]]
enter = "goal-1"
score = 1
to = "sky"
back = 1.5

[[rules]]
enter = "goal-2"
score = 1
to = "orange"
back = 1.5
"#;

/// The goals of each team after at most `seconds` of [`KICKABOUT`]. The hero of the seat whose activity is given does not
/// move; bots have the rest.
fn kickabout(seed: u64, seconds: u32, still: Option<(u16, Activity)>) -> Vec<i32> {
    let activity =
        |seat: Seat| still.filter(|(own, _)| *own == seat.0).map(|(_, activity)| activity);
    let scene = Scene::parse("kickabout.toml", KICKABOUT).unwrap_or_else(|error| panic!("{error}"));
    let mut game = Game::new(Arc::new(scene), seed);
    let mut bots = Bots::filling(&game, seed, 2).expect("a scene with bots");
    for seat in (0..2).map(Seat) {
        game.join(seat);
        if activity(seat).is_none() {
            bots.add(seat);
        }
    }
    for _ in 0..seconds * SECOND {
        bots.survey(&game, activity);
        let mut inputs = Vec::new();
        bots.play(&game, |seat, input| inputs.push((seat, input)));
        game.tick(&inputs);
        if game.round().is_some_and(|round| round.phase == RoundPhase::Over) {
            break;
        }
    }
    let round = game.round().expect("a round");
    round.teams.iter().map(|team| team.score).collect()
}

#[test]
fn a_bot_that_walks_scores_against_a_hero_at_rest() {
    for (seed, seat) in (0..5).flat_map(|seed| [(seed, 0), (seed, 1)]) {
        // It spares an active person, but plays all the same.
        for (activity, least) in [(Activity::Idle, 4), (Activity::Active, 1)] {
            let goals = kickabout(seed, 90, Some((seat, activity)));
            println!("seed {seed}, seat {seat} {activity:?}: {goals:?}");
            assert!(goals[usize::from(1 - seat)] >= least, "seed {seed}, {activity:?}: {goals:?}");
        }
    }
}

#[test]
fn bots_that_walk_score_against_each_other() {
    for seed in 0..5 {
        let goals = kickabout(seed, 60, None);
        println!("seed {seed}: {goals:?}");
        assert!(goals.iter().sum::<i32>() >= 2, "seed {seed}: {goals:?}");
    }
}
