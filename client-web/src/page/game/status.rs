//! The stage that a game is at, and everything the page says about it besides the world itself.

use crate::page::strings::Card;

/// The stage that a game is at, as `data-state` names it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Waiting for the first seat.
    #[default]
    Connecting,
    Playing,
    /// Another server goes on with the room: the picture stays as it is for a moment.
    Moving,
    /// The socket was lost; the world stays on view.
    Reconnecting,
    /// The session ended; a notice says why.
    Refused,
    /// A scripted demo stands still.
    Frozen,
}

impl State {
    /// The value of `data-state`.
    pub fn name(self) -> &'static str {
        match self {
            State::Connecting => "connecting",
            State::Playing => "playing",
            State::Moving => "moving",
            State::Reconnecting => "reconnecting",
            State::Refused => "refused",
            State::Frozen => "frozen",
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Status {
    pub state: State,
    /// Why the session ended, if it did.
    pub notice: Option<Card>,
    /// When the first seat was taken.
    pub joined_ms: Option<f64>,
    /// When the room began to move to another server, if it does.
    pub moved_ms: f64,
    /// A tick in the page took this long, and the game stands still since then, milliseconds.
    pub stalled_ms: Option<f64>,
    /// When the server will close.
    pub closing_ms: Option<f64>,
    /// The server closed, and is tried until it is back.
    pub restarting: bool,
    /// Whether the room goes on after the restart where it was.
    pub is_kept: bool,
    /// The server took this page for the room's host.
    pub host: bool,
    /// The player closed the room.
    pub closes: bool,
    /// When the room last denied what only a host may ask for.
    pub denied_ms: Option<f64>,
    /// The answer to the last request for a clip, and when it came: its name, empty for a file of this machine, or a
    /// sentence that says why there is none.
    pub clip: Option<(f64, Result<String, &'static str>)>,
}
