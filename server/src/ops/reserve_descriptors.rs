//! Reserve descriptors for the operators' port. Even when players, rooms and files have taken all the descriptors that
//! the system allows, operators can still connect and act.

use std::fs::File;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use tokio::net::{TcpListener, TcpStream};

/// Number of reserve descriptors: one for a scraper that keeps its connection open, and one for a person.
const SPARE: usize = 2;
/// A file that can be opened on any system at no cost.
const NOTHING: &str = if cfg!(windows) { "NUL" } else { "/dev/null" };

/// Open files that are closed when an operator's connection finds no free descriptor. Players are accepted under the
/// same lock, so that none of them takes the descriptor that was freed.
#[derive(Debug, Default)]
pub struct SpareDescriptors {
    held: Mutex<Vec<File>>,
}

impl SpareDescriptors {
    /// Replaces missing reserve descriptors, if any are available.
    pub fn refill(&self) {
        refill(&mut self.lock());
    }

    /// Accepts an operator's connection, using a reserve descriptor if needed.
    pub async fn accept(&self, listener: &TcpListener) -> io::Result<(TcpStream, SocketAddr)> {
        poll_fn(|context| {
            let mut held = self.lock();
            let accepted = listener.poll_accept(context);
            if !matches!(accepted, Poll::Ready(Err(_))) || held.pop().is_none() {
                return accepted;
            }
            let accepted = listener.poll_accept(context);
            if !matches!(accepted, Poll::Ready(Ok(_))) {
                refill(&mut held);
            }
            accepted
        })
        .await
    }

    /// Accepts a player's connection.
    pub async fn accept_player(
        &self,
        listener: &TcpListener,
    ) -> io::Result<(TcpStream, SocketAddr)> {
        poll_fn(|context| {
            let _held = self.lock();
            listener.poll_accept(context)
        })
        .await
    }

    /// Drops an operator's connection, keeping its descriptor if the reserve lacks one.
    pub fn take_back<T>(&self, connection: T) {
        let mut held = self.lock();
        drop(connection);
        refill(&mut held);
    }

    fn lock(&self) -> MutexGuard<'_, Vec<File>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn refill(held: &mut Vec<File>) {
    while held.len() < SPARE {
        let Ok(file) = File::open(NOTHING) else { return };
        held.push(file);
    }
}
