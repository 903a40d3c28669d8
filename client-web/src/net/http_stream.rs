//! The two directions of a connection over HTTP: a streamed response down and short posts up. The bodies carry the
//! bytes that a WebSocket would carry after its upgrade (RFC 6455), so the server treats both alike.

use crate::net::report::SocketEvent;
use jostle_protocol::limits::{POST_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};

/// Number of digits of the session's id, with which the streamed response begins.
const ID_DIGITS: usize = 32;
/// Maximum number of bytes that wait while a post is repeated; beyond that the connection is given up.
const WAITING_BYTES_MAX: usize = 16 * POST_BYTES_MAX;
/// The bit of a frame that ends its message, and the kinds of frames. The server sends no fragments.
const FINAL: u8 = 0x80;
const BINARY: u8 = 2;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;
/// The bit of a frame's length that says that it is masked, as the frames of clients have to be. The mask is zero.
const MASKED: u8 = 0x80;
/// Close codes: the player leaves, the peer broke the protocol, and none was sent.
const LEAVE_CODE: u16 = 1000;
const BROKEN_FRAME: u16 = 1002;
const NO_CODE: u16 = 1005;

/// The state of a connection over HTTP. It performs no requests itself.
#[derive(Debug, Default)]
pub struct HttpStream {
    /// Received bytes that are not a whole frame yet, from `taken` on.
    received: Vec<u8>,
    taken: usize,
    /// The session's id, once the response has begun.
    id: Option<String>,
    /// The number of the next post, or of the one that is on its way.
    number: u32,
    /// Frames that no post carries yet.
    waiting: Vec<u8>,
    /// The body of the post that is on its way.
    posted: Option<Vec<u8>>,
}

/// The next step after the answer to a post.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Send what has gathered in the meantime.
    Post,
    /// Repeat the post after a moment.
    Retry,
    /// The session has ended.
    End,
}

