//! Bytes that no page sends, in rows 5, 6 and 9 to 18 of docs/faults.md.

use super::stage::Stage;
use crate::client::{Client, LONG};
use crate::faults::frames::{self, FIRST, NEXT, WHOLE, frame, hello, input, write};
use jostle_game::{Buttons, Input};
use jostle_protocol::{ClientMessage, Refusal, ServerMessage, VERSION};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

const ROOM: &str = "impulse";

/// A connection without a game socket.
async fn connect(stage: &Stage) -> TcpStream {
    let stream = TcpStream::connect(stage.address).await.expect("a connection");
    stream.set_nodelay(true).expect("a live socket");
    stream
}

/// Reads everything until the peer closes or resets the connection.
async fn read_all(stream: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    let _ = timeout(LONG, stream.read_to_end(&mut answer)).await.expect("an end in time");
    String::from_utf8_lossy(&answer).into_owned()
}

/// Row 5: a head sent byte by byte, a body that never arrives, and a missing hello.
pub async fn slow_handshakes(stage: &Stage) {
    tokio::join!(slow_head(stage), slow_body(stage), no_hello(stage));
}

async fn slow_head(stage: &Stage) {
    let mut slow = connect(stage).await;
    let drip = async {
        let head = b"GET /arena HTTP/1.1\r\nX-Filler: ";
        for byte in head.iter().chain([b'x'].iter().cycle()) {
            if slow.write_all(&[*byte]).await.is_err() {
                return;
            }
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(LONG, drip).await.expect("the server gives up");
    stage.refuses("slow_request");
}

async fn slow_body(stage: &Stage) {
    let mut half = connect(stage).await;
    let head = "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nContent-Length: 17\r\n\r\n{";
    half.write_all(head.as_bytes()).await.expect("a live socket");
    assert!(read_all(&mut half).await.starts_with("HTTP/1.1 408 "));
}

async fn no_hello(stage: &Stage) {
    Client::connect(stage.address, ROOM).await.is_refused(Refusal::BadHello).await;
    stage.refuses("bad_hello");
}

/// Row 6: everything in one-byte segments.
pub async fn segments_of_a_byte(stage: &Stage) {
    let mut guest = Client::connect(stage.address, ROOM).await;
    guest.socket.get_ref().set_nodelay(true).expect("a live socket");
    for &byte in frame(WHOLE, &hello("Byte")).iter() {
        write(&mut guest, &[byte]).await;
    }
    let ServerMessage::Welcome { seat: Some(own), .. } = guest.message().await else {
        panic!("no welcome")
    };
    guest.seat = own.seat.0;
    stage.counts("jostle_joins_total{how=\"new\"}", 1);
    for seq in 1..=20 {
        for &byte in frame(WHOLE, &input(seq)).iter() {
            write(&mut guest, &[byte]).await;
        }
    }
    guest.seq = 20;
    guest.keeps_playing().await;
    stage.leave(guest).await;
}

/// Row 9: a request head of 20 MB.
pub async fn endless_head(stage: &Stage) {
    let mut stream = connect(stage).await;
    stream.write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Filler: ").await.expect("a socket");
    let mut taken = 0;
    while taken < 20 << 20 {
        match timeout(LONG, stream.write(&[b'x'; 64 << 10])).await.expect("an end in time") {
            Ok(count) => taken += count,
            Err(_closed) => break,
        }
    }
    assert!(taken < 20 << 20, "all of it was taken");
    stage.refuses("bad_request");
}

/// Rows 10 and 11: frames that claim 2^63 bytes or have no mask, before and after the hello.
pub async fn broken_frames(stage: &Stage) {
    let huge = [&[WHOLE, 0xff][..], &(1u64 << 63).to_be_bytes(), &[0; 4]].concat();
    let bare = [&[WHOLE, 4][..], &[2, 0, 0, 0]].concat();
    for bytes in [huge, bare] {
        let mut stranger = Client::connect(stage.address, ROOM).await;
        write(&mut stranger, &bytes).await;
        stranger.is_refused(Refusal::BadMessage).await;
        stage.refuses("bad_message");
        let mut guest = stage.join(ROOM, "Broken").await;
        write(&mut guest, &bytes).await;
        stage.ends(ROOM, guest, Refusal::BadMessage, "bad_message").await;
    }
}

/// Row 12: fragments of a message, and fragments that never become one.
pub async fn fragments(stage: &Stage) {
    let mut guest = stage.join(ROOM, "Pieces").await;
    let whole = input(guest.seq + 1);
    let (first, rest) = whole.split_at(1);
    guest.seq += 1;
    write(&mut guest, &[frame(FIRST, first), frame(NEXT | 0x80, rest)].concat()).await;
    guest.keeps_playing().await;
    write(&mut guest, &frame(FIRST, &[])).await;
    flooded(stage, guest, &frame(NEXT, &[])).await;
}

/// Row 13: more messages than any client needs.
pub async fn flood(stage: &Stage) {
    let guest = stage.join(ROOM, "Flood").await;
    let again = frame(WHOLE, &input(guest.seq + 1));
    flooded(stage, guest, &again).await;
}

/// Checks that a guest who writes bytes endlessly loses the socket and can return to the seat.
async fn flooded(stage: &Stage, mut guest: Client, bytes: &[u8]) {
    frames::flood(&mut guest, bytes).await;
    stage.refuses("flood");
    stage.returns(ROOM, guest).await;
}

/// Row 14: a client with a different version.
pub async fn another_version(stage: &Stage) {
    let mut old = Client::connect(stage.address, ROOM).await;
    old.hello(VERSION + 1, "Old", None).await;
    old.is_refused(Refusal::Version).await;
    stage.refuses("version");
}

/// Row 15: a page from another site.
pub async fn foreign_page(stage: &Stage) {
    let mut stream = connect(stage).await;
    let request = "GET /arena HTTP/1.1\r\nHost: localhost\r\nOrigin: http://elsewhere\r\n\
        Connection: upgrade, close\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    stream.write_all(request.as_bytes()).await.expect("a live socket");
    assert!(read_all(&mut stream).await.starts_with("HTTP/1.1 403 "));
    stage.refuses("foreign_page");
}

/// Row 16: pointers that are not valid positions.
pub async fn invalid_pointers(stage: &Stage) {
    for x in [f32::NAN, f32::INFINITY, f32::MAX, -1.1e6] {
        let mut guest = stage.join(ROOM, "Nowhere").await;
        // An input ends with its pointer.
        let mut bytes = input(guest.seq + 1);
        let at = bytes.len() - 8;
        bytes[at..at + 4].copy_from_slice(&x.to_le_bytes());
        write(&mut guest, &frame(WHOLE, &bytes)).await;
        stage.ends(ROOM, guest, Refusal::BadMessage, "bad_message").await;
    }
}

/// Row 17: inputs from the far future and the past.
pub async fn inputs_from_other_times(stage: &Stage) {
    let mut guest = stage.join(ROOM, "Then").await;
    let seq = guest.seq;
    for wrong in [0, seq, u32::MAX, 1 << 31, seq + 1000] {
        let input = Input::new(Buttons::LEFT, None);
        guest.send(&ClientMessage::Input { seq: wrong, ack_tick: 0, input }).await;
        stage.counts("jostle_inputs_ignored_total", 1);
    }
    guest.keeps_playing().await;
    assert!(guest.player().input_seq <= guest.seq);
    stage.leave(guest).await;
}

/// Row 18: a client whose clock jumps.
pub async fn jumping_clock(stage: &Stage) {
    let mut guest = stage.join(ROOM, "Jump").await;
    let mut newest = 0;
    for jumped in [5, u32::MAX, 0, 1 << 31, 7] {
        guest.send(&ClientMessage::Ping { stamp: jumped }).await;
        let tick = loop {
            if let ServerMessage::Pong { stamp, tick } = guest.message().await {
                assert_eq!(stamp, jumped);
                break tick;
            }
        };
        assert!(tick >= newest, "the server's ticks go on");
        newest = tick;
    }
    guest.keeps_playing().await;
    stage.leave(guest).await;
}
