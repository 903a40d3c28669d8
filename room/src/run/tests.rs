//! Checks that a run is read from its replay, and that a replay that was tampered with proves none.

use super::*;
use crate::Room;
use jostle_game::{Buttons, Input};
use jostle_protocol::replay::{Block, Change, Record, header};

/// A dash to the right. The first to reach the post wins.
const DASH: &str = r#"
title = "Dash"
size = [100, 60]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero"]
[round]
goal = 1
time = 60
pause = 2
[hero]
size = [4, 4]
spawns = [[10, 30], [10, 40]]
[[zones]]
name = "post"
area = [[80, 0], [100, 60]]
[[rules]]
enter = "post"
score = 1
"#;

fn scene(text: &str) -> Arc<Scene> {
    Arc::new(Scene::parse("dash.toml", text).expect("a scene"))
}

fn built_in(name: &str) -> Scene {
    let mut scenes = Scene::built_in().into_iter();
    scenes.find(|scene| scene.name == name).expect("a shipped scene")
}

/// The records of a game between Ann and Bob, in which Ann waits for this many ticks in each round and then flies to
/// the post.
fn records(ticks: u32, waits: &[u32]) -> Vec<Record> {
    let mut room = Room::new("alone", scene(DASH), 7);
    room.record("test", 1000);
    let look = |name| Appearance::new(name, 3).expect("a name");
    room.join(look("Bob"), None).expect("a seat");
    let ann = room.join(look("Ann"), None).expect("a seat").claim.seat;
    let (mut records, mut round, mut was) = (Vec::new(), 0, RoundPhase::Waiting);
    for seq in 1..=ticks {
        let info = room.game().round().expect("rules");
        let elapsed = seq - 1 - info.since;
        round += usize::from(was == RoundPhase::Over && info.phase != was);
        was = info.phase;
        let wait = waits.get(round).copied().unwrap_or(u32::MAX);
        let flies = was == RoundPhase::Running && elapsed >= wait;
        let buttons = if flies { Buttons::RIGHT } else { Buttons::default() };
        room.input(ann, seq, Input::new(buttons, None));
        room.tick();
        records.extend(room.take_records());
    }
    records.extend(room.recording_end());
    records
}

fn replay(records: &[Record]) -> Arc<Replay> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    Arc::new(Replay::read(bytes).expect("a start"))
}

fn proved(records: &[Record]) -> Result<Run, Unproven> {
    prove(&replay(records), &scene(DASH), || true)
}

fn blocks(records: &mut [Record]) -> impl Iterator<Item = &mut Block> {
    records.iter_mut().filter_map(|record| match record {
        Record::Ticks(block) => Some(block),
        _ => None,
    })
}

#[test]
fn a_run_is_the_best_round_that_was_won() {
    let run = proved(&records(1200, &[200, 60, 100])).expect("a run");
    assert_eq!(run.measure, Measure::Time);
    let names: Vec<_> = run.players.iter().map(|(seat, look)| (seat.0, &*look.name)).collect();
    assert_eq!((names, run.points), (vec![(1, "Ann")], 1));
    let alone = proved(&records(480, &[60])).expect("a run");
    assert_eq!(alone.begin, 180, "after a countdown of three seconds");
    assert!(alone.ticks() > 60 && alone.ticks() < 200, "{alone:?}");
    // The second round of the longer game was played like the only round of the other game.
    assert_eq!(run.ticks(), alone.ticks());
    assert!(run.begin > alone.end);
}

#[test]
fn a_game_that_goes_on_has_a_recording_to_its_present_end() {
    let mut room = Room::new("alone", scene(DASH), 7);
    assert_eq!(room.recording_end(), Vec::new());
    room.record("test", 0);
    let mut taken = Vec::new();
    for tick in 1..=700 {
        room.tick();
        taken.extend(room.take_records());
        let all = [&taken[..], &room.recording_end()].concat();
        let replay = replay(&all);
        assert_eq!((replay.last_tick(), replay.ending()), (tick, Ending::Whole));
    }
}

#[test]
fn a_replay_that_was_tampered_with_is_refused() {
    let whole = records(480, &[60]);
    let run = proved(&whole).expect("a run");
    let refused = |tamper: &dyn Fn(&mut Vec<Record>)| {
        let mut records = whole.clone();
        tamper(&mut records);
        proved(&records).expect_err("it was tampered with")
    };
    // Ann flies a tick earlier than in the recording.
    let earlier = refused(&|records| {
        let block = blocks(records).next().expect("ticks");
        let at = (run.begin + 59 - block.first) as usize;
        let (_, input) = block.ticks[at].inputs.last_mut().expect("Ann's");
        assert_eq!(input.buttons(), Buttons::default());
        *input = input.with_buttons(Buttons::RIGHT);
    });
    assert_eq!(earlier, Unproven::Differs(run.begin + 59));
    let hash = refused(&|records| blocks(records).next().expect("ticks").ticks[99].hash ^= 1);
    assert_eq!(hash, Unproven::Differs(100));
    let end = refused(&|records| match records.last_mut() {
        Some(Record::End { hash, .. }) => *hash ^= 1 << 63,
        other => panic!("{other:?} ends it"),
    });
    assert_eq!(end, Unproven::Differs(480));
    let seed = refused(&|records| match &mut records[0] {
        Record::Start(start) => start.seed += 1,
        other => panic!("{other:?} begins it"),
    });
    assert_eq!(seed, Unproven::Differs(1));
    let text = refused(&|records| match &mut records[0] {
        Record::Start(start) => start.scene = start.scene.replace("[80, 0]", "[70, 0]"),
        other => panic!("{other:?} begins it"),
    });
    assert_eq!(text, Unproven::OtherScene("dash".to_owned()));
    assert!(matches!(refused(&|records| drop(records.pop())), Unproven::NotWhole(_)));
    let seat = refused(&|records| {
        let joins = &mut blocks(records).next().expect("ticks").ticks[0].changes;
        joins.retain(|change| !matches!(change, Change::Join(Seat(1), _)));
    });
    assert!(matches!(seat, Unproven::Differs(_) | Unproven::Unplayable(_)), "{seat}");
    let late = proved(&records(4000, &[])).expect_err("time was up, and no hero came to the post");
    assert_eq!(late, Unproven::NoResult);
    let none = proved(&records(480, &[])).expect_err("a round without a winner");
    assert_eq!(none.to_string(), "no player wins a round in this replay");
}