impl HttpStream {
    /// Adds bytes of the streamed response.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.received.drain(..std::mem::take(&mut self.taken));
        self.received.extend_from_slice(bytes);
    }

    /// The next event in the received bytes. Pings are answered with the next post.
    pub fn next_event(&mut self) -> Option<SocketEvent> {
        if self.id.is_none() {
            let id = self.take(ID_DIGITS)?;
            self.id = Some(String::from_utf8_lossy(&id).into_owned());
            return Some(SocketEvent::Opened);
        }
        loop {
            let rest = &self.received[self.taken..];
            let (kind, length) = (*rest.first()?, *rest.get(1)?);
            let (head, length) = match length {
                126 => (4, usize::from(u16::from_be_bytes([*rest.get(2)?, *rest.get(3)?]))),
                127 => {
                    let digits = rest.get(2..10)?.iter();
                    (10, digits.fold(0, |sum, digit| sum << 8 | u64::from(*digit)) as usize)
                }
                _ => (2, usize::from(length)),
            };
            if length > SERVER_MESSAGE_BYTES_MAX {
                return Some(SocketEvent::Closed { code: BROKEN_FRAME });
            }
            let frame = self.take(head + length)?;
            let payload = &frame[head..];
            match kind ^ FINAL {
                BINARY => return Some(SocketEvent::Message(payload.to_vec())),
                PING => self.queue(PONG, payload),
                PONG => {}
                CLOSE => {
                    let code =
                        payload.first_chunk().map_or(NO_CODE, |code| u16::from_be_bytes(*code));
                    return Some(SocketEvent::Closed { code });
                }
                _ => return Some(SocketEvent::Closed { code: BROKEN_FRAME }),
            }
        }
    }

    fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        let bytes = self.received.get(self.taken..self.taken + count)?.to_vec();
        self.taken += count;
        Some(bytes)
    }

    /// Queues a message, unless the response has not begun.
    pub fn send(&mut self, message: &[u8]) {
        if self.id.is_some() {
            self.queue(BINARY, message);
        }
    }

    /// Queues the note that the player leaves on purpose.
    pub fn leave(&mut self) {
        self.queue(CLOSE, &LEAVE_CODE.to_be_bytes());
    }

    fn queue(&mut self, kind: u8, payload: &[u8]) {
        let length = payload.len();
        self.waiting.push(FINAL | kind);
        match length {
            0..126 => self.waiting.push(MASKED | length as u8),
            _ => {
                self.waiting.push(MASKED | 126);
                self.waiting.extend((length as u16).to_be_bytes());
            }
        }
        self.waiting.extend([0; 4]);
        self.waiting.extend(payload);
    }

    /// The path and the body of the next post; `None` if one is on its way, nothing is waiting, or the response has not
    /// begun.
    pub fn next_post(&mut self) -> Option<(String, Vec<u8>)> {
        if self.id.is_none() || self.posted.is_some() || self.waiting.is_empty() {
            return None;
        }
        let count = self.waiting.len().min(POST_BYTES_MAX);
        self.posted = Some(self.waiting.drain(..count).collect());
        self.post()
    }

    /// The post that is on its way, to be sent again.
    pub fn post(&self) -> Option<(String, Vec<u8>)> {
        let (id, body) = (self.id.as_ref()?, self.posted.as_ref()?);
        Some((format!("/api/send/{id}/{}", self.number), body.clone()))
    }

    /// Handles the status that answers a post, or 0 if no answer came.
    pub fn answered(&mut self, status: u16) -> Next {
        match status {
            200..300 => {
                self.posted = None;
                self.number += 1;
                Next::Post
            }
            0 | 408 | 429 | 500.. if self.waiting.len() <= WAITING_BYTES_MAX => Next::Retry,
            _ => Next::End,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: &str = "00112233445566778899aabbccddeeff";

    fn opened() -> HttpStream {
        let mut stream = HttpStream::default();
        stream.receive(ID.as_bytes());
        assert_eq!(stream.next_event(), Some(SocketEvent::Opened));
        stream
    }

    fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
        let length = payload.len();
        let head = match length {
            0..126 => vec![kind, length as u8],
            126..65_536 => [&[kind, 126][..], &(length as u16).to_be_bytes()].concat(),
            _ => [&[kind, 127][..], &(length as u64).to_be_bytes()].concat(),
        };
        [head, payload.to_vec()].concat()
    }

    #[test]
    fn messages_of_all_lengths_come_whole_however_they_arrive() {
        let sent: Vec<Vec<u8>> =
            [0, 1, 125, 126, 65_535, 65_536, 3].map(|length| vec![7; length]).to_vec();
        let mut wire = ID.as_bytes().to_vec();
        sent.iter().for_each(|message| wire.extend(frame(0x82, message)));
        wire.extend(frame(0x88, &4007u16.to_be_bytes()));
        for part in [1, 7, 1000, wire.len()] {
            let mut stream = HttpStream::default();
            let mut events = Vec::new();
            for bytes in wire.chunks(part) {
                stream.receive(bytes);
                events.extend(std::iter::from_fn(|| stream.next_event()));
            }
            assert_eq!(events.remove(0), SocketEvent::Opened);
            assert_eq!(events.pop(), Some(SocketEvent::Closed { code: 4007 }));
            assert!(
                events.into_iter().eq(sent.iter().cloned().map(SocketEvent::Message)),
                "{part}"
            );
        }
    }

    #[test]
    fn a_ping_is_answered_and_a_broken_frame_ends_the_connection() {
        let mut stream = opened();
        stream.receive(&frame(0x89, b"hi"));
        assert_eq!(stream.next_event(), None);
        let pong = vec![0x8a, 0x82, 0, 0, 0, 0, b'h', b'i'];
        assert_eq!(stream.next_post(), Some((format!("/api/send/{ID}/0"), pong)));
        for broken in
            [frame(0x02, b"part"), frame(0x81, b"text"), vec![0x82, 127, 1, 0, 0, 0, 0, 0, 0, 0]]
        {
            let mut stream = opened();
            stream.receive(&broken);
            assert_eq!(stream.next_event(), Some(SocketEvent::Closed { code: 1002 }));
        }
    }

    #[test]
    fn one_post_is_on_its_way_and_the_rest_gathers() {
        let mut stream = HttpStream::default();
        stream.send(&[9]);
        stream.leave();
        assert_eq!(stream.next_post(), None, "not open yet");
        let mut stream = opened();
        stream.send(&[1]);
        let first = Some((format!("/api/send/{ID}/0"), vec![0x82, 0x81, 0, 0, 0, 0, 1]));
        assert_eq!(stream.next_post(), first);
        stream.send(&[2; 126]);
        stream.leave();
        assert_eq!(stream.next_post(), None);
        for status in [0, 429, 503] {
            assert_eq!(stream.answered(status), Next::Retry);
            assert_eq!(stream.next_post(), None);
            assert_eq!(stream.post(), first);
        }
        assert_eq!(stream.answered(204), Next::Post);
        let (path, body) = stream.next_post().expect("what gathered");
        assert_eq!(path, format!("/api/send/{ID}/1"));
        let long = [&[0x82, 0xfe, 0, 126, 0, 0, 0, 0][..], &[2; 126]].concat();
        assert_eq!(body, [&long[..], &[0x88, 0x82, 0, 0, 0, 0, 3, 0xe8]].concat());
        assert_eq!(stream.answered(404), Next::End);
    }

    #[test]
    fn a_connection_on_which_too_much_waits_is_given_up() {
        let mut stream = opened();
        stream.send(&[1]);
        stream.next_post().expect("a post");
        while stream.answered(503) == Next::Retry {
            assert!(stream.waiting.len() <= WAITING_BYTES_MAX);
            stream.send(&[2; 100]);
        }
        assert!(stream.waiting.len() > WAITING_BYTES_MAX);
    }

    #[test]
    fn a_long_wait_is_split_into_posts() {
        let mut stream = opened();
        (0..300).for_each(|_| stream.send(&[3; 30]));
        let mut lengths = Vec::new();
        while let Some((_, body)) = stream.next_post() {
            lengths.push(body.len());
            assert_eq!(stream.answered(204), Next::Post);
        }
        assert_eq!(lengths, [POST_BYTES_MAX, 300 * 36 - POST_BYTES_MAX]);
    }
}
