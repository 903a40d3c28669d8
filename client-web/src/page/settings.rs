//! The settings: keys, gamepad, calm, full screen and language. What is chosen is remembered.

use crate::input::action::Action;
use crate::input::bindings::{Bindings, Layout};
use crate::input::pad::{self, PadBindings, PadState};
use crate::language::{self, fill, say};
use crate::page::app::App;
use crate::page::context::{Context, Remembered};
use crate::page::event::{Effect, Key};
use crate::page::layers::Layer;
use crate::page::strings;
use crate::page::tools::Cap;

/// Languages of the page: English, and those with a file.
pub const LANGUAGES: [&str; 2] = ["en", "de"];

/// A choice that waits for the player to press something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The next key gets this action.
    Key(Action),
    /// The next button of the gamepad does.
    Button(Action),
}

/// A change of the settings.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsEvent {
    Language(String),
    /// The file of a language came, or did not.
    LanguageCame(String, Option<String>),
    Calm(bool),
    /// The page got the whole screen, or gave it back.
    FullScreen(bool),
    /// The browser knows the letters of keys, by their places.
    Layout(Vec<(String, String)>),
    /// A gamepad was connected, or the last one is gone.
    PadConnected(bool),
    /// Once a frame while one is connected.
    Pad(PadState),
    /// Percent.
    DeadZone(u8),
}

/// The settings, and what the sheet says of them.
#[derive(Debug)]
pub struct Settings {
    pub keys: Bindings,
    pub layout: Layout,
    pub pad: PadBindings,
    /// No particles to speak of, no flashes, nothing that shakes.
    pub calm: bool,
    pub is_full: bool,
    /// The chosen language, and the one that the page speaks: the file of another may be on its way.
    pub language: String,
    pub spoken: String,
    /// A gamepad is connected.
    pub has_pad: bool,
    /// The key or button that is asked for.
    pub choice: Option<Choice>,
    /// What came of the last choice.
    pub note: String,
    pub(super) pad_state: PadState,
    pub(super) pad_actions: u32,
}

impl Settings {
    /// As they were left, or as the browser is set up: it prefers a language, and less motion or not.
    pub fn new(remembered: &Remembered, preferred: &str, calm: bool) -> Settings {
        let chosen = remembered.setting(Remembered::LANGUAGE).unwrap_or(preferred);
        let language = LANGUAGES.into_iter().find(|known| is_of(chosen, known)).unwrap_or("en");
        Settings {
            keys: Bindings::parse(remembered.setting(Remembered::KEYS).unwrap_or_default()),
            layout: Layout::default(),
            pad: PadBindings::parse(remembered.setting(Remembered::PAD).unwrap_or_default()),
            calm: remembered.setting(Remembered::CALM).map_or(calm, |word| word == "1"),
            is_full: false,
            language: language.to_owned(),
            spoken: "en".to_owned(),
            has_pad: false,
            choice: None,
            note: String::new(),
            pad_state: PadState::default(),
            pad_actions: 0,
        }
    }

    /// The label of the key of an action; a dash without one.
    pub fn cap(&self, action: Action) -> String {
        self.layout.cap(&self.keys, action).map_or("\u{2013}".to_owned(), |cap| match &*cap {
            "Space" => say("Space").to_owned(),
            "Enter" => say("Enter").to_owned(),
            _ => cap,
        })
    }

    /// The label of what a cap of the game stands for.
    pub fn key_of(&self, cap: &Cap) -> String {
        match Action::that_presses(cap.buttons).filter(|action| *action != Action::Fire) {
            Some(action) => self.cap(action),
            None => say(cap.key).to_owned(),
        }
    }

    /// Has the browser fetch the file of the chosen language, if it is not spoken.
    pub fn ask_language(&mut self, ctx: &mut Context) {
        if self.language == self.spoken {
            return;
        }
        if self.language == "en" {
            self.speak("");
        } else {
            ctx.request(Effect::FetchLanguage(self.language.clone()));
        }
    }

    fn speak(&mut self, file: &'static str) {
        language::speak(file);
        self.spoken.clone_from(&self.language);
        self.note.clear();
    }

    fn take_language(&mut self, language: &str, file: Option<String>) {
        if self.language != language {
            return;
        }
        match file {
            // Sentences are borrowed for as long as the page lives; languages are changed by hand.
            Some(file) => self.speak(String::leak(file)),
            None => {
                self.language.clone_from(&self.spoken);
                self.note = say(strings::NO_LANGUAGE).to_owned();
            }
        }
    }

    /// Gives the action that waits this key.
    fn choose_key(&mut self, action: Action, key: &Key) {
        let moved = self.keys.assign(action, &key.code, &key.letter);
        let label = self.cap(action);
        self.note = strings::now_does(&label, action);
        if let Some(other) = moved {
            self.note += &strings::swapped(other, &self.cap(other));
        }
    }

    fn choose_button(&mut self, action: Action, button: u8) {
        let moved = self.pad.assign(action, button);
        self.note = strings::now_does(strings::pad_button(button), action);
        if let Some(other) = moved {
            let button = self.pad.button(other).map_or("\u{2013}", strings::pad_button);
            self.note += &strings::swapped(other, button);
        }
    }
}

/// Whether a tag of the browser (`de-AT`) is of a language.
fn is_of(tag: &str, language: &str) -> bool {
    tag.split('-').next().is_some_and(|first| first.eq_ignore_ascii_case(language))
}

impl App {
    pub(super) fn set(&mut self, event: SettingsEvent) {
        let settings = &mut self.settings;
        match event {
            SettingsEvent::Language(language) => {
                settings.language = language;
                self.ctx.remember(Remembered::LANGUAGE, &settings.language);
                settings.ask_language(&mut self.ctx);
            }
            SettingsEvent::LanguageCame(language, file) => settings.take_language(&language, file),
            SettingsEvent::Calm(calm) => {
                settings.calm = calm;
                self.ctx.remember(Remembered::CALM, if calm { "1" } else { "0" });
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

    pub(super) fn toggle_settings(&mut self) {
        self.release_input();
        self.wheel = None;
        self.settings.choice = None;
        self.settings.note.clear();
        self.dialogs.toggle_settings(self.top());
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
        self.ctx.remember(Remembered::KEYS, "");
        self.keep_pad();
    }

    fn keep_pad(&mut self) {
        let text = self.settings.pad.text();
        self.ctx.remember(Remembered::PAD, &text);
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
                    self.ctx.remember(Remembered::KEYS, &text);
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
