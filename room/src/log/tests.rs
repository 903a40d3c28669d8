use super::*;
use crate::divergence::verify;
use crate::room::Room;
use jostle_game::{Buttons, Scene, Seat};
use jostle_protocol::replay::{Ending, Replay, header};

/// A busy arena with four players, after this many ticks. It keeps clips.
fn arena(ticks: u32) -> Room {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    let mut room = Room::new("oak", Arc::new(scene.expect("a shipped scene")), 7);
    room.keep_clips("0.0.0");
    room.record("0.0.0", 5);
    for color in 0..4 {
        room.join(Appearance { name: format!("P{color}").into(), color }, None).expect("a seat");
    }
    for tick in 1..=ticks {
        for seat in 0..4 {
            let buttons = Buttons((tick / 17 * 7 + seat * 5) as u16 % 32);
            let pointer = Some(jostle_sim::Vec2::new((tick % 150) as f32, (seat * 20) as f32));
            room.input(Seat(seat as u16), tick, Input::new(buttons, pointer));
        }
        room.tick();
    }
    room
}

fn bytes(records: &[Arc<Record>]) -> Vec<u8> {
    header().into_iter().chain(records.iter().flat_map(|record| record.seal())).collect()
}

fn recorded(room: &mut Room) -> Vec<u8> {
    let records = room.stop_recording();
    header().into_iter().chain(records.iter().flat_map(Record::seal)).collect()
}

fn plays_again(bytes: Vec<u8>) -> Replay {
    let replay = Replay::read(bytes).expect("a replay");
    assert_eq!(replay.ending(), Ending::Whole);
    assert_eq!(verify(&Arc::new(replay.clone()), |_| {}), Ok(None));
    replay
}

#[test]
fn a_clip_has_the_last_twenty_seconds_and_plays_again() {
    for ticks in [1, 700, CLIP_TICKS, CLIP_TICKS + 1, 3 * CLIP_TICKS + 77] {
        let room = arena(ticks);
        let kept = Replay::read(bytes(&room.clip(9).expect("clips are kept"))).expect("a replay");
        let from = ticks.saturating_sub(CLIP_TICKS);
        assert!(kept.first_tick() <= from && from - kept.first_tick() <= CLIP_KEYFRAME_TICKS_MIN);
        let clip = plays_again(cut(kept, from, ticks).expect("a clip"));
        assert_eq!((clip.first_tick(), clip.last_tick()), (from, ticks));
        assert_eq!((clip.start().unix_s, clip.start().room.as_str()), (9, "oak"));
        assert_eq!(clip.end_hash(), Some(room.game().hash()));
        assert_eq!(clip.keyframe_ticks().collect::<Vec<_>>(), [from][usize::from(from == 0)..]);
    }
}

#[test]
fn any_part_of_a_replay_can_be_cut_out() {
    let mut room = arena(2000);
    let replay = Replay::read(recorded(&mut room)).expect("a replay");
    for (from, to) in [(0, 2000), (0, 1), (5, 300), (300, 301), (299, 901), (1999, 2000)] {
        let clip = plays_again(cut(replay.clone(), from, to).expect("a clip"));
        assert_eq!((clip.first_tick(), clip.last_tick()), (from, to));
    }
    let clip = plays_again(cut(replay, 1000, u32::MAX).expect("a clip"));
    assert_eq!((clip.first_tick(), clip.last_tick()), (1000, 2000));
}

#[test]
fn the_buffer_forgets_what_is_older() {
    let room = arena(6000);
    let clips = room.clip(0).expect("clips are kept");
    let ticks = clips.iter().map(|record| match &**record {
        Record::Ticks(block) => block.ticks.len(),
        _ => 0,
    });
    assert!(ticks.sum::<usize>() <= (CLIP_TICKS + CLIP_KEYFRAME_TICKS_MIN) as usize);
}
