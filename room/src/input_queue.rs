//! The jitter buffer for one player's inputs, between the socket and the tick. Inputs arrive in bursts and with gaps,
//! but one is played per tick. The queue evens out the bursts, and stays short so that no delay builds up.

use jostle_game::{Buttons, Input};
use std::collections::VecDeque;

/// Maximum number of inputs waiting for one player; beyond this, the oldest are dropped.
pub const INPUTS_QUEUED_MAX: usize = 8;
/// Number of ticks for which the last input is repeated when none arrives; after that, the player stops steering.
pub const SILENCE_TICKS: u32 = 15;
/// Like [`SILENCE_TICKS`], for an input without buttons, which an idle player's page repeats less often.
const REST_TICKS: u32 = 60;
/// Number of inputs that may wait for long; any more would only add delay.
pub const INPUTS_WAITING_GOAL: usize = 2;
/// Number of consecutive ticks with more inputs than the goal after which the queue is cut to the goal.
pub const LONG_QUEUE_TICKS: u32 = 30;
/// Maximum difference between consecutive sequence numbers.
pub const SEQ_AHEAD_MAX: u32 = 60;

/// One session's inputs, in order.
#[derive(Clone, Debug, Default)]
pub struct InputQueue {
    waiting: VecDeque<Waiting>,
    seq_newest: u32,
    seq_played: u32,
    /// Repeated until a new input arrives.
    last: Option<Input>,
    /// Whether the last tick played a new input that differs from the one before.
    changed: bool,
    silent_ticks: u32,
    long_ticks: u32,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    seq: u32,
    input: Input,
    /// The merged inputs that were dropped before this one. A click among them is not lost, and takes effect where it
    /// was made.
    dropped: Input,
}

impl Waiting {
    /// The input, merged with those dropped before it.
    fn merged(&self) -> Input {
        let (dropped, input) = (self.dropped.buttons().0, self.input.buttons().0);
        let lost = dropped & !input != 0;
        let pressed = input & !dropped != 0;
        // A button that this input itself presses takes effect at this input's pointer.
        let pointer = if lost && !pressed { self.dropped.pointer() } else { self.input.pointer() };
        Input::new(Buttons(dropped | input), pointer.or(self.input.pointer()))
    }
}

impl InputQueue {
    /// Sequence number of the newest input played; 0 before the first.
    pub fn seq_played(&self) -> u32 {
        self.seq_played
    }

    /// Whether the last tick played a new input that differs from the one before. A page repeats its input while
    /// nothing happens, and no page waits for the number of a repeat.
    pub fn has_changed(&self) -> bool {
        self.changed
    }

    /// Queues an input, and returns whether it was accepted. Old, repeated and far-future numbers are refused. If there
    /// are more than [`INPUTS_QUEUED_MAX`], the oldest input is dropped.
    pub fn push(&mut self, seq: u32, input: Input) -> bool {
        let ahead = seq.checked_sub(self.seq_newest);
        if !ahead.is_some_and(|ahead| (1..=SEQ_AHEAD_MAX).contains(&ahead)) {
            return false;
        }
        self.seq_newest = seq;
        if self.waiting.len() == INPUTS_QUEUED_MAX {
            self.drop_oldest();
        }
        self.waiting.push_back(Waiting { seq, input, dropped: Input::default() });
        true
    }

    /// Queues an input created by the room itself under the next number, even before the player's first input.
    pub fn push_next(&mut self, input: Input) {
        self.push(self.seq_newest.saturating_add(1), input);
    }

    /// Takes the input to play in this tick: the next one, or the last one again for up to [`SILENCE_TICKS`], or
    /// `None` for a player at rest. An input without buttons is repeated for up to [`REST_TICKS`].
    pub fn take(&mut self) -> Option<Input> {
        self.shorten();
        self.changed = false;
        let Some(next) = self.waiting.pop_front() else {
            self.silent_ticks = self.silent_ticks.saturating_add(1);
            let rests = self.last.is_some_and(|last| last.buttons() == Buttons::default());
            if self.silent_ticks > if rests { REST_TICKS } else { SILENCE_TICKS } {
                self.last = None;
            }
            return self.last;
        };
        let input = next.merged();
        self.changed = self.last.unwrap_or_default() != input;
        self.seq_played = next.seq;
        self.silent_ticks = 0;
        self.last = Some(next.input);
        Some(input)
    }

