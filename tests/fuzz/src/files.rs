//! Properties of files: replays and scenes.

use crate::part;
use jostle_game::scene::Plan;
use jostle_game::{Buttons, Game, Input, Scene, Seat};
use jostle_protocol::replay::{Replay, frame, header};
use jostle_room::Playback;
use jostle_sim::Vec2;
use std::sync::Arc;

const TICKS_MAX: usize = 3;
/// Worlds with more bodies than this are read but not played, because playing them would take long and show nothing
/// new.
const BODIES_PLAYED_MAX: usize = 300;

/// Checks a replay. The input is the file itself if its first byte is even, and otherwise consists of records as parts,
/// which are given frames with correct checksums.
pub fn replay(bytes: &[u8]) {
    let Some((&kind, mut rest)) = bytes.split_first() else { return };
    if kind % 2 == 0 {
        return read_replay(rest.to_vec());
    }
    let mut file = header();
    while let Some((kind, payload)) = part(&mut rest) {
        file.extend(frame(kind, payload));
    }
    read_replay(file);
}

fn read_replay(file: Vec<u8>) {
    let length = file.len();
    let Ok(replay) = Replay::read(file) else { return };
    assert!(replay.first_tick() <= replay.last_tick());
    assert_eq!(replay.byte_count(), length);
    let ticks = replay.first_tick()..=replay.last_tick();
    assert!(replay.keyframe_ticks().all(|tick| ticks.contains(&tick)));
    for tick in [replay.first_tick(), replay.last_tick()] {
        let held = replay.block_with(tick);
        assert!(held.is_none_or(|block| block.first <= tick && tick <= block.last()));
        let before = replay.keyframe_before(tick);
        assert!(before.is_none_or(|keyframe| keyframe.tick <= tick));
    }
    let sizes = replay.sizes();
    let sum = sizes.start + sizes.hashes + sizes.inputs + sizes.keyframes + sizes.end + sizes.lost;
    assert_eq!(sum, length, "{sizes:?}");
    play_replay(replay);
}

fn play_replay(replay: Replay) {
    let Ok(mut playback) = Playback::new(Arc::new(replay)) else { return };
    for _ in 0..TICKS_MAX {
        let small = playback.game().bodies().count() <= BODIES_PLAYED_MAX;
        if !small || !matches!(playback.step(), Ok(Some(_))) {
            return;
        }
    }
    playback.snapshot();
}

/// Checks a scene file: every accepted scene must be playable.
pub fn scene(bytes: &[u8]) {
    let source = String::from_utf8_lossy(bytes);
    match Scene::parse("fuzz.toml", &source) {
        Ok(scene) => play_scene(Arc::new(scene)),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn play_scene(scene: Arc<Scene>) {
    // Both results depend only on the scene, and computing them must not fail.
    let _ = Plan::of(&scene);
    let mut game = Game::new(Arc::clone(&scene), 1);
    if game.bodies().count() > BODIES_PLAYED_MAX {
        return;
    }
    game.join(Seat(0));
    for tick in 0..TICKS_MAX {
        let buttons = Buttons(Buttons::ALL.0 >> tick);
        let pointer = Some(Vec2::new(scene.size.x / 2.0, 1.0));
        game.tick(&[(Seat(0), Input::new(buttons, pointer))]);
    }
    let saved = game.save();
    let again = Game::restore(scene, &saved).expect("what was saved can be restored");
    assert_eq!(again.hash(), game.hash());
}
