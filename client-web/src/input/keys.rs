//! Keys, pointer and thumbs become [`Input`]s. Positions arrive as shares of the canvas and leave in
//! world units.

use crate::view::frame::View;
use jostle_game::{Buttons, Input};
use jostle_sim::Vec2;

/// Everything that is down now.
#[derive(Debug, Default)]
pub struct Controls {
    /// Keys that are down, by place, with what each pressed: two may press the same, and a letter
    /// may change (Shift, another layout) before its key goes up.
    keys: Vec<(String, Buttons)>,
    /// Pointer buttons, on-screen buttons and the stick.
    pointed: Buttons,
    /// Buttons and sticks of a gamepad.
    pub pad: Buttons,
    /// Last pointer position, as shares of the canvas's width and height: under a still pointer, the
    /// adaptive quality may give the canvas another number of pixels.
    pointer: Option<Vec2>,
}

impl Controls {
    /// The key at a place went down, and presses this.
    pub fn key_down(&mut self, place: &str, buttons: Buttons) {
        if !self.keys.iter().any(|(code, _)| code == place) {
            self.keys.push((place.to_owned(), buttons));
        }
    }

    /// It went up; `false` if it was not down.
    pub fn key_up(&mut self, place: &str) -> bool {
        let held = self.keys.iter().position(|(code, _)| code == place);
        held.map(|index| self.keys.swap_remove(index)).is_some()
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

    /// Moves the pointer (shares of the canvas, (0, 0) top left), or takes it out of the view.
    pub fn point(&mut self, share: Option<Vec2>) {
        self.pointer = share;
    }

    /// Where the pointer is, as shares of the canvas.
    pub fn pointed_at(&self) -> Option<Vec2> {
        self.pointer
    }

    /// Lets go of everything: the page lost the focus, or a dialogue opened.
    pub fn release(&mut self) {
        *self = Controls { pointer: self.pointer, ..Controls::default() };
    }

    /// Everything that is down, whichever way it was pressed.
    pub fn buttons(&self) -> Buttons {
        let keys = self.keys.iter().fold(0, |all, (_, buttons)| all | buttons.0);
        Buttons(keys | self.pointed.0 | self.pad.0)
    }

    /// The pointer in world units.
    pub fn pointer(&self, view: &View) -> Option<Vec2> {
        let pixels = Vec2::from(view.pixels.map(|pixels| pixels as f32));
        self.pointer.map(|share| view.to_world(share * pixels)).filter(|point| point.is_finite())
    }

    /// The intent of this moment.
    pub fn input(&self, view: &View) -> Input {
        Input::new(self.buttons(), self.pointer(view))
    }
}

#[cfg(test)]
mod tests;
