//! Changes of the settings: what is chosen is used at once, and remembered.

use crate::input::bindings::Bindings;
use crate::input::pad::{self, PadBindings, PadState};
use crate::language::{fill, say};
use crate::page::choices::{Choice, SettingsEvent};
use crate::page::context::Context;
use crate::page::event::{Effect, Key};
use crate::page::settings::Settings;
use crate::page::{storage, strings};

impl Settings {
    /// Returns the state of the gamepad if it is to be played by.
    pub(super) fn update(&mut self, ctx: &mut Context, event: SettingsEvent) -> Option<PadState> {
        match event {
            SettingsEvent::Language(language) => {
                self.language = language;
                ctx.storage.keep(storage::LANGUAGE, &self.language);
                self.ask_language(ctx);
            }
            SettingsEvent::LanguageCame(language, file) => self.take_language(&language, file),
            SettingsEvent::Calm(calm) => {
                self.calm = calm;
                ctx.storage.keep_flag(storage::CALM, calm);
            }
            SettingsEvent::FullScreen(is_full) => self.is_full = is_full,
            SettingsEvent::Layout(labels) => {
                for (place, letter) in labels {
                    self.layout.note(&place, &letter);
                }
            }
            SettingsEvent::PadConnected(has_pad) => {
                self.has_pad = has_pad;
                return self.take_pad(ctx, PadState::default());
            }
            SettingsEvent::Pad(state) => return self.take_pad(ctx, state),
            SettingsEvent::DeadZone(percent) => {
                let [least, most] = pad::DEAD_ZONES;
                self.pad.dead_zone = percent.clamp(least, most);
                self.keep_pad(ctx);
            }
        }
        None
    }

    /// Asks for the key or the button of an action, or no longer.
    pub(super) fn ask_choice(&mut self, choice: Option<Choice>) {
        self.choice = choice.filter(|_| self.choice != choice);
        self.note = match self.choice {
            Some(Choice::Key(action)) => strings::press_key(action),
            Some(Choice::Button(action)) => strings::press_button(action),
            None => String::new(),
        };
    }

    /// Everything is as at first.
    pub(super) fn reset_hands(&mut self, ctx: &mut Context) {
        self.keys = Bindings::default();
        self.pad = PadBindings::default();
        self.choice = None;
        self.note = say(strings::RESET).to_owned();
        ctx.storage.keep(storage::KEYS, "");
        self.keep_pad(ctx);
    }

    fn keep_pad(&mut self, ctx: &mut Context) {
        ctx.storage.keep(storage::PAD, &self.pad.text());
    }

    pub(super) fn toggle_full_screen(&mut self, ctx: &mut Context) {
        ctx.request(Effect::FullScreen(!self.is_full));
    }

    /// A key in the sheet: the one that is asked for, or the one that ends the question. `false` if it is neither.
    pub(super) fn key_down(&mut self, ctx: &mut Context, key: &Key) -> bool {
        match self.choice {
            Some(_) if key.code == "Escape" => self.ask_choice(None),
            Some(Choice::Key(action)) => {
                // Tab leads on, and these have a use of their own.
                if key.code == "Tab" || key.modified || is_modifier(&key.letter) {
                    return false;
                }
                if is_function(&key.code) {
                    self.note = fill(strings::TAKEN_KEY, &[("key", &key.code)]);
                } else {
                    self.choose_key(action, key);
                    self.choice = None;
                    ctx.storage.keep(storage::KEYS, &self.keys.text());
                }
            }
            _ => return false,
        }
        true
    }

    /// Learns what the cap of a key reads.
    pub(super) fn note_cap(&mut self, key: &Key) {
        if !key.modified && !key.shift {
            self.layout.note(&key.code, &key.letter);
        }
    }

    /// Takes the state of the gamepad; returns it unless a button was asked for.
    fn take_pad(&mut self, ctx: &mut Context, state: PadState) -> Option<PadState> {
        let pressed = state.buttons & !self.pad_state.buttons;
        self.pad_state = state;
        let Some(Choice::Button(action)) = self.choice else { return Some(state) };
        let chosen = (0..pad::BUTTONS).find(|button| pressed >> button & 1 == 1);
        if let Some(button) = chosen.filter(|button| pad::is_free(*button)) {
            self.choose_button(action, button);
            self.choice = None;
            self.keep_pad(ctx);
        }
        None
    }
}

fn is_modifier(letter: &str) -> bool {
    matches!(letter, "Shift" | "Control" | "Alt" | "Meta" | "AltGraph" | "CapsLock" | "Dead")
}

/// Keys that the page or the browser needs.
fn is_function(code: &str) -> bool {
    let number = code.strip_prefix('F').and_then(|number| number.parse::<u8>().ok());
    number.is_some()
}
