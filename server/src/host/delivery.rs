//! Delivery to one socket: its snapshots, the lower rate for a client that is slow or whose address exceeds its budget,
//! and the check that the client still acknowledges snapshots.

use crate::host::outbox::Outbox;
use crate::limits::uplink::Allowance;
use crate::ops::metrics::{Metrics, Skip};
use bytes::Bytes;
use jostle_game::Seat;
use jostle_protocol::{Refusal, ServerMessage};
use jostle_room::{Rate, Room, Subscriber};
use jostle_sim::TICKS_PER_SECOND;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Maximum number of live particles, of about 20 bytes each, in first keyframes that are waiting for their sockets in
/// one room: as many as the largest scene has, and twice as many as a guest's scene has.
const WAITING_PARTICLES_MAX: usize = 20_000;
/// Number of ticks for which a client must keep up before its rate rises again.
const RATE_RISE_TICKS: u32 = 600;
/// Number of ticks by which a client may fall further behind than its recent best. The round trip does not explain more
/// than that.
const LAG_GROWTH_TICKS: u32 = 45;
/// A lag that no round trip can explain: two seconds.
const LAG_TICKS_MAX: u32 = 2 * TICKS_PER_SECOND;
/// Number of ticks for which a client must lag before its rate falls; network stalls are shorter.
const LAGGING_TICKS: u32 = TICKS_PER_SECOND;
/// Length of a window, in ticks. A client is compared with its best performance in this window and the previous one.
const LAG_WINDOW_TICKS: u32 = 30 * TICKS_PER_SECOND;

/// Limits the memory used by particles in first keyframes that are waiting for a room's sockets. Beyond the limit,
/// newcomers get keyframes without particles, which are only decoration. Otherwise a crowd that reads nothing would
/// exhaust memory.
#[derive(Clone, Debug)]
pub struct ParticlePermits(Arc<Semaphore>);

impl Default for ParticlePermits {
    fn default() -> ParticlePermits {
        ParticlePermits(Arc::new(Semaphore::new(WAITING_PARTICLES_MAX)))
    }
}

/// The snapshots for one socket.
pub struct Delivery {
    /// The player's seat. Spectators have none, and get snapshots of the whole world.
    seat: Option<Seat>,
    pub(super) outbox: Arc<Outbox>,
    pub(super) lag: AckLag,
    /// The subscription to snapshots; `None` until the next keyframe is sent.
    subscriber: Option<Subscriber>,
    /// Whether a keyframe has been sent.
    subscribed: bool,
    permits: ParticlePermits,
    rate: Rate,
    /// Tick at which the client was last found far behind, or at which its budget last ran out.
    late_tick: u32,
    /// The session's byte budget.
    allowance: Allowance,
    /// Whether the next keyframe has to wait for the budget.
    held_back: bool,
    /// Whether the client asked for the list of bots.
    follows_bots: bool,
}

impl Delivery {
    /// Creates the delivery for a client that has just been welcomed.
    pub fn new(
        seat: Option<Seat>,
        outbox: Arc<Outbox>,
        allowance: Allowance,
        permits: ParticlePermits,
        tick: u32,
    ) -> Delivery {
        let (lag, rate, late_tick) = (AckLag::new(tick), Rate::default(), tick);
        // The keyframe waits for the budget. Otherwise a client that keeps reconnecting would get one every time.
        let (subscriber, subscribed, held_back) = (None, false, true);
        Delivery {
            seat,
            outbox,
            lag,
            subscriber,
            subscribed,
            permits,
            rate,
            late_tick,
            allowance,
            held_back,
            follows_bots: false,
        }
    }

    /// Sends the list of bots now, and from now on whenever it changes.
    pub fn follow_bots(&mut self, room: &Room) {
        if !std::mem::replace(&mut self.follows_bots, true) {
            self.outbox.control(ServerMessage::Bots { seats: room.bot_seats() }.encode());
        }
    }

    /// Sends the list of bots, which has changed, to a client that asked for it.
    pub fn tell_bots(&self, message: &Bytes) {
        if self.follows_bots {
            self.outbox.control(message.clone());
        }
    }

    pub fn welcome(&self, welcome: Vec<u8>, now: Instant) {
        self.allowance.charge(welcome.len(), now);
        self.outbox.control(welcome);
    }

