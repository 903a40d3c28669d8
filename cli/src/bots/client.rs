//! A bot, which consists of a real socket and a [`BotInput`]. It joins, plays, loses its socket now and then, and
//! resumes its seat with its token. [`CrowdStage`] signals when to start measuring and when to leave.

use super::report::ClientReport;
use super::socket::{JoinedBot, SessionEnd, connect, connect_within, next, read, send};
use super::target::BotTarget;
use crate::bot_input::BotInput;
use bytes::Bytes;
use jostle_game::Input;
use jostle_protocol::{
    Appearance, ClientMessage, Refusal, ServerMessage, Servers, Snapshot, Token,
};
use jostle_sim::{BodyId, TICKS_PER_SECOND};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{self, UnboundedSender};
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior, interval, sleep, sleep_until};
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// Number of inputs between pings.
const PING_EVERY_INPUTS: u32 = 30;
/// Number of ticks between an idle bot's inputs, the same as on an idle player's page.
const IDLE_EVERY_TICKS: u32 = 15;
/// Time between successive bots' connections.
pub const JOIN_EVERY: Duration = Duration::from_millis(4);
/// Time between attempts to come back.
const RETRY_EVERY: Duration = Duration::from_millis(250);
/// Time within which a bot must be back in its room. By then, a server that died has been replaced.
const RETURN_WAIT: Duration = Duration::from_secs(60);
/// The snapshot kind and its keyframe bit, in the first byte of a coded snapshot. In a delta, the low byte of the tick
/// follows.
const SNAPSHOT: u8 = 0x80;
const KEYFRAME: u8 = 0x40;

/// How long a bot waits for one of a fleet's servers before it asks another.
#[derive(Clone, Copy, Debug)]
pub struct ServerTimeouts {
    /// Timeout for an attempt to join while other servers have not been asked yet.
    pub answer: Duration,
    pub silence: Duration,
}

impl Default for ServerTimeouts {
    fn default() -> ServerTimeouts {
        ServerTimeouts { answer: Duration::from_secs(2), silence: Duration::from_secs(6) }
    }
}

/// The stage that all bots are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrowdStage {
    /// Bots are joining; nothing is measured yet.
    Joining,
    /// Bots are playing and measuring, starting at this time.
    Playing(Instant),
    Over,
}

