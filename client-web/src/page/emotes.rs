//! Emotes: the wheel they are picked from, and those that players show.

use crate::input::pad::PadInput;
use crate::page::app::App;
use crate::page::event::{Key, Pointer, PointerChange};
use crate::page::layers::Layer;
use jostle_game::Seat;
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

/// An emote is shown for this long, milliseconds.
pub const SHOWN_MS: f64 = 2000.0;
/// Share of the picture's smaller side around the middle of the wheel within which nothing is picked.
const MIDDLE: f32 = 0.06;
/// The same for a stick, which is at most 1 from its middle.
const STICK_MIDDLE: f32 = 0.4;

/// An emote over a hero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownEmote {
    pub seat: Seat,
    /// Below [`EMOTES`].
    pub emote: u8,
    pub since_ms: f64,
}

/// Emotes on display, at most one a seat.
#[derive(Debug, Default)]
pub struct ShownEmotes(Vec<ShownEmote>);

impl ShownEmotes {
    /// A player shows an emote, in place of any earlier one.
    pub fn show(&mut self, now_ms: f64, seat: Seat, emote: u8) {
        self.0.retain(|shown| shown.seat != seat);
        self.0.push(ShownEmote { seat, emote, since_ms: now_ms });
    }

    /// Those that are on display now, the newest last.
    pub fn at(&self, now_ms: f64) -> impl Iterator<Item = &ShownEmote> {
        self.0.iter().filter(move |shown| now_ms - shown.since_ms < SHOWN_MS)
    }
}

/// The open wheel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wheel {
    /// The emote under the pointer or the stick.
    pub picked: Option<u8>,
    /// The place of the key that is held for it, and whether a button of the gamepad is.
    key: Option<String>,
    pad: bool,
}

/// The emote in a direction from the middle, y down; the first is at the top, the others follow clockwise.
pub fn sector(offset: Vec2, middle: f32) -> Option<u8> {
    if offset.length() <= middle {
        return None;
    }
    let turns = offset.x.atan2(-offset.y) / std::f32::consts::TAU;
    Some((turns * f32::from(EMOTES)).round().rem_euclid(f32::from(EMOTES)) as u8 % EMOTES)
}

impl App {
    /// Opens the wheel, or closes it.
    pub(super) fn toggle_wheel(&mut self) {
        let opens = self.wheel.is_none() && self.game().is_some() && self.top() == Layer::Page;
        self.wheel = opens.then(Wheel::default);
    }

    /// Shows an emote, and closes the wheel.
    pub(super) fn emote(&mut self, emote: u8) {
        self.wheel = None;
        if emote < EMOTES {
            self.with_game(|game, ctx| game.emote(ctx, emote));
        }
    }

    /// The key of the wheel went down.
    pub(super) fn hold_wheel(&mut self, key: &Key) {
        self.toggle_wheel();
        if let Some(wheel) = &mut self.wheel {
            wheel.key = Some(key.code.clone());
        }
    }

    /// A key went down while the wheel is open: a number picks, Escape closes. `false` if it is neither.
    pub(super) fn wheel_key_down(&mut self, key: &Key) -> bool {
        if self.wheel.is_none() || key.modified {
            return false;
        }
        let number = key.code.strip_prefix("Digit").or_else(|| key.code.strip_prefix("Numpad"));
        match number.and_then(|number| number.parse::<u8>().ok()) {
            Some(number @ 1..=EMOTES) => self.emote(number - 1),
            _ if key.code == "Escape" => self.wheel = None,
            _ => return false,
        }
        true
    }

    /// The key of the wheel was let go: with something picked that is shown; after a tap the wheel stays open.
    pub(super) fn wheel_key_up(&mut self, code: &str) {
        let Some(wheel) = &mut self.wheel else { return };
        if wheel.key.as_deref() == Some(code) {
            wheel.key = None;
            let picked = wheel.picked;
            picked.into_iter().for_each(|emote| self.emote(emote));
        }
    }

    /// A pointer picks while the wheel is open, and shows what it is pressed on. `false` without a wheel.
    pub(super) fn wheel_pointer(&mut self, pointer: &Pointer) -> bool {
        let Some(wheel) = &mut self.wheel else { return false };
        let offset = pointer.at - 0.5 * pointer.canvas;
        wheel.picked = sector(offset, MIDDLE * pointer.canvas.min_element());
        if pointer.change == PointerChange::Down {
            match wheel.picked {
                Some(emote) => self.emote(emote),
                None => self.wheel = None,
            }
        }
        true
    }

    /// The gamepad opens the wheel, picks with the right stick, and shows that when its button is let go.
    pub(super) fn wheel_pad(&mut self, input: &PadInput, pressed: bool, released: bool) {
        if pressed {
            self.toggle_wheel();
            self.wheel.iter_mut().for_each(|wheel| wheel.pad = true);
        }
        let Some(wheel) = self.wheel.as_mut().filter(|wheel| wheel.pad) else { return };
        let picked = sector(input.aim * Vec2::new(1.0, -1.0), STICK_MIDDLE);
        wheel.picked = picked.or(wheel.picked);
        if released {
            match wheel.picked {
                Some(emote) => self.emote(emote),
                None => self.wheel = None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheel_begins_at_the_top_and_goes_clockwise() {
        let picked = |x, y| sector(Vec2::new(x, y), 10.0);
        assert_eq!(picked(0.0, -50.0), Some(0));
        assert_eq!(picked(40.0, -40.0), Some(1));
        assert_eq!(picked(50.0, 1.0), Some(2));
        assert_eq!(picked(0.0, 50.0), Some(4));
        assert_eq!(picked(-50.0, 0.0), Some(6));
        assert_eq!(picked(-30.0, -30.0), Some(7));
        assert_eq!(picked(-1.0, -50.0), Some(0), "the seam is within the first");
        assert_eq!(picked(7.0, 7.0), None);
    }

    #[test]
    fn an_emote_is_shown_for_two_seconds_or_until_the_next() {
        let mut shown = ShownEmotes::default();
        shown.show(0.0, Seat(1), 3);
        shown.show(500.0, Seat(2), 4);
        shown.show(1000.0, Seat(1), 5);
        let at = |now_ms| shown.at(now_ms).map(|s| (s.seat.0, s.emote)).collect::<Vec<_>>();
        assert_eq!(at(1000.0), [(2, 4), (1, 5)]);
        assert_eq!(at(2600.0), [(1, 5)]);
        assert_eq!(at(3000.0), []);
    }
}
