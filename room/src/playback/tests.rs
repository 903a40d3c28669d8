//! Checks that recorded games can be replayed from any of their ticks.

use super::*;
use crate::log::{KEYFRAME_TICKS_MIN, REPLAY_BLOCK_TICKS};
use crate::{Claim, Room};
use jostle_game::{Buttons, Input};
use jostle_protocol::replay::{Ending, Record, header};
use jostle_sim::Rng;
use jostle_sim::Vec2;

/// A replay of a room whose players join, give random inputs, lose their sockets, return and leave.
pub fn recorded(scene: &str, ticks: u32, seed: u64) -> Arc<Replay> {
    Arc::new(Replay::read(file(&records(scene, ticks, seed))).expect("a replay"))
}

pub fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

pub fn records(scene: &str, ticks: u32, seed: u64) -> Vec<Record> {
    let scene = Scene::built_in().into_iter().find(|built_in| built_in.name == scene);
    let scene = Arc::new(scene.expect("a shipped scene"));
    let mut room = Room::new("test", Arc::clone(&scene), seed);
    room.record("test", 0);
    let mut rng = Rng::new(seed, 1);
    let mut records = Vec::new();
    let mut claims = Vec::new();
    for tick in 0..ticks {
        if tick % 200 == 0 && claims.len() < 3 {
            let look = Appearance::new("Ann", claims.len() as u8).unwrap();
            claims.push(room.join(look, None).unwrap().claim);
        }
        if tick == 450 {
            room.disconnect(claims[0].seat);
        }
        if tick == 500 {
            let look = Appearance::new("Bob", 5).unwrap();
            room.join(look, Some(claims[0])).unwrap();
        }
        if tick == 700 {
            room.leave(claims[1].seat);
        }
        for &Claim { seat, .. } in &claims {
            if rng.below(4) > 0 {
                room.input(seat, tick + 1, wild(&mut rng, scene.size));
            }
        }
        room.tick();
        records.extend(room.take_records());
    }
    records.extend(room.stop_recording());
    records
}

fn wild(rng: &mut Rng, size: Vec2) -> Input {
    let mut buttons = Buttons((rng.next_u32() & rng.next_u32()) as u16 & Buttons::ALL.0);
    if rng.below(100) > 0 {
        buttons.0 &= !Buttons::CLEAR.0;
    }
    let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
    Input::new(buttons, Some(pointer))
}

#[test]
fn every_scene_replays_as_recorded() {
    for scene in Scene::built_in() {
        let replay = recorded(&scene.name, 900, 5);
        assert_eq!(replay.ending(), Ending::Whole);
        assert_eq!(replay.last_tick(), 900);
        assert_eq!(crate::divergence::verify(&replay, |_| {}), Ok(None), "{}", scene.name);
    }
}

#[test]
fn names_are_those_at_the_tick() {
    let mut playback = Playback::new(recorded("arena", 900, 5)).unwrap();
    let names = |playback: &Playback| -> Vec<String> {
        playback
            .snapshot()
            .players
            .iter()
            .map(|player| player.appearance.name.to_string())
            .collect()
    };
    playback.seek(300).unwrap();
    assert_eq!(names(&playback), ["Ann", "Ann 2"]);
    playback.seek(600).unwrap();
    assert_eq!(names(&playback), ["Bob", "Ann 2", "Ann 3"]);
    playback.seek(800).unwrap();
    assert_eq!(names(&playback), ["Bob", "Ann 3"]);
}

#[test]
fn seeking_gives_the_same_state_as_playing() {
    let ticks = KEYFRAME_TICKS_MIN + 300;
    let replay = recorded("impulse", ticks, 9);
    assert_eq!(replay.keyframe_ticks().collect::<Vec<_>>(), [KEYFRAME_TICKS_MIN]);
    let mut straight = Playback::new(Arc::clone(&replay)).unwrap();
    let mut hashes = vec![straight.game().hash()];
    while let Some(played) = straight.step().unwrap() {
        assert!(played.agrees, "tick {}", played.tick);
        hashes.push(straight.game().hash());
    }
    let mut rng = Rng::new(1, 1);
    let mut playback = Playback::new(replay).unwrap();
    for _ in 0..12 {
        let tick = rng.below(ticks + 1);
        playback.seek(tick).unwrap();
        assert_eq!((playback.tick(), playback.game().hash()), (tick, hashes[tick as usize]));
    }
    playback.seek(u32::MAX).unwrap();
    assert_eq!(playback.tick(), ticks);
    assert_eq!(playback.step(), Ok(None));
}

