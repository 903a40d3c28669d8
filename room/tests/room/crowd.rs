//! A room with the maximum number of players. All of them are seated, visible, saved and recorded, including those
//! whose seat numbers take two bytes.

use jostle_game::{Buttons, Game, Input, SEATS_MAX, Scene, Seat};
use jostle_protocol::replay::{Replay, header};
use jostle_protocol::{Appearance, Refusal, SnapshotStream};
use jostle_room::{Playback, Rate, Room};
use jostle_sim::Vec2;
use std::sync::Arc;

const SEATS: u16 = SEATS_MAX as u16;
const TICKS: u32 = 40;
/// The player who leaves halfway through.
const LEAVER: u16 = 300;

/// An open field without gravity. Every two seats share a spawn point.
fn field() -> Arc<Scene> {
    let spawns: Vec<_> = (0..SEATS / 2).map(|at| [50 + at % 16 * 100, 45 + at / 16 * 54]).collect();
    let text = format!(
        r#"title = "Field"
size = [1600, 900]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero", "minion"]
pairs = [["hero", "hero"], ["hero", "minion"], ["minion", "minion"]]
limits = {{ players = {SEATS} }}
minion = {{ radius = 5, speed = 12 }}

[hero]
size = [9, 12]
thrust = [110, 110]
speed_max = 60
spawns = {spawns:?}

[[layouts]]
kind = "minion"
count = 64
area = [[20, 20], [1580, 880]]
grid = [8, 8]
shapes = [{{ radius = 5 }}]
"#
    );
    Arc::new(Scene::parse("field.toml", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn look(seat: u16) -> Appearance {
    // There are only eight names, so nearly all players need a number.
    Appearance::new(&format!("P{}", seat % 8), (seat % 8) as u8).expect("a name")
}

fn input(seat: u16, tick: u32) -> Input {
    let buttons = [Buttons::LEFT, Buttons::UP, Buttons::RIGHT, Buttons::DOWN];
    let way = buttons[(u32::from(seat) + tick / 10) as usize % 4];
    Input::new(way, Some(Vec2::new(f32::from(seat), tick as f32)))
}

#[test]
fn five_hundred_and_twelve_players_share_a_room() {
    let scene = field();
    let mut room = Room::new("crowd", Arc::clone(&scene), 5);
    room.record("a test", 0);
    for seat in 0..SEATS {
        let welcome = room.join(look(seat), None).expect("a seat");
        assert_eq!(welcome.claim.seat, Seat(seat));
    }
    assert_eq!(room.join(look(0), None), Err(Refusal::RoomFull));
    let (subscriber, keyframe) = room.subscribe(Rate::Full);
    let mut stream = SnapshotStream::default();
    stream.decode(&keyframe).expect("a keyframe");
    for tick in 1..=TICKS {
        for seat in 0..SEATS {
            let taken = room.input(Seat(seat), tick, input(seat, tick));
            assert_eq!(taken, seat != LEAVER || tick <= TICKS / 2);
        }
        if tick == TICKS / 2 {
            room.leave(Seat(LEAVER));
        }
        room.tick();
        if let Some(message) = room.message(&subscriber) {
            stream.decode(message).expect("a message");
        }
    }
    let snapshot = room.snapshot();
    assert_eq!(stream.newest().map(Arc::as_ref), Some(snapshot));
    assert_eq!(snapshot.players.len(), SEATS_MAX - 1);
    assert!(snapshot.players.iter().all(|player| player.hero.is_some()));
    let mut names: Vec<_> = snapshot.players.iter().map(|player| &player.appearance.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), SEATS_MAX - 1, "no two names are the same");

    let game = room.game();
    let restored = Game::restore(scene, &game.save()).expect("its own state");
    assert_eq!(restored.hash(), game.hash());
    let hash = game.hash();
    assert_eq!(replayed(&mut room), hash);
}

/// Replays the room's recording, compares every tick, and returns the final hash.
fn replayed(room: &mut Room) -> u64 {
    let mut bytes = header();
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    let replay = Arc::new(Replay::read(bytes).expect("a replay"));
    let mut playback = Playback::new(replay).expect("a scene");
    while let Some(played) = playback.step().expect("possible changes") {
        assert!(played.agrees, "tick {}", played.tick);
    }
    playback.game().hash()
}
