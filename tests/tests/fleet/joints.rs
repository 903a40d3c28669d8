//! Checks the replays of a fleet in which rooms continued at another node.

use super::games::Seen;
use super::node::Node;
use jostle_protocol::replay::Replay;
use jostle_room::Playback;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Ends the nodes and verifies all replays of public rooms: each must be complete, and each room that moved must have
/// continued at the other node with the very next tick, from exactly the same state. Returns the number of moves.
pub async fn verify_joints(mut seen: Seen) -> usize {
    for node in &mut seen.nodes {
        node.signal("TERM");
        node.ended().await;
    }
    let mut joints = 0;
    let replays: Vec<_> = seen.nodes.iter().map(Node::replays).collect();
    let verified = tokio::task::spawn_blocking(move || {
        replays.iter().flat_map(|dir| files(dir)).map(verify).collect::<Vec<_>>()
    });
    let parts = verified.await.expect("replays that can be played");
    for room in &seen.rooms {
        let mut of_room: Vec<_> = parts.iter().filter(|part| part.room == *room).collect();
        of_room.sort_by_key(|part| part.first.0);
        for pair in of_room.windows(2) {
            assert_eq!(pair[0].last, pair[1].first, "{room}: tick and hash where it went on");
            joints += 1;
        }
    }
    drop((seen.cluster, seen.dir));
    joints
}

/// A verified replay.
struct Part {
    room: String,
    first: (u32, u64),
    last: (u32, u64),
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(dir) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "jostle")).collect()
}

fn verify(path: PathBuf) -> Part {
    let replay = Replay::read(fs::read(path).expect("a file")).expect("a replay");
    let room = replay.start().room.clone();
    // A replay that starts at the room's very beginning has no keyframe and does not continue another.
    let keyframe = replay.keyframe_before(replay.first_tick());
    let first = keyframe.map_or((0, 0), |keyframe| (keyframe.tick, keyframe.hash));
    let mut playback = Playback::new(Arc::new(replay)).expect("a scene and a state");
    while let Some(played) = playback.step().expect("a tick") {
        assert!(played.agrees, "{room}: tick {}", played.tick);
    }
    Part { room, first, last: (playback.tick(), playback.game().hash()) }
}
