//! Keys, pointer and thumbs become [`Input`]s: what is down now, and a queue that sends every
//! change once. Keys leave at once; what can wait leaves when no other input is played in the same
//! tick, so that none waits at the server. Positions arrive in device pixels and leave in world units.

use crate::frame::View;
use jostle_sim::{Buttons, Input, Vec2};
use std::collections::VecDeque;

/// Keys by their place on the keyboard (`KeyboardEvent.code`): the hand finds them.
pub const PLACES: [(&str, Buttons); 9] = [
    ("KeyW", Buttons::UP),
    ("ArrowUp", Buttons::UP),
    ("Space", Buttons::UP),
    ("KeyA", Buttons::LEFT),
    ("ArrowLeft", Buttons::LEFT),
    ("KeyS", Buttons::DOWN),
    ("ArrowDown", Buttons::DOWN),
    ("KeyD", Buttons::RIGHT),
    ("ArrowRight", Buttons::RIGHT),
];
/// Keys by their letter (`KeyboardEvent.key`), which the page prints: the eye finds them. Each with
/// its place on the keyboard of the United States, for keyboards that lack the letter.
pub const LETTERS: [(&str, &str, Buttons); 7] = [
    ("z", "KeyZ", Buttons::MAKE),
    ("x", "KeyX", Buttons::HOLD),
    ("c", "KeyC", Buttons::AGITATE),
    ("v", "KeyV", Buttons::CLEAR),
    ("h", "KeyH", Buttons::PICK_HERO),
    ("m", "KeyM", Buttons::PICK_MINION),
    ("p", "KeyP", Buttons::PICK_PLATFORM),
];

/// What the key at a place with a letter on it stands for. Where they disagree the places to steer
/// win, then letters: a French keyboard has Z where the hand steers up, and its W makes instead.
pub fn meaning(place: &str, letter: &str) -> Option<Buttons> {
    let letter = letter.to_lowercase();
    let steers = PLACES.iter().find(|(code, _)| *code == place).map(|(_, button)| *button);
    let named = || LETTERS.iter().find(|(key, ..)| *key == letter).map(|(.., button)| *button);
    let instead = || LETTERS.iter().find(|(_, code, _)| *code == place).map(|(.., b)| *b);
    steers.or_else(named).or_else(instead)
}

/// Inputs a second, the server plays one a tick.
const RATE_HZ: f64 = 60.0;
/// Inputs that may leave at once after a pause: a press, its release and a move.
const BURST: f64 = 3.0;
/// Inputs that wait when changes come faster than ticks; the oldest moves go first.
const WAITING_MAX: usize = 8;
/// Without a change the input is repeated so often, so that the server knows that it still holds.
const REPEAT_MS: f64 = 80.0;

/// After so long something is sent whatever is booked: the server would let go of all keys.
const OVERDUE_MS: f64 = 160.0;
/// What can wait leaves in this share of a tick or later if another one is played in the tick before:
/// one that arrives a little sooner than expected is not to meet that.
const PHASE_MIN: f64 = 0.25;
/// Ticks that may be booked ahead; more is an error.
const BOOKED_AHEAD_MAX: u32 = 90;

/// What is down now.
#[derive(Debug, Default)]
pub struct Controls {
    /// Keys that are down, by place, with what each pressed: two may press the same, and a letter
    /// may change (Shift, another layout) before its key goes up.
    keys: Vec<(String, Buttons)>,
    /// Pointer buttons, on-screen buttons and the stick.
    pointed: Buttons,
    /// Last pointer position, device pixels.
    pointer: Option<Vec2>,
}

impl Controls {
    /// A key went down or up; `false` if it means nothing here.
    pub fn key(&mut self, place: &str, letter: &str, down: bool) -> bool {
        let held = self.keys.iter().position(|(code, _)| code == place);
        if !down {
            return held.map(|index| self.keys.swap_remove(index)).is_some();
        }
        let Some(buttons) = meaning(place, letter) else { return false };
        if held.is_none() {
            self.keys.push((place.to_owned(), buttons));
        }
        true
    }

    /// Sets or clears buttons that are not keys.
    pub fn press(&mut self, buttons: Buttons, down: bool) {
        self.pointed.0 =
            if down { self.pointed.0 | buttons.0 } else { self.pointed.0 & !buttons.0 };
    }

