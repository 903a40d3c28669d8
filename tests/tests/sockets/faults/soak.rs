//! Many faults at once, for some seconds, against a server whose games are recorded. Afterwards each
//! replay plays again in a fresh room that knows of no faults, with the inputs that were accepted: the
//! hash of every tick is the recorded one, so the faults had no way into the game but their inputs.

use super::frames::{FIRST, NEXT, WHOLE, frame, input, write};
use super::refusals;
use crate::client::Client;
use crate::http::get;
use crate::replays::{Dir, play, recording, verify};
use jostle_protocol::replay::{Ending, Replay};
use jostle_protocol::{Refusal, VERSION};
use jostle_server::limits::BYTES_BURST_MAX;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

/// Ticks of the two games.
const TICKS: u32 = 420;
const GUEST_ROUNDS: u32 = 2;

/// Those who never get a seat, again and again, at the room of two players.
async fn strangers(server: SocketAddr) {
    loop {
        for bytes in
            [&b"GET /arena HTTP/1.1\r\nHost: jos"[..], b"\x16\x03\x01\x02 a TLS hello\r\n\r\n"]
        {
            let mut stream = TcpStream::connect(server).await.expect("a connection");
            // Refused or left, half sent.
            let _ = stream.write_all(bytes).await;
        }
        let mut old = Client::connect(server, "arena").await;
        old.hello(VERSION + 1, "Old", None).await;
        old.is_refused(Refusal::Version).await;
        for bytes in [frame(WHOLE | 0x40, &[1]), [WHOLE, 0xff, 0x80].to_vec(), frame(WHOLE, &[9])] {
            let mut eve = Client::connect(server, "arena").await;
            write(&mut eve, &bytes).await;
        }
        Client::connect(server, "nowhere").await.is_refused(Refusal::NoSuchRoom).await;
    }
}

/// Those who get a seat first, at another room of two players. Each round leaves two seats that are
/// held, so that there are few rounds.
async fn guests(server: SocketAddr) {
    for _ in 0..GUEST_ROUNDS {
        let mut killed = Client::join(server, "pile", "Killed").await;
        killed.is_heard().await;
        write(&mut killed, &frame(WHOLE, &input(1))[..5]).await;
        let token = killed.token;
        drop(killed);
        let mut back = Client::connect(server, "pile").await;
        back.enter("Back", Some(token)).await;
        write(&mut back, &frame(WHOLE, &input(1))).await;
        // One that takes the seat over, and one that comes with the token too late.
        let (mut second, mut late) =
            (Client::connect(server, "pile").await, Client::connect(server, "pile").await);
        second.enter("Second", Some(back.token)).await;
        back.is_refused(Refusal::Replaced).await;
        late.hello(VERSION, "Late", Some(token)).await;
        late.is_refused(Refusal::BadToken).await;
        let mut late = Client::join(server, "pile", "Late").await;
        for seq in [0, 1 << 30, u32::MAX] {
            write(&mut late, &frame(WHOLE, &input(seq))).await;
        }
        write(&mut late, &frame(FIRST, &[])).await;
        write(&mut late, &frame(NEXT, &[]).repeat(BYTES_BURST_MAX as usize / 3)).await;
        late.is_refused(Refusal::Flood).await;
        // Reads nothing from here on.
        write(&mut second, &frame(WHOLE, &input(1))).await;
        write(&mut second, &frame(WHOLE, &[0xee; 20])).await;
    }
    std::future::pending().await
}

async fn operators(ops: SocketAddr) {
    loop {
        assert_eq!(get(ops, "/metrics").await.status, 200);
    }
}

/// The one replay of a room.
fn of_room<'a>(replays: &'a [Arc<Replay>], room: &str) -> &'a Arc<Replay> {
    let mut found = replays.iter().filter(|replay| replay.start().room == room);
    let replay = found.next().unwrap_or_else(|| panic!("no replay of {room}"));
    assert!(found.next().is_none(), "two replays of {room}");
    replay
}

/// How many came and went in the first block of a replay.
fn changes(replay: &Replay) -> usize {
    let block = replay.block_with(1).expect("ticks");
    block.ticks.iter().map(|tick| tick.changes.len()).sum()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_have_no_way_into_a_game_but_their_inputs() {
    let dir = Dir::new("soak");
    let mut server = recording(dir.settings()).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    let mut cid = Client::join(server.address, "pile", "Cid").await;
    let mut dan = Client::join(server.address, "pile", "Dan").await;
    let faults = [
        tokio::spawn(strangers(server.address)),
        tokio::spawn(guests(server.address)),
        tokio::spawn(operators(server.ops)),
    ];
    tokio::join!(play(&mut ann, &mut bob, TICKS), play(&mut cid, &mut dan, TICKS));
    for fault in faults {
        assert!(!fault.is_finished(), "a fault had another answer than it should");
        fault.abort();
    }
    for reason in ["version", "bad_message", "bad_hello", "bad_request", "no_such_room"] {
        assert!(server.count(&refusals(reason)).await > 0, "{reason}");
    }
    for reason in ["replaced", "flood", "bad_token"] {
        assert!(server.count(&refusals(reason)).await > 0, "{reason}");
    }
    assert!(server.count("jostle_inputs_ignored_total").await > 0);
    let last_tick = ann.newest.tick;
    server.stop();
    drop((ann, bob, cid, dan));
    server.ended().await;

    let replays = dir.replays();
    let (arena, pile) = (of_room(&replays, "arena"), of_room(&replays, "pile"));
    for replay in [arena, pile] {
        assert_eq!(replay.ending(), Ending::Whole);
        verify(replay).await;
    }
    assert!(arena.last_tick() >= last_tick);
    // Nobody but the two ever was in the first game; the second one was a coming and going.
    assert_eq!(changes(arena), 2);
    assert!(changes(pile) > 4);
}
