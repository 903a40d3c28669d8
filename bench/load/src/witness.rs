//! Newcomers to a room that is being played, and the bot that saw what they should be shown.

use jostle_cli::bots::histogram::{Durations, Percentiles};
use jostle_cli::bots::socket::connect;
use jostle_cli::bots::target::Target;
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
    /// A witness, and where it is sent what it sees. Inside a runtime only.
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

/// Newcomers, and the states they were shown.
#[derive(Debug, Default, Serialize)]
pub struct Newcomers {
    #[serde(skip)]
    took: Durations,
    /// From the hello to the first keyframe, decoded.
    took_ms: Percentiles,
    /// Shown the very state that the first bot saw; another; one of a tick that it did not see.
    right: u32,
    wrong: u32,
    unseen: u32,
    /// Those that did not get that far, and why the first of them did not.
    failed: u32,
    error: Option<String>,
}

impl Newcomers {
    /// Has newcomers join one after another, evenly over a time.
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
        newcomers.took_ms = newcomers.took.percentiles();
        newcomers
    }

    /// The first thing that went wrong.
    pub fn failure(&self) -> Option<String> {
        if let Some(error) = &self.error {
            return Some(format!("{} newcomers failed: {error}", self.failed));
        }
        (self.wrong > 0).then(|| format!("{} newcomers were shown a wrong state", self.wrong))
    }

    async fn one_more(&mut self, number: u32, target: &Target, witness: &Witness) {
        let appearance = Appearance { name: format!("newcomer {}", number + 1).into(), color: 0 };
        let arrival = match connect(target, appearance, None).await {
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
        // A server that is gone by now told so before.
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
