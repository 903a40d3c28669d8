//! Buffers for a room's messages. The encoder's scratch buffers and the memory of messages no longer in use are kept,
//! so that a steady tick allocates nothing.

use bytes::{Bytes, BytesMut};
use jostle_protocol::{EncodeScratch, Snapshot, SnapshotStream, TimedEvent};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of messages whose memory is kept for reuse. Beyond this, the oldest leaves the pool, and its last
/// holder frees it.
const MESSAGES_MAX: usize = 1024;
/// Limit on the total length of pooled messages, bytes. A megabyte is enough for 64 players in a large world who
/// receive 500 bytes per tick and lag by half a second. Buffers grow by doubling, so the pool holds at most twice as
/// much.
const BYTES_MAX: usize = 1 << 20;
/// Number of messages to try to reuse before allocating new memory.
const TRIES: usize = 4;
/// Maximum length of a message to pool, bytes. Larger ones are rare, and their last holder frees them.
const KEPT_BYTES_MAX: usize = 16 << 10;
/// Capacity of a new buffer, bytes. Most messages fit.
const USUAL_BYTES: usize = 512;

/// Encodes messages into reused memory, for any number of streams.
#[derive(Clone, Debug, Default)]
pub struct BufferPool {
    scratch: EncodeScratch,
    /// Encoded messages, oldest first.
    messages: VecDeque<Bytes>,
    bytes: usize,
}

impl BufferPool {
    /// Encodes the message that takes a stream to this snapshot. See [`SnapshotStream::encode`].
    pub fn encode(
        &mut self,
        stream: &mut SnapshotStream,
        snapshot: &Arc<Snapshot>,
        events: &[TimedEvent],
    ) -> Bytes {
        let mut buffer = self.free_buffer();
        buffer.extend_from_slice(stream.encode_with(&mut self.scratch, snapshot, events));
        // Bytes that were split off share one reference count; `freeze` alone would allocate one per message.
        let message = buffer.split().freeze();
        if message.len() > KEPT_BYTES_MAX {
            return message;
        }
        self.bytes += message.len();
        self.messages.push_back(message.clone());
        while self.messages.len() > MESSAGES_MAX || self.bytes > BYTES_MAX {
            self.pop_oldest();
        }
        message
    }

    fn pop_oldest(&mut self) -> Option<Bytes> {
        let message = self.messages.pop_front()?;
        self.bytes -= message.len();
        Some(message)
    }

    /// The buffer of a message that is no longer in use, or a new one.
    fn free_buffer(&mut self) -> BytesMut {
        for _ in 0..TRIES.min(self.messages.len()) {
            match self.pop_oldest().map(Bytes::try_into_mut) {
                Some(Ok(mut buffer)) => {
                    buffer.clear();
                    return buffer;
                }
                Some(Err(in_use)) => {
                    self.bytes += in_use.len();
                    self.messages.push_back(in_use);
                }
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
    fn memory_is_reused_after_the_last_holder_drops_it() {
        let (mut pool, mut stream) = (BufferPool::default(), SnapshotStream::new(1));
        let held = pool.encode(&mut stream, &snapshot(1), &[]);
        let copy = held.to_vec();
        let other = pool.encode(&mut stream, &snapshot(2), &[]);
        assert_ne!(other.as_ptr(), held.as_ptr());
        assert_eq!(held, copy, "a message in use does not change");
        let place = held.as_ptr();
        drop(held);
        assert_eq!(pool.encode(&mut stream, &snapshot(3), &[]).as_ptr(), place);
        assert_eq!(pool.messages.len(), 2);
    }

    #[test]
    fn the_memory_of_a_large_message_is_not_kept() {
        let (mut pool, mut stream) = (BufferPool::default(), SnapshotStream::new(1));
        let body = |index| jostle_protocol::SnapshotBody {
            id: jostle_sim::BodyId { index, generation: 0 },
            kind: jostle_game::Kind::Block,
            owner: None,
            group: 0,
            shape: jostle_sim::Shape::circle(1.0),
            quanta: [7 * index as i32, 7],
        };
        let bodies = (0..KEPT_BYTES_MAX as u32 / 4).map(body).collect();
        let crowd = Arc::new(Snapshot { tick: 1, bodies, ..Snapshot::default() });
        assert!(pool.encode(&mut stream, &crowd, &[]).len() > KEPT_BYTES_MAX);
        assert!(pool.messages.is_empty());
        pool.encode(&mut stream, &snapshot(2), &[]);
        assert_eq!(pool.messages.len(), 1);
    }

    #[test]
    fn memory_that_is_never_released_leaves_the_pool() {
        let (mut pool, mut stream) = (BufferPool::default(), SnapshotStream::new(1));
        let held: Vec<Bytes> = (0..MESSAGES_MAX as u32 + 9)
            .map(|tick| pool.encode(&mut stream, &snapshot(tick), &[]))
            .collect();
        assert_eq!(pool.messages.len(), MESSAGES_MAX);
        assert_eq!(held.iter().filter(|message| message.is_unique()).count(), 9);
    }

    #[test]
    fn the_pool_keeps_a_megabyte_however_many_messages_are_held() {
        let (mut pool, mut stream) = (BufferPool::default(), SnapshotStream::new(1));
        let body = |index| jostle_protocol::SnapshotBody {
            id: jostle_sim::BodyId { index, generation: 0 },
            kind: jostle_game::Kind::Block,
            owner: None,
            group: 0,
            shape: jostle_sim::Shape::circle(1.0),
            quanta: [7 * index as i32, 7],
        };
        let crowd = Snapshot { bodies: (0..1000).map(body).collect(), ..Snapshot::default() };
        let held: Vec<Bytes> = (1..=900)
            .map(|tick| {
                // Each message is a keyframe.
                stream = SnapshotStream::new(1);
                pool.encode(&mut stream, &Arc::new(Snapshot { tick, ..crowd.clone() }), &[])
            })
            .collect();
        assert!(held.iter().map(Bytes::len).sum::<usize>() > 2 * BYTES_MAX);
        assert!(pool.messages.iter().map(Bytes::len).sum::<usize>() <= BYTES_MAX);
    }
}
