//! Mouse and fingers over the canvas.

use crate::input::stick;
use crate::input::touch::Touched;
use crate::page::app::App;
use crate::page::event::{Pointer, PointerChange};
use jostle_game::Buttons;

impl App {
    pub(super) fn pointer(&mut self, pointer: &Pointer) {
        // The first touch brings the stick and the tool buttons, also where a mouse is present.
        self.settings.touched |= pointer.touch && pointer.change == PointerChange::Down;
        self.screen.with_editor(&self.ctx, |screen, now_ms| screen.point(now_ms, pointer));
        if self.screen.game().is_none() {
            return;
        }
        let used = self.visit.wheel_pointer(pointer);
        if self.use_wheel(used) {
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
                self.screen.point(&mut self.ctx, Some(pointer));
                if matches!(pointer.button, 0 | 2) {
                    self.screen.press(&mut self.ctx, Buttons::FIRE, true);
                }
            }
            PointerChange::Moved => {
                self.screen.point(&mut self.ctx, Some(pointer));
                // A second button that goes down or up while one is held only shows up as a move.
                if pointer.button >= 0 {
                    self.screen.press(&mut self.ctx, Buttons::FIRE, pointer.pressed);
                }
            }
            PointerChange::Up => self.screen.press(&mut self.ctx, Buttons::FIRE, pointer.pressed),
            PointerChange::Left => {
                self.screen.press(&mut self.ctx, Buttons::FIRE, false);
                self.screen.point(&mut self.ctx, None);
            }
        }
    }

    fn touched(&mut self, touched: Touched, pointer: &Pointer) {
        match touched {
            Touched::Grip(_) | Touched::Loose => {
                self.screen.steer(&mut self.ctx, Buttons::default())
            }
            Touched::Lean(offset) => self.screen.steer(&mut self.ctx, stick::directions(offset)),
            Touched::Aim(buttons, down) => {
                self.screen.point(&mut self.ctx, Some(pointer));
                self.screen.press(&mut self.ctx, buttons, down);
            }
            Touched::Move => self.screen.point(&mut self.ctx, Some(pointer)),
            Touched::Nothing => {}
        }
    }

    /// Releases everything: no key may stick when its release is never seen.
    pub(super) fn release_input(&mut self) {
        self.visit.fingers.release();
        self.screen.with_game(&mut self.ctx, |game, ctx| {
            game.controls.release();
            game.send_due(ctx);
        });
    }
}