/// A bot that has not joined yet.
pub struct Bot {
    /// The bot's number, starting at 0.
    pub index: u32,
    /// A seed shared by all bots.
    pub seed: u64,
    /// The room to join.
    pub target: BotTarget,
    /// Local address from which to join, if it matters.
    pub from: Option<IpAddr>,
    /// Delay before the bot joins.
    pub waits: Duration,
    /// Whether the bot presses nothing.
    pub idles: bool,
    /// Whether the bot decodes every snapshot, as a page does; other bots read only the heads of deltas.
    pub decodes: bool,
    /// Times since the start of the measurement at which the bot drops its socket.
    pub losses: Vec<Duration>,
    /// How long the bot waits for servers.
    pub timeouts: ServerTimeouts,
    /// The stage that the bot follows.
    pub stage: watch::Receiver<CrowdStage>,
    /// Notified once the bot has a seat, or has failed to get one.
    pub seated: mpsc::Sender<()>,
    /// Receives every snapshot that the bot decodes.
    pub snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

impl Bot {
    /// Plays until the end or the first error, and returns the measurements.
    pub async fn play(mut self) -> ClientReport {
        let mut report = ClientReport::new(self.index);
        let mut servers = Servers::new(self.target.origin());
        sleep(self.waits).await;
        let arrival = self.enter(&mut servers, &mut None, &mut report).await;
        // The receiver expects one notification from each bot.
        let _ = self.seated.send(()).await;
        let played = match arrival {
            Ok(Some(arrival)) => self.play_on(arrival, servers, &mut report).await,
            Ok(None) => Ok(()),
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

    async fn play_on(
        &mut self,
        arrival: JoinedBot,
        mut servers: Servers,
        report: &mut ClientReport,
    ) -> Result<(), SessionEnd> {
        report.seat = Some(arrival.seat);
        let size = arrival.size()?;
        let input = (!self.idles).then(|| BotInput::new(self.seed, self.index, size));
        let mut player = Player::new(arrival, input, self.decodes, self.snapshots.take());
        let mut losses = std::mem::take(&mut self.losses).into_iter();
        let mut loss_at = None;
        loop {
            let silent_at = servers.has_others().then(|| player.heard_at + self.timeouts.silence);
            let end = tokio::select! {
                // The measurement starts and ends on time, and inputs are sent on schedule, no matter how much there is
                // to read.
                biased;
                changed = self.stage.changed() => {
                    match *self.stage.borrow_and_update() {
                        CrowdStage::Playing(now) => {
                            report.begin(now);
                            loss_at = losses.next().map(|after| now + after);
                        }
                        CrowdStage::Over => break,
                        CrowdStage::Joining => {}
                    }
                    if changed.is_err() { break }
                    continue;
                }
                _ = player.inputs.tick() => {
                    // If the socket is closed, the next read will report the reason.
                    let _ = player.send_input(report).await;
                    continue;
                }
                () = sleep_until_some(loss_at) => {
                    loss_at = losses.next().map(|after| report.began() + after);
                    SessionEnd::Dropped
                }
                message = next(&mut player.arrival.socket) => {
                    match message.and_then(|bytes| player.receive(bytes, &mut servers, report)) {
                        Ok(()) => continue,
                        Err(end) => end,
                    }
                }
                () = sleep_until_some(silent_at) => SessionEnd::Lost("silence".to_owned()),
            };
            match self.resume(player, end, &mut servers, report).await? {
                Some(back) => player = back,
                None => return Ok(()),
            }
        }
        report.end(Instant::now());
        player.leave().await;
        Ok(())
    }

    /// Drops the socket without a close frame, and uses the token to resume the seat on another socket. `None` if all
    /// bots leave before that.
    async fn resume(
        &self,
        player: Player,
        end: SessionEnd,
        servers: &mut Servers,
        report: &mut ClientReport,
    ) -> Result<Option<Player>, SessionEnd> {
        let Player {
            arrival: JoinedBot { socket, seat, token, .. }, hero, input, snapshots, ..
        } = player;
        let lost_at = Instant::now();
        drop(socket);
        let mut token = Some(token);
        prepare(end, servers, &mut token, report).await?;
        let Some(arrival) = self.enter(servers, &mut token, report).await? else {
            report.end(Instant::now());
            return Ok(None);
        };
        let same_seat = token.is_some() && arrival.seat == seat;
        let heroes = [hero, arrival.hero()];
        report.returned(lost_at.elapsed(), same_seat, heroes, Instant::now());
        Ok(Some(Player::new(arrival, input, self.decodes, snapshots)))
    }

    /// Asks one server after another until one has a seat for the bot. `None` if all bots leave before that. A refused
    /// token is cleared.
    async fn enter(
        &self,
        servers: &mut Servers,
        token: &mut Option<Token>,
        report: &mut ClientReport,
    ) -> Result<Option<JoinedBot>, SessionEnd> {
        let begun = Instant::now();
        while *self.stage.borrow() != CrowdStage::Over {
            match self.ask(servers, *token).await {
                Ok(mut arrival) => {
                    servers.welcomed();
                    if let Some(nodes) = arrival.nodes.take() {
                        servers.told(nodes);
                    }
                    return Ok(Some(arrival));
                }
                Err(end) if begun.elapsed() > RETURN_WAIT => return Err(end),
                Err(end) => prepare(end, servers, token, report).await?,
            }
        }
        Ok(None)
    }

    async fn ask(&self, servers: &Servers, token: Option<Token>) -> Result<JoinedBot, SessionEnd> {
        let no_tls = || SessionEnd::Lost(format!("no way to {}", servers.current()));
        let target = self.target.at(servers.current()).ok_or_else(no_tls)?;
        if servers.has_untried() {
            return connect_within(
                self.timeouts.answer,
                &target,
                self.from,
                self.appearance(),
                token,
            )
            .await;
        }
        connect(&target, self.from, self.appearance(), token).await
    }
}

/// Prepares the next attempt after a session or attempt has ended, and waits until that is due. Returns the error if
/// another attempt cannot help.
async fn prepare(
    end: SessionEnd,
    servers: &mut Servers,
    token: &mut Option<Token>,
    report: &mut ClientReport,
) -> Result<(), SessionEnd> {
    match end {
        SessionEnd::Moved(url) => {
            report.moved();
            if servers.moved(url) {
                return Ok(());
            }
        }
        SessionEnd::Dropped => {
            servers.lost();
            return Ok(());
        }
        SessionEnd::Refused(Refusal::BadToken) if token.take().is_some() => return Ok(()),
        SessionEnd::Refused(Refusal::Moved | Refusal::Moving) => {
            servers.moving();
            servers.lost();
        }
        SessionEnd::Lost(_) | SessionEnd::Refused(Refusal::Closing) if servers.has_others() => {
            servers.lost();
        }
        end => return Err(end),
    }
    sleep(RETRY_EVERY).await;
    Ok(())
}

/// Sleeps until a time, or forever if it is `None`.
async fn sleep_until_some(at: Option<Instant>) {
    match at {
        Some(at) => sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

/// A bot with a seat and a socket.
struct Player {
    arrival: JoinedBot,
    hero: Option<BodyId>,
    /// Tick of the newest snapshot.
    tick: u32,
    /// Time of the last message from the server.
    heard_at: Instant,
    decodes: bool,
    /// Source of the bot's inputs; `None` for an idle bot.
    input: Option<BotInput>,
    seq: u32,
    inputs: Interval,
    snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
}

impl Player {
    fn new(
        arrival: JoinedBot,
        input: Option<BotInput>,
        decodes: bool,
        snapshots: Option<UnboundedSender<Arc<Snapshot>>>,
    ) -> Player {
        let apart = if input.is_some() { 1 } else { IDLE_EVERY_TICKS };
        let mut inputs = interval(Duration::from_secs(1) * apart / TICKS_PER_SECOND);
        inputs.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (hero, tick) = (arrival.hero(), arrival.tick());
        let heard_at = Instant::now();
        Player { arrival, hero, tick, heard_at, decodes, input, seq: 0, inputs, snapshots }
    }

    fn next_input(&mut self) -> Input {
        self.input.as_mut().map_or_else(Input::default, BotInput::next_input)
    }

    /// Sends an input and, with every [`PING_EVERY_INPUTS`] inputs, a ping.
    async fn send_input(&mut self, report: &mut ClientReport) -> Result<(), SessionEnd> {
        self.seq += 1;
        let (ack_tick, input) = (self.tick as u16, self.next_input());
        send(&mut self.arrival.socket, &ClientMessage::Input { seq: self.seq, ack_tick, input })
            .await?;
        if self.seq % PING_EVERY_INPUTS == 1 {
            let stamp = report.stamp(Instant::now());
            send(&mut self.arrival.socket, &ClientMessage::Ping { stamp }).await?;
        }
        Ok(())
    }

    /// Handles a message; `None` stands for a ping or a pong.
    fn receive(
        &mut self,
        bytes: Option<Bytes>,
        servers: &mut Servers,
        report: &mut ClientReport,
    ) -> Result<(), SessionEnd> {
        let Some(bytes) = bytes else { return Ok(()) };
        let now = Instant::now();
        self.heard_at = now;
        let [head, low, ..] = *bytes else { return Err(SessionEnd::Unexpected) };
        if head & SNAPSHOT == 0 {
            return receive_other(&bytes, servers, report, now);
        }
        let before = self.tick;
        let mut unchanged_until = None;
        if head & KEYFRAME != 0 || self.decodes {
            unchanged_until = self.arrival.stream.decode(&bytes)?.unchanged_until;
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

    async fn leave(mut self) {
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // It makes no difference whether the server is still there.
        let _ = self.arrival.socket.close(Some(frame)).await;
    }
}

fn receive_other(
    bytes: &[u8],
    servers: &mut Servers,
    report: &mut ClientReport,
    now: Instant,
) -> Result<(), SessionEnd> {
    match read(bytes)? {
        ServerMessage::Pong { stamp, .. } => {
            report.ponged(stamp, bytes.len(), now);
            return Ok(());
        }
        ServerMessage::Welcome { .. } => return Err(SessionEnd::Unexpected),
        ServerMessage::Nodes { urls } => servers.told(urls),
        _ => {}
    }
    report.count_other(bytes.len());
    Ok(())
}

#[cfg(test)]
mod tests;
