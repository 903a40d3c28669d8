//! One bot: a real socket and [`BotInput`]. It joins, plays, loses its socket now and then, and comes back
//! with its token, as [`Stage`] says.

use super::report::ClientReport;
use super::socket::{Arrival, BotError, Socket, connect, next, send};
use super::target::Target;
use crate::bot_input::BotInput;
use jostle_protocol::{Appearance, ClientMessage, ServerMessage, Snapshot, SnapshotStream, Token};
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
/// Time from one bot's connecting to the next one's.
const JOIN_EVERY: Duration = Duration::from_millis(4);
/// Kind and keyframe bit of a coded snapshot, and where the low byte of a delta's tick is.
const SNAPSHOT: u8 = 0x80;
const KEYFRAME: u8 = 0x40;

/// The stage of all bots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// They come; nothing is measured yet.
    Coming,
    /// They play, from this moment on.
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
    /// Where.
    pub target: Target,
    /// Whether it decodes every snapshot as a page does; others read the heads of deltas only.
    pub decodes: bool,
    /// When, since the play began, it loses its socket.
    pub losses: Vec<Duration>,
    /// The stage that it follows.
    pub stage: watch::Receiver<Stage>,
    /// Receives a word when it is seated, or will not be.
    pub seated: mpsc::Sender<()>,
    /// Receives every snapshot that it decodes.
    pub snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

impl Bot {
    /// Plays to the end or to the first error, and says how it went.
    pub async fn play(mut self) -> ClientReport {
        let mut report = ClientReport::new(self.index);
        sleep(JOIN_EVERY * self.index).await;
        let come = connect(&self.target, self.appearance(), None).await;
        // The receiver waits for one of each bot.
        let _ = self.seated.send(()).await;
        let played = match come {
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

    async fn play_on(&mut self, come: Arrival, report: &mut ClientReport) -> Result<(), BotError> {
        report.seat = Some(come.seat);
        let input = BotInput::new(self.seed, self.index, come.size()?);
        let mut player = Player::new(come, input, self.decodes, self.snapshots.take());
        let mut losses = std::mem::take(&mut self.losses).into_iter();
        let mut loss_at = None;
        loop {
            tokio::select! {
                message = next(&mut player.socket) => {
                    let Some(bytes) = message? else { continue };
                    player.hear(&bytes, report)?;
                }
                _ = player.inputs.tick() => player.act(report).await?,
                () = moment(loss_at) => {
                    player = self.come_back(player, report).await?;
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
                        Stage::Coming => {}
                    }
                    if changed.is_err() { break }
                }
            }
        }
        report.end(Instant::now());
        player.leave().await;
        Ok(())
    }

    /// The socket is gone without a word; another one, with the token, is the same player.
    async fn come_back(
        &self,
        player: Player,
        report: &mut ClientReport,
    ) -> Result<Player, BotError> {
        let Player { socket, seat, token, hero, input, snapshots, .. } = player;
        let killed_at = Instant::now();
        drop(socket);
        let arrival = connect(&self.target, self.appearance(), Some(token)).await?;
        report.returned(killed_at.elapsed(), arrival.seat == seat, hero, arrival.hero());
        Ok(Player::new(arrival, input, self.decodes, snapshots))
    }
}

/// Waits for a moment; for ever if there is none.
async fn moment(at: Option<Instant>) {
    match at {
        Some(at) => sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

/// A bot with a seat and a socket.
struct Player {
    socket: Socket,
    seat: u16,
    token: Token,
    hero: Option<BodyId>,
    stream: SnapshotStream,
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
        come: Arrival,
        input: BotInput,
        decodes: bool,
        snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
    ) -> Player {
        let mut inputs = interval(Duration::from_secs(1) / TICKS_PER_SECOND);
        inputs.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (hero, tick) = (come.hero(), come.tick());
        let Arrival { socket, seat, token, stream, .. } = come;
        Player {
            socket,
            seat,
            token,
            hero,
            stream,
            tick,
            decodes,
            input,
            seq: 0,
            inputs,
            snapshots,
        }
    }

    /// An input, and now and then a ping.
    async fn act(&mut self, report: &mut ClientReport) -> Result<(), BotError> {
        self.seq += 1;
        let (ack_tick, input) = (self.tick as u16, self.input.next_input());
        send(&mut self.socket, &ClientMessage::Input { seq: self.seq, ack_tick, input }).await?;
        if self.seq % PING_EVERY_INPUTS == 1 {
            let stamp = report.stamp(Instant::now());
            send(&mut self.socket, &ClientMessage::Ping { stamp }).await?;
        }
        Ok(())
    }

    fn hear(&mut self, bytes: &[u8], report: &mut ClientReport) -> Result<(), BotError> {
        let now = Instant::now();
        let [head, low, ..] = *bytes else { return Err(BotError::Unexpected) };
        if head & SNAPSHOT == 0 {
            return self.hear_other(bytes, report, now);
        }
        let before = self.tick;
        let mut unchanged_until = None;
        if head & KEYFRAME != 0 || self.decodes {
            unchanged_until = self.stream.decode(bytes)?.unchanged_until;
            let newest = self.stream.newest().expect("one was just decoded");
            self.tick = newest.tick;
            if let Some(snapshots) = &self.snapshots {
                // The receiver may have stopped listening.
                let _ = snapshots.send(Arc::clone(newest));
            }
            let own = newest.players.iter().find(|player| player.seat.0 == self.seat);
            self.hero = own.and_then(|player| player.hero).or(self.hero);
        } else {
            self.tick += u32::from(low.wrapping_sub(self.tick as u8));
        }
        let told = unchanged_until.unwrap_or(before);
        report.saw(
            head & KEYFRAME != 0,
            bytes.len(),
            self.tick,
            self.tick - told.min(self.tick),
            now,
        );
        Ok(())
    }

    fn hear_other(
        &mut self,
        bytes: &[u8],
        report: &mut ClientReport,
        now: Instant,
    ) -> Result<(), BotError> {
        match ServerMessage::decode(bytes)? {
            ServerMessage::Pong { stamp, .. } => report.ponged(stamp, bytes.len(), now),
            ServerMessage::Refused { refusal } => return Err(BotError::Refused(refusal)),
            ServerMessage::Welcome { .. } => return Err(BotError::Unexpected),
            _ => report.heard_other(bytes.len()),
        }
        Ok(())
    }

    async fn leave(mut self) {
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // The play is over: a server that is gone by now changes nothing.
        let _ = self.socket.close(Some(frame)).await;
    }
}
