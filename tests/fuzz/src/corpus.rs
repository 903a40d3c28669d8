//! The corpus: for each property some inputs that reach deep into the code under test. That code also generates them,
//! so they always have the current format.

use crate::{RUN_SCENE, push_part, snapshots};
use jostle_game::scene::presets;
use jostle_game::{Buttons, Event, Input, Kind, Scene, Seat};
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_protocol::replay::{Record, frame};
use jostle_protocol::{
    Appearance, ClientMessage, ClipRefusal, Refusal, Role, ServerMessage, Snapshot, SnapshotStream,
    TimedEvent, Token, VERSION, WelcomeSeat,
};
use jostle_room::{Claim, Rate, Room};
use jostle_server::host::token_signer::SeatClaim;
use jostle_sim::{BodyId, EmitterDef, Particles, Source, Vec2};
use std::sync::Arc;

/// The inputs of a property; empty if it is unknown.
pub fn corpus(property: &str) -> Vec<Vec<u8>> {
    match property {
        "client_message" => client_messages(),
        "server_message" => server_messages(),
        "keyframe" => keyframes(),
        "delta" => deltas(),
        "events" => coded_events(),
        "particles" => encoded_particles(),
        "replay" => replays(),
        "scene" => scenes(),
        "room" => rooms(),
        "link" => links(),
        "handshake" => handshakes(),
        "token" => tokens(),
        "guest_scene" => guest_scenes(),
        "run" => runs(),
        "tiled_map" => tiled_maps(),
        _ => Vec::new(),
    }
}

// Messages.

fn hello(name: &str, token: Option<Token>) -> ClientMessage {
    let appearance = Appearance { name: name.into(), color: 5 };
    let role = Role::Player;
    ClientMessage::Hello { version: VERSION, appearance, token, host_key: None, role }
}

fn watcher() -> ClientMessage {
    let appearance = Appearance { name: "Eye".into(), color: 0 };
    let role = Role::Spectator;
    ClientMessage::Hello { version: VERSION, appearance, token: None, host_key: None, role }
}

/// An unsigned token, which the fuzzer's room accepts.
fn token(seat: u8, serial: u8) -> Token {
    let mut token = Token([0; TOKEN_BYTES]);
    (token.0[0], token.0[1]) = (seat, serial);
    token
}

fn input(seq: u32, buttons: Buttons, pointer: Option<Vec2>) -> ClientMessage {
    ClientMessage::Input { seq, ack_tick: seq as u16, input: Input::new(buttons, pointer) }
}

fn client_messages() -> Vec<Vec<u8>> {
    let messages = [
        hello("Ann", None),
        hello("Ørsted 日本 🙂", Some(Token([255; TOKEN_BYTES]))),
        input(1, Buttons(0), None),
        input(u32::MAX, Buttons::ALL, Some(Vec2::new(-1.5, 1e6))),
        ClientMessage::Ping { stamp: 0xdead_beef },
        ClientMessage::View { size: Vec2::new(160.0, 90.0) },
        ClientMessage::Kick { seat: Seat(63) },
        ClientMessage::CloseRoom,
        watcher(),
        ClientMessage::Clip,
        ClientMessage::Emote { emote: 7 },
    ];
    let mut inputs: Vec<Vec<u8>> = messages.iter().map(ClientMessage::encode).collect();
    // A hello of another version.
    inputs.push(vec![0, 1, 0, 9, 9]);
    inputs
}

fn server_messages() -> Vec<Vec<u8>> {
    let welcome = ServerMessage::Welcome {
        seat: Some(WelcomeSeat { seat: Seat(3), host: true, token: token(1, 2) }),
        tick: 300,
        room: "k7f3q2".into(),
        scene_name: "arena".into(),
        scene: "title = \"A\"\n".into(),
    };
    let refused = Refusal::ALL.map(|refusal| ServerMessage::Refused { refusal });
    let others = [
        ServerMessage::Draining { seconds: 2, keeps_room: true },
        ServerMessage::Pong { stamp: 7, tick: 1 << 20 },
        ServerMessage::Denied,
        ServerMessage::Moved { url: "https://b.example.org:8443".into() },
        ServerMessage::Nodes { urls: vec!["http://10.0.0.1:80".into(), "https://c".into()] },
        ServerMessage::Snapshot(vec![0x80, 1]),
        ServerMessage::Emote { seat: Seat(3), emote: 5 },
        ServerMessage::Clip { kept: Ok("arena-k7f3q2-20260101-120000-clip".into()) },
        ServerMessage::Clip { kept: Err(ClipRefusal::TooMany) },
    ];
    let watching = ServerMessage::Welcome {
        seat: None,
        tick: 1,
        room: "arena".into(),
        scene_name: "arena".into(),
        scene: "title = \"A\"\n".into(),
    };
    let all = [welcome].into_iter().chain(refused).chain(others).chain([watching]);
    all.map(|message| message.encode()).collect()
}

