//! Where the messages of a room are made. What a message is written with, and the memory of messages
//! that nobody holds any more, are used again: a steady tick asks for no memory.

use bytes::{Bytes, BytesMut};
use jostle_protocol::{Pen, Snapshot, Stream, TimedEvent};
use std::collections::VecDeque;
use std::sync::Arc;

/// Messages whose memory is waited for; past them the oldest is let go, and freed by who holds it last.
const MESSAGES_MAX: usize = 1024;
/// Messages that are asked whether their memory is free before more is taken.
const TRIES: usize = 4;
/// Bytes of a message whose memory is used again, at most: a larger one is rare, and freed by who
/// holds it last. So the memory kept is bounded by messages times twice this, for it grows by doubling.
const KEPT_BYTES_MAX: usize = 16 << 10;
/// Memory of a new message: most of them fit.
const USUAL_BYTES: usize = 512;

/// Makes messages, for as many streams as there are.
#[derive(Clone, Debug, Default)]
pub struct Press {
    pen: Pen,
    /// Those that were made, the oldest first.
    made: VecDeque<Bytes>,
}

impl Press {
    /// The message that leads the stream to this snapshot: [`Stream::encode`].
    pub fn message(
        &mut self,
        stream: &mut Stream,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
    ) -> Bytes {
        let mut memory = self.memory();
        memory.extend_from_slice(stream.write(&mut self.pen, snapshot, events));
        // Split off, the bytes share one count for good; `freeze` alone would make a new one each time.
        let message = memory.split().freeze();
        if message.len() > KEPT_BYTES_MAX {
            return message;
        }
        if self.made.len() == MESSAGES_MAX {
            self.made.pop_front();
        }
        self.made.push_back(message.clone());
        message
    }

    /// That of a message that nobody holds any more, or else new.
    fn memory(&mut self) -> BytesMut {
        for _ in 0..TRIES.min(self.made.len()) {
            match self.made.pop_front().map(Bytes::try_into_mut) {
                Some(Ok(mut memory)) => {
                    memory.clear();
                    return memory;
                }
                Some(Err(held)) => self.made.push_back(held),
                None => {}
            }
        }
        BytesMut::with_capacity(USUAL_BYTES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(tick: u32) -> Arc<Snapshot> {
        Arc::new(Snapshot { tick, ..Snapshot::default() })
    }

    #[test]
    fn memory_is_used_again_once_nobody_holds_it() {
        let (mut press, mut stream) = (Press::default(), Stream::new(1));
        let held = press.message(&mut stream, &snapshot(1), &[]);
        let copy = held.to_vec();
        let other = press.message(&mut stream, &snapshot(2), &[]);
        assert_ne!(other.as_ptr(), held.as_ptr());
        assert_eq!(held, copy, "what is held stays as it is");
        let place = held.as_ptr();
        drop(held);
        assert_eq!(press.message(&mut stream, &snapshot(3), &[]).as_ptr(), place);
        assert_eq!(press.made.len(), 2);
    }

    #[test]
    fn the_memory_of_a_large_message_is_not_kept() {
        let (mut press, mut stream) = (Press::default(), Stream::new(1));
        let body = |index| jostle_protocol::SnapshotBody {
            id: jostle_sim::BodyId { index, generation: 0 },
            kind: jostle_sim::Kind::Block,
            owner: None,
            group: 0,
            shape: jostle_sim::Shape::circle(1.0),
            quanta: [7 * index as i32, 7],
        };
        let bodies = (0..KEPT_BYTES_MAX as u32 / 4).map(body).collect();
        let crowd = Arc::new(Snapshot { tick: 1, bodies, ..Snapshot::default() });
        assert!(press.message(&mut stream, &crowd, &[]).len() > KEPT_BYTES_MAX);
        assert!(press.made.is_empty());
        press.message(&mut stream, &snapshot(2), &[]);
        assert_eq!(press.made.len(), 1);
    }

    #[test]
    fn memory_that_is_never_given_back_is_let_go() {
        let (mut press, mut stream) = (Press::default(), Stream::new(1));
        let held: Vec<Bytes> = (0..MESSAGES_MAX as u32 + 9)
            .map(|tick| press.message(&mut stream, &snapshot(tick), &[]))
            .collect();
        assert_eq!(press.made.len(), MESSAGES_MAX);
        assert_eq!(held.iter().filter(|message| message.is_unique()).count(), 9);
    }
}
