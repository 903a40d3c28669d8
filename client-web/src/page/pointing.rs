//! Mouse and fingers over the canvas.

use crate::input::stick;
use crate::input::touch::Touched;
use crate::page::app::App;
use crate::page::event::{Pointer, PointerChange};
use jostle_game::Buttons;
use jostle_sim::Vec2;

impl App {
    pub(super) fn pointer(&mut self, pointer: &Pointer) {
        // The first touch brings the stick and the tool buttons, also where a mouse is present.
        self.settings.touched |= pointer.touch && pointer.change == PointerChange::Down;
        self.with_editor(|screen, now_ms| screen.point(now_ms, pointer));
        if self.game().is_none() || self.wheel_pointer(pointer) {
            return;
        }
        if pointer.touch {
            let touched = match pointer.change {
                PointerChange::Down => {
                    self.visit.fingers.down(pointer.id, pointer.at, pointer.canvas)
                }
                PointerChange::Moved => self.visit.fingers.moved(pointer.id, pointer.at),
                PointerChange::Up => self.visit.fingers.up(pointer.id),
                PointerChange::Left => Touched::Nothing,
            };
            return self.touched(touched, pointer);
        }
        match pointer.change {
            PointerChange::Down => {
                self.point(Some(pointer));
                if matches!(pointer.button, 0 | 2) {
                    self.press(Buttons::FIRE, true);
                }
            }
            PointerChange::Moved => {
                self.point(Some(pointer));
                // A second button that goes down or up while one is held only shows up as a move.
                if pointer.button >= 0 {
                    self.press(Buttons::FIRE, pointer.pressed);
                }
            }
            PointerChange::Up => self.press(Buttons::FIRE, pointer.pressed),
            PointerChange::Left => {
                self.press(Buttons::FIRE, false);
                self.point(None);
            }
        }
    }

    fn touched(&mut self, touched: Touched, pointer: &Pointer) {
        match touched {
            Touched::Grip(_) | Touched::Loose => self.steer(Buttons::default()),
            Touched::Lean(offset) => self.steer(stick::directions(offset)),
            Touched::Aim(buttons, down) => {
                self.point(Some(pointer));
                self.press(buttons, down);
            }
            Touched::Move => self.point(Some(pointer)),
            Touched::Nothing => {}
        }
    }

    /// Presses or releases buttons that are not keys, and sends that at once.
    pub(super) fn press(&mut self, buttons: Buttons, down: bool) {
        self.with_game(|game, ctx| {
            game.controls.press(buttons, down);
            game.send_due(ctx);
        });
    }

    /// Releases everything: no key may stick when its release is never seen.
    pub(super) fn release_input(&mut self) {
        self.visit.fingers.release();
        self.with_game(|game, ctx| {
            game.controls.release();
            game.send_due(ctx);
        });
    }

    fn steer(&mut self, directions: Buttons) {
        self.with_game(|game, ctx| {
            game.controls.steer(directions);
            game.send_due(ctx);
        });
    }

    fn point(&mut self, pointer: Option<&Pointer>) {
        let share =
            |pointer: &Pointer| pointer.at / pointer.canvas.max(Vec2::splat(f32::MIN_POSITIVE));
        self.with_game(|game, ctx| {
            game.controls.point(pointer.map(share));
            game.send_due(ctx);
        });
    }
}