fn events(tick: u32) -> Vec<TimedEvent> {
    let id = |index| BodyId { index, generation: 2 };
    let point = Vec2::new(3.5, -1.0);
    let emitter = |source| EmitterDef { recipe: 3, count: 200, seed: 9, source };
    let events = [
        Event::Impact { a: id(1), b: id(2), point, speed: 30.0 },
        Event::PackHit { owner: Some(Seat(1)), victim: Some(Seat(4)), hero: id(2), point },
        Event::PackHit { owner: None, victim: None, hero: id(2), point },
        Event::BodyLeft { kind: Kind::Marble, body: id(0), point },
        Event::EmitterStarted(emitter(Source::Point(point))),
        Event::EmitterStarted(emitter(Source::Body(id(1)))),
        Event::ScheduledEmitterStarted { index: 200, seed: 9 },
        Event::Said { rule: 127, it: Some(Seat(3)), by: None },
        Event::Joined(Seat(511)),
        Event::Left(Seat(0)),
    ];
    events.into_iter().map(|event| TimedEvent { tick, event }).collect()
}

fn encode(snapshot: Snapshot, every: u8, events: &[TimedEvent]) -> Vec<u8> {
    SnapshotStream::new(every).encode(&Arc::new(snapshot), events)
}

fn keyframes() -> Vec<Vec<u8>> {
    let mut keyframes = vec![
        encode(Snapshot::default(), 1, &[]),
        encode(snapshots::sample(300, 3, 9, -100), 3, &events(299)),
        encode(snapshots::sample(7, 40, 500, 1 << 20), 12, &[]),
    ];
    keyframes.extend(fresh_rooms().map(|room| encode(room.snapshot().clone(), 1, &[])));
    // Keyframes with live particles.
    keyframes.extend(fresh_rooms().map(|mut room| room.subscribe(Rate::Full).1.to_vec()));
    keyframes
}

fn coded_events() -> Vec<Vec<u8>> {
    let empty = |tick| Snapshot { tick, ..Snapshot::default() };
    let all = events(16_383);
    let some = all.chunks(1).chain([&all[..]]);
    // The property adds the header.
    some.map(|events| encode(empty(16_383), 1, events)[4..].to_vec()).collect()
}

/// Encodes no particles, an emitter that has just started, and the particles of two emitters after a while.
fn encoded_particles() -> Vec<Vec<u8>> {
    let mut particles = Particles::new(presets(), 500);
    let mut encoded_particles = vec![particles.encode()];
    let source_point = Source::Point(Vec2::new(30.0, 20.0));
    let body = Source::Body(BodyId { index: 3, generation: 1 });
    for (recipe, source) in [(0, source_point), (1, body)] {
        particles.start(EmitterDef { recipe, count: 60, seed: 5, source });
        encoded_particles.push(particles.encode());
    }
    for _ in 0..8 {
        particles.step(&[], |_| None);
        encoded_particles.push(particles.encode());
    }
    encoded_particles
}

/// For each stream, messages that continue it and messages that do not.
fn deltas() -> Vec<Vec<u8>> {
    let mut inputs = Vec::new();
    for (chosen, stream) in snapshots::streams().iter().enumerate() {
        for surprise in [0, 1, 300] {
            let mut stream = stream.clone();
            let mut input = vec![chosen as u8];
            for step in 1..5 {
                let message = stream.encode(&Arc::new(next(&stream, step * surprise)), &[]);
                push_part(0, &message, &mut input);
            }
            inputs.push(input);
        }
    }
    inputs
}

/// The next snapshot of a stream. With a `surprise`, bodies and pointers deviate by it, and bodies die, appear and
/// cause events.
fn next(stream: &SnapshotStream, surprise: i32) -> Snapshot {
    let mut next = stream.newest().map_or_else(Snapshot::default, |newest| (**newest).clone());
    next.tick += 1;
    for (index, body) in next.bodies.iter_mut().enumerate() {
        body.quanta[index % 2] += surprise * (index as i32 % 3);
    }
    for player in &mut next.players {
        player.input_seq += 1;
        player.score += surprise.unsigned_abs() as u16;
        player.pointer = player.pointer.map(|[x, y]| [x, y + surprise]);
    }
    if surprise > 100 {
        next.bodies.retain(|body| body.id.index % 5 != 1);
        next.players.retain(|player| player.seat != Seat(1));
    }
    next
}

