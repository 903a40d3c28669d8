//! The wheel of emotes under keys, pointers and gamepads.

use crate::input::pad::PadInput;
use crate::page::app::Visit;
use crate::page::emotes::{Wheel, sector};
use crate::page::event::{Key, Pointer, PointerChange};
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

/// Share of the picture's smaller side around the middle of the wheel within which nothing is picked.
const MIDDLE: f32 = 0.06;
/// The same for a stick, which is at most 1 from its middle.
const STICK_MIDDLE: f32 = 0.4;

/// The meaning of a key or a pointer to the wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WheelUse {
    /// Nothing: there is none, or it has no use for it.
    Unused,
    Used,
    /// It shows an emote; the wheel is closed.
    Emote(u8),
}

impl Visit {
    /// Opens the wheel where that is possible, or closes it.
    pub fn toggle_wheel(&mut self, may_open: bool) {
        let opens = self.wheel.is_none() && may_open;
        self.wheel = opens.then(Wheel::default);
    }

    /// A key went down while the wheel is open: a number picks, Escape closes.
    pub fn wheel_key_down(&mut self, key: &Key) -> WheelUse {
        if self.wheel.is_none() || key.modified {
            return WheelUse::Unused;
        }
        let number = key.code.strip_prefix("Digit").or_else(|| key.code.strip_prefix("Numpad"));
        let emote = match number.and_then(|number| number.parse::<u8>().ok()) {
            Some(number @ 1..=EMOTES) => Some(number - 1),
            _ if key.code == "Escape" => None,
            _ => return WheelUse::Unused,
        };
        self.close_wheel(emote)
    }

    /// The key of the wheel was let go: with something picked that is shown; after a tap the wheel stays open.
    pub fn wheel_key_up(&mut self, code: &str) -> Option<u8> {
        let wheel = self.wheel.as_mut().filter(|wheel| wheel.key.as_deref() == Some(code))?;
        wheel.key = None;
        wheel.picked
    }

    /// A pointer picks while the wheel is open, and shows what it is pressed on.
    pub fn wheel_pointer(&mut self, pointer: &Pointer) -> WheelUse {
        let Some(wheel) = &mut self.wheel else { return WheelUse::Unused };
        let offset = pointer.at - 0.5 * pointer.canvas;
        wheel.picked = sector(offset, MIDDLE * pointer.canvas.min_element());
        match pointer.change {
            PointerChange::Down => {
                let picked = wheel.picked;
                self.close_wheel(picked)
            }
            // A button or finger that was down before comes up.
            PointerChange::Up => WheelUse::Unused,
            PointerChange::Moved | PointerChange::Left => WheelUse::Used,
        }
    }

    /// The gamepad picks with the right stick while it holds the wheel, and shows that when its button is let go.
    pub fn wheel_pad(&mut self, input: &PadInput, released: bool) -> WheelUse {
        let Some(wheel) = self.wheel.as_mut().filter(|wheel| wheel.pad) else {
            return WheelUse::Unused;
        };
        let picked = sector(input.aim * Vec2::new(1.0, -1.0), STICK_MIDDLE);
        wheel.picked = picked.or(wheel.picked);
        let picked = wheel.picked;
        if released { self.close_wheel(picked) } else { WheelUse::Used }
    }

    fn close_wheel(&mut self, emote: Option<u8>) -> WheelUse {
        self.wheel = None;
        emote.map_or(WheelUse::Used, WheelUse::Emote)
    }
}
