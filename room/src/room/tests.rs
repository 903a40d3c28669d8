//! Tests of rooms without a server: joins, leaves, silence, and the messages to clients. Clients decode every message,
//! so that the tests check the bytes on the wire.

mod clients;
mod extremes;
mod restore;
mod vanishing;

use super::*;
use crate::SEAT_HELD_TICKS;
use crate::{SEQ_AHEAD_MAX, SILENCE_TICKS};
use jostle_game::{Buttons, Event};
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_protocol::{PlayerState, SnapshotStream, TimedEvent, Token, WelcomeSeat};
use jostle_sim::Vec2;
use std::iter::zip;

/// Three seats, heroes on a floor, and a few blocks to bump into.
const YARD: &str = r#"title = "Yard"
size = [100, 60]
tools = ["steer", "launch"]
groups = ["hero", "platform", "block", "pack"]
pairs = [["hero", "platform"], ["hero", "block"], ["block", "platform"], ["block", "block"],
    ["hero", "hero"]]

[limits]
players = 3

[hero]
spawns = [[20, 20], [50, 20], [80, 20]]

[pack]
recipe = "fire"

[[bodies]]
kind = "wall"
position = [50, 0]
size = [200, 4]

[[bodies]]
kind = "block"
position = [35, 10]
size = [6, 6]

[[bodies]]
kind = "block"
position = [65, 10]
radius = 3
"#;

fn yard() -> Room {
    let scene = Scene::parse("yard.toml", YARD).unwrap_or_else(|error| panic!("{error}"));
    Room::new("oak", Arc::new(scene), 7)
}

fn look(name: &str) -> Appearance {
    Appearance::new(name, 0).unwrap()
}

fn join(room: &mut Room, name: &str) -> Seat {
    room.join(look(name), None).unwrap().claim.seat
}

/// Joins, or returns with a claim. Returns the new claim, and whether a seat was resumed.
fn claim(room: &mut Room, name: &str, claim: Option<Claim>) -> (Claim, bool) {
    let welcome = room.join(look(name), claim).unwrap();
    (welcome.claim, welcome.resumed)
}

fn ticks(room: &mut Room, count: u32) {
    (0..count).for_each(|_| room.tick());
}

fn down(buttons: Buttons) -> Input {
    Input::new(buttons, None)
}

fn player(room: &Room, seat: Seat) -> Option<&PlayerState> {
    room.snapshot().players.iter().find(|player| player.seat == seat)
}

fn hero_x(room: &Room, seat: Seat) -> i32 {
    let hero = player(room, seat).unwrap().hero.unwrap();
    room.snapshot().bodies.iter().find(|body| body.id == hero).unwrap().quanta[0]
}

/// A client with its snapshot stream and all the events it has received. `receive` must be called after every tick.
#[derive(Default)]
struct Client {
    rate: Rate,
    subscriber: Option<Subscriber>,
    stream: SnapshotStream,
    events: Vec<TimedEvent>,
    bytes: usize,
}

impl Client {
    fn at(rate: Rate) -> Client {
        Client { rate, ..Client::default() }
    }