    /// Queues the snapshot of the newest tick. A client that is too far behind gets a keyframe and a lower rate; once
    /// it has kept up for long enough, it gets a higher rate. If its budget is used up, the keyframe and the lower rate
    /// wait until some budget is available. A client that acknowledges nothing for `silent_ticks_max` ticks is
    /// disconnected. Returns whether anything was queued.
    pub fn feed(
        &mut self,
        room: &mut Room,
        silent_ticks_max: u32,
        now: Instant,
        metrics: &Metrics,
    ) -> bool {
        let tick = room.game().tick_count();
        // This comes first, because a keyframe for a tick that is already queued would repeat its events.
        self.choose_rate(tick, now, metrics);
        let mut queued = self.hand_over(room, tick, now, metrics);
        if self.subscriber.is_none() && self.may_subscribe(tick, now, metrics) {
            let permit = self.particle_permit(room);
            let (subscriber, keyframe) = self.subscribe(room, permit.is_some());
            metrics.sent(self.rate, keyframe.len());
            self.allowance.charge(keyframe.len(), now);
            let dropped = self.outbox.keyframe(keyframe, permit);
            metrics.skipped(Skip::Lag, dropped);
            self.lag.sent(subscriber.keyframe_tick);
            self.subscriber = Some(subscriber);
            queued = true;
        }
        if self.lag.is_silent(tick, silent_ticks_max) {
            self.outbox.end(Refusal::Silent);
        }
        if tick.is_multiple_of(TICKS_PER_SECOND) {
            metrics.lag.observe(f64::from(self.lag.ticks()));
        }
        queued
    }

    /// Returns whether the next keyframe may be sent. A keyframe that waited for the budget is sent at a tick of its
    /// rate, for the same reason that the rate falls only at such a tick.
    fn may_subscribe(&mut self, tick: u32, now: Instant, metrics: &Metrics) -> bool {
        if !self.held_back {
            return true;
        }
        let is_due = tick.is_multiple_of(self.rate.every().into());
        self.held_back = !is_due || !self.allowance.has_some(now);
        if self.held_back {
            metrics.skipped(if is_due { Skip::Uplink } else { Skip::Rate }, 1);
        }
        !self.held_back
    }

    /// A permit for the particles in a first keyframe, if there are any and not too many are already waiting.
    fn particle_permit(&mut self, room: &Room) -> Option<OwnedSemaphorePermit> {
        let again = std::mem::replace(&mut self.subscribed, true);
        let particles = room.game().world().particles();
        if again || !particles.is_active() {
            return None;
        }
        Arc::clone(&self.permits.0).try_acquire_many_owned(particles.len() as u32).ok()
    }

    fn subscribe(&self, room: &mut Room, particles: bool) -> (Subscriber, Bytes) {
        match self.seat {
            Some(seat) if particles => room.subscribe_view(seat, self.rate),
            Some(seat) => room.subscribe_view_again(seat, self.rate),
            None if particles => room.subscribe(self.rate),
            None => room.subscribe_again(self.rate),
        }
    }

    fn hand_over(&mut self, room: &Room, tick: u32, now: Instant, metrics: &Metrics) -> bool {
        let Some(subscriber) = &self.subscriber else { return false };
        let Some(message) = room.message(subscriber) else {
            let due = tick.is_multiple_of(u32::from(self.rate.every()));
            metrics.skipped(if due { Skip::Quiet } else { Skip::Rate }, 1);
            return false;
        };
        if !self.allowance.take(message.len(), now) {
            metrics.skipped(Skip::Uplink, 1);
            self.lower_rate(tick);
            return false;
        }
        match self.outbox.snapshot(message) {
            0 => {
                metrics.sent(self.rate, message.len());
                self.lag.sent(tick);
                true
            }
            dropped => {
                metrics.skipped(Skip::Queue, dropped);
                metrics.late.inc();
                self.lower_rate(tick);
                false
            }
        }
    }

    fn choose_rate(&mut self, tick: u32, now: Instant, metrics: &Metrics) {
        // The rate falls only at a tick of the lower rate. Between two such ticks, the keyframe would be the earlier
        // tick's, and events that may already have been sent would be sent again.
        let lower = self.rate.lower();
        if self.lag.lags(tick) && tick.is_multiple_of(lower.every().into()) {
            self.lag.restart(tick);
            self.late_tick = tick;
            if lower != self.rate {
                metrics.late.inc();
                self.lower_rate(tick);
            }
        }
        let keeps_up = || {
            let is_long = tick - self.late_tick >= RATE_RISE_TICKS;
            is_long && self.outbox.is_drained() && self.allowance.is_roomy(now)
        };
        if self.rate != Rate::Full && keeps_up() {
            self.subscriber = None;
            self.rate = self.rate.higher();
            self.late_tick = tick;
        }
    }

