//! Newcomers to a room that is being played, and one who saw what they should be shown.

use super::Target;
use super::socket::connect;
use super::tally::Tally;
use jostle_protocol::{Appearance, Snapshot};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::sleep;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// Snapshots kept: some seconds of them.
const SEEN_MAX: usize = 240;
/// Time for the witness to see what a newcomer saw, and how often it is asked.
const WITNESS_WAIT: Duration = Duration::from_secs(3);
/// See there.
const WITNESS_EVERY: Duration = Duration::from_millis(50);

/// The newest snapshots of a bot that was there all the time.
#[derive(Default)]
pub struct Witness(Mutex<VecDeque<Arc<Snapshot>>>);

impl Witness {
    /// One more.
    pub fn saw(&self, snapshot: &Arc<Snapshot>) {
        let mut seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if seen.len() == SEEN_MAX {
            seen.pop_front();
        }
        seen.push_back(Arc::clone(snapshot));
    }

    /// Waits until it has come as far as this snapshot, and says what it saw then.
    async fn judge(&self, snapshot: &Snapshot) -> Option<bool> {
        let asked_at = Instant::now();
        while asked_at.elapsed() < WITNESS_WAIT && self.newest_tick() < snapshot.tick {
            sleep(WITNESS_EVERY).await;
        }
        self.agrees(snapshot)
    }

    fn newest_tick(&self) -> u32 {
        let seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        seen.back().map_or(0, |seen| seen.tick)
    }

    /// Whether it saw the same at that tick; `None` if it saw nothing then.
    fn agrees(&self, snapshot: &Snapshot) -> Option<bool> {
        let seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = seen.iter().find(|seen| seen.tick == snapshot.tick)?;
        Some(**same == *snapshot)
    }
}

/// What newcomers met.
#[derive(Debug, Default)]
pub struct Newcomers {
    /// From the hello to the first keyframe, decoded.
    pub took: Tally,
    /// Who was shown what the witness saw, something else, and what nobody else saw.
    pub right: u32,
    /// See there.
    pub wrong: u32,
    /// See there.
    pub unseen: u32,
    /// Who did not get that far, and why the first of them did not.
    pub failed: u32,
    /// See there.
    pub error: Option<String>,
}

impl Newcomers {
    /// So many come, one after another, evenly over a time.
    pub async fn come(
        count: u32,
        over: Duration,
        target: Target,
        witness: Arc<Witness>,
    ) -> Newcomers {
        let start = tokio::time::Instant::now();
        let mut newcomers = Newcomers::default();
        for number in 0..count {
            let at = over.mul_f64((f64::from(number) + 0.5) / f64::from(count));
            tokio::time::sleep_until(start + at).await;
            newcomers.one_more(number, &target, &witness).await;
        }
        newcomers
    }

    async fn one_more(&mut self, number: u32, target: &Target, witness: &Witness) {
        let appearance = Appearance { name: format!("newcomer {}", number + 1), color: 0 };
        let arrival = match connect(target, appearance, None).await {
            Ok(arrival) => arrival,
            Err(error) => {
                self.failed += 1;
                self.error.get_or_insert(error.to_string());
                return;
            }
        };
        self.took.add(arrival.took);
        let shown = arrival.stream.newest().expect("an arrival holds a keyframe");
        let is_there = shown.players.iter().any(|player| player.seat.0 == arrival.seat);
        match witness.judge(shown).await {
            Some(true) if is_there => self.right += 1,
            Some(_) => self.wrong += 1,
            None => self.unseen += 1,
        }
        let mut socket = arrival.socket;
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // A server that is gone by now told so before.
        let _ = socket.close(Some(frame)).await;
    }
}
