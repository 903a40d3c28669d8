//! Sent inputs, and the ticks in which the server plays them. These ticks are first estimated from the delays of
//! earlier inputs, then taken from snapshots.

use jostle_game::{Buttons, Input};
use jostle_room::SILENCE_TICKS;
use std::collections::VecDeque;

/// Share of the difference between a measurement and the lead by which the lead is corrected.
const LEAD_SHARE: f64 = 0.25;
/// Like [`LEAD_SHARE`], but for snapshots that are more than a tick apart.
const WIDE_SHARE: f64 = 0.02;
/// Initial estimate of the ticks until an input is played.
const LEAD_TICKS: f64 = 1.0;
/// Maximum plausible lead, ticks.
const LEAD_TICKS_MAX: f64 = 60.0;
/// Maximum number of inputs remembered; the oldest are dropped first.
const SENT_MAX: usize = 256;

/// Inputs in the order in which they were sent.
#[derive(Debug)]
pub(super) struct InputSchedule {
    sent: VecDeque<Sent>,
    acknowledged: u32,
    /// Number of ticks from the server's tick when an input is sent to the tick in which it is played, not counting the
    /// wait for that tick to begin.
    pub lead: f64,
    measured: u32,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    seq: u32,
    input: Input,
    /// Whether it repeats the input before. The room may leave out messages while inputs are only repeated.
    repeats: bool,
    /// The tick in which the input is played.
    played: u32,
    /// The server's tick when the input was sent; `None` if it had to wait for an earlier input.
    at: Option<f64>,
}

impl Default for InputSchedule {
    fn default() -> InputSchedule {
        InputSchedule { sent: VecDeque::new(), acknowledged: 0, lead: LEAD_TICKS, measured: 0 }
    }
}

impl InputSchedule {
    /// Discards all inputs, as the room does with those of a closed socket. The lead is kept.
    pub fn restart(&mut self) {
        self.sent.clear();
        self.acknowledged = 0;
    }

    /// Records an input sent at this moment. It will be played in the next tick, at one input per tick. Returns whether
    /// it changes the pressed buttons.
    pub fn send(&mut self, seq: u32, input: Input, server_tick: f64, moment: f64) -> bool {
        let next = next_tick(moment);
        let last = self.sent.back();
        let played = last.map_or(next, |last| next.max(last.played + 1));
        let before = last.map(|last| last.input).unwrap_or_default();
        let (repeats, changes) = (before == input, before.buttons() != input.buttons());
        let at = (played == next).then_some(server_tick);
        if self.sent.len() == SENT_MAX {
            self.sent.pop_front();
        }
        self.sent.push_back(Sent { seq, input, repeats, played, at });
        changes
    }

    /// Records that, according to the snapshot of `tick`, inputs up to `seq` were played. The room played only repeated
    /// inputs after tick `heard`, that of the previous snapshot, until tick `since`.
    pub fn acknowledge(&mut self, seq: u32, heard: u32, since: u32, tick: u32) {
        let mut earliest = tick + 1;
        for sent in &mut self.sent {
            if sent.seq > seq {
                // One input is played per tick, so a late one delays those behind it.
                sent.played = sent.played.max(earliest);
                earliest = sent.played + 1;
                continue;
            }
            sent.played = sent.played.min(tick.saturating_sub(seq - sent.seq));
            if let Some(at) = sent.at.take() {
                self.measured += 1;
                let since = if sent.repeats { heard } else { since };
                let (low, high) = (f64::from(since) - at, f64::from(tick) - at);
                self.lead = measured(self.lead, low, high, self.measured);
            }
        }
        self.acknowledged = seq;
    }

    /// The buttons pressed in a tick: those of the last input played, until the room releases them.
    pub fn at(&self, tick: u32) -> Buttons {
        let after = self.sent.partition_point(|sent| sent.played <= tick);
        let newest = after.checked_sub(1).map(|place| &self.sent[place]);
        let held = newest.filter(|newest| tick - newest.played <= SILENCE_TICKS);
        held.map_or(Buttons::default(), |held| held.input.buttons())
    }

    /// The last tick in which a sent input is played.
    pub fn booked(&self) -> u32 {
        self.sent.back().map_or(0, |last| last.played)
    }

    /// Discards inputs that are not needed for this tick or later ones.
    pub fn forget_before(&mut self, tick: u32) {
        while self.sent.get(1).is_some_and(|second| second.played <= tick) {
            self.sent.pop_front();
        }
    }

    /// The number of inputs not yet acknowledged as played.
    pub fn waiting(&self) -> usize {
        self.sent.iter().filter(|sent| sent.seq > self.acknowledged).count()
    }
}