    /// Drops all inputs, which leaves the player at rest.
    pub fn rest(&mut self) {
        self.waiting.clear();
        self.last = None;
    }

    /// Shortens a queue that has been too long for a while. It would not become shorter on its own, and would only add
    /// delay.
    fn shorten(&mut self) {
        if self.waiting.len() <= INPUTS_WAITING_GOAL {
            self.long_ticks = 0;
            return;
        }
        self.long_ticks += 1;
        if self.long_ticks >= LONG_QUEUE_TICKS {
            self.long_ticks = 0;
            while self.waiting.len() > INPUTS_WAITING_GOAL {
                self.drop_oldest();
            }
        }
    }

    /// Drops the oldest input, and passes its buttons on to the next one.
    fn drop_oldest(&mut self) {
        let oldest = self.waiting.pop_front();
        if let (Some(oldest), Some(next)) = (oldest, self.waiting.front_mut()) {
            next.dropped = oldest.merged();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_protocol::limits::POINTER_MAX;
    use jostle_sim::Vec2;

    fn down(buttons: Buttons) -> Input {
        Input::new(buttons, None)
    }

    fn numbered(seq: u32) -> Input {
        Input::new(Buttons::default(), Some(Vec2::new(seq as f32, 0.0)))
    }

    /// Sequence numbers that `take` plays until the queue is empty.
    fn played(queue: &mut InputQueue) -> Vec<u32> {
        let mut seqs = Vec::new();
        while !queue.waiting.is_empty() {
            queue.take();
            seqs.push(queue.seq_played());
        }
        seqs
    }

    #[test]
    fn a_repeated_input_changes_nothing() {
        let mut queue = InputQueue::default();
        let pressed = Input::new(Buttons::RIGHT, None);
        let inputs = [pressed, pressed, Input::default(), Input::default()];
        let changes = (1..).zip(inputs).map(|(seq, input)| {
            queue.push(seq, input);
            queue.take();
            queue.has_changed()
        });
        assert_eq!(changes.collect::<Vec<bool>>(), [true, false, true, false]);
        queue.take();
        assert!(!queue.has_changed(), "nothing was played");
    }

    #[test]
    fn one_input_is_played_a_tick_in_order() {
        let mut queue = InputQueue::default();
        (1..=2).for_each(|seq| assert!(queue.push(seq, numbered(seq))));
        assert_eq!(queue.seq_played(), 0);
        for seq in 1..=2 {
            assert_eq!(queue.take(), Some(numbered(seq)));
            assert_eq!(queue.seq_played(), seq);
        }
    }

    #[test]
    fn old_repeated_and_far_future_inputs_are_dropped() {
        let mut queue = InputQueue::default();
        for seq in [0, 2, 1, 2, 3 + SEQ_AHEAD_MAX, u32::MAX, 4, 3, 4 + SEQ_AHEAD_MAX] {
            queue.push(seq, numbered(seq));
        }
        assert_eq!(played(&mut queue), [2, 4, 4 + SEQ_AHEAD_MAX]);
    }

    #[test]
    fn the_largest_sequence_number_does_not_overflow() {
        let mut queue = InputQueue { seq_newest: u32::MAX - 1, ..InputQueue::default() };
        queue.push(u32::MAX, numbered(1));
        queue.push(0, numbered(2));
        assert_eq!(played(&mut queue), [u32::MAX]);
    }

    #[test]
    fn the_last_input_is_repeated_and_then_nothing_is_held() {
        let mut queue = InputQueue::default();
        assert_eq!(queue.take(), None);
        let right = down(Buttons::RIGHT);
        queue.push(1, right);
        for _ in 0..=SILENCE_TICKS {
            assert_eq!(queue.take(), Some(right));
        }
        assert_eq!(queue.take(), None);
        queue.push(2, right);
        assert_eq!(queue.take(), Some(right));
    }

    #[test]
    fn a_full_queue_drops_its_oldest_input_but_not_its_click() {
        let mut queue = InputQueue::default();
        queue.push(1, down(Buttons::FIRE));
        for seq in 2..=INPUTS_QUEUED_MAX as u32 + 3 {
            queue.push(seq, down(Buttons::RIGHT));
        }
        assert_eq!(queue.waiting.len(), INPUTS_QUEUED_MAX);
        let both = Buttons(Buttons::FIRE.0 | Buttons::RIGHT.0);
        assert_eq!(queue.take(), Some(down(both)));
        assert_eq!(queue.take(), Some(down(Buttons::RIGHT)));
    }

    #[test]
    fn a_dropped_button_is_played_once_and_not_repeated() {
        let mut queue = InputQueue::default();
        queue.push(1, down(Buttons::FIRE));
        queue.push(2, down(Buttons::RIGHT));
        queue.drop_oldest();
        assert!(queue.take().unwrap().buttons().contains(Buttons::FIRE));
        assert_eq!(queue.take(), Some(down(Buttons::RIGHT)));
    }

    #[test]
    fn a_dropped_button_acts_where_it_was_pressed() {
        let mut queue = InputQueue::default();
        let at = |x, buttons| Input::new(buttons, Some(Vec2::new(x, 0.0)));
        queue.push(1, at(10.0, Buttons::FIRE));
        queue.push(2, at(20.0, Buttons::default()));
        queue.drop_oldest();
        assert_eq!(queue.take(), Some(at(10.0, Buttons::FIRE)), "nothing is dragged to 20");
        // A button that is still pressed takes effect at the current pointer.
        queue.push(3, at(30.0, Buttons::FIRE));
        queue.push(4, at(40.0, Buttons::FIRE));
        queue.drop_oldest();
        assert_eq!(queue.take(), Some(at(40.0, Buttons::FIRE)));
        // A click keeps its pointer, whichever key was dropped before it.
        queue.push(5, at(50.0, Buttons::RIGHT));
        queue.push(6, at(60.0, Buttons::FIRE));
        queue.drop_oldest();
        let both = Buttons(Buttons::RIGHT.0 | Buttons::FIRE.0);
        assert_eq!(queue.take(), Some(at(60.0, both)));
    }

    #[test]
    fn a_queue_that_stays_long_is_cut_down() {
        let mut queue = InputQueue::default();
        (1..=5).for_each(|seq| assert!(queue.push(seq, numbered(seq))));
        let mut delays = Vec::new();
        for seq in 6..100 {
            queue.take();
            queue.push(seq, numbered(seq));
            delays.push(seq - queue.seq_played());
        }
        assert_eq!(delays[..LONG_QUEUE_TICKS as usize - 1], [5; LONG_QUEUE_TICKS as usize - 1]);
        assert_eq!(delays[LONG_QUEUE_TICKS as usize..], [2; 94 - LONG_QUEUE_TICKS as usize]);
    }

    #[test]
    fn a_short_burst_is_not_cut() {
        let mut queue = InputQueue::default();
        let mut seqs = Vec::new();
        for burst in 0..20 {
            (burst * 6 + 1..=burst * 6 + 6).for_each(|seq| assert!(queue.push(seq, numbered(seq))));
            seqs.extend(played(&mut queue));
        }
        assert_eq!(seqs, (1..=120).collect::<Vec<_>>());
    }

    #[test]
    fn invalid_pointers_and_buttons_are_removed() {
        let mut queue = InputQueue::default();
        for (seq, x) in [(1, f32::NAN), (2, f32::INFINITY), (3, 2.0 * POINTER_MAX)] {
            queue.push(seq, Input::new(Buttons(u16::MAX), Some(Vec2::splat(x))));
            assert_eq!(queue.take(), Some(down(Buttons::ALL)));
        }
    }
}