    fn receive(&mut self, room: &mut Room) {
        let bytes = match &self.subscriber {
            Some(subscriber) => room.message(subscriber).cloned(),
            None => {
                let (subscriber, keyframe) = room.subscribe(self.rate);
                self.subscriber = Some(subscriber);
                Some(keyframe)
            }
        };
        bytes.iter().for_each(|bytes| self.hear(bytes));
        if self.rate == Rate::Full {
            assert_eq!(self.held().bodies, room.snapshot().bodies);
            let (held, players) = (&self.held().players, &room.snapshot().players);
            assert_eq!(held.len(), players.len());
            let differ = zip(held, players).find(|(held, player)| !held.is_like(player));
            assert_eq!(differ, None, "only repeated inputs are left out");
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        let message = ServerMessage::decode(bytes).unwrap();
        let ServerMessage::Snapshot(coded) = message else { panic!("{message:?}") };
        self.bytes += bytes.len();
        self.events.extend(self.stream.decode(&coded).unwrap().events);
    }

    fn held(&self) -> &Snapshot {
        self.stream.newest().expect("a keyframe came")
    }
}

#[test]
fn a_new_room_is_empty_at_tick_0() {
    let mut room = yard();
    assert_eq!((room.code(), room.scene().name.as_str()), ("oak", "yard"));
    assert_eq!((room.players(), room.connected(), room.game().tick_count()), (0, 0, 0));
    let mut client = Client::default();
    client.receive(&mut room);
    let held = client.held();
    assert_eq!((held.tick, held.bodies.len(), held.players.len()), (0, 3, 0));
}

#[test]
fn a_welcome_holds_everything_that_a_client_needs() {
    let mut room = yard();
    ticks(&mut room, 4);
    let welcome = room.join(look("Ann"), None).unwrap();
    assert_eq!((welcome.claim.seat, welcome.resumed), (Seat(0), false));
    let token = Token([9; TOKEN_BYTES]);
    let seat = Some(WelcomeSeat { seat: welcome.claim.seat, host: true, token });
    let expected = ServerMessage::Welcome {
        seat,
        tick: 5,
        room: "oak".to_owned(),
        scene_name: "yard".to_owned(),
        scene: YARD.to_owned(),
    };
    let bytes = room.welcome(seat);
    assert_eq!(ServerMessage::decode(&bytes), Ok(expected));
}

#[test]
fn two_players_see_each_other_move() {
    let mut room = yard();
    let (ann, bob) = (join(&mut room, "Ann"), join(&mut room, "Bob"));
    assert_eq!((ann, bob), (Seat(0), Seat(1)));
    room.tick();
    let (ann_x, bob_x) = (hero_x(&room, ann), hero_x(&room, bob));
    for seq in 1..=20 {
        room.input(ann, seq, down(Buttons::RIGHT));
        room.input(bob, seq, down(Buttons::LEFT));
        room.tick();
    }
    assert!(hero_x(&room, ann) > ann_x && hero_x(&room, bob) < bob_x);
    let mut client = Client::default();
    client.receive(&mut room);
    let players = &client.held().players;
    let seen: Vec<_> = players
        .iter()
        .map(|p| (p.seat, &*p.appearance.name, p.appearance.color, p.input_seq))
        .collect();
    assert_eq!(seen, [(ann, "Ann", 0, 20), (bob, "Bob", 1, 20)]);
}

#[test]
fn a_player_who_joins_appears_with_the_next_tick() {
    let mut room = yard();
    join(&mut room, "Ann");
    ticks(&mut room, 50);
    let mut watcher = Client::default();
    watcher.receive(&mut room);

    let bob = join(&mut room, "Bob");
    assert_eq!(room.players(), 2);
    assert!(player(&room, bob).is_none());
    room.tick();
    assert!(player(&room, bob).unwrap().hero.is_some());
    watcher.receive(&mut room);
    assert!(watcher.events.contains(&TimedEvent { tick: 51, event: Event::Joined(bob) }));
    Client::default().receive(&mut room);
}

#[test]
fn a_player_who_leaves_is_gone_with_the_next_tick_and_frees_the_seat() {
    let mut room = yard();
    let (ann, bob) = (join(&mut room, "Ann"), join(&mut room, "Bob"));
    room.tick();
    let mut watcher = Client::default();
    watcher.receive(&mut room);

    room.leave(ann);
    assert_eq!(room.players(), 1);
    assert!(player(&room, ann).is_some());
    room.tick();
    watcher.receive(&mut room);
    assert!(watcher.events.contains(&TimedEvent { tick: 2, event: Event::Left(ann) }));
    assert_eq!(room.snapshot().players.len(), 1);
    assert_eq!(room.snapshot().bodies.iter().filter(|body| body.owner.is_some()).count(), 1);

    assert_eq!(join(&mut room, "Cid"), ann);
    room.leave(bob);
    room.leave(bob);
    room.tick();
    let names: Vec<_> = room.snapshot().players.iter().map(|p| &*p.appearance.name).collect();
    assert_eq!(names, ["Cid"]);
}

#[test]
fn a_seat_changes_hands_within_one_tick() {
    let mut room = yard();
    let ann = join(&mut room, "Ann");
    room.tick();
    let first = player(&room, ann).unwrap().hero;
    room.leave(ann);
    let cid = join(&mut room, "Cid");
    assert_eq!(cid, ann);
    room.tick();
    let now = player(&room, cid).unwrap();
    assert_eq!(&*now.appearance.name, "Cid");
    assert_ne!(now.hero, first);
}

#[test]
fn a_player_who_leaves_before_the_next_tick_never_joined() {
    let (mut room, mut other) = (yard(), yard());
    for _ in 0..5 {
        let ann = join(&mut room, "Ann");
        room.leave(ann);
    }
    assert_eq!(room.members.changes, []);
    room.tick();
    other.tick();
    assert_eq!(room.game().events(), []);
    assert_eq!(room.game().hash(), other.game().hash());
}

#[test]
fn a_full_room_refuses_and_plays_on() {
    let mut room = yard();
    for name in ["Ann", "Bob", "Cid"] {
        join(&mut room, name);
    }
    assert_eq!(room.join(look("Dan"), None), Err(Refusal::RoomFull));
    ticks(&mut room, 3);
    assert_eq!((room.players(), room.snapshot().players.len()), (3, 3));
    room.leave(Seat(1));
    assert_eq!(join(&mut room, "Dan"), Seat(1));
}

#[test]
fn names_and_colours_are_made_distinct() {
    let mut room = yard();
    for _ in 0..3 {
        join(&mut room, "Ann");
    }
    room.tick();
    let looks: Vec<_> = room.snapshot().players.iter().map(|p| p.appearance.clone()).collect();
    let expected = [("Ann", 0), ("Ann 2", 1), ("Ann 3", 2)];
    assert_eq!(looks, expected.map(|(name, color)| Appearance::new(name, color).unwrap()));
}

// Inputs.

#[test]
fn a_silent_player_steers_on_for_silence_ticks() {
    let (mut silent, mut spoken) = (yard(), yard());
    let seat = join(&mut silent, "Ann");
    join(&mut spoken, "Ann");
    silent.input(seat, 1, down(Buttons::RIGHT));
    for seq in 1..200 {
        let held = seq <= SILENCE_TICKS + 1;
        spoken.input(seat, seq, if held { down(Buttons::RIGHT) } else { Input::default() });
        silent.tick();
        spoken.tick();
        assert_eq!(silent.game().hash(), spoken.game().hash(), "at tick {seq}");
    }
    assert_eq!(player(&silent, seat).unwrap().input_seq, 1);
}

#[test]
fn inputs_from_the_past_and_the_future_change_nothing() {
    let (mut room, mut other) = (yard(), yard());
    let seat = join(&mut room, "Ann");
    join(&mut other, "Ann");
    for seq in 1..100 {
        for room in [&mut room, &mut other] {
            room.input(seat, seq, down(Buttons::RIGHT));
        }
        for wrong in [0, seq, seq.saturating_sub(5), seq + SEQ_AHEAD_MAX + 1, u32::MAX] {
            room.input(seat, wrong, down(Buttons::LEFT));
        }
        room.input(Seat(2), seq, down(Buttons::LEFT));
        room.input(Seat(700), seq, down(Buttons::LEFT));
        room.tick();
        other.tick();
        assert_eq!(room.game().hash(), other.game().hash(), "at tick {seq}");
    }
}

#[test]
fn a_burst_of_inputs_is_played_one_a_tick() {
    let mut room = yard();
    let seat = join(&mut room, "Ann");
    (1..=4).for_each(|seq| assert!(room.input(seat, seq, Input::default())));
    for seq in [1, 2, 3, 4, 4] {
        room.tick();
        assert_eq!(player(&room, seat).unwrap().input_seq, seq);
    }
}

#[test]
fn a_click_in_a_dropped_input_still_launches() {
    let mut room = yard();
    let seat = join(&mut room, "Ann");
    ticks(&mut room, 2);
    let at = |buttons| Input::new(buttons, Some(Vec2::new(50.0, 50.0)));
    room.input(seat, 1, at(Buttons::FIRE));
    (2..=20).for_each(|seq| assert!(room.input(seat, seq, at(Buttons::default()))));
    room.tick();
    let packs = room.snapshot().bodies.iter().filter(|body| body.kind == jostle_game::Kind::Pack);
    assert_eq!(packs.count(), 1);
}

// Lost sockets.

#[test]
fn a_claim_gives_the_seat_and_its_hero_back() {
    let mut room = yard();
    join(&mut room, "Ann");
    let (bobs, _) = claim(&mut room, "Bob", None);
    let bob = bobs.seat;
    (1..=30).for_each(|seq| {
        room.input(bob, seq, down(Buttons::RIGHT));
        room.tick();
    });
    let hero = player(&room, bob).unwrap().hero;

    room.disconnect(bob);
    ticks(&mut room, SEAT_HELD_TICKS - 1);
    assert_eq!((room.players(), room.connected()), (2, 1));
    assert!(!player(&room, bob).unwrap().connected);

    let (again, resumed) = claim(&mut room, "Bob", Some(bobs));
    assert_eq!((again.seat, resumed), (bob, true));
    room.input(bob, 1, Input::default());
    room.tick();
    let back = player(&room, bob).unwrap();
    assert!(back.connected && back.hero == hero && back.input_seq == 1);
    assert_eq!(&*back.appearance.name, "Bob");
    ticks(&mut room, SEAT_HELD_TICKS + 1);
    assert_eq!(room.players(), 2);
}

#[test]
fn an_invented_claim_is_refused() {
    let mut room = yard();
    let (anns, _) = claim(&mut room, "Ann", None);
    room.input(anns.seat, 1, Input::default());
    room.tick();
    room.disconnect(anns.seat);
    let others = [
        Claim { serial: anns.serial + 1, ..anns },
        Claim { serial: 0, ..anns },
        Claim { seat: Seat(1), ..anns },
        Claim { seat: Seat(200), ..anns },
    ];
    for other in others {
        assert_eq!(room.join(look("Ann"), Some(other)), Err(Refusal::BadToken));
    }
    assert_eq!((room.players(), room.connected()), (1, 0));
}

#[test]
fn a_used_claim_is_refused_once_the_new_one_arrived() {
    let mut room = yard();
    let (first, _) = claim(&mut room, "Ann", None);
    room.input(first.seat, 1, Input::default());
    room.disconnect(first.seat);
    // A welcome may get lost, so the first claim stays valid until an input arrives.
    let mut newest = first;
    for _ in 0..3 {
        let lost = newest;
        let (again, resumed) = claim(&mut room, "Ann", Some(first));
        assert!(resumed && again.seat == first.seat && again.serial > lost.serial);
        newest = again;
    }
    room.input(first.seat, 1, Input::default());
    assert_eq!(room.join(look("Ann"), Some(first)), Err(Refusal::BadToken));
    assert!(claim(&mut room, "Ann", Some(newest)).1);
}

#[test]
fn a_seat_is_held_only_if_its_player_ever_sent_an_input() {
    let mut room = yard();
    let (anns, _) = claim(&mut room, "Ann", None);
    room.disconnect(anns.seat);
    assert_eq!((room.players(), room.held()), (0, vec![]));
    assert_eq!(room.join(look("Ann"), Some(anns)), Err(Refusal::BadToken));
    let (bobs, _) = claim(&mut room, "Bob", None);
    room.tick();
    room.disconnect(bobs.seat);
    room.tick();
    assert_eq!((room.players(), room.game().players().count()), (0, 0));

    let (cids, dans) = (join(&mut room, "Cid"), claim(&mut room, "Dan", None).0);
    for seat in [cids, dans.seat] {
        assert!(room.input(seat, 1, Input::default()));
    }
    room.disconnect(dans.seat);
    // The newer session has sent nothing, but there is a game to return to.
    let (again, _) = claim(&mut room, "Dan", Some(dans));
    ticks(&mut room, 2);
    room.disconnect(cids);
    ticks(&mut room, 2);
    room.disconnect(again.seat);
    assert_eq!((room.players(), room.held()), (2, vec![cids, again.seat]));
}

#[test]
fn a_claim_expires_with_its_seat() {
    let mut room = yard();
    let (anns, _) = claim(&mut room, "Ann", None);
    room.leave(anns.seat);
    let (bobs, _) = claim(&mut room, "Bob", None);
    assert_eq!(bobs.seat, anns.seat);
    assert_eq!(room.join(look("Ann"), Some(anns)), Err(Refusal::BadToken));
}

#[test]
fn a_second_socket_takes_the_seat_over() {
    let mut room = yard();
    let (anns, _) = claim(&mut room, "Ann", None);
    let ann = anns.seat;
    (1..=9).for_each(|seq| {
        room.input(ann, seq, Input::default());
        room.tick();
    });
    let (again, resumed) = claim(&mut room, "Ann", Some(anns));
    assert_eq!((again.seat, resumed, room.players()), (ann, true, 1));
    // The sequence numbers start over.
    room.input(ann, 1, Input::default());
    room.tick();
    assert_eq!(player(&room, ann).unwrap().input_seq, 1);
}

#[test]
fn a_lost_player_rests_at_once_and_is_removed_in_the_end() {
    let (mut lost, mut resting) = (yard(), yard());
    let seat = join(&mut lost, "Ann");
    join(&mut resting, "Ann");
    for room in [&mut lost, &mut resting] {
        room.input(seat, 1, down(Buttons::RIGHT));
        room.tick();
    }
    lost.disconnect(seat);
    lost.input(seat, 2, down(Buttons::RIGHT));
    for seq in 2..=SEAT_HELD_TICKS + 1 {
        resting.input(seat, seq, Input::default());
        lost.tick();
        resting.tick();
    }
    assert_eq!(lost.game().hash(), resting.game().hash());
    assert_eq!((lost.players(), lost.connected()), (1, 0));
    lost.tick();
    assert_eq!((lost.players(), lost.snapshot().players.len()), (0, 0));
}
