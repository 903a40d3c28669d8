use super::*;
use std::collections::VecDeque;
use std::iter;
use tokio::io::{AsyncReadExt, DuplexStream, duplex};

/// A writer to a socket that accepts this many bytes, and the peer.
fn socket(bytes: usize) -> (SocketWriter, DuplexStream) {
    let (socket, peer) = duplex(bytes);
    (SocketWriter::new(socket), peer)
}

fn queued(lengths: &[usize]) -> VecDeque<Bytes> {
    (1..).zip(lengths).map(|(fill, &length)| vec![fill; length].into()).collect()
}

/// The messages as they appear on the wire.
fn on_the_wire(messages: &VecDeque<Bytes>) -> Vec<u8> {
    let header = |length: usize| match length {
        0..126 => vec![0x82, length as u8],
        _ => iter::once(0x82).chain([126]).chain((length as u16).to_be_bytes()).collect(),
    };
    messages.iter().flat_map(|bytes| [header(bytes.len()), bytes.to_vec()].concat()).collect()
}

#[tokio::test]
async fn a_socket_that_takes_a_little_at_a_time_gets_all_in_order() {
    for capacity in [1, 2, 3, 7, 100, 5000] {
        let (writer, mut peer) = socket(capacity);
        let mut waiting = queued(&[0, 1, 125, 126, 4000, 3]);
        let mut expected = on_the_wire(&waiting);
        let sends = async {
            poll_fn(|cx| writer.poll_send(cx, || waiting.pop_front())).await.expect("a socket");
            writer.take().expect("a writer").finish().await.expect("a socket");
        };
        let mut received = Vec::new();
        let (_, read) = tokio::join!(sends, peer.read_to_end(&mut received));
        read.expect("a socket");
        assert!(received == expected, "{capacity} bytes at a time");
        expected.clear();
    }
}

#[tokio::test]
async fn what_the_socket_does_not_take_is_left_to_the_session() {
    let (writer, mut peer) = socket(10);
    let mut waiting = queued(&[3, 30, 4]);
    let expected = on_the_wire(&waiting);
    assert!(!writer.send_now(|| waiting.pop_front()));
    assert_eq!(waiting.len(), 1, "it can still be replaced");
    assert!(writer.send_now(|| waiting.pop_front()), "the session is at it");
    assert_eq!(waiting.len(), 1);
    let sends = poll_fn(|cx| writer.poll_send(cx, || waiting.pop_front()));
    let mut received = vec![0; expected.len()];
    let (sent, read) = tokio::join!(sends, peer.read_exact(&mut received));
    assert!(sent.is_ok() && read.is_ok());
    assert_eq!(received, expected);
}

#[tokio::test]
async fn control_frames_never_come_between_the_parts_of_a_message() {
    let (writer, mut peer) = socket(4);
    let mut waiting = queued(&[6, 1]);
    assert!(!writer.send_now(|| waiting.pop_front()));
    writer.queue(Frame::ping(Bytes::new()));
    assert!(writer.queue_bytes(&[0x8a, 0]));
    let sends = poll_fn(|cx| writer.poll_send(cx, || waiting.pop_front()));
    let mut received = [0; 15];
    let (sent, read) = tokio::join!(sends, peer.read_exact(&mut received));
    assert!(sent.is_ok() && read.is_ok());
    assert_eq!(received, *b"\x82\x06\x01\x01\x01\x01\x01\x01\x89\x00\x8a\x00\x82\x01\x02");
}

#[tokio::test]
async fn frames_that_wait_are_bounded() {
    let (writer, _peer) = socket(1);
    let kilobyte = [0; 1024];
    let taken = iter::repeat_with(|| writer.queue_bytes(&kilobyte)).take_while(|&taken| taken);
    assert_eq!(taken.count(), FRAMES_BYTES_MAX / 1024);
}

#[tokio::test]
async fn after_it_was_taken_or_the_peer_left_nothing_is_sent() {
    let (writer, peer) = socket(100);
    drop(peer);
    let mut waiting = queued(&[3, 3]);
    assert!(!writer.send_now(|| waiting.pop_front()), "the session sees the error");
    let sent = poll_fn(|cx| writer.poll_send(cx, || waiting.pop_front())).await;
    assert_eq!(sent.expect_err("no peer").kind(), ErrorKind::BrokenPipe);
    let (writer, _peer) = socket(100);
    assert!(writer.take().is_some() && writer.take().is_none());
    assert!(!writer.send_now(|| waiting.pop_front()));
    assert_eq!(waiting.len(), 1);
}
