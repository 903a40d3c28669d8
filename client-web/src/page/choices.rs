//! What the settings hear of: choices of the player, and facts about the browser.

use crate::input::action::Action;
use crate::input::pad::PadState;

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
    DeadZone(u8),
}
