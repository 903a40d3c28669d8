//! Tasks that the page has for the player of sounds, and events about sound.

use super::mixer::Voice;

/// A task for the player.
#[derive(Clone, Debug, PartialEq)]
pub enum SoundTask {
    /// Sound is wanted from now on, at this gain. The first time this must come from a click or key: browsers
    /// let no page sound before.
    Wake(f32),
    /// Nothing is to be heard from now on.
    Rest,
    /// Sounds at this gain.
    Gain(f32),
    Start(Vec<Voice>),
}

/// Anything that happens to sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoundEvent {
    /// A volume was chosen, percent.
    VolumeChosen(u8),
    /// Sound was switched off, or on again.
    MuteChosen(bool),
    /// Captions were switched on or off.
    CaptionsChosen(bool),
    /// The page was hidden, or is seen again.
    Hidden(bool),
    /// The browser has no sound for pages.
    Missing,
    /// The browser waits for a click or key.
    Blocked,
}
