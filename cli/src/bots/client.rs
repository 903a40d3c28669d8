//! One bot: a real socket and a [`BotInput`]. It joins, plays, loses its socket now and then, and resumes its
//! seat with its token. [`Stage`] says when.

use super::report::ClientReport;
use super::socket::{Arrival, connect, next, refused, send, unexpected, unreadable};
use super::target::Target;
use crate::bot_input::BotInput;
use anyhow::Result;
use jostle_protocol::{Appearance, ClientMessage, ServerMessage, Snapshot};
use jostle_sim::{BodyId, TICKS_PER_SECOND};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{self, UnboundedSender};
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior, interval, sleep, sleep_until};
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// Inputs from one ping to the next.
const PING_EVERY_INPUTS: u32 = 30;
/// Time between the connections of two bots.
const JOIN_EVERY: Duration = Duration::from_millis(4);
/// Kind and keyframe bit of a coded snapshot, and where the low byte of a delta's tick is.
const SNAPSHOT: u8 = 0x80;
const KEYFRAME: u8 = 0x40;

/// The stage of all bots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// They join; nothing is measured yet.
    Joining,
    /// They play and measure, from this time on.
    Playing(Instant),
    /// They leave.
    Over,
}

/// A bot before it plays.
pub struct Bot {
    /// Its number, from 0.
    pub index: u32,
    /// Seed of all bots.
    pub seed: u64,
    /// The room to join.
    pub target: Target,
    /// Whether it decodes every snapshot as a page does; others read the heads of deltas only.
    pub decodes: bool,
    /// Times since the start of the measurement at which it loses its socket.
    pub losses: Vec<Duration>,
    /// The stage that it follows.
    pub stage: watch::Receiver<Stage>,
    /// Notified once it has a seat, or has failed to get one.
    pub seated: mpsc::Sender<()>,
    /// Receives every snapshot that it decodes.
    pub snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

impl Bot {
    /// Plays to the end or to the first error, and returns the measurements.
    pub async fn play(mut self) -> ClientReport {
        let mut report = ClientReport::new(self.index);
        sleep(JOIN_EVERY * self.index).await;
        let arrival = connect(&self.target, self.appearance(), None).await;
        // The receiver waits for one of each bot.
        let _ = self.seated.send(()).await;
        let played = match arrival {
            Ok(arrival) => self.play_on(arrival, &mut report).await,
            Err(error) => Err(error),
        };
        if let Err(error) = played {
            report.error = Some(error.to_string());
        }
        report
    }

    fn appearance(&self) -> Appearance {
        let color = (self.index % u32::from(jostle_protocol::limits::COLORS)) as u8;
        Appearance { name: format!("bot {}", self.index + 1).into(), color }
    }

    async fn play_on(&mut self, arrival: Arrival, report: &mut ClientReport) -> Result<()> {
        report.seat = Some(arrival.seat);
        let input = BotInput::new(self.seed, self.index, arrival.size()?);
        let mut player = Player::new(arrival, input, self.decodes, self.snapshots.take());
        let mut losses = std::mem::take(&mut self.losses).into_iter();
        let mut loss_at = None;
        loop {
            tokio::select! {
                message = next(&mut player.arrival.socket) => {
                    let Some(bytes) = message? else { continue };
                    player.receive(&bytes, report)?;
                }
                _ = player.inputs.tick() => player.send_input(report).await?,
                () = sleep_until_some(loss_at) => {
                    player = self.resume(player, report).await?;
                    loss_at = losses.next().map(|after| report.began() + after);
                }
                changed = self.stage.changed() => {
                    let stage = *self.stage.borrow_and_update();
                    match stage {
                        Stage::Playing(now) => {
                            report.begin(now);
                            loss_at = losses.next().map(|after| now + after);
                        }
                        Stage::Over => break,
                        Stage::Joining => {}
                    }
                    if changed.is_err() { break }
                }
            }
        }
        report.end(Instant::now());
        player.leave().await;
        Ok(())
    }

