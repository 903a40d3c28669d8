//! Handles keys, the pointer, gamepads and the page's buttons during a game.

use super::GameScreen;
use super::input::WheelUse;
use crate::input::action::Action;
use crate::input::bindings::Bindings;
use crate::input::keys::DIRECTIONS;
use crate::input::pad::PadInput;
use crate::input::stick;
use crate::input::touch::Touched;
use crate::page::context::Context;
use crate::page::dialogs::Layer;
use crate::page::event::{Focus, Key, Pointer, PointerChange};
use crate::page::page_action::{KeyUse, PageAction};
use crate::world::replica::Replica;
use jostle_game::{Buttons, Seat, Tools};
use jostle_protocol::limits::EMOTES;
use jostle_sim::Vec2;

impl GameScreen {
    /// Performs the action of a button.
    pub fn click(&mut self, ctx: &mut Context, action: PageAction, value: &str) {
        match action {
            // Requests the next round, until it begins.
            PageAction::Again => self.press(ctx, Buttons::AGAIN, true),
            PageAction::Bounds => self.view.bounds_toggled = !self.view.bounds_toggled,
            PageAction::Clip => self.connection.keep_clip(ctx),
            PageAction::Emote => value.parse().into_iter().for_each(|emote| self.emote(ctx, emote)),
            PageAction::Follow => self.follow_player(value.parse().ok().map(Seat)),
            PageAction::Highlights => self.toggle_highlights(ctx),
            PageAction::SwitchTeam => {
                self.press(ctx, Buttons::TEAM, true);
                self.press(ctx, Buttons::TEAM, false);
            }
            _ => {}
        }
    }

    pub fn key_down(
        &mut self,
        ctx: &mut Context,
        keys: &Bindings,
        top: Layer,
        key: &Key,
    ) -> KeyUse {
        // Input fields do not use function keys.
        let is_function = matches!(key.code.as_str(), "F2" | "F3" | "F4");
        if key.focus == Focus::Field && !is_function {
            return KeyUse::Unused;
        }
        // While Ctrl, Alt or Meta is held, the system may swallow the release of other keys. A tap on Ctrl or Alt alone
        // swallows nothing, and neither does a key that only repeats what it already does.
        if key.modified {
            if key.repeat && self.input.controls.holds(&key.code) {
                return KeyUse::Used;
            }
            if key.letter == "Meta" || !key.is_modifier() {
                self.release_input(ctx);
            }
            return KeyUse::Unused;
        }
        let used = self.input.wheel_key_down(key);
        if self.use_wheel(ctx, used) {
            return KeyUse::Used;
        }
        if top == Layer::Page && keys.actions(&key.code, &key.letter).contains(&Action::Emote) {
            if !key.repeat {
                self.input.toggle_wheel(true);
                let wheel = self.input.wheel.iter_mut();
                wheel.for_each(|wheel| wheel.key = Some(key.code.clone()));
            }
            return KeyUse::Used;
        }
        if let Some(action) = self.action_of(keys, top, key) {
            return if key.repeat { KeyUse::Used } else { KeyUse::Action(action) };
        }
        let presses_button =
            key.focus == Focus::Button && matches!(key.code.as_str(), "Space" | "Enter");
        let may_be_world = !presses_button && top == Layer::Page;
        KeyUse::when(may_be_world && self.world_key_down(ctx, keys, key))
    }

    /// The page action that a key triggers, if any.
    fn action_of(&self, keys: &Bindings, top: Layer, key: &Key) -> Option<PageAction> {
        let actions = keys.actions(&key.code, &key.letter);
        let is_for = |action| top == Layer::Page && actions.contains(&action);
        // In scenes in which the player selects bodies, M selects a minion.
        let selects = |replica: &Replica| replica.room.scene.tools.contains(Tools::SELECT);
        Some(match (key.code.as_str(), key.letter.as_str(), top) {
            _ if is_for(Action::Again) && key.focus != Focus::Button && self.is_round_over() => {
                PageAction::Again
            }
            _ if is_for(Action::Edit) && self.is_in_page() => PageAction::EditToggle,
            _ if is_for(Action::Clip) => PageAction::Clip,
            (_, "h" | "H", Layer::Page) if self.watches() => PageAction::Clean,
            ("Escape", _, Layer::Page) if self.shows_asked() => PageAction::Highlights,
            _ if is_for(Action::FullScreen) => PageAction::FullScreen,
            _ if is_for(Action::Mute) && !self.replica().is_some_and(selects) => PageAction::Mute,
            ("F2", ..) => PageAction::Bounds,
            ("F3", ..) => PageAction::Figures,
            ("F4", ..) => PageAction::Network,
            (_, "?", _) | ("Escape", _, Layer::Help) => PageAction::Help,
            ("Escape", _, Layer::Ask) => PageAction::Cancel,
            _ => return None,
        })
    }