// Files.

/// A room for every scene, in which a player has used everything for a while.
fn fresh_rooms() -> impl Iterator<Item = Room> {
    Scene::built_in().into_iter().map(|scene| {
        let mut room = Room::new("corpus", Arc::new(scene), 5);
        let look = Appearance { name: "Ann".into(), color: 1 };
        room.join(look, None).expect("a free seat");
        for seq in 1..20 {
            let pointer = Some(Vec2::new(10.0 + seq as f32, 20.0));
            let buttons = Buttons(Buttons::ALL.0 >> (seq % 7));
            room.input(Seat(0), seq, Input::new(buttons, pointer));
            room.tick();
        }
        room
    })
}

fn replays() -> Vec<Vec<u8>> {
    fresh_rooms().map(replay_of).collect()
}

/// Records of some more ticks, as parts. They start in the middle of a game, so that a keyframe comes first.
fn replay_of(mut room: Room) -> Vec<u8> {
    room.record("corpus", 0);
    for seq in 20..30 {
        room.input(Seat(0), seq, Input::new(Buttons::RIGHT, None));
        room.tick();
    }
    let mut input = vec![1];
    for record in room.stop_recording() {
        push_part(kind_of(&record), &record.seal()[frame(0, &[]).len()..], &mut input);
    }
    input
}

/// Kind of a record: the first byte of its frame.
fn kind_of(record: &Record) -> u8 {
    record.seal()[0]
}

/// Small scenes. The shipped ones are separate inputs.
fn scenes() -> Vec<Vec<u8>> {
    let least = "title = \"A\"\nsize = [40, 30]\ngroups = [\"a\"]\n";
    let mut texts = vec![String::new(), least.to_owned(), format!("{least}gravity = [0, -1e9]\n")];
    // The first half of each shipped scene, or all of it if it is a game, since rules come last.
    for scene in Scene::built_in() {
        let lines: Vec<&str> = scene.source.lines().collect();
        texts.push(lines[..lines.len() / 2].join("\n"));
        if scene.is_game() {
            texts.push(scene.source);
        }
    }
    texts.into_iter().map(String::into_bytes).collect()
}

// Play, and the server.

fn rooms() -> Vec<Vec<u8>> {
    let tick = 0x80;
    let mut usual = Vec::new();
    for (seat, name) in ["Ann", "Bob", "Cid"].into_iter().enumerate() {
        push_part(tick | seat as u8, &hello(name, None).encode(), &mut usual);
    }
    for seq in 1..30 {
        let buttons = Buttons(1 << (seq % 12));
        let pointer = (seq % 4 > 0).then_some(Vec2::new(seq as f32, 40.0));
        push_part(tick | (seq % 3) as u8, &input(seq, buttons, pointer).encode(), &mut usual);
    }
    let mut lost = usual.clone();
    push_part(tick | 0x41, &[1], &mut lost);
    push_part(tick, &hello("Bob", Some(token(1, 2))).encode(), &mut lost);
    push_part(tick, &hello("Eve", Some(token(1, 2))).encode(), &mut lost);
    push_part(tick | 0x40, &[], &mut lost);
    push_part(0x40, &[], &mut lost);
    push_part(tick, &hello("Ann", Some(token(0, 99))).encode(), &mut lost);
    vec![Vec::new(), usual, lost]
}

fn links() -> Vec<Vec<u8>> {
    let words = ["arena", "ARENA", "abc%20/", "%41bc", "abc%C2%A0", "%zz", "%", "..%2f", "é", ""];
    words.into_iter().map(|word| word.as_bytes().to_vec()).collect()
}

fn tokens() -> Vec<Vec<u8>> {
    let signer = jostle_server::host::token_signer::TokenSigner::new(&crate::SIGNING_KEY);
    let claim = |room, seat, serial| SeatClaim { room, claim: Claim { seat: Seat(seat), serial } };
    let claims = [claim(0, 0, 1), claim(u64::MAX, 63, u64::MAX)];
    let seats = claims.map(|claim| signer.seat_token(claim));
    let all = seats.into_iter().chain([signer.host_key(0), signer.host_key(1 << 40)]);
    all.map(|token| token.0.to_vec()).collect()
}

