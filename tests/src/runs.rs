//! Runs for tests of records: a scene with short runs, and replays of that scene.

use jostle_game::{Buttons, Input, RoundPhase, Scene};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Record, header};
use jostle_room::Room;
use std::sync::Arc;

/// Name of the scene.
pub const DASH_NAME: &str = "dash";

/// A dash to the right, which the player who reaches the post wins.
pub const DASH: &str = r#"title = "Dash"
size = [100, 60]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero"]

[round]
goal = 1
time = 60
countdown = 1
pause = 60

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

/// Returns the replay records of a game of [`DASH`] in which the player waits for the given number of ticks and then
/// flies to the post.
pub fn dash(player: &str, wait: u32) -> Vec<Record> {
    let scene = Scene::parse("dash.toml", DASH).expect("a scene");
    let mut room = Room::new("alone", Arc::new(scene), 7);
    room.record("test", 1000);
    let look = Appearance::new(player, 3).expect("a name");
    let seat = room.join(look, None).expect("a seat").claim.seat;
    let mut records = Vec::new();
    for seq in 1..=400 + wait {
        let round = room.game().round().expect("rules");
        let flies = round.phase == RoundPhase::Running && seq > round.since + wait;
        let buttons = if flies { Buttons::RIGHT } else { Buttons::default() };
        room.input(seat, seq, Input::new(buttons, None));
        room.tick();
        records.extend(room.take_records());
        if round.phase == RoundPhase::Over {
            break;
        }
    }
    records.extend(room.stop_recording());
    records
}

/// Returns the replay records of the shipped race, won by a bot while the player does nothing.
///
/// Bots wait for a player who is far behind, and not every race ends in time.
pub fn race() -> Vec<Record> {
    (1..).find_map(race_of).expect("a race that a bot wins")
}

fn race_of(seed: u64) -> Option<Vec<Record>> {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "race");
    let mut room = Room::filled("alone", Arc::new(scene.expect("a shipped scene")), seed, 2);
    room.record("test", 1000);
    let look = Appearance::new("Ann", 3).expect("a name");
    room.join(look, None).expect("a seat");
    let mut records = Vec::new();
    while room.game().round().is_none_or(|round| round.phase != RoundPhase::Over) {
        room.tick();
        records.extend(room.take_records());
    }
    records.extend(room.stop_recording());
    let round = room.game().round()?;
    let has_won = round.players.iter().any(|player| player.side.score >= 3);
    has_won.then_some(records)
}

/// Returns a replay file that contains the given records.
pub fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}