    /// Lowers the rate, and makes the next snapshot a keyframe as soon as the budget allows.
    fn lower_rate(&mut self, tick: u32) {
        (self.subscriber, self.held_back) = (None, true);
        self.rate = self.rate.lower();
        self.late_tick = tick;
    }
}

/// The ticks that one client has been sent and has acknowledged. To the socket, bytes waiting in kernel buffers and
/// proxies count as sent; here they do not. A long round trip is not lag: a client is compared with its own best
/// performance in the past minute.
#[derive(Clone, Debug)]
pub struct AckLag {
    /// Ticks of the newest snapshot sent and of the newest one acknowledged.
    sent: u32,
    acked: u32,
    /// Tick when `acked` last increased, or when everything had been acknowledged.
    moved: u32,
    /// Number of ticks between the newest acknowledged snapshot and the newest one sent, as of the client's last input.
    behind: u32,
    /// The lowest `behind` in this window and in the previous one.
    least: [u32; 2],
    window_began: u32,
    /// Tick since when the lag has been more than the round trip explains.
    lagging_since: Option<u32>,
}

impl AckLag {
    /// Creates the lag of a client whose first snapshot is sent at this tick.
    pub fn new(tick: u32) -> AckLag {
        AckLag {
            sent: tick,
            acked: tick,
            moved: tick,
            behind: 0,
            least: [u32::MAX; 2],
            window_began: tick,
            lagging_since: None,
        }
    }

    /// Notes that a snapshot of this tick was sent. While nothing moves, a keyframe may be older than the previous
    /// snapshot; its tick is then the newest that can be acknowledged.
    pub fn sent(&mut self, tick: u32) {
        if self.acked == self.sent {
            self.moved = tick;
        }
        self.sent = tick;
        self.acked = self.acked.min(tick);
    }

    /// Notes the low bits of the tick that an input acknowledges. A client that acknowledges a tick that was not sent
    /// yet is treated as up to date.
    pub fn acked(&mut self, low: u16, now: u32) {
        let behind = u32::from((self.sent as u16).wrapping_sub(low));
        let behind = if behind < 1 << 15 { behind } else { 0 };
        let acked = self.sent.saturating_sub(behind);
        if acked > self.acked {
            (self.acked, self.moved) = (acked, now);
        }
        self.behind = self.sent - self.acked;
        if now - self.window_began >= LAG_WINDOW_TICKS {
            self.least = [u32::MAX, self.least[0]];
            self.window_began = now;
        }
        self.least[0] = self.least[0].min(self.behind);
        let usual = self.least[0].min(self.least[1]);
        let lags = self.behind > usual + LAG_GROWTH_TICKS || self.behind > LAG_TICKS_MAX;
        self.lagging_since = lags.then(|| self.lagging_since.unwrap_or(now));
    }

    /// Number of ticks between the newest acknowledged snapshot and the newest one sent.
    pub fn ticks(&self) -> u32 {
        self.behind
    }

    /// Returns whether the client has lagged long enough to get a lower rate.
    pub fn lags(&self, now: u32) -> bool {
        self.lagging_since.is_some_and(|since| now - since >= LAGGING_TICKS)
    }

    /// Notes that the client's rate was lowered, to give it time to catch up.
    pub fn restart(&mut self, now: u32) {
        self.lagging_since = self.lagging_since.map(|_| now);
    }

    /// Returns whether the client is being sent snapshots but has acknowledged none for `ticks_max` ticks.
    pub fn is_silent(&self, now: u32, ticks_max: u32) -> bool {
        self.sent > self.acked && now - self.moved >= ticks_max
    }
}

/// Iterates over a room's sessions. The session that comes first changes with each snapshot at the lowest rate, because
/// the first has the best chance when the budget is almost used up.
pub fn in_turn<T>(sessions: &mut [T], tick: u32) -> impl Iterator<Item = &mut T> {
    // The multiplication by the golden ratio keeps the turns of neighbours in the list far apart.
    let turn = (tick / u32::from(Rate::Twelfth.every())).wrapping_mul(0x9E37_79B9);
    let first = turn as usize % sessions.len().max(1);
    let (last, rest) = sessions.split_at_mut(first);
    rest.iter_mut().chain(last)
}

#[cfg(test)]
mod tests;