/// The first tick that begins after a moment.
pub(super) fn next_tick(moment: f64) -> u32 {
    moment.max(0.0) as u32 + 1
}

/// Updates the lead after an input that was played between `low` (exclusive) and `high` ticks after it was sent. A lead
/// within these bounds is kept: inputs sent at the same phase of a tick provide no further information.
fn measured(lead: f64, low: f64, high: f64, count: u32) -> f64 {
    let first = 1.0 / f64::from(count);
    let (wanted, share) = match high - low > 1.0 {
        // Sparse snapshots result in wide bounds and cover every phase, so the middle is right on average.
        true => (0.5 * (low + high), first.max(WIDE_SHARE)),
        false => (lead.clamp(low, high), first.max(LEAD_SHARE)),
    };
    (lead + (wanted - lead) * share).clamp(0.0, LEAD_TICKS_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: Buttons = Buttons::RIGHT;

    fn pressed(buttons: Buttons) -> Input {
        Input::new(buttons, None)
    }

    #[test]
    fn an_input_holds_from_the_tick_after_its_moment_to_the_next_one() {
        let mut schedule = InputSchedule::default();
        assert!(schedule.send(1, pressed(RIGHT), 9.0, 10.4));
        assert!(!schedule.send(2, pressed(RIGHT), 13.0, 14.4), "nothing changes");
        assert!(schedule.send(3, Input::default(), 14.0, 15.4));
        let held: Vec<bool> = (9..18).map(|tick| schedule.at(tick) == RIGHT).collect();
        assert_eq!(held, [false, false, true, true, true, true, true, false, false]);
    }

    #[test]
    fn inputs_are_released_after_silence_as_the_room_does() {
        let mut schedule = InputSchedule::default();
        schedule.send(1, pressed(RIGHT), 9.0, 10.4);
        assert_eq!(schedule.at(11 + SILENCE_TICKS), RIGHT);
        assert_eq!(schedule.at(12 + SILENCE_TICKS), Buttons::default());
    }

    #[test]
    fn inputs_of_one_tick_are_played_one_after_the_other() {
        let mut schedule = InputSchedule::default();
        schedule.send(1, pressed(RIGHT), 9.0, 10.2);
        schedule.send(2, pressed(Buttons::LEFT), 9.2, 10.4);
        assert_eq!((schedule.at(11), schedule.at(12)), (RIGHT, Buttons::LEFT));
    }

    #[test]
    fn the_server_says_when_they_were_played() {
        let mut schedule = InputSchedule::default();
        schedule.send(1, pressed(RIGHT), 9.0, 10.2);
        schedule.send(2, pressed(Buttons::LEFT), 9.2, 10.4);
        schedule.acknowledge(0, 11, 11, 12);
        assert_eq!(schedule.at(12), Buttons::default(), "not yet");
        assert_eq!((schedule.at(13), schedule.at(14)), (RIGHT, Buttons::LEFT));
        schedule.acknowledge(1, 12, 12, 13);
        schedule.acknowledge(2, 13, 13, 14);
        assert_eq!(
            (schedule.at(13), schedule.at(14), schedule.waiting()),
            (RIGHT, Buttons::LEFT, 0)
        );
    }

    #[test]
    fn a_repeat_acknowledged_late_does_not_lengthen_the_lead() {
        let mut schedule = InputSchedule::default();
        // Inputs are played 1 tick after they were sent. While they are repeated, the room sends every 13th tick.
        for round in 0..40 {
            let tick = 100 + 13 * round;
            for repeat in 0..3 {
                let seq = 3 * round + repeat + 1;
                let sent = f64::from(tick + 4 * repeat);
                schedule.send(seq, pressed(RIGHT), sent, sent + schedule.lead);
            }
            schedule.acknowledge(3 * round + 3, tick - 1, tick + 11, tick + 12);
        }
        assert!((schedule.lead - 1.0).abs() < 1.5, "lead {}", schedule.lead);
        schedule.send(200, Input::default(), 700.0, 701.0);
        schedule.acknowledge(200, 690, 700, 701);
        assert!((schedule.lead - 1.0).abs() < 1.2, "lead {}", schedule.lead);
    }

    #[test]
    fn the_lead_is_learned_from_inputs_that_did_not_wait() {
        let mut schedule = InputSchedule::default();
        for seq in 1..=60 {
            // Inputs sent at any phase arrive 7.3 ticks later and are played in the next tick.
            let at = f64::from(seq) * 4.83;
            schedule.send(seq, pressed(RIGHT), at, at + schedule.lead);
            let played = (at + 7.3) as u32 + 1;
            schedule.acknowledge(seq, played - 1, played - 1, played);
        }
        assert!((schedule.lead - 7.3).abs() < 0.3, "lead {}", schedule.lead);
    }
}
