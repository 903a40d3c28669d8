//! Where the faults happen: the two ports of the server, and a tally of what its counters have to say
//! in the end.

use crate::client::{Client, LONG};
use crate::faults::refusals;
use crate::server::{count, until_count};
use futures_util::StreamExt;
use jostle_protocol::{Refusal, Token};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::RwLock;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// What every fault needs to know.
pub struct Stage {
    pub address: SocketAddr,
    pub ops: SocketAddr,
    /// For how long a tab stays in the background.
    pub background: Duration,
    /// Held to read by faults of peers, to write by those of the machine, so that each is alone with
    /// its own.
    pub machine: RwLock<()>,
    tally: Mutex<BTreeMap<String, u64>>,
}

/// What gives a seat back.
pub struct Ticket {
    pub seat: u16,
    pub token: Token,
}

impl Ticket {
    pub fn of(client: &Client) -> Ticket {
        Ticket { seat: client.seat, token: client.token }
    }
}

impl Stage {
    pub fn new(address: SocketAddr, ops: SocketAddr, background: Duration) -> Stage {
        Stage { address, ops, background, machine: RwLock::default(), tally: Mutex::default() }
    }

    /// A counter will have moved by so much.
    pub fn counts(&self, series: &str, by: u64) {
        let mut tally = self.tally.lock().unwrap_or_else(PoisonError::into_inner);
        *tally.entry(series.to_owned()).or_default() += by;
    }

    /// A refusal will have been counted.
    pub fn refuses(&self, reason: &str) {
        self.counts(&refusals(reason), 1);
    }

    /// A guest whose first input was played, so that the seat is worth to be held.
    pub async fn join(&self, room: &str, name: &str) -> Client {
        let mut guest = Client::join(self.address, room, name).await;
        self.counts("jostle_joins_total{how=\"new\"}", 1);
        guest.is_heard().await;
        guest
    }

    /// The owner of a seat comes back to it.
    pub async fn resume(&self, room: &str, lost: Ticket) -> Client {
        let mut back = Client::connect(self.address, room).await;
        back.enter("Back", Some(lost.token)).await;
        assert_eq!(back.seat, lost.seat, "the seat was held");
        self.counts("jostle_joins_total{how=\"resumed\"}", 1);
        back.is_heard().await;
        back
    }

    /// A guest goes for good.
    pub async fn leave(&self, mut guest: Client) {
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        guest.socket.close(Some(frame)).await.expect("a live socket");
        let end = async { while guest.socket.next().await.is_some_and(|frame| frame.is_ok()) {} };
        timeout(LONG, end).await.expect("an answer in time");
        self.counts("jostle_leaves_total{how=\"left\"}", 1);
    }

    /// A guest did what ends its session. It comes back to its seat, and goes.
    pub async fn ends(&self, room: &str, mut guest: Client, refusal: Refusal, reason: &str) {
        guest.is_refused(refusal).await;
        self.refuses(reason);
        let back = self.resume(room, Ticket::of(&guest)).await;
        self.leave(back).await;
    }

    /// What a counter says now.
    pub async fn count(&self, series: &str) -> u64 {
        count(self.ops, series).await
    }

    /// Waits until a counter has moved by so much since `before`.
    pub async fn moved(&self, series: &str, before: u64, by: u64) {
        until_count(self.ops, series, before + by).await;
    }

    /// Compares the counters with the tally: those of `exact` say just that, the others no less.
    pub async fn check_tally(&self, exact: &[&str]) {
        let tally = self.tally.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for (series, expected) in tally {
            let found = self.count(&series).await;
            println!("{series}: {found}, of which faults {expected}");
            let wrong = match exact.iter().any(|reason| refusals(reason) == series) {
                true => found != expected,
                false => found < expected,
            };
            assert!(!wrong, "{series} is {found}; the faults make {expected}");
        }
    }
}
