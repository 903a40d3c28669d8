//! Answers to pings. Clients ping several times a second, and in a steady tick the pongs are all that a session
//! sends beside shared snapshots: their memory is reused once they were sent.

use crate::limits::PONGS_BYTES;
use bytes::{Bytes, BytesMut};
use jostle_protocol::ServerMessage;
use jostle_protocol::wire::Writer;

/// The pongs of one session.
#[derive(Default)]
pub struct Pongs {
    writer: Writer,
    memory: BytesMut,
}

impl Pongs {
    /// Encodes the answer to a ping of this stamp, at this tick.
    pub fn pong(&mut self, stamp: u32, tick: u32) -> Bytes {
        self.writer.clear();
        ServerMessage::Pong { stamp, tick }.write(&mut self.writer);
        let bytes = self.writer.bytes();
        if self.memory.capacity() < bytes.len() {
            self.memory.reserve(PONGS_BYTES);
        }
        self.memory.extend_from_slice(bytes);
        self.memory.split().freeze()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn pongs_are_right_and_reuse_the_memory_of_those_sent() {
        let mut pongs = Pongs::default();
        let mut addresses = BTreeSet::new();
        for stamp in 0..1000 {
            let pong = pongs.pong(stamp, 70_000);
            let answer = ServerMessage::Pong { stamp, tick: 70_000 };
            assert_eq!(ServerMessage::decode(&pong), Ok(answer));
            addresses.insert(pong.as_ptr() as usize);
        }
        let (first, last) = (addresses.first().unwrap(), addresses.last().unwrap());
        assert!(last - first < PONGS_BYTES, "all in the same memory");
    }

    #[test]
    fn waiting_pongs_are_not_overwritten() {
        let mut pongs = Pongs::default();
        let waiting: Vec<Bytes> = (0..100).map(|stamp| pongs.pong(stamp, 5)).collect();
        for (stamp, pong) in (0..).zip(&waiting) {
            let answer = ServerMessage::Pong { stamp, tick: 5 };
            assert_eq!(ServerMessage::decode(pong), Ok(answer));
        }
    }
}
