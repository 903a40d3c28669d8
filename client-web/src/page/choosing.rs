//! Changes of the settings: what is chosen is used at once, and remembered.

use crate::input::bindings::Bindings;
use crate::input::pad::{self, PadBindings, PadState};
use crate::language::{fill, say};
use crate::page::app::{Activity, App};
use crate::page::choices::{Choice, SettingsEvent};
use crate::page::event::{Effect, Key};
use crate::page::layers::Layer;
use crate::page::{storage, strings};
use jostle_protocol::Appearance;

impl App {
    pub(super) fn set(&mut self, event: SettingsEvent) {
        let settings = &mut self.settings;
        match event {
            SettingsEvent::Language(language) => {
                settings.language = language;
                self.ctx.storage.keep(storage::LANGUAGE, &settings.language);
                settings.ask_language(&mut self.ctx);
            }
            SettingsEvent::LanguageCame(language, file) => settings.take_language(&language, file),
            SettingsEvent::Calm(calm) => {
                settings.calm = calm;
                self.ctx.storage.keep_flag(storage::CALM, calm);
            }
            SettingsEvent::FullScreen(is_full) => settings.is_full = is_full,
            SettingsEvent::Layout(labels) => {
                for (place, letter) in labels {
                    settings.layout.note(&place, &letter);
                }
            }
            SettingsEvent::PadConnected(has_pad) => {
                settings.has_pad = has_pad;
                self.use_pad(PadState::default());
            }
            SettingsEvent::Pad(state) => self.use_pad(state),
            SettingsEvent::DeadZone(percent) => {
                let [least, most] = pad::DEAD_ZONES;
                settings.pad.dead_zone = percent.clamp(least, most);
                self.keep_pad();
            }
        }
    }

    /// Takes over what another tab has written.
    pub(super) fn take_stored(&mut self, key: &str, value: Option<String>) {
        self.ctx.storage.take(key, value);
        let storage = &self.ctx.storage;
        let (name, color) = storage.player();
        let predicts = storage.predicts(None);
        if let Ok(appearance) = Appearance::new(name, color.unwrap_or(self.appearance.color)) {
            self.take_player(appearance);
        }
        self.sound.recall(&self.ctx.storage);
        self.set_gain();
        self.settings.recall(&self.ctx.storage);
        self.settings.ask_language(&mut self.ctx);
        if key == storage::PREDICT {
            self.set_prediction(predicts);
        }
    }

    /// Another tab has renamed the player: the next game here is begun as that one, and the form says so.
    fn take_player(&mut self, appearance: Appearance) {
        if self.appearance == appearance {
            return;
        }
        self.appearance = appearance;
        if let Activity::Lobby = self.activity {
            self.visit.own_color = self.appearance.color;
            self.visit.number += 1;
        }
    }

    pub(super) fn set_prediction(&mut self, on: bool) {
        self.ctx.predicts = on;
        self.with_game(|game, _| game.set_prediction(on));
    }

    pub(super) fn toggle_settings(&mut self) {
        self.release_input();
        self.visit.wheel = None;
        self.settings.choice = None;
        self.settings.note.clear();
        self.visit.dialogs.toggle_settings(self.top());
    }

    /// Asks for the key or the button of an action, or no longer.
    pub(super) fn ask_choice(&mut self, choice: Option<Choice>) {
        let settings = &mut self.settings;
        settings.choice = choice.filter(|_| settings.choice != choice);
        settings.note = match settings.choice {
            Some(Choice::Key(action)) => strings::press_key(action),
            Some(Choice::Button(action)) => strings::press_button(action),
            None => String::new(),
        };
    }

    /// Everything is as at first.
    pub(super) fn reset_hands(&mut self) {
        self.settings.keys = Bindings::default();
        self.settings.pad = PadBindings::default();
        self.settings.choice = None;
        self.settings.note = say(strings::RESET).to_owned();
        self.ctx.storage.keep(storage::KEYS, "");
        self.keep_pad();
    }

    fn keep_pad(&mut self) {
        let text = self.settings.pad.text();
        self.ctx.storage.keep(storage::PAD, &text);
    }

    pub(super) fn toggle_full_screen(&mut self) {
        self.ctx.request(Effect::FullScreen(!self.settings.is_full));
    }

    /// A key in the settings: the one that is asked for, or the one that closes them. `false` if it is neither.
    pub(super) fn settings_key_down(&mut self, key: &Key) -> bool {
        if self.top() != Layer::Settings {
            return false;
        }
        let is_escape = key.code == "Escape";
        match self.settings.choice {
            Some(_) if is_escape => self.ask_choice(None),
            Some(Choice::Key(action)) => {
                // Tab leads on, and these have a use of their own.
                if key.code == "Tab" || key.modified || is_modifier(&key.letter) {
                    return false;
                }
                if is_function(&key.code) {
                    self.settings.note = fill(strings::TAKEN_KEY, &[("key", &key.code)]);
                } else {
                    self.settings.choose_key(action, key);
                    self.settings.choice = None;
                    let text = self.settings.keys.text();
                    self.ctx.storage.keep(storage::KEYS, &text);
                }
            }
            _ if is_escape => self.toggle_settings(),
            _ => return false,
        }
        self.ctx.request(Effect::PreventDefault);
        true
    }

    /// Learns what the cap of a key reads.
    pub(super) fn note_cap(&mut self, key: &Key) {
        if !key.modified && !key.shift {
            self.settings.layout.note(&key.code, &key.letter);
        }
    }

    /// Takes the state of the gamepad.
    fn use_pad(&mut self, state: PadState) {
        let before = std::mem::replace(&mut self.settings.pad_state, state);
        let pressed = state.buttons & !before.buttons;
        if let Some(Choice::Button(action)) = self.settings.choice {
            let chosen = (0..pad::BUTTONS).find(|button| pressed >> button & 1 == 1);
            if let Some(button) = chosen.filter(|button| pad::is_free(*button)) {
                self.settings.choose_button(action, button);
                self.settings.choice = None;
                self.keep_pad();
            }
            return;
        }
        self.play_by_pad(&state);
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