    /// Drops the socket without a close frame, and resumes the seat on another one with the token.
    async fn resume(&self, player: Player, report: &mut ClientReport) -> Result<Player> {
        let Player { arrival: Arrival { socket, seat, token, .. }, hero, input, snapshots, .. } =
            player;
        let killed_at = Instant::now();
        drop(socket);
        let arrival = connect(&self.target, self.appearance(), Some(token)).await?;
        report.returned(killed_at.elapsed(), arrival.seat == seat, hero, arrival.hero());
        Ok(Player::new(arrival, input, self.decodes, snapshots))
    }
}

/// Sleeps until a time; for ever if there is none.
async fn sleep_until_some(at: Option<Instant>) {
    match at {
        Some(at) => sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

/// A bot with a seat and a socket.
struct Player {
    arrival: Arrival,
    hero: Option<BodyId>,
    /// Tick of the newest snapshot.
    tick: u32,
    decodes: bool,
    input: BotInput,
    seq: u32,
    inputs: Interval,
    snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

impl Player {
    fn new(
        arrival: Arrival,
        input: BotInput,
        decodes: bool,
        snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
    ) -> Player {
        let mut inputs = interval(Duration::from_secs(1) / TICKS_PER_SECOND);
        inputs.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (hero, tick) = (arrival.hero(), arrival.tick());
        Player { arrival, hero, tick, decodes, input, seq: 0, inputs, snapshots }
    }

    /// Sends an input, and now and then a ping.
    async fn send_input(&mut self, report: &mut ClientReport) -> Result<()> {
        self.seq += 1;
        let (ack_tick, input) = (self.tick as u16, self.input.next_input());
        send(&mut self.arrival.socket, &ClientMessage::Input { seq: self.seq, ack_tick, input })
            .await?;
        if self.seq % PING_EVERY_INPUTS == 1 {
            let stamp = report.stamp(Instant::now());
            send(&mut self.arrival.socket, &ClientMessage::Ping { stamp }).await?;
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &[u8], report: &mut ClientReport) -> Result<()> {
        let now = Instant::now();
        let [head, low, ..] = *bytes else { return Err(unexpected()) };
        if head & SNAPSHOT == 0 {
            return self.receive_other(bytes, report, now);
        }
        let before = self.tick;
        let mut unchanged_until = None;
        if head & KEYFRAME != 0 || self.decodes {
            unchanged_until =
                self.arrival.stream.decode(bytes).map_err(unreadable)?.unchanged_until;
            let newest = self.arrival.stream.newest().expect("one was just decoded");
            self.tick = newest.tick;
            if let Some(snapshots) = &self.snapshots {
                // The receiver may have stopped listening.
                let _ = snapshots.send(Arc::clone(newest));
            }
            let own = newest.players.iter().find(|player| player.seat.0 == self.arrival.seat);
            self.hero = own.and_then(|player| player.hero).or(self.hero);
        } else {
            self.tick += u32::from(low.wrapping_sub(self.tick as u8));
        }
        let announced = unchanged_until.unwrap_or(before);
        report.saw(
            head & KEYFRAME != 0,
            bytes.len(),
            self.tick,
            self.tick - announced.min(self.tick),
            now,
        );
        Ok(())
    }

    fn receive_other(
        &mut self,
        bytes: &[u8],
        report: &mut ClientReport,
        now: Instant,
    ) -> Result<()> {
        match ServerMessage::decode(bytes).map_err(unreadable)? {
            ServerMessage::Pong { stamp, .. } => report.ponged(stamp, bytes.len(), now),
            ServerMessage::Refused { refusal } => return Err(refused(refusal)),
            ServerMessage::Welcome { .. } => return Err(unexpected()),
            _ => report.count_other(bytes.len()),
        }
        Ok(())
    }

    async fn leave(mut self) {
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // A server that is gone by now makes no difference.
        let _ = self.arrival.socket.close(Some(frame)).await;
    }
}
