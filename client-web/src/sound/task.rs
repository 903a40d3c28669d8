//! Tasks for the sound player, and events about sound.

use super::mixer::Voice;

/// A task for the player.
#[derive(Clone, Debug, PartialEq)]
pub enum SoundTask {
    /// Start playing sound at this gain. The first time, this must follow a click or key press, since browsers require
    /// that.
    Wake(f32),
    Rest,
    Gain(f32),
    Start(Vec<Voice>),
}

/// An event about sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoundEvent {
    /// A volume was chosen, percent.
    VolumeChosen(u8),
    /// Sound was muted or unmuted.
    MuteChosen(bool),
    /// Captions were switched on or off.
    CaptionsChosen(bool),
    /// The page was hidden or shown.
    Hidden(bool),
    /// The browser does not support sound.
    Missing,
    /// The browser blocks sound until a click or key press.
    Blocked,
}
