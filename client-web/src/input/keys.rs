//! Combines keys, pointer and touches into [`Input`]s. Positions come in as fractions of the canvas and go out in world
//! units.

use crate::view::frame::View;
use jostle_game::{Buttons, Input};
use jostle_sim::Vec2;

/// The bits of the buttons that steer.
pub const DIRECTIONS: u16 = Buttons::UP.0 | Buttons::LEFT.0 | Buttons::DOWN.0 | Buttons::RIGHT.0;

/// Everything that is currently pressed.
#[derive(Debug, Default)]
pub struct Controls {
    /// Keys that are down, by code, with the buttons that each pressed. Two keys may press the same button, and a
    /// letter may change (Shift, another layout) before its key goes up.
    keys: Vec<(String, Buttons)>,
    /// Pointer buttons, on-screen buttons and the stick.
    pointed: Buttons,
    /// Buttons pressed on a gamepad, including by its sticks.
    pub pad: Buttons,
    /// Last pointer position as fractions of the canvas's width and height. Pixels would not work, because adaptive
    /// quality may change the canvas's resolution while the pointer rests.
    pointer: Option<Vec2>,
}

/// The position of a key (`KeyboardEvent.code`). Screen keyboards and remote desktops send none; then it is the position
/// that the key has on the US layout, according to its letter (`KeyboardEvent.key`).
pub fn place_of(code: String, letter: &str) -> String {
    if !code.is_empty() && code != "Unidentified" {
        return code;
    }
    let prefix = match letter.as_bytes() {
        b" " => return "Space".to_owned(),
        [b'a'..=b'z' | b'A'..=b'Z'] => "Key",
        [b'0'..=b'9'] => "Digit",
        _ => "",
    };
    match prefix {
        "" => letter.to_owned(),
        _ => prefix.to_owned() + &letter.to_ascii_uppercase(),
    }
}

impl Controls {
    /// Records that a key went down and presses these buttons.
    pub fn key_down(&mut self, place: &str, buttons: Buttons) {
        if !self.holds(place) {
            self.keys.push((place.to_owned(), buttons));
        }
    }

    /// Whether a key is down.
    pub fn holds(&self, place: &str) -> bool {
        self.keys.iter().any(|(code, _)| code == place)
    }

    /// Records that a key went up; `false` if it was not down.
    pub fn key_up(&mut self, place: &str) -> bool {
        let held = self.keys.iter().position(|(code, _)| code == place);
        held.map(|index| self.keys.swap_remove(index)).is_some()
    }

    /// Presses or releases buttons that do not come from keys.
    pub fn press(&mut self, buttons: Buttons, down: bool) {
        self.pointed.0 =
            if down { self.pointed.0 | buttons.0 } else { self.pointed.0 & !buttons.0 };
    }

    /// Sets the directions of the stick, replacing the previous ones.
    pub fn steer(&mut self, directions: Buttons) {
        self.pointed.0 = self.pointed.0 & !DIRECTIONS | directions.0 & DIRECTIONS;
    }

    /// Moves the pointer (fractions of the canvas, (0, 0) top left), or removes it from the view.
    pub fn point(&mut self, share: Option<Vec2>) {
        self.pointer = share;
    }

    /// The pointer's position as fractions of the canvas.
    pub fn pointed_at(&self) -> Option<Vec2> {
        self.pointer
    }

    /// Releases everything, because the page lost focus or a dialog opened.
    pub fn release(&mut self) {
        *self = Controls { pointer: self.pointer, ..Controls::default() };
    }

    /// All pressed buttons from every source.
    pub fn buttons(&self) -> Buttons {
        let keys = self.keys.iter().fold(0, |all, (_, buttons)| all | buttons.0);
        Buttons(keys | self.pointed.0 | self.pad.0)
    }

    /// The pointer's position in world units.
    pub fn pointer(&self, view: &View) -> Option<Vec2> {
        let pixels = Vec2::from(view.pixels.map(|pixels| pixels as f32));
        self.pointer.map(|share| view.to_world(share * pixels)).filter(|point| point.is_finite())
    }

    /// The player's input right now.
    pub fn input(&self, view: &View) -> Input {
        Input::new(self.buttons(), self.pointer(view))
    }
}

#[cfg(test)]
mod tests;
