//! The wheel of emotes under keys, pointers and gamepads.

use crate::input::pad::PadInput;
use crate::page::app::App;
use crate::page::emotes::{Wheel, sector};
use crate::page::event::{Key, Pointer, PointerChange};
use crate::page::layers::Layer;
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

/// Share of the picture's smaller side around the middle of the wheel within which nothing is picked.
const MIDDLE: f32 = 0.06;
/// The same for a stick, which is at most 1 from its middle.
const STICK_MIDDLE: f32 = 0.4;

impl App {
    /// Opens the wheel, or closes it.
    pub(super) fn toggle_wheel(&mut self) {
        let opens =
            self.visit.wheel.is_none() && self.screen.game().is_some() && self.top() == Layer::Page;
        self.visit.wheel = opens.then(Wheel::default);
    }

    /// Shows an emote, and closes the wheel.
    pub(super) fn emote(&mut self, emote: u8) {
        self.visit.wheel = None;
        if emote < EMOTES {
            self.screen.with_game(&mut self.ctx, |game, ctx| game.emote(ctx, emote));
        }
    }

    /// The key of the wheel went down.
    pub(super) fn hold_wheel(&mut self, key: &Key) {
        self.toggle_wheel();
        if let Some(wheel) = &mut self.visit.wheel {
            wheel.key = Some(key.code.clone());
        }
    }

    /// A key went down while the wheel is open: a number picks, Escape closes. `false` if it is neither.
    pub(super) fn wheel_key_down(&mut self, key: &Key) -> bool {
        if self.visit.wheel.is_none() || key.modified {
            return false;
        }
        let number = key.code.strip_prefix("Digit").or_else(|| key.code.strip_prefix("Numpad"));
        match number.and_then(|number| number.parse::<u8>().ok()) {
            Some(number @ 1..=EMOTES) => self.emote(number - 1),
            _ if key.code == "Escape" => self.visit.wheel = None,
            _ => return false,
        }
        true
    }

    /// The key of the wheel was let go: with something picked that is shown; after a tap the wheel stays open.
    pub(super) fn wheel_key_up(&mut self, code: &str) {
        let Some(wheel) = &mut self.visit.wheel else { return };
        if wheel.key.as_deref() == Some(code) {
            wheel.key = None;
            let picked = wheel.picked;
            picked.into_iter().for_each(|emote| self.emote(emote));
        }
    }

    /// A pointer picks while the wheel is open, and shows what it is pressed on. `false` without a wheel.
    pub(super) fn wheel_pointer(&mut self, pointer: &Pointer) -> bool {
        let Some(wheel) = &mut self.visit.wheel else { return false };
        let offset = pointer.at - 0.5 * pointer.canvas;
        wheel.picked = sector(offset, MIDDLE * pointer.canvas.min_element());
        if pointer.change == PointerChange::Down {
            match wheel.picked {
                Some(emote) => self.emote(emote),
                None => self.visit.wheel = None,
            }
        }
        // A button or finger that was down before comes up.
        pointer.change != PointerChange::Up
    }

    /// The gamepad opens the wheel, picks with the right stick, and shows that when its button is let go.
    pub(super) fn wheel_pad(&mut self, input: &PadInput, pressed: bool, released: bool) {
        if pressed {
            self.toggle_wheel();
            self.visit.wheel.iter_mut().for_each(|wheel| wheel.pad = true);
        }
        let Some(wheel) = self.visit.wheel.as_mut().filter(|wheel| wheel.pad) else { return };
        let picked = sector(input.aim * Vec2::new(1.0, -1.0), STICK_MIDDLE);
        wheel.picked = picked.or(wheel.picked);
        if released {
            match wheel.picked {
                Some(emote) => self.emote(emote),
                None => self.visit.wheel = None,
            }
        }
    }
}
