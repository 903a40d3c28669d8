//! One player with a socket: what it is fed, at which rate, and whether it hears it.

use super::FromSession;
use crate::lag::Lag;
use crate::limits;
use crate::metrics::{Metrics, Skip};
use crate::outbox::Outbox;
use jostle_protocol::Refusal;
use jostle_room::{Rate, Reader, Room};
use jostle_sim::{Seat, TICKS_PER_SECOND};
use std::sync::Arc;
use std::sync::mpsc::Receiver;

/// One player with a socket.
pub struct Member {
    pub(super) seat: Seat,
    /// Whether it may have others leave.
    pub(super) host: bool,
    pub(super) inbox: Receiver<FromSession>,
    pub(super) outbox: Arc<Outbox>,
    pub(super) lag: Lag,
    /// What it is fed; `None` until its next keyframe.
    reader: Option<Reader>,
    rate: Rate,
    /// Tick at which it was last found to be far behind.
    late_tick: u32,
}

impl Member {
    /// Who just took a seat.
    pub fn new(
        seat: Seat,
        host: bool,
        inbox: Receiver<FromSession>,
        outbox: Arc<Outbox>,
        tick: u32,
    ) -> Member {
        let lag = Lag::new(tick);
        let rate = Rate::default();
        Member { seat, host, inbox, outbox, lag, reader: None, rate, late_tick: tick }
    }

    /// Hands over what the newest tick sends. Who is too far behind begins anew at a lower rate,
    /// and gets a higher one after it kept up for long enough; who hears nothing for so many ticks is
    /// given up.
    pub fn feed(&mut self, room: &mut Room, silent_ticks_max: u32, metrics: &Metrics) {
        let tick = room.game().tick_count();
        // First: a keyframe of a tick that was handed over already would tell it twice.
        self.choose_rate(tick, metrics);
        self.hand_over(room, tick, metrics);
        if self.reader.is_none() {
            let (reader, keyframe) = room.begin_at(self.seat, self.rate);
            metrics.sent(self.rate, keyframe.len());
            let dropped = self.outbox.keyframe(keyframe);
            metrics.skipped(Skip::Lag, dropped);
            self.lag.sent(reader.began);
            self.reader = Some(reader);
        }
        if self.lag.is_silent(tick, silent_ticks_max) {
            self.outbox.end(Refusal::Silent);
        }
        if tick.is_multiple_of(TICKS_PER_SECOND) {
            metrics.lag.observe(f64::from(self.lag.ticks()));
        }
    }

    fn hand_over(&mut self, room: &Room, tick: u32, metrics: &Metrics) {
        let Some(reader) = &self.reader else { return };
        let Some(message) = room.message(reader) else {
            let due = tick.is_multiple_of(u32::from(self.rate.every()));
            return metrics.skipped(if due { Skip::Quiet } else { Skip::Rate }, 1);
        };
        match self.outbox.snapshot(message) {
            0 => {
                metrics.sent(self.rate, message.len());
                self.lag.sent(tick);
            }
            dropped => {
                metrics.skipped(Skip::Queue, dropped);
                self.begin_lower(tick, metrics);
            }
        }
    }

    fn choose_rate(&mut self, tick: u32, metrics: &Metrics) {
        // Only at a tick of the lower rate: between two of them its keyframe is of the one before, and
        // what happened since, which may have been told already, would be told again.
        let lower = self.rate.lower();
        if self.lag.lags(tick) && tick.is_multiple_of(lower.every().into()) {
            self.lag.relieved(tick);
            self.late_tick = tick;
            if lower != self.rate {
                self.begin_lower(tick, metrics);
            }
        }
        let calm = || tick - self.late_tick >= limits::RATE_RISE_TICKS && self.outbox.is_drained();
        if self.rate != Rate::Full && calm() {
            self.reader = None;
            self.rate = self.rate.higher();
            self.late_tick = tick;
        }
    }

    /// The next it is sent is a keyframe, at a lower rate.
    fn begin_lower(&mut self, tick: u32, metrics: &Metrics) {
        metrics.late.inc();
        self.reader = None;
        self.rate = self.rate.lower();
        self.late_tick = tick;
    }
}

#[cfg(test)]
mod tests;
