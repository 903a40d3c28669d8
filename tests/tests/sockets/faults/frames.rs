//! Tests of bytes that no page sends: broken, huge or fragmented heads, frames and inputs.

use super::refusals;
use crate::client::{Client, LONG};
use crate::server::Server;
use jostle_game::{Buttons, Input};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Refusal, Role, ServerMessage, VERSION};
use jostle_server::limits::{HTTP_BUFFER_BYTES_MAX, Timeouts};
use jostle_sim::Vec2;
use jostle_tests::server::{BRIEF, PATIENT};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// First bytes of an unfragmented binary frame, of the first, a middle and the last fragment, and of a ping.
pub const WHOLE: u8 = 0x82;
pub const FIRST: u8 = 0x02;
pub const NEXT: u8 = 0x00;
const LAST: u8 = 0x80;
const PING: u8 = 0x89;

/// A frame whose mask is zero, which leaves the payload unchanged.
pub fn frame(first: u8, payload: &[u8]) -> Vec<u8> {
    let length = u8::try_from(payload.len()).expect("a short payload");
    assert!(length < 126, "a payload whose length is one byte");
    [&[first, 0x80 | length, 0, 0, 0, 0], payload].concat()
}

pub fn hello(name: &str) -> Vec<u8> {
    let appearance = Appearance { name: name.into(), color: 0 };
    let (token, host_key, role) = (None, None, Role::Player);
    ClientMessage::Hello { version: VERSION, appearance, token, host_key, role }.encode()
}

pub fn input(seq: u32) -> Vec<u8> {
    let input = Input::new(Buttons::RIGHT, Some(Vec2::new(40.0, 30.0)));
    ClientMessage::Input { seq, ack_tick: 0, input }.encode()
}

/// Writes raw bytes below the client's framing. The server may close the connection before it has read everything.
pub async fn write(client: &mut Client, bytes: &[u8]) {
    let _ = timeout(LONG, client.socket.get_mut().write_all(bytes)).await.expect("time");
}

