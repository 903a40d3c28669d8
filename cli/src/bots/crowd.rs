//! Many bots that join, play and leave together.

use super::client::{Bot, CrowdStage, JOIN_EVERY, ServerTimeouts};
use super::report::ClientReport;
use super::target::BotTarget;
use jostle_protocol::Snapshot;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{self, UnboundedSender};
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// Settings for a crowd.
#[derive(Clone, Debug)]
pub struct CrowdPlan {
    /// Rooms to join; the bots are divided among them.
    pub targets: Vec<BotTarget>,
    pub clients: u32,
    /// The first bot's number.
    pub first: u32,
    /// The local address from which a bot with this number joins, if it matters.
    pub address_of: fn(u32) -> Option<IpAddr>,
    /// Whether the bots press nothing.
    pub idle: bool,
    /// Seed for the bots' input.
    pub seed: u64,
    /// Number of bots that decode every snapshot, as a page does; the others read only the heads of deltas, which is
    /// cheap. The first bot always decodes.
    pub decoders: u32,
    /// Times, counted from the start of the measurement, at which a socket is dropped; the bots take turns.
    pub losses: Vec<Duration>,
    /// Receives the first bot's snapshots.
    pub snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

pub struct BotCrowd {
    stage: watch::Sender<CrowdStage>,
    bots: Vec<JoinHandle<ClientReport>>,
}

impl BotCrowd {
    /// Connects all bots, and waits until each has a seat or has failed to get one. The bots then play, but nothing is
    /// measured yet.
    pub async fn join(plan: &CrowdPlan) -> BotCrowd {
        let (stage, followed) = watch::channel(CrowdStage::Joining);
        let (seated, mut waiting) = mpsc::channel(plan.clients as usize);
        let bot = |index: u32| Bot {
            index: plan.first + index,
            from: (plan.address_of)(plan.first + index),
            waits: JOIN_EVERY * index,
            idles: plan.idle,
            seed: plan.seed,
            target: plan.targets[index as usize % plan.targets.len()].clone(),
            decodes: index < plan.decoders.max(1),
            losses: plan.losses_of(index),
            timeouts: ServerTimeouts::default(),
            stage: followed.clone(),
            seated: seated.clone(),
            snapshots: plan.snapshots.clone().filter(|_| index == 0),
        };
        let bots = (0..plan.clients).map(|index| tokio::spawn(bot(index).play())).collect();
        for _ in 0..plan.clients {
            waiting.recv().await;
        }
        BotCrowd { stage, bots }
    }

    pub fn begin(&self) {
        self.stage.send_replace(CrowdStage::Playing(Instant::now()));
    }

    /// Disconnects all bots, and returns their measurements.
    pub async fn end(self) -> Vec<ClientReport> {
        self.stage.send_replace(CrowdStage::Over);
        let mut reports = Vec::new();
        for bot in self.bots {
            reports.push(bot.await.expect("a bot does not panic"));
        }
        reports
    }
}

impl CrowdPlan {
    fn losses_of(&self, index: u32) -> Vec<Duration> {
        let losses = self.losses.iter().skip(index as usize);
        losses.step_by(self.clients as usize).copied().collect()
    }
}

/// The times at which this many sockets are lost, spread evenly.
pub fn evenly(count: u32, length: Duration) -> Vec<Duration> {
    let at = |loss: u32| length.mul_f64((f64::from(loss) + 0.5) / f64::from(count));
    (0..count).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_are_shared_out_evenly() {
        let length = Duration::from_secs(10);
        let losses = evenly(6, length);
        let plan = CrowdPlan {
            targets: Vec::new(),
            clients: 4,
            first: 0,
            address_of: |_| None,
            idle: false,
            seed: 0,
            decoders: 1,
            losses,
            snapshots: None,
        };
        let counts: Vec<_> = (0..4).map(|index| plan.losses_of(index).len()).collect();
        assert_eq!(counts, [2, 2, 1, 1]);
        assert!(plan.losses_of(1)[1] < length);
    }
}
