//! Sends inputs to the server. Every change of buttons is sent exactly once, immediately. Moves and repeats wait for a
//! tick in which no other input is played, so that no queue builds up at the server.

use jostle_game::{Buttons, Input};
use std::collections::VecDeque;

/// Number of inputs per second; the server plays one per tick.
const RATE_HZ: f64 = 60.0;
/// Number of inputs that may be sent at once after a pause: a press, its release and a move.
const BURST: f64 = 3.0;
/// Maximum number of queued inputs when changes come faster than ticks; the oldest moves are dropped first.
const WAITING_MAX: usize = 8;
/// Interval at which an unchanged input is repeated while a button is pressed. The server releases the buttons of a
/// player whom it does not hear.
const REPEAT_MS: f64 = 80.0;
/// Like [`REPEAT_MS`], once neither buttons nor pointer have changed for [`REST_AFTER_MS`] and no button is pressed. Until
/// then, repeats show how long inputs take to be played.
const REST_MS: f64 = 250.0;
const REST_AFTER_MS: f64 = 3000.0;
/// After this time an input is sent regardless of booked ticks; otherwise the server would release all keys.
const OVERDUE_MS: f64 = 160.0;
/// If another input is played in the preceding tick, a move is sent only after this fraction of a tick. If sent sooner,
/// it could arrive a little early and collide with that input.
const PHASE_MIN: f64 = 0.25;
/// Maximum number of ticks booked ahead; more would indicate an error.
const BOOKED_AHEAD_MAX: u32 = 90;

/// The queue for outgoing inputs.
#[derive(Debug)]
pub struct InputSender {
    waiting: VecDeque<Input>,
    last: Option<Input>,
    sent_ms: f64,
    /// When the input last changed.
    changed_ms: f64,
    allowance: f64,
    refilled_ms: f64,
    seq: u32,
    /// The last tick in which a sent input is played.
    booked: u32,
}

impl Default for InputSender {
    fn default() -> InputSender {
        InputSender {
            waiting: VecDeque::new(),
            last: None,
            sent_ms: f64::NEG_INFINITY,
            changed_ms: f64::NEG_INFINITY,
            allowance: BURST,
            refilled_ms: 0.0,
            seq: 0,
            booked: 0,
        }
    }
}

impl InputSender {
    /// Records the current input. A change of buttons is kept with its pointer, so that a tap shorter than a tick still
    /// counts and a press acts where it was made. A mere move is replaced by the next input, except that the last move
    /// of a drag is played before the button is released.
    pub fn note(&mut self, input: Input) {
        if self.ends_in_a_move() && !self.ends_a_drag(input) {
            self.waiting.pop_back();
        }
        if self.waiting.back().copied().or(self.last) == Some(input) {
            return;
        }
        if self.waiting.len() == WAITING_MAX {
            self.waiting.pop_front();
        }
        self.waiting.push_back(input);
    }

    /// Whether an input releases a button with which the newest queued input is dragging.
    fn ends_a_drag(&self, input: Input) -> bool {
        const DRAGS: u16 = Buttons::FIRE.0 | Buttons::HOLD.0;
        self.waiting
            .back()
            .is_some_and(|newest| newest.buttons().0 & !input.buttons().0 & DRAGS != 0)
    }

    /// Whether the newest queued input changes no button.
    fn ends_in_a_move(&self) -> bool {
        let before = match self.waiting.len() {
            0 => return false,
            1 => self.last,
            count => self.waiting.get(count - 2).copied(),
        };
        let newest = self.waiting.back();
        before.zip(newest).is_some_and(|(before, newest)| before.buttons() == newest.buttons())
    }

    /// The next input to send at `now_ms` with its sequence number, if one is due. It would be played in the first tick
    /// after `moment`. Call repeatedly until it returns `None`.
    pub fn due(&mut self, now_ms: f64, moment: f64) -> Option<(u32, Input)> {
        self.refill(now_ms);
        let tick = moment.max(0.0) as u32 + 1;
        if self.booked > tick + BOOKED_AHEAD_MAX {
            // The tick numbering changed: this is another session, or the ticks were a guess made before the first
            // snapshot.
            self.booked = 0;
        }
        let repeat = self.last.filter(|last| {
            let pressed = last.buttons() != Buttons::default();
            let rests = !pressed && now_ms - self.changed_ms >= REST_AFTER_MS;
            now_ms - self.sent_ms >= if rests { REST_MS } else { REPEAT_MS }
        });
        let input = self.waiting.front().copied().or(repeat)?;
        let urgent = self.last.is_none_or(|last| last.buttons() != input.buttons());
        let overdue = now_ms - self.sent_ms >= OVERDUE_MS;
        // Frames may fall at the same phase of the tick for seconds on end. If the previous tick is free too, the move
        // may arrive in it.
        let ahead = tick.saturating_sub(self.booked);
        let fits = overdue || ahead > 1 || ahead == 1 && moment.rem_euclid(1.0) >= PHASE_MIN;
        if self.allowance < 1.0 || !(urgent || fits) {
            return None;
        }
        self.waiting.pop_front();
        self.booked = tick.max(self.booked + 1);
        self.allowance -= 1.0;
        self.sent_ms = now_ms;
        if self.last.replace(input) != Some(input) {
            self.changed_ms = now_ms;
        }
        self.seq += 1;
        Some((self.seq, input))
    }

    /// Notes that sent inputs are played later than expected, up to this tick.
    pub fn book_until(&mut self, tick: u32) {
        self.booked = self.booked.max(tick);
    }

    fn refill(&mut self, now_ms: f64) {
        let elapsed_s = ((now_ms - self.refilled_ms) / 1000.0).max(0.0);
        self.allowance = (self.allowance + elapsed_s * RATE_HZ).min(BURST);
        self.refilled_ms = now_ms;
    }
}

#[cfg(test)]
mod tests;