    /// The stick's four directions, replacing its last ones.
    pub fn steer(&mut self, directions: Buttons) {
        let all = Buttons::UP.0 | Buttons::LEFT.0 | Buttons::DOWN.0 | Buttons::RIGHT.0;
        self.pointed.0 = self.pointed.0 & !all | directions.0 & all;
    }

    /// Moves the pointer (device pixels), or takes it out of the view.
    pub fn point(&mut self, pixel: Option<Vec2>) {
        self.pointer = pixel;
    }

    /// Lets go of everything: the page lost the focus, or a dialogue opened.
    pub fn release(&mut self) {
        *self = Controls { pointer: self.pointer, ..Controls::default() };
    }

    /// Everything that is down, whichever way it was pressed.
    pub fn buttons(&self) -> Buttons {
        let keys = self.keys.iter().fold(0, |all, (_, buttons)| all | buttons.0);
        Buttons(keys | self.pointed.0)
    }

    /// The pointer in world units.
    pub fn pointer(&self, view: &View) -> Option<Vec2> {
        self.pointer.map(|pixel| view.to_world(pixel)).filter(|point| point.is_finite())
    }

    /// The intent of this moment.
    pub fn input(&self, view: &View) -> Input {
        Input { buttons: self.buttons(), pointer: self.pointer(view) }
    }
}

/// Inputs on their way out.
#[derive(Debug)]
pub struct Outflow {
    waiting: VecDeque<Input>,
    last: Option<Input>,
    sent_ms: f64,
    allowance: f64,
    refilled_ms: f64,
    seq: u32,
    /// The last tick in which something is played that was sent.
    booked: u32,
}

impl Default for Outflow {
    fn default() -> Outflow {
        Outflow {
            waiting: VecDeque::new(),
            last: None,
            sent_ms: f64::NEG_INFINITY,
            allowance: BURST,
            refilled_ms: 0.0,
            seq: 0,
            booked: 0,
        }
    }
}

impl Outflow {
    /// Notes the intent of this moment. A change of buttons is kept, so that a tap shorter than a
    /// tick still counts; a mere move gives way to whatever comes after it.
    pub fn note(&mut self, input: Input) {
        if self.ends_in_a_move() {
            self.waiting.pop_back();
        }
        if let Some(newest) = self.waiting.back_mut()
            && newest.buttons == input.buttons
        {
            *newest = input;
            return;
        }
        if self.waiting.is_empty() && self.last == Some(input) {
            return;
        }
        if self.waiting.len() == WAITING_MAX {
            self.waiting.pop_front();
        }
        self.waiting.push_back(input);
    }

    /// Whether the newest input that waits changes no button.
    fn ends_in_a_move(&self) -> bool {
        let before = match self.waiting.len() {
            0 => return false,
            1 => self.last,
            count => self.waiting.get(count - 2).copied(),
        };
        let newest = self.waiting.back();
        before.zip(newest).is_some_and(|(before, newest)| before.buttons == newest.buttons)
    }

    /// The next input to send at `now_ms` with its sequence number, if one is due. It would be played
    /// in the first tick after `moment`. Call until `None`.
    pub fn due(&mut self, now_ms: f64, moment: f64) -> Option<(u32, Input)> {
        self.refill(now_ms);
        let tick = moment.max(0.0) as u32 + 1;
        if self.booked > tick + BOOKED_AHEAD_MAX {
            // The ticks are others: another session, or a guess before the first snapshot.
            self.booked = 0;
        }
        let repeat = self.last.filter(|_| now_ms - self.sent_ms >= REPEAT_MS);
        let input = self.waiting.front().copied().or(repeat)?;
        let urgent = self.last.is_none_or(|last| last.buttons != input.buttons);
        let overdue = now_ms - self.sent_ms >= OVERDUE_MS;
        // Frames may keep one phase for seconds: where the tick before is free too, it may be met.
        let ahead = tick.saturating_sub(self.booked);
        let fits = overdue || ahead > 1 || ahead == 1 && moment.rem_euclid(1.0) >= PHASE_MIN;
        if self.allowance < 1.0 || !(urgent || fits) {
            return None;
        }
        self.waiting.pop_front();
        self.booked = tick.max(self.booked + 1);
        self.allowance -= 1.0;
        self.sent_ms = now_ms;
        self.last = Some(input);
        self.seq += 1;
        Some((self.seq, input))
    }

    /// What was sent is played later than was thought: up to this tick.
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
