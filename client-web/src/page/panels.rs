//! The panels of the page. Each is a pure function from the app's state to a [`View`](crate::page::view::View).

pub mod dialogs;
pub mod editor;
pub mod emotes;
mod help;
mod hud;
pub mod lobby;
mod network;
mod page;
pub mod players;
mod race;
pub mod replay;
pub mod round;
mod settings;
mod sound;
mod touchpad;
pub mod zones;

use crate::page::app::App;
use crate::page::view::View;

/// Panels that are updated after every event.
pub const ALL: [fn(&App) -> View; 8] = [
    page::view,
    sound::view,
    network::view,
    touchpad::view,
    emotes::wheel,
    help::view,
    settings::view,
    editor::view,
];

/// Panels that may change with every frame of a game, a replay or the editor.
pub const OF_FRAMES: [fn(&App) -> View; 12] = [
    hud::title,
    hud::caps,
    hud::answers,
    hud::news,
    round::view,
    round::banner,
    round::highlights,
    round::record,
    race::view,
    sound::captions,
    replay::view,
    editor::error,
];

/// Panels with numbers, which would be unreadable if they changed with every frame.
pub const OF_NUMBERS: [fn(&App) -> View; 5] =
    [players::view, hud::status, network::connection, network::figures, replay::marks];
