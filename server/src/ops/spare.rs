//! Descriptors in reserve for the operators' port: when players, rooms and files have taken all that the system
//! allows, operators can still look and act.

use std::fs::File;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use tokio::net::{TcpListener, TcpStream};

/// Descriptors that are held: one for a scraper that keeps its connection, and one for a person.
const SPARE: usize = 2;
/// A file that can be opened anywhere, at no cost.
const NOTHING: &str = if cfg!(windows) { "NUL" } else { "/dev/null" };

/// Open files that are closed when the connection of an operator finds no descriptor. Players are accepted under the
/// same lock, so that none of them gets the descriptor meanwhile.
#[derive(Debug, Default)]
pub struct SpareDescriptors {
    held: Mutex<Vec<File>>,
}

impl SpareDescriptors {
    /// Takes as many as are missing, as far as there are any.
    pub fn refill(&self) {
        refill(&mut self.lock());
    }

    /// Accepts a connection of an operator, if need be with one of the descriptors.
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

    /// Accepts a connection of a player.
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

    /// Drops an operator's connection, and takes its descriptor if one is missing.
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
