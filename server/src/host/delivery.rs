//! What one socket is sent: its snapshots, the lower rate of a slow client, and whether the client still
//! acknowledges them.

use crate::host::ack_lag::AckLag;
use crate::host::outbox::Outbox;
use crate::limits;
use crate::ops::metrics::{Metrics, Skip};
use bytes::Bytes;
use jostle_game::Seat;
use jostle_protocol::Refusal;
use jostle_room::{Rate, Room, Subscriber};
use jostle_sim::TICKS_PER_SECOND;
use std::sync::Arc;

/// The snapshots of one socket.
pub struct Delivery {
    /// The player's seat; a spectator has none, and is sent the whole world.
    seat: Option<Seat>,
    pub(super) outbox: Arc<Outbox>,
    pub(super) lag: AckLag,
    /// Its subscription to snapshots; `None` until its next keyframe.
    subscriber: Option<Subscriber>,
    /// Whether it was sent a keyframe.
    subscribed: bool,
    rate: Rate,
    /// Tick at which it was last found to be far behind.
    late_tick: u32,
}

impl Delivery {
    /// The feed of a client that was just welcomed.
    pub fn new(seat: Option<Seat>, outbox: Arc<Outbox>, tick: u32) -> Delivery {
        let (lag, rate) = (AckLag::new(tick), Rate::default());
        let (subscriber, subscribed) = (None, false);
        Delivery { seat, outbox, lag, subscriber, subscribed, rate, late_tick: tick }
    }

    /// Queues the snapshot of the newest tick. A client that is too far behind gets a keyframe and a lower
    /// rate, and a higher one after it kept up for long enough. A client that acknowledges nothing for
    /// `silent_ticks_max` ticks is disconnected. Returns whether anything was queued.
    pub fn feed(&mut self, room: &mut Room, silent_ticks_max: u32, metrics: &Metrics) -> bool {
        let tick = room.game().tick_count();
        // First: a keyframe of a tick that was queued already would repeat its events.
        self.choose_rate(tick, metrics);
        let mut queued = self.hand_over(room, tick, metrics);
        if self.subscriber.is_none() {
            let (subscriber, keyframe) = self.subscribe(room);
            metrics.sent(self.rate, keyframe.len());
            let dropped = self.outbox.keyframe(keyframe);
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

    fn subscribe(&mut self, room: &mut Room) -> (Subscriber, Bytes) {
        let again = std::mem::replace(&mut self.subscribed, true);
        match self.seat {
            Some(seat) => room.subscribe_view(seat, self.rate),
            None if again => room.subscribe_again(self.rate),
            None => room.subscribe(self.rate),
        }
    }

    fn hand_over(&mut self, room: &Room, tick: u32, metrics: &Metrics) -> bool {
        let Some(subscriber) = &self.subscriber else { return false };
        let Some(message) = room.message(subscriber) else {
            let due = tick.is_multiple_of(u32::from(self.rate.every()));
            metrics.skipped(if due { Skip::Quiet } else { Skip::Rate }, 1);
            return false;
        };
        match self.outbox.snapshot(message) {
            0 => {
                metrics.sent(self.rate, message.len());
                self.lag.sent(tick);
                true
            }
            dropped => {
                metrics.skipped(Skip::Queue, dropped);
                self.lower_rate(tick, metrics);
                false
            }
        }
    }

    fn choose_rate(&mut self, tick: u32, metrics: &Metrics) {
        // Only at a tick of the lower rate: between two of them its keyframe is of the one before, and
        // events since then, which may have been sent already, would be sent again.
        let lower = self.rate.lower();
        if self.lag.lags(tick) && tick.is_multiple_of(lower.every().into()) {
            self.lag.restart(tick);
            self.late_tick = tick;
            if lower != self.rate {
                self.lower_rate(tick, metrics);
            }
        }
        let keeps_up =
            || tick - self.late_tick >= limits::RATE_RISE_TICKS && self.outbox.is_drained();
        if self.rate != Rate::Full && keeps_up() {
            self.subscriber = None;
            self.rate = self.rate.higher();
            self.late_tick = tick;
        }
    }

    /// Makes its next snapshot a keyframe, at a lower rate.
    fn lower_rate(&mut self, tick: u32, metrics: &Metrics) {
        metrics.late.inc();
        self.subscriber = None;
        self.rate = self.rate.lower();
        self.late_tick = tick;
    }
}

#[cfg(test)]
mod tests;
