//! The player's input in a game: keys, pointer, fingers and gamepad, and the emote wheel that they control.

use crate::input::keys::Controls;
use crate::input::pad::PadInput;
use crate::input::touch::{Fingers, Touched};
use crate::page::emotes::{Wheel, sector};
use crate::page::event::{Key, Pointer, PointerChange};
use crate::page::tools;
use crate::view::frame::View;
use jostle_game::Scene;
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

/// Radius of the neutral area at the wheel's centre, as a share of the picture's smaller side.
const MIDDLE: f32 = 0.06;
/// Radius of the neutral area for a stick, whose range is 1.
const STICK_MIDDLE: f32 = 0.4;

/// Distance from the hero at full deflection of the right stick, as a share of the picture's height.
const AIM_REACH: f32 = 0.35;
/// Without a hero, the stick moves the pointer by at most this share of the picture's height per frame.
const POINTER_STEP: f32 = 0.02;

/// The effect of a key or a pointer on the wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WheelUse {
    /// The wheel is closed or does not react.
    Unused,
    Used,
    /// The wheel was closed and this emote is shown.
    Emote(u8),
}

/// Keys and buttons that are held in one game, and the pointer's position.
#[derive(Debug, Default)]
pub struct GameInput {
    /// Keys, pointer and touch controls.
    pub controls: Controls,
    pub fingers: Fingers,
    /// Source of the scene for which `fingers` was set up.
    touch_scene: Option<String>,
    /// The emote wheel while it is open.
    pub wheel: Option<Wheel>,
}

impl GameInput {
    /// Adopts the tools of a scene, unless it is the current one.
    pub fn adopt(&mut self, scene: &Scene) {
        if self.touch_scene.as_ref() != Some(&scene.source) {
            self.touch_scene = Some(scene.source.clone());
            self.fingers = tools::fingers(scene);
        }
    }

    /// Releases everything, so that no key sticks if its release is never seen.
    pub fn release(&mut self) {
        self.fingers.release();
        self.controls.release();
    }

    /// Handles a change in a finger's state.
    pub fn touch(&mut self, pointer: &Pointer) -> Touched {
        match pointer.change {
            PointerChange::Down => self.fingers.down(pointer.id, pointer.at, pointer.canvas),
            PointerChange::Moved => self.fingers.moved(pointer.id, pointer.at),
            PointerChange::Up => self.fingers.up(pointer.id),
            PointerChange::Left => Touched::Nothing,
        }
    }

    /// Moves the pointer to where the gamepad's stick points from the hero. Without a hero, the stick pushes the
    /// pointer along.
    pub fn aim(&mut self, view: &View, hero: Option<Vec2>, stick: Vec2) {
        if stick == Vec2::ZERO {
            return;
        }
        let pixels = Vec2::from(view.pixels.map(|pixels| pixels as f32)).max(Vec2::ONE);
        let at = match hero {
            Some(hero) => view.to_pixel(hero + stick * (AIM_REACH * view.height)) / pixels,
            None => {
                let step = stick * Vec2::new(pixels.y / pixels.x, -1.0) * POINTER_STEP;
                self.controls.pointed_at().unwrap_or(Vec2::splat(0.5)) + step
            }
        };
        self.controls.point(Some(at.clamp(Vec2::ZERO, Vec2::ONE)));
    }

    /// Opens the wheel if possible, or closes it.
    pub fn toggle_wheel(&mut self, may_open: bool) {
        let opens = self.wheel.is_none() && may_open;
        self.wheel = opens.then(Wheel::default);
    }

    /// Handles a key while the wheel is open. A digit picks an emote, and Escape closes the wheel.
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

    /// Handles the release of the key that opened the wheel, and returns the picked emote, if any. After a mere tap the
    /// wheel stays open.
    pub fn wheel_key_up(&mut self, code: &str) -> Option<u8> {
        let wheel = self.wheel.as_mut().filter(|wheel| wheel.key.as_deref() == Some(code))?;
        wheel.key = None;
        wheel.picked
    }

    /// Handles a pointer while the wheel is open. Moving it picks an emote, and pressing shows that emote.
    pub fn wheel_pointer(&mut self, pointer: &Pointer) -> WheelUse {
        let Some(wheel) = &mut self.wheel else { return WheelUse::Unused };
        let offset = pointer.at - 0.5 * pointer.canvas;
        wheel.picked = sector(offset, MIDDLE * pointer.canvas.min_element());
        match pointer.change {
            PointerChange::Down => {
                let picked = wheel.picked;
                self.close_wheel(picked)
            }
            // A button or finger that was down before the wheel opened is released.
            PointerChange::Up => WheelUse::Unused,
            PointerChange::Moved | PointerChange::Left => WheelUse::Used,
        }
    }

    /// While the gamepad holds the wheel open, the right stick picks an emote; releasing the button shows it.
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