#[test]
fn a_recording_that_begins_in_mid_game_begins_with_a_keyframe() {
    let scene = Arc::new(Scene::built_in().remove(0));
    let mut room = Room::new("test", scene, 3);
    room.join(Appearance::new("Ann", 0).unwrap(), None).unwrap();
    (0..100).for_each(|_| room.tick());
    room.join(Appearance::new("Bob", 0).unwrap(), None).unwrap();
    room.record("test", 0);
    (0..100).for_each(|_| room.tick());
    let replay = Arc::new(Replay::read(file(&room.stop_recording())).unwrap());
    assert_eq!((replay.first_tick(), replay.last_tick()), (100, 200));
    let mut playback = Playback::new(Arc::clone(&replay)).unwrap();
    assert_eq!(playback.snapshot().players.len(), 1);
    playback.seek(150).unwrap();
    assert_eq!(playback.snapshot().players.len(), 2);
    playback.seek(0).unwrap();
    assert_eq!(playback.tick(), 100);
    assert_eq!(crate::divergence::verify(&replay, |_| {}), Ok(None));
}

#[test]
fn records_are_ready_while_the_game_runs() {
    let records = records("pile", 3 * REPLAY_BLOCK_TICKS as u32 + 10, 2);
    let kinds: Vec<_> = records
        .iter()
        .map(|record| match record {
            Record::Start(_) => "start".to_owned(),
            Record::Ticks(block) => format!("{}..={}", block.first, block.last()),
            Record::Keyframe(keyframe) => format!("keyframe {}", keyframe.tick),
            Record::End { tick, .. } => format!("end {tick}"),
            Record::Host(_) => "host".to_owned(),
        })
        .collect();
    assert_eq!(kinds, ["start", "1..=300", "301..=600", "601..=900", "901..=910", "end 910"]);
}

#[test]
fn impossible_changes_are_refused() {
    let mut records = records("pile", 400, 2);
    let Record::Ticks(block) = &mut records[1] else { panic!("the first block") };
    block.ticks[50].changes.push(Change::Leave(Seat(9)));
    let replay = Arc::new(Replay::read(file(&records)).unwrap());
    let refused = crate::divergence::verify(&replay, |_| {});
    assert_eq!(refused, Err(PlaybackError::Change { tick: 51, seat: 9 }));
}

/// Records with a valid seal but undecodable contents are detected when they are played or sought.
#[test]
fn a_record_that_cannot_be_decoded_ends_the_replay_there() {
    use jostle_protocol::replay::frame;
    let records = records("pile", KEYFRAME_TICKS_MIN + 10, 2);
    let broken_at = |kind: u8, tick: u32| {
        let mut bytes = header();
        for record in &records {
            let mut sealed = record.seal();
            let holds = match record {
                Record::Ticks(block) => kind == 2 && block.first == tick,
                Record::Keyframe(keyframe) => kind == 3 && keyframe.tick == tick,
                _ => false,
            };
            if holds {
                let payload = &sealed[9..sealed.len() - 1];
                sealed = frame(kind, payload);
            }
            bytes.extend(sealed);
        }
        Arc::new(Replay::read(bytes).unwrap())
    };
    let replay = broken_at(2, 301);
    assert_eq!((replay.last_tick(), replay.ending()), (KEYFRAME_TICKS_MIN + 10, Ending::Whole));
    let mut playback = Playback::new(Arc::clone(&replay)).unwrap();
    assert_eq!(playback.seek(300), Ok(()));
    let refused = PlaybackError::Record { tick: 301 };
    assert_eq!(playback.step(), Err(refused.clone()));
    assert_eq!(crate::divergence::verify(&replay, |_| {}), Err(refused));

    let replay = broken_at(3, KEYFRAME_TICKS_MIN);
    let mut playback = Playback::new(Arc::clone(&replay)).unwrap();
    let refused = PlaybackError::Record { tick: KEYFRAME_TICKS_MIN };
    assert_eq!(playback.jump(u32::MAX), Err(refused.clone()));
    assert_eq!(crate::divergence::verify(&replay, |_| {}), Err(refused));
}
