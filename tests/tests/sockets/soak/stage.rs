//! The soak test's shared state: the server's two ports and a tally of the expected counter values.

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

/// State shared by all faults.
pub struct Stage {
    pub address: SocketAddr,
    pub ops: SocketAddr,
    /// How long a tab stays in the background.
    pub background: Duration,
    /// Read-locked by peers' faults and write-locked by machine faults, which occur one at a time and alone.
    pub machine: RwLock<()>,
    tally: Mutex<BTreeMap<String, u64>>,
}

/// Everything needed to return to a seat.
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

    /// Notes that a counter will increase by `by`.
    pub fn counts(&self, series: &str, by: u64) {
        let mut tally = self.tally.lock().unwrap_or_else(PoisonError::into_inner);
        *tally.entry(series.to_owned()).or_default() += by;
    }

    /// Notes that a refusal will be counted.
    pub fn refuses(&self, reason: &str) {
        self.counts(&refusals(reason), 1);
    }

    /// Joins as a guest whose first input has been played, so that the seat is held.
    pub async fn join(&self, room: &str, name: &str) -> Client {
        let mut guest = Client::join(self.address, room, name).await;
        self.counts("jostle_joins_total{how=\"new\"}", 1);
        guest.play_one_input().await;
        guest
    }

    /// Reconnects and returns to a lost seat.
    pub async fn resume(&self, room: &str, lost: Ticket) -> Client {
        let mut back = Client::connect(self.address, room).await;
        back.enter("Back", Some(lost.token)).await;
        assert_eq!(back.seat, lost.seat, "the seat was held");
        self.counts("jostle_joins_total{how=\"resumed\"}", 1);
        back.play_one_input().await;
        back
    }

    pub async fn leave(&self, mut guest: Client) {
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        guest.socket.close(Some(frame)).await.expect("a live socket");
        let end = async { while guest.socket.next().await.is_some_and(|frame| frame.is_ok()) {} };
        timeout(LONG, end).await.expect("an answer in time");
        self.counts("jostle_leaves_total{how=\"left\"}", 1);
    }

    /// Checks that the guest is refused, lets it return to its seat, and makes it leave.
    pub async fn ends(&self, room: &str, mut guest: Client, refusal: Refusal, reason: &str) {
        guest.is_refused(refusal).await;
        self.refuses(reason);
        self.returns(room, guest).await;
    }

    /// Lets a guest who lost the socket return to its seat, and makes it leave.
    pub async fn returns(&self, room: &str, guest: Client) {
        let back = self.resume(room, Ticket::of(&guest)).await;
        self.leave(back).await;
    }

    /// The current value of a counter.
    pub async fn count(&self, series: &str) -> u64 {
        count(self.ops, series).await
    }

    /// Waits until a counter has increased by `by` since `before`.
    pub async fn moved(&self, series: &str, before: u64, by: u64) {
        until_count(self.ops, series, before + by).await;
    }

    /// Compares the counters with the tally: those in `exact` must be equal, the others at least as large.
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
