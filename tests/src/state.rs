//! What a page says of itself through `window.jostle.state()`.

use serde::Deserialize;
use std::collections::BTreeMap;

/// A page at one moment.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct State {
    /// `lobby`, `connecting`, `playing`, `reconnecting`, `refused`, `frozen` or `unsupported`.
    #[serde(default)]
    pub state: String,
    /// Own seat, while there is one.
    #[serde(default)]
    pub seat: Option<u8>,
    /// Tick shown.
    #[serde(default)]
    pub tick: u32,
    /// Bodies shown.
    #[serde(default)]
    pub bodies: Vec<Body>,
    /// Particles shown.
    #[serde(default)]
    pub particles: u32,
    /// Emitters at work.
    #[serde(default)]
    pub emitters: u32,
    /// Players in the room.
    #[serde(default)]
    pub players: u32,
    /// Frames drawn since the page was opened.
    #[serde(default)]
    pub drawn_frames: u64,
}

/// A body as shown.
#[derive(Clone, Debug, Deserialize)]
pub struct Body {
    /// Its name.
    pub id: u64,
    /// `hero`, `minion`, `dumb`, `pack`, `platform`, `wall`.
    pub kind: String,
    /// Seat of its player.
    #[serde(default)]
    pub owner: Option<u8>,
    /// Centre, world units.
    pub pos: [f32; 2],
}

impl State {
    /// The hero of a seat.
    pub fn hero(&self, seat: u8) -> Option<&Body> {
        self.bodies.iter().find(|body| body.kind == "hero" && body.owner == Some(seat))
    }

    /// The page's own hero.
    pub fn own_hero(&self) -> Option<&Body> {
        self.hero(self.seat?)
    }

    /// All bodies of a kind.
    pub fn of_kind(&self, kind: &str) -> Vec<&Body> {
        self.bodies.iter().filter(|body| body.kind == kind).collect()
    }

    /// Whether the page plays and shows its own hero.
    pub fn plays(&self) -> bool {
        self.state == "playing" && self.own_hero().is_some()
    }
}

/// What a page said of itself from one frame to the next, see `Tab::record`.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Recorded {
    /// States in the order in which they were first seen.
    pub states: Vec<String>,
    /// Most bodies of a kind at once.
    pub kinds: BTreeMap<String, u32>,
    /// Most particles at once.
    pub particles: u32,
    /// Most emitters at once.
    pub emitters: u32,
}

impl Recorded {
    /// Most bodies of a kind at once.
    pub fn most_of(&self, kind: &str) -> u32 {
        self.kinds.get(kind).copied().unwrap_or(0)
    }
}