/// Maps: the example, one without layers, and one with an object that cannot be imported.
fn tiled_maps() -> Vec<Vec<u8>> {
    let head = r#"{"width":9,"height":9,"tilewidth":8,"tileheight":8,"properties":[{"name":"title","value":"A"},{"name":"groups","value":"[\"a\"]"}],"layers":"#;
    let object = r#"[{"type":"objectgroup","objects":[{"type":"wall","polygon":[{"x":0,"y":0},{"x":9,"y":9}]}]}]}"#;
    let example = include_str!("../../../docs/examples/tiled/court.tmj");
    [example.to_owned(), format!("{head}[]}}"), format!("{head}{object}")].map(Vec::from).to_vec()
}

/// Runs: an early and a late win, and one in which the player never moves.
fn runs() -> Vec<Vec<u8>> {
    [0, 20, 1000].map(run_after).to_vec()
}

/// Records, as parts, of a game in which the player flies to the post after this many ticks.
fn run_after(wait: u32) -> Vec<u8> {
    let scene = Scene::parse("hop.toml", RUN_SCENE).expect("a scene");
    let mut room = Room::new("corpus", Arc::new(scene), 3);
    room.record("corpus", 0);
    let look = Appearance::new("Ann", 1).expect("a name");
    let seat = room.join(look, None).expect("a seat").claim.seat;
    for seq in 1..=60 {
        let buttons = if seq > wait { Buttons::RIGHT } else { Buttons::default() };
        room.input(seat, seq, Input::new(buttons, None));
        room.tick();
    }
    let mut input = Vec::new();
    for record in room.stop_recording() {
        push_part(kind_of(&record), &record.seal()[frame(0, &[]).len()..], &mut input);
    }
    input
}

/// Guest scenes: within the budget, above it, and with deceptive text.
fn guest_scenes() -> Vec<Vec<u8>> {
    let small = ["arena", "hill", "planets", "slingshot"];
    let mut texts: Vec<String> = Scene::built_in()
        .into_iter()
        .filter(|scene| small.contains(&scene.name.as_str()))
        .map(|scene| scene.source)
        .collect();
    let head = "title = \"Mine\"\nsize = [100, 100]\ngroups = [\"wall\"]\n";
    texts.push(format!("{head}limits = {{ bodies = 1001 }}\n"));
    texts.push(format!("{head}relaxation = {{ iterations = 31 }}\n"));
    texts.push(head.replace("Mine", "\\u202EMine"));
    texts.into_iter().map(String::into_bytes).collect()
}

fn handshakes() -> Vec<Vec<u8>> {
    let key = "Sec-WebSocket-Key: YW55IHNpeHRlZW4gYnl0ZQ==\r\n";
    let upgrade = "Host: a\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n";
    let full = format!("GET /arena HTTP/1.1\r\n{upgrade}Sec-WebSocket-Version: 13\r\n{key}\r\n");
    let heads = [
        full.clone(),
        full.replace("13", "8"),
        full.replace("Host: a\r\n", "Host: a\r\nOrigin: http://b\r\nX-Forwarded-For: ::1\r\n"),
        "GET / HTTP/1.1\r\nHost: a\r\n\r\nGET /api/scenes HTTP/1.0\r\n\r\n".into(),
        "GET /assets/client.js HTTP/1.1\r\nHost: a\r\nAccept-Encoding: br\r\n\r\n".into(),
        "GET /replays/a-b-20260101-000000.jostle HTTP/1.1\r\nHost: a\r\n\r\n".into(),
        "POST /api/rooms HTTP/1.1\r\nHost: a\r\nContent-Length: 17\r\n\r\n{\"scene\":\"arena\"}"
            .into(),
        "POST /api/rooms HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n".into(),
        "POST /api/guest-rooms HTTP/1.1\r\nHost: a\r\nContent-Length: 11\r\n\r\ntitle = \"a\""
            .into(),
        "POST /api/guest-rooms?listed=true HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\n#"
            .into(),
        "POST /api/records HTTP/1.1\r\nHost: a\r\nContent-Length: 8\r\n\r\njostle\u{1a}\n".into(),
        "GET /api/records?scene=race HTTP/1.1\r\nHost: a\r\n\r\n".into(),
        "OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n".into(),
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".into(),
    ];
    heads.into_iter().map(String::into_bytes).collect()
}
