//! A room with all the players that there may be: everybody is seated, seen, saved and recorded, past
//! the seats that take one byte too.

use jostle_protocol::replay::{Replay, header};
use jostle_protocol::{Appearance, Refusal, Stream};
use jostle_room::{Playback, Rate, Room};
use jostle_sim::{Buttons, Game, Input, SEATS_MAX, Scene, Seat, Vec2};
use std::sync::Arc;

const SEATS: u16 = SEATS_MAX as u16;
const TICKS: u32 = 40;
/// Who leaves halfway.
const LEAVER: u16 = 300;

fn field() -> Arc<Scene> {
    let text = include_str!("../../tests/crowd/crowd.toml");
    Arc::new(Scene::parse("crowd.toml", text).unwrap_or_else(|error| panic!("{error}")))
}

fn look(seat: u16) -> Appearance {
    // Eight names, so that nearly all of them have to be told apart.
    Appearance::new(&format!("P{}", seat % 8), (seat % 8) as u8).expect("a name")
}

fn input(seat: u16, tick: u32) -> Input {
    let buttons = [Buttons::LEFT, Buttons::UP, Buttons::RIGHT, Buttons::DOWN];
    let way = buttons[(u32::from(seat) + tick / 10) as usize % 4];
    Input { buttons: way, pointer: Some(Vec2::new(f32::from(seat), tick as f32)) }
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
    let (reader, keyframe) = room.begin(Rate::Full);
    let mut stream = Stream::default();
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
        if let Some(message) = room.message(&reader) {
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

/// The hash at the end of what the room recorded, every tick of which is played again and compared.
fn replayed(room: &mut Room) -> u64 {
    let mut bytes = header();
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    let replay = Arc::new(Replay::read(bytes).expect("a replay"));
    let mut playback = Playback::new(replay).expect("a scene");
    while let Some(played) = playback.step().expect("changes that can be made") {
        assert!(played.agrees, "tick {}", played.tick);
    }
    playback.game().hash()
}