#[test]
fn the_states_in_a_replay_are_compared_too() {
    let whole = records(2000, &[60]);
    let at = whole.iter().position(|record| matches!(record, Record::Keyframe(_)));
    let at = at.expect("a keyframe after half a minute");
    assert!(proved(&whole).is_ok());
    let with = |change: &dyn Fn(&mut jostle_protocol::replay::Keyframe)| {
        let mut records = whole.clone();
        let Record::Keyframe(keyframe) = &mut records[at] else { panic!("a keyframe") };
        change(keyframe);
        proved(&records)
    };
    assert_eq!(with(&|keyframe| keyframe.state[20] ^= 1), Err(Unproven::OtherState(1800)));
    assert_eq!(with(&|keyframe| keyframe.hash ^= 1), Err(Unproven::OtherState(1800)));
    assert_eq!(with(&|keyframe| drop(keyframe.members.pop())), Err(Unproven::OtherState(1800)));
    // In this game, a player starts with points.
    let mut records = whole.clone();
    let Record::Keyframe(keyframe) = records[at].clone() else { panic!("a keyframe") };
    records.insert(1, Record::Keyframe(jostle_protocol::replay::Keyframe { tick: 0, ..keyframe }));
    assert!(proved(&records).is_err());
}

#[test]
fn a_run_begins_at_the_first_tick_and_is_not_too_long() {
    let whole = records(480, &[60]);
    let later = |first_tick| match whole[0].clone() {
        Record::Start(start) => {
            Record::Start(jostle_protocol::replay::Start { first_tick, ..start })
        }
        other => panic!("{other:?} begins it"),
    };
    assert_eq!(proved(&[later(30)]), Err(Unproven::Midway(30)));
    let slow = prove(&replay(&whole), &scene(DASH), || false);
    assert_eq!(slow, Err(Unproven::TooSlow(1)));
    let tick = jostle_protocol::replay::Tick { changes: vec![], inputs: vec![], hash: 0 };
    let ticks = |first| Record::Ticks(Block { first, ticks: vec![tick.clone(); 600] });
    let mut long = vec![whole[0].clone()];
    long.extend((1..=RUN_TICKS_MAX + 1).step_by(600).map(ticks));
    assert_eq!(proved(&long), Err(Unproven::TooLong(RUN_TICKS_MAX + 600)));
}

#[test]
fn the_measure_follows_from_the_rules() {
    let measure = |name| Measure::of(&built_in(name));
    for name in ["race", "hill", "herd", "lock", "lamp"] {
        assert_eq!(measure(name), Some(Measure::Time), "{name}");
    }
    for name in ["arena", "splash", "slingshot"] {
        assert_eq!(measure(name), Some(Measure::Points), "{name}");
    }
    for name in ["pile", "hockey", "pong", "flags", "roundup", "tower"] {
        assert_eq!(measure(name), None, "{name}");
    }
}

#[test]
fn more_points_are_better_and_less_time() {
    let run = |measure, points, ticks: u32| {
        let (begin, end) = (100, 100 + ticks);
        Run { measure, begin, end, points, hash: 0, players: Vec::new() }.rank()
    };
    assert!(run(Measure::Time, 3, 500) < run(Measure::Time, 9, 501));
    assert!(run(Measure::Points, 9, 501) < run(Measure::Points, 3, 500));
    assert!(run(Measure::Points, 9, 500) < run(Measure::Points, 9, 501));
}

#[test]
fn a_game_of_more_players_than_a_room_takes_is_no_run() {
    let whole = records(480, &[60]);
    let small = Scene { players_max: 1, ..Scene::clone(&scene(DASH)) };
    assert_eq!(prove(&replay(&whole), &small, || true), Err(Unproven::TooMany(2)));
}

#[test]
fn a_run_ends_with_its_goal_even_if_the_round_goes_on() {
    let text = DASH.replace("goal = 1", "goal = 1\nfinish = 5");
    let mut plain = Room::new("alone", scene(DASH), 7);
    let mut waits = Room::new("alone", scene(&text), 7);
    let mut runs = Vec::new();
    for (room, text) in [(&mut plain, DASH), (&mut waits, &text)] {
        room.record("test", 1000);
        let look = |name| Appearance::new(name, 3).expect("a name");
        let ann = room.join(look("Ann"), None).expect("a seat").claim.seat;
        room.join(look("Bob"), None).expect("a seat");
        let mut records = Vec::new();
        for seq in 1..=900 {
            room.input(ann, seq, Input::new(Buttons::RIGHT, None));
            room.tick();
            records.extend(room.take_records());
        }
        records.extend(room.recording_end());
        runs.push(prove(&replay(&records), &scene(text), || true).expect("a run"));
    }
    assert_eq!((runs[0].begin, runs[0].end), (runs[1].begin, runs[1].end));
    assert_eq!(runs[0].players, runs[1].players);
}
