//! Checks the close code for every way a client can violate the protocol, as listed in docs/protocol.md. The codes of
//! all other refusals are checked wherever a test expects one (`Client::is_refused`).

use crate::client::Client;
use crate::faults::frames::{FIRST, NEXT, WHOLE, frame, input, write};
use crate::server::Server;
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Refusal, Role, VERSION};
use tokio_tungstenite::tungstenite::Message;

/// First bytes of a complete text frame, the last fragment, a ping and a close.
const TEXT: u8 = 0x81;
const LAST: u8 = 0x80;
const PING: u8 = 0x89;
const CLOSE: u8 = 0x88;

/// A header that claims a payload of `length` bytes.
fn claims(length: u64) -> Vec<u8> {
    [&[WHOLE, 0xff][..], &length.to_be_bytes(), &[0; 4]].concat()
}

fn hello() -> Vec<u8> {
    let appearance = Appearance { name: "Again".into(), color: 0 };
    let (token, host_key) = (None, None);
    ClientMessage::Hello { version: VERSION, appearance, token, host_key, role: Role::Player }
        .encode()
}

/// Frames that are refused both before and after the hello, each with its close code.
fn violations() -> Vec<(&'static str, Vec<u8>, u16)> {
    let without_mask = [&[WHOLE, 4][..], &[2, 0, 0, 0]].concat();
    let long_ping = [&[PING, 0xfe, 0, 126, 0, 0, 0, 0][..], &[0; 126]].concat();
    let interrupted = [frame(FIRST, &[1]), frame(WHOLE, &input(1))].concat();
    let long_in_parts = [frame(FIRST, &[1; 100]), frame(NEXT, &[1; 100])].concat();
    vec![
        ("no mask", without_mask, 1002),
        ("a reserved bit", frame(WHOLE | 0x40, &input(1)), 1002),
        ("a reserved kind", frame(0x83, &input(1)), 1002),
        ("a reserved control frame", frame(0x8b, b""), 1002),
        ("a fragmented ping", frame(0x09, b"half"), 1002),
        ("a long ping", long_ping, 1002),
        ("a fragment without a first one", frame(LAST, &input(1)), 1002),
        ("a message inside another", interrupted, 1002),
        ("text", frame(TEXT, b"hello"), 1003),
        ("empty text", frame(TEXT, b""), 1003),
        ("text that is no UTF-8", frame(TEXT, &[0xff, 0xfe]), 1007),
        ("a byte too many", claims(CLIENT_MESSAGE_BYTES_MAX as u64 + 1), 1009),
        ("half of all addresses", claims(1 << 63), 1009),
        ("fragments of too many bytes", long_in_parts, 1009),
    ]
}

/// The refusals, if any, before and after the hello, with their close codes.
type Expected = [Option<(Refusal, u16)>; 2];

/// Messages that are valid but arrive at the wrong time.
fn misplaced() -> Vec<(&'static str, Vec<u8>, Expected)> {
    let (hello_1008, message) =
        (Some((Refusal::BadHello, 1008)), |code| Some((Refusal::BadMessage, code)));
    vec![
        ("no message at all", vec![0xee; 20], [hello_1008, message(1007)]),
        ("an empty message", vec![], [hello_1008, message(1007)]),
        ("half an input", input(1)[..4].to_vec(), [hello_1008, message(1007)]),
        ("an input", input(1), [hello_1008, None]),
        ("a hello", hello(), [None, message(1008)]),
    ]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_violation_has_its_close_code_before_and_after_the_hello() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut cases = Vec::new();
    for (name, bytes, code) in violations() {
        cases.push((name, bytes, [Some((Refusal::BadMessage, code)); 2]));
    }
    for (name, message, expected) in misplaced() {
        cases.push((name, frame(WHOLE, &message), expected));
    }
    for (name, bytes, [before, after]) in cases {
        if let Some(expected) = before {
            let mut stranger = Client::connect(server.address, "arena").await;
            write(&mut stranger, &bytes).await;
            assert_eq!(stranger.refusal().await, expected, "{name}, before the hello");
        }
        if let Some(expected) = after {
            let mut eve = Client::join(server.address, "arena", "Eve").await;
            write(&mut eve, &bytes).await;
            assert_eq!(eve.refusal().await, expected, "{name}, after the hello");
        }
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn close_frames_are_answered_with_their_code_or_as_a_protocol_error() {
    let server = Server::start().await;
    for (sent, answered) in [
        (Some(1000), Some(1000)),
        (Some(1001), Some(1001)),
        (Some(4321), Some(4321)),
        (None, None),
        // Close codes that must not be sent: reserved for local use, unassigned, or missing.
        (Some(1005), Some(1002)),
        (Some(1006), Some(1002)),
        (Some(999), Some(1002)),
        (Some(2999), Some(1002)),
    ] {
        let mut client = Client::join(server.address, "arena", "Ann").await;
        let payload = sent.map_or(Vec::new(), |code: u16| code.to_be_bytes().to_vec());
        write(&mut client, &frame(CLOSE, &payload)).await;
        let code = loop {
            match client.frame().await {
                Some(Ok(Message::Close(reason))) => break reason.map(|reason| reason.code.into()),
                Some(Ok(_)) => {}
                other => panic!("{other:?} instead of an answer to {sent:?}"),
            }
        };
        assert_eq!(code, answered, "the answer to {sent:?}");
    }
}
