//! Newcomers to a running room, checked against a bot that has been there the whole time.

use jostle_cli::bots::histogram::{Durations, Percentiles};
use jostle_cli::bots::socket::connect;
use jostle_cli::bots::target::BotTarget;
use jostle_protocol::{Appearance, Snapshot};
use serde::Serialize;
use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::time::sleep;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// Number of snapshots kept, enough for a few seconds.
const SEEN_MAX: usize = 240;
/// How long to wait for the witness to see a newcomer's tick.
const WITNESS_WAIT: Duration = Duration::from_secs(3);
/// Interval between checks while waiting for the witness.
const WITNESS_EVERY: Duration = Duration::from_millis(50);

/// The newest snapshots received by a bot that was present throughout.
#[derive(Default)]
pub struct Witness(Mutex<VecDeque<Arc<Snapshot>>>);

impl Witness {
    /// Creates a witness and the channel that it receives snapshots on. Requires a runtime.
    pub fn new() -> (Arc<Witness>, UnboundedSender<Arc<Snapshot>>) {
        let witness = Arc::new(Witness::default());
        let (sender, mut snapshots) = unbounded_channel();
        let watching = Arc::clone(&witness);
        tokio::spawn(async move {
            while let Some(snapshot) = snapshots.recv().await {
                watching.saw(snapshot);
            }
        });
        (witness, sender)
    }

    fn saw(&self, snapshot: Arc<Snapshot>) {
        let mut seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if seen.len() == SEEN_MAX {
            seen.pop_front();
        }
        seen.push_back(snapshot);
    }

    /// Waits until the witness has reached the snapshot's tick, and compares the two states.
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

    /// Returns whether the witness saw the same state at that tick; `None` if it has no snapshot of that tick.
    fn agrees(&self, snapshot: &Snapshot) -> Option<bool> {
        let seen = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = seen.iter().find(|seen| seen.tick == snapshot.tick)?;
        Some(**same == *snapshot)
    }
}

/// How quickly newcomers were served, and whether they were shown the correct state.
#[derive(Debug, Default, Serialize)]
pub struct Newcomers {
    #[serde(skip)]
    took: Durations,
    /// Time from the hello to the first decoded keyframe.
    took_ms: Percentiles,
    /// Number of newcomers whose state matched the witness's, differed from it, or belonged to a tick that the witness
    /// did not see.
    right: u32,
    wrong: u32,
    unseen: u32,
    /// Number of newcomers that failed before their first keyframe, and the first one's reason.
    failed: u32,
    error: Option<String>,
}

impl Newcomers {
    /// Lets newcomers join one after another, spread evenly over a period.
    pub async fn come(
        count: u32,
        over: Duration,
        target: BotTarget,
        witness: Arc<Witness>,
    ) -> Newcomers {
        let start = tokio::time::Instant::now();
        let mut newcomers = Newcomers::default();
        for number in 0..count {
            let at = over.mul_f64((f64::from(number) + 0.5) / f64::from(count));
            tokio::time::sleep_until(start + at).await;
            newcomers.one_more(number, &target, &witness).await;
        }
        newcomers.took_ms = newcomers.took.percentiles();
        newcomers
    }

    /// The first failure, if any.
    pub fn failure(&self) -> Option<String> {
        if let Some(error) = &self.error {
            return Some(format!("{} newcomers failed: {error}", self.failed));
        }
        (self.wrong > 0).then(|| format!("{} newcomers were shown a wrong state", self.wrong))
    }

    async fn one_more(&mut self, number: u32, target: &BotTarget, witness: &Witness) {
        let appearance = Appearance { name: format!("newcomer {}", number + 1).into(), color: 0 };
        let arrival = match connect(target, None, appearance, None).await {
            Ok(arrival) => arrival,
            Err(error) => {
                self.failed += 1;
                self.error.get_or_insert(error.to_string());
                return;
            }
        };
        self.took.record(arrival.took);
        let shown = arrival.stream.newest().expect("an arrival holds a keyframe");
        let is_there = shown.players.iter().any(|player| player.seat.0 == arrival.seat);
        match witness.judge(shown).await {
            Some(true) if is_there => self.right += 1,
            Some(_) => self.wrong += 1,
            None => self.unseen += 1,
        }
        let mut socket = arrival.socket;
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // If the server is gone by now, the failure has already been reported.
        let _ = socket.close(Some(frame)).await;
    }
}

impl fmt::Display for Newcomers {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Newcomers { took_ms, right, wrong, unseen, failed, .. } = self;
        write!(
            f,
            "newcomers {took_ms}; {right} shown the right state, {wrong} a wrong one, {unseen} one that nobody \
             else saw, {failed} failed"
        )
    }
}
