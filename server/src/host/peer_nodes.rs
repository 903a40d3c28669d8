//! The other nodes of a fleet, for clients to ask where a room is if this node falls silent.

use bytes::Bytes;
use jostle_protocol::ServerMessage;
use jostle_protocol::limits::NODES_MAX;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The addresses of other nodes.
#[derive(Debug, Default)]
pub struct PeerNodes {
    revision: AtomicU64,
    urls: Mutex<Arc<[String]>>,
}

impl PeerNodes {
    /// Sets the addresses of the other nodes.
    pub fn set(&self, urls: Vec<String>) {
        let mut current = self.lock();
        if **current != *urls {
            *current = urls.into();
            self.revision.fetch_add(1, Ordering::Release);
        }
    }

    /// Increases whenever the addresses change; 0 outside a fleet.
    pub fn revision(&self) -> u64 {
        self.revision.load(Ordering::Acquire)
    }

    /// The message that tells clients the first of these addresses.
    pub fn message(&self) -> Bytes {
        let urls = self.lock().iter().take(NODES_MAX).cloned().collect();
        ServerMessage::Nodes { urls }.encode().into()
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> std::sync::MutexGuard<'_, Arc<[String]>> {
        self.urls.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
