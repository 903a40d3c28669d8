//! Keys, pointer and thumbs become [`Input`]s. Positions arrive as shares of the canvas and leave in
//! world units.

use crate::view::frame::View;
use jostle_game::{Buttons, Input};
use jostle_sim::Vec2;

/// Keys by their position on the keyboard (`KeyboardEvent.code`), the same on every layout.
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
/// Keys by their letter (`KeyboardEvent.key`), as the page prints it. Each with its position on the
/// keyboard of the United States, for keyboards that lack the letter.
pub const LETTERS: [(&str, &str, Buttons); 8] = [
    ("z", "KeyZ", Buttons::MAKE),
    ("x", "KeyX", Buttons::HOLD),
    ("c", "KeyC", Buttons::AGITATE),
    ("v", "KeyV", Buttons::CLEAR),
    ("h", "KeyH", Buttons::PICK_HERO),
    ("m", "KeyM", Buttons::PICK_MINION),
    ("p", "KeyP", Buttons::PICK_PLATFORM),
    ("t", "KeyT", Buttons::TEAM),
];

/// The button of the key at a place with a letter on it. Where they disagree the places to steer
/// win, then letters: a French keyboard has Z where the hand steers up, and its W makes instead.
pub fn meaning(place: &str, letter: &str) -> Option<Buttons> {
    let letter = letter.to_lowercase();
    let steers = PLACES.iter().find(|(code, _)| *code == place).map(|(_, button)| *button);
    let named = || LETTERS.iter().find(|(key, ..)| *key == letter).map(|(.., button)| *button);
    let instead = || LETTERS.iter().find(|(_, code, _)| *code == place).map(|(.., b)| *b);
    steers.or_else(named).or_else(instead)
}

/// Everything that is down now.
#[derive(Debug, Default)]
pub struct Controls {
    /// Keys that are down, by place, with what each pressed: two may press the same, and a letter
    /// may change (Shift, another layout) before its key goes up.
    keys: Vec<(String, Buttons)>,
    /// Pointer buttons, on-screen buttons and the stick.
    pointed: Buttons,
    /// Last pointer position, as shares of the canvas's width and height: under a still pointer, the
    /// adaptive quality may give the canvas another number of pixels.
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

    /// Moves the pointer (shares of the canvas, (0, 0) top left), or takes it out of the view.
    pub fn point(&mut self, share: Option<Vec2>) {
        self.pointer = share;
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
        let pixels = Vec2::from(view.pixels.map(|pixels| pixels as f32));
        self.pointer.map(|share| view.to_world(share * pixels)).filter(|point| point.is_finite())
    }

    /// The intent of this moment.
    pub fn input(&self, view: &View) -> Input {
        Input { buttons: self.buttons(), pointer: self.pointer(view) }
    }
}

#[cfg(test)]
mod tests;
