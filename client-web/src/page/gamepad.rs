//! Playing by gamepad: what it presses, where its right stick points, and what it asks of the page.

use crate::input::action::Action;
use crate::input::pad::{self, PadInput, PadState};
use crate::page::app::App;
use crate::page::dialogs::Layer;
use crate::page::game::GameScreen;
use jostle_game::Buttons;
use jostle_sim::Vec2;

/// The right stick aims as far as this share of the picture's height from the hero.
const AIM_REACH: f32 = 0.35;
/// Without a hero it moves the pointer by at most this share of the picture's height a frame.
const POINTER_STEP: f32 = 0.02;

impl App {
    pub(super) fn play_by_pad(&mut self, state: &PadState) {
        let input = pad::read(state, &self.settings.pad);
        let before = std::mem::replace(&mut self.settings.pad_actions, input.actions);
        let is_free = self.top() == Layer::Page;
        // The right stick picks then.
        let picks = self.visit.wheel.is_some();
        self.screen.with_game(&mut self.ctx, |game, ctx| {
            game.controls.pad = if is_free { input.buttons } else { Buttons::default() };
            if is_free && !picks {
                aim(game, &input);
            }
            game.send_due(ctx);
        });
        if is_free {
            let is_in = |actions: u32, action: Action| actions >> action as u32 & 1 == 1;
            let pressed = input.actions & !before;
            let released = is_in(before & !input.actions, Action::Emote);
            if is_in(pressed, Action::Emote) {
                self.toggle_wheel();
                self.visit.wheel.iter_mut().for_each(|wheel| wheel.pad = true);
            }
            let used = self.visit.wheel_pad(&input, released);
            self.use_wheel(used);
            self.press_on_pad(pressed);
        }
    }

    /// Does what concerns the page alone, once a press.
    fn press_on_pad(&mut self, pressed: u32) {
        let is_pressed = |action: Action| pressed >> action as u32 & 1 == 1;
        if is_pressed(Action::Mute) {
            self.sound.toggle_mute(&mut self.ctx);
        }
        if is_pressed(Action::FullScreen) {
            self.settings.toggle_full_screen(&mut self.ctx);
        }
        if is_pressed(Action::Clip) {
            self.screen.with_game(&mut self.ctx, |game, ctx| game.connection.keep_clip(ctx));
        }
        if is_pressed(Action::Again) && self.screen.is_round_over() {
            self.go_on();
        }
    }
}

/// Moves the pointer to where the stick points from the hero, or by the stick where there is none.
fn aim(game: &mut GameScreen, input: &PadInput) {
    if input.aim == Vec2::ZERO {
        return;
    }
    let view = *game.view();
    let pixels = Vec2::from(view.pixels.map(|pixels| pixels as f32)).max(Vec2::ONE);
    let hero = game.replica().and_then(|replica| replica.own_hero()).map(|hero| hero.center);
    let at = match (hero, game.controls.pointed_at()) {
        (Some(hero), _) => view.to_pixel(hero + input.aim * (AIM_REACH * view.height)) / pixels,
        (None, pointed) => {
            let step = input.aim * Vec2::new(pixels.y / pixels.x, -1.0) * POINTER_STEP;
            pointed.unwrap_or(Vec2::splat(0.5)) + step
        }
    };
    game.controls.point(Some(at.clamp(Vec2::ZERO, Vec2::ONE)));
}