    /// Presses the game buttons of a key; `false` if it has none. For a spectator, a digit follows the player with that
    /// rank in the list.
    fn world_key_down(&mut self, ctx: &mut Context, keys: &Bindings, key: &Key) -> bool {
        if self.watches() {
            let Ok(number) = key.letter.parse::<usize>() else { return false };
            let ranking = self.replica().map_or(Vec::new(), |replica| replica.room.ranking());
            let seat = number.checked_sub(1).and_then(|index| ranking.get(index));
            let seat = seat.map(|player| player.seat);
            if !key.repeat {
                self.follow_player(seat);
            }
            return true;
        }
        let buttons = keys.buttons(&key.code, &key.letter);
        let known = buttons.0 != 0;
        // A key that is still held when the page gets it back steers again.
        if known && (!key.repeat || buttons.0 & !DIRECTIONS == 0) {
            self.input.controls.key_down(&key.code, buttons);
            self.send_due(ctx);
        }
        known
    }

    pub fn key_up(&mut self, ctx: &mut Context, place: &str) {
        if let Some(emote) = self.input.wheel_key_up(place) {
            self.emote(ctx, emote);
        }
        self.input.controls.key_up(place);
        self.send_due(ctx);
    }

    /// Handles a change in the state of the mouse or a finger over the canvas.
    pub fn point(&mut self, ctx: &mut Context, pointer: &Pointer) {
        let used = self.input.wheel_pointer(pointer);
        if self.use_wheel(ctx, used) {
            return;
        }
        if pointer.touch {
            let touched = self.input.touch(pointer);
            return self.touched(ctx, touched, pointer);
        }
        match pointer.change {
            PointerChange::Down => {
                self.point_at(ctx, Some(pointer));
                if matches!(pointer.button, 0 | 2) {
                    self.press(ctx, Buttons::FIRE, true);
                }
            }
            PointerChange::Moved => {
                self.point_at(ctx, Some(pointer));
                // If another button changes while one is held, the browser reports only a move.
                if pointer.button >= 0 {
                    self.press(ctx, Buttons::FIRE, pointer.pressed);
                }
            }
            PointerChange::Up => self.press(ctx, Buttons::FIRE, pointer.pressed),
            PointerChange::Left => {
                self.press(ctx, Buttons::FIRE, false);
                self.point_at(ctx, None);
            }
        }
    }

    fn touched(&mut self, ctx: &mut Context, touched: Touched, pointer: &Pointer) {
        match touched {
            Touched::Grip(_) | Touched::Loose => self.steer(ctx, Buttons::default()),
            Touched::Lean(offset) => self.steer(ctx, stick::directions(offset)),
            Touched::Aim(buttons, down) => {
                self.point_at(ctx, Some(pointer));
                self.press(ctx, buttons, down);
            }
            Touched::Move => self.point_at(ctx, Some(pointer)),
            Touched::Nothing => {}
        }
    }

    fn point_at(&mut self, ctx: &mut Context, pointer: Option<&Pointer>) {
        let share =
            |pointer: &Pointer| pointer.at / pointer.canvas.max(Vec2::splat(f32::MIN_POSITIVE));
        self.input.controls.point(pointer.map(share));
        self.send_due(ctx);
    }

    /// Steers with the thumb stick.
    fn steer(&mut self, ctx: &mut Context, directions: Buttons) {
        self.input.controls.steer(directions);
        self.send_due(ctx);
    }

    /// Presses or releases buttons that do not come from keys, and sends the change immediately.
    pub(super) fn press(&mut self, ctx: &mut Context, buttons: Buttons, down: bool) {
        self.input.controls.press(buttons, down);
        self.send_due(ctx);
    }

    /// Releases everything and sends the change.
    pub fn release_input(&mut self, ctx: &mut Context) {
        self.input.release();
        self.send_due(ctx);
    }

    /// Applies the gamepad's buttons and the direction of its right stick. `before` holds its actions in the previous
    /// frame; `free` is false while a card takes the input.
    pub fn play_by_pad(&mut self, ctx: &mut Context, input: &PadInput, before: u32, free: bool) {
        let controls = &mut self.input.controls;
        controls.pad = if free { input.buttons } else { Buttons::default() };
        // While the wheel is open, the right stick picks an emote instead.
        if free && self.input.wheel.is_none() {
            let hero = self.replica().and_then(Replica::own_hero).map(|hero| hero.center);
            let view = *self.view();
            self.input.aim(&view, hero, input.aim);
        }
        self.send_due(ctx);
        if !free {
            return;
        }
        let has_wheel = |actions: u32| actions >> Action::Emote as u32 & 1 == 1;
        if has_wheel(input.actions & !before) {
            self.input.toggle_wheel(true);
            self.input.wheel.iter_mut().for_each(|wheel| wheel.pad = true);
        }
        let used = self.input.wheel_pad(input, has_wheel(before & !input.actions));
        self.use_wheel(ctx, used);
    }

    /// Shows an emote to everyone, and closes the wheel.
    fn emote(&mut self, ctx: &mut Context, emote: u8) {
        self.input.wheel = None;
        if emote < EMOTES {
            self.connection.emote(ctx, emote);
        }
    }

    /// Shows the emote picked on the wheel; `false` if the wheel does not handle the input.
    fn use_wheel(&mut self, ctx: &mut Context, used: WheelUse) -> bool {
        if let WheelUse::Emote(emote) = used {
            self.emote(ctx, emote);
        }
        used != WheelUse::Unused
    }
}