/// Writes the given bytes repeatedly until the server refuses them as a flood. The limits are rates, so a server that
/// reads slowly accepts more.
pub async fn flood(client: &mut Client, bytes: &[u8]) {
    let mut many = bytes.repeat((32 << 10) / bytes.len());
    many.extend(frame(PING, &[]));
    let refused = async {
        loop {
            write(client, &many).await;
            // Nothing may be written after the refusal, because a connection reset could otherwise discard it.
            if let Err(refusal) = client.pong().await {
                return (refusal, client.close_code(refusal).await);
            }
        }
    };
    let refused = timeout(LONG, refused).await.expect("an end of the flood");
    assert_eq!(refused, (Refusal::Flood, Refusal::Flood.close_code()));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn broken_frames_are_refused_before_and_after_the_hello() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let claims = |length: u64| [&[WHOLE, 0xff][..], &length.to_be_bytes(), &[0; 4]].concat();
    let broken = [
        claims(1 << 63),
        claims(u64::MAX),
        claims(CLIENT_MESSAGE_BYTES_MAX as u64 + 1),
        // No mask, even though clients must use one.
        [&[WHOLE, 4][..], &[2, 0, 0, 0]].concat(),
        // A reserved bit, a reserved opcode, a fragmented ping, and a ping that is too long.
        frame(WHOLE | 0x40, &input(1)),
        frame(0x83, &input(1)),
        frame(0x09, b"half"),
        [&[0x89, 0xfe, 0, 126, 0, 0, 0, 0][..], &[0; 126]].concat(),
        // A final fragment without a first one, a message inside another, and fragments whose total size is too large.
        frame(LAST, &input(1)),
        [frame(FIRST, &[1]), frame(WHOLE, &input(1))].concat(),
        [frame(FIRST, &[1; 100]), frame(NEXT, &[1; 100])].concat(),
    ];
    for bytes in &broken {
        let mut stranger = Client::connect(server.address, "arena").await;
        write(&mut stranger, bytes).await;
        stranger.is_refused(Refusal::BadMessage).await;
        let mut eve = Client::join(server.address, "arena", "Eve").await;
        write(&mut eve, bytes).await;
        eve.is_refused(Refusal::BadMessage).await;
    }
    server.counts(&refusals("bad_message"), 2 * broken.len() as u64).await;
    server.counts("jostle_leaves_total{how=\"lost\"}", broken.len() as u64).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_in_fragments_are_whole_messages() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::connect(server.address, "arena").await;
    // The hello in one-byte fragments, which are sent in one-byte segments.
    let bytes = hello("Bob");
    let (last, before) = bytes.split_last().expect("a hello");
    let mut pieces = vec![frame(FIRST, &[])];
    pieces.extend(before.iter().map(|&byte| frame(NEXT, &[byte])));
    pieces.push(frame(LAST, &[*last]));
    for &byte in pieces.concat().iter() {
        write(&mut bob, &[byte]).await;
    }
    let ServerMessage::Welcome { seat: Some(own), .. } = bob.message().await else {
        panic!("no welcome")
    };
    bob.seat = own.seat.0;
    for seq in 1..=30 {
        for &byte in frame(WHOLE, &input(seq)).iter() {
            write(&mut bob, &[byte]).await;
        }
        bob.snapshot().await;
    }
    bob.seq = 30;
    bob.keeps_playing().await;
    assert_eq!(server.count("jostle_inputs_ignored_total").await, 0);
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_upgrade_in_segments_of_a_byte_is_an_upgrade() {
    let server = Server::start().await;
    let request = "GET /arena HTTP/1.1\r\nHost: localhost\r\nConnection: upgrade\r\n\
        Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    let mut stream = TcpStream::connect(server.address).await.expect("a connection");
    stream.set_nodelay(true).expect("a live socket");
    for byte in request.bytes().chain(frame(WHOLE, &hello("Bob"))) {
        stream.write_all(&[byte]).await.expect("a live socket");
    }
    let mut answer = [0; 12];
    timeout(LONG, stream.read_exact(&mut answer)).await.expect("time").expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 101");
    server.counts("jostle_joins_total{how=\"new\"}", 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn fragments_that_never_become_a_message_are_a_flood() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut eve = Client::join(server.address, "arena", "Eve").await;
    let mut stranger = Client::connect(server.address, "arena").await;
    // Empty fragments never form a message, so only their bytes can be counted.
    for client in [&mut eve, &mut stranger] {
        write(client, &frame(FIRST, &[])).await;
        flood(client, &frame(NEXT, &[])).await;
    }
    server.counts(&refusals("flood"), 2).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_dies_inside_a_frame_keeps_its_seat_for_a_while() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    bob.play_one_input().await;
    let whole = frame(WHOLE, &input(2));
    write(&mut bob, &whole[..whole.len() / 2]).await;
    let (seat, token) = (bob.seat, bob.token);
    // Unread data makes the kernel reset the connection.
    drop(bob);
    server.counts("jostle_leaves_total{how=\"lost\"}", 1).await;
    assert_eq!(server.count(&refusals("bad_message")).await, 0);
    let mut bob = Client::connect(server.address, "arena").await;
    bob.enter("Bob", Some(token)).await;
    assert_eq!(bob.seat, seat);
    server.counts("jostle_joins_total{how=\"resumed\"}", 1).await;
    bob.keeps_playing().await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_head_of_twenty_megabytes_is_cut_off() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut stream = TcpStream::connect(server.address).await.expect("a connection");
    stream
        .write_all(b"GET /arena HTTP/1.1\r\nHost: localhost\r\nX-Filler: ")
        .await
        .expect("a socket");
    let chunk = [b'x'; 64 << 10];
    let mut taken = 0;
    while taken < 20 << 20 {
        match timeout(LONG, stream.write(&chunk)).await.expect("the server reads or closes") {
            Ok(count) => taken += count,
            Err(_closed) => break,
        }
    }
    // The kernel buffers a few megabytes; the server itself never holds more than its buffer.
    assert!(taken < 20 << 20, "all {taken} bytes were taken, {HTTP_BUFFER_BYTES_MAX} are allowed");
    server.counts(&refusals("bad_request"), 1).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_head_sent_byte_by_byte_is_closed() {
    let waits = Timeouts { http_head: BRIEF, ..PATIENT };
    let server = Server::start_with_waits(waits).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut stream = TcpStream::connect(server.address).await.expect("a connection");
    let drip = async {
        for byte in b"GET /arena HTTP/1.1\r\nX-Filler: ".iter().chain([b'x'].iter().cycle()) {
            if stream.write_all(&[*byte]).await.is_err() {
                return;
            }
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, drip).await.expect("the server gives up");
    server.counts(&refusals("slow_request"), 1).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pointers_that_are_no_position_are_refused() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let wrong = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.1e6];
    for x in wrong {
        let mut eve = Client::join(server.address, "arena", "Eve").await;
        // An input ends with its pointer.
        let mut bytes = input(1);
        let at = bytes.len() - 8;
        bytes[at..at + 4].copy_from_slice(&x.to_le_bytes());
        write(&mut eve, &frame(WHOLE, &bytes)).await;
        eve.is_refused(Refusal::BadMessage).await;
    }
    server.counts(&refusals("bad_message"), wrong.len() as u64).await;
    // Pointers at the most distant positions and with the smallest numbers.
    for x in [1_048_576.0, -1_048_576.0, f32::MIN_POSITIVE / 2.0, -0.0] {
        ann.input(Buttons::ALL, Some(Vec2::splat(x))).await;
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn inputs_from_far_future_and_past_are_ignored() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    bob.keeps_playing().await;
    let seq = bob.seq;
    let wrong = [0, seq, u32::MAX, 1 << 31, seq + 1000];
    for seq in wrong {
        let input = Input::new(Buttons::LEFT, None);
        bob.send(&ClientMessage::Input { seq, ack_tick: 0, input }).await;
    }
    server.counts("jostle_inputs_ignored_total", wrong.len() as u64).await;
    bob.snapshot().await;
    assert!(bob.player().input_seq <= seq);
    bob.keeps_playing().await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_jumping_client_clock_changes_nothing() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let first = ann.tick().await;
    for jumped in [5, u32::MAX, 0, 1 << 31, 7] {
        ann.send(&ClientMessage::Ping { stamp: jumped }).await;
        let tick = loop {
            if let ServerMessage::Pong { stamp, tick } = ann.message().await {
                assert_eq!(stamp, jumped);
                break tick;
            }
        };
        assert!(tick >= first, "the server's ticks go on");
    }
    ann.keeps_playing().await;
    assert_eq!(server.count("jostle_inputs_ignored_total").await, 0);
}
