//! The settings: keys, gamepad, reduced motion, full screen and language. Choices are stored.

use crate::input::action::Action;
use crate::input::bindings::{Bindings, KeyboardLayout};
use crate::input::pad::{self, PadBindings, PadInput, PadState};
use crate::language::{self, fill, say};
use crate::page::context::Context;
use crate::page::event::{Effect, Key, SettingsEvent};
use crate::page::page_action::PageAction;
use crate::page::storage::{self, Storage};
use crate::page::strings;
use crate::page::tools::Cap;

/// The page's languages: English, and those with a translation file.
pub const LANGUAGES: [&str; 2] = ["en", "de"];

/// A choice that waits for the player to press a key or button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The action gets the next key.
    Key(Action),
    /// The action gets the next gamepad button.
    Button(Action),
}

/// The settings and the state of their dialog.
#[derive(Debug)]
pub struct Settings {
    pub keys: Bindings,
    pub layout: KeyboardLayout,
    pub pad: PadBindings,
    /// Whether motion is reduced: few particles, no flashes, no shaking.
    pub calm: bool,
    pub is_full: bool,
    /// Whether the page is used by touch.
    pub touched: bool,
    /// The chosen language. `spoken` is the current one until the file of the chosen one is loaded.
    pub language: String,
    pub spoken: String,
    /// Whether a gamepad is connected.
    pub has_pad: bool,
    /// The action that waits for a key or button.
    pub choice: Option<Choice>,
    /// The result of the most recent choice.
    pub note: String,
    pad_state: PadState,
    pad_actions: u32,
}

impl Settings {
    /// The stored settings. The defaults follow the browser's preferred language and its reduced-motion preference.
    pub fn new(storage: &Storage, preferred: &str, calm: bool) -> Settings {
        let mut settings = Settings {
            keys: Bindings::default(),
            layout: KeyboardLayout::default(),
            pad: PadBindings::default(),
            calm,
            is_full: false,
            touched: false,
            language: language_of(preferred).to_owned(),
            spoken: "en".to_owned(),
            has_pad: false,
            choice: None,
            note: String::new(),
            pad_state: PadState::default(),
            pad_actions: 0,
        };
        settings.recall(storage);
        settings
    }

    /// Applies the stored values.
    pub fn recall(&mut self, storage: &Storage) {
        let kept = |key| storage.get(key);
        self.keys = kept(storage::KEYS).map_or(self.keys.clone(), Bindings::parse);
        self.pad = kept(storage::PAD).map_or(self.pad.clone(), PadBindings::parse);
        self.calm = kept(storage::CALM).map_or(self.calm, |word| word == "1");
        if let Some(chosen) = kept(storage::LANGUAGE) {
            language_of(chosen).clone_into(&mut self.language);
        }
    }

    /// The label of an action's key; a dash if it has none.
    pub fn cap(&self, action: Action) -> String {
        self.layout.cap(&self.keys, action).map_or("\u{2013}".to_owned(), |cap| match &*cap {
            "Space" => say("Space").to_owned(),
            "Enter" => say("Enter").to_owned(),
            _ => cap,
        })
    }

    /// The label of the key that a key cap in the game stands for.
    pub fn key_of(&self, cap: &Cap) -> String {
        match Action::that_presses(cap.buttons).filter(|action| *action != Action::Fire) {
            Some(action) => self.cap(action),
            None => say(cap.key).to_owned(),
        }
    }

    /// Applies and stores the player's choices. Returns the gamepad's state if it should control the game.
    pub fn update(&mut self, ctx: &mut Context, event: SettingsEvent) -> Option<PadState> {
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

    /// Performs the action of a button in the settings dialog.
    pub fn click(&mut self, ctx: &mut Context, action: PageAction, value: &str) {
        match action {
            PageAction::ChooseKey => self.ask_choice(Action::of_id(value).map(Choice::Key)),
            PageAction::ChooseButton => self.ask_choice(Action::of_id(value).map(Choice::Button)),
            PageAction::FullScreen => ctx.request(Effect::FullScreen(!self.is_full)),
            PageAction::ResetHands => self.reset_hands(ctx),
            _ => {}
        }
    }

    /// Waits for the key or button of an action. Choosing the same action again cancels this.
    fn ask_choice(&mut self, choice: Option<Choice>) {
        self.choice = choice.filter(|_| self.choice != choice);
        self.note = match self.choice {
            Some(Choice::Key(action)) => strings::press_key(action),
            Some(Choice::Button(action)) => strings::press_button(action),
            None => String::new(),
        };
    }

    /// Restores the default keys and buttons.
    fn reset_hands(&mut self, ctx: &mut Context) {
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

    /// Handles a key in the settings dialog: the one to assign, or Escape to cancel. `false` if the key is neither.
    pub fn key_down(&mut self, ctx: &mut Context, key: &Key) -> bool {
        match self.choice {
            Some(_) if key.code == "Escape" => self.ask_choice(None),
            Some(Choice::Key(action)) => {
                // Tab moves the focus, and modified keys have other uses.
                if key.code == "Tab" || key.modified || key.is_modifier() {
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

    /// Records the label on a key.
    pub fn note_cap(&mut self, key: &Key) {
        if !key.modified && !key.shift {
            self.layout.note(&key.code, &key.letter);
        }
    }

    /// Stores the state of the gamepad; returns it unless a button is being assigned.
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

    /// Reads the state of the gamepad; also returns its actions in the previous frame.
    pub fn read_pad(&mut self, state: &PadState) -> (PadInput, u32) {
        let input = pad::read(state, &self.pad);
        let before = std::mem::replace(&mut self.pad_actions, input.actions);
        (input, before)
    }

    /// Requests the file of the chosen language if it is not the current one.
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
            // Sentences are borrowed for the lifetime of the page. The leak is small because only the player changes
            // the language.
            Some(file) => self.speak(String::leak(file)),
            None => {
                self.language.clone_from(&self.spoken);
                self.note = say(strings::NO_LANGUAGE).to_owned();
            }
        }
    }

    /// Assigns this key to the waiting action.
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

/// Whether a key is a function key, which the page or the browser needs.
fn is_function(code: &str) -> bool {
    let number = code.strip_prefix('F').and_then(|number| number.parse::<u8>().ok());
    number.is_some()
}

/// The page language for a language tag.
fn language_of(tag: &str) -> &'static str {
    LANGUAGES.into_iter().find(|known| is_of(tag, known)).unwrap_or("en")
}

/// Whether a browser's language tag (`de-AT`) belongs to a language.
fn is_of(tag: &str, language: &str) -> bool {
    tag.split('-').next().is_some_and(|first| first.eq_ignore_ascii_case(language))
}
