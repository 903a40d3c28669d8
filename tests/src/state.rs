//! The page's report about itself, `window.jostle.state()`.

use serde::Deserialize;
use std::collections::BTreeMap;

/// The state of a page at one moment.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct State {
    /// `lobby`, `connecting`, `playing`, `reconnecting`, `refused`, `frozen`, `replay` or
    /// `unsupported`.
    #[serde(default)]
    pub state: String,
    /// The page's own seat, if it has one.
    #[serde(default)]
    pub seat: Option<u16>,
    /// The displayed tick, including its fraction, which is slightly behind the server.
    #[serde(default)]
    pub tick: Option<f64>,
    /// State hash of a game that runs in the page, as 16 hexadecimal digits.
    #[serde(default)]
    pub hash: Option<String>,
    /// The tick that `hash` belongs to.
    #[serde(default)]
    pub hash_tick: Option<u32>,
    #[serde(default)]
    pub bodies: Vec<Body>,
    #[serde(default)]
    pub particles: u32,
    /// Digest of the displayed particles, as 16 hexadecimal digits.
    #[serde(default)]
    pub particle_digest: Option<String>,
    #[serde(default)]
    pub emitters: u32,
    /// Players in the room, including those whose seat is held.
    #[serde(default)]
    pub players: Vec<Player>,
    /// Number of frames drawn since the page was opened.
    #[serde(default)]
    pub drawn_frames: u64,
    /// GPU resources, once they have been created.
    #[serde(default)]
    pub gpu: Option<Gpu>,
    /// For each section of snapshots, the number of messages that contained it.
    #[serde(default)]
    pub sections: Option<BTreeMap<String, u64>>,
    /// Number of received events that started emitters.
    #[serde(default)]
    pub emitter_events: u64,
    /// Position of the player's hero according to the newest snapshot.
    #[serde(default)]
    pub told_place: Option<[f32; 2]>,
    /// Prediction of the player's hero.
    #[serde(default)]
    pub prediction: Option<Prediction>,
    /// Position of a ghost on the stage, in world units.
    #[serde(default)]
    pub ghost: Option<[f32; 2]>,
    /// The displayed replay.
    #[serde(default)]
    pub replay: Option<Shown>,
    #[serde(default)]
    pub sound: Sound,
}

/// The state of a page's sound.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Sound {
    /// State of the audio context: `none`, `suspended` or `running`.
    pub context: String,
    /// Number of voices started so far.
    pub started: u64,
    /// Chosen volume in percent.
    pub volume: u8,
    /// Whether sound is neither muted nor at volume 0.
    pub on: bool,
}

/// Prediction of the player's hero.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Prediction {
    /// Smoothed distance between the server's position and the predicted one for the same tick, in world units.
    pub error: f32,
    /// Number of inputs that the server has not played yet.
    pub unacknowledged: usize,
}

#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Gpu {
    /// Names of the pipelines.
    pub pipelines: Vec<String>,
    /// Size of each texture in bytes.
    pub textures: BTreeMap<String, u64>,
}

/// A displayed replay.
#[derive(Clone, Debug, Deserialize)]
pub struct Shown {
    /// The displayed tick, as a whole number.
    pub tick: u32,
    /// The last tick that can be displayed.
    pub last: u32,
    /// Whether the replay is playing.
    pub playing: bool,
    /// Playback speed as a multiple of real time.
    pub speed: f64,
    /// Whether the replay is seeking.
    pub seeking: bool,
    /// State hash of the displayed tick, as 16 hexadecimal digits; `None` while seeking.
    pub hash: Option<String>,
    /// The tick up to which all ticks have been compared and are equal.
    pub agrees_until: u32,
    /// The first tick that is known to differ.
    pub differs_at: Option<u32>,
    /// Number of ticks compared so far.
    pub compared: u32,
    /// Seat of the player being followed.
    pub followed: Option<u8>,
    pub view: ShownView,
}

#[derive(Clone, Debug, Deserialize)]
pub struct ShownView {
    /// World point at the centre of the view.
    pub center: [f32; 2],
    /// Visible height in world units.
    pub height: f32,
    pub pixels: [u32; 2],
}

/// A body as displayed.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Body {
    /// The body's index, which a later body of the next generation may reuse.
    pub id: u32,
    /// Number of earlier bodies with the same index.
    pub generation: u32,
    /// `hero`, `minion`, `dumb`, `pack`, `platform`, `wall`.
    pub kind: String,
    /// Seat of the player it belongs to.
    #[serde(default)]
    pub owner: Option<u16>,
    /// Centre in world units.
    pub pos: [f32; 2],
}

/// A player as displayed.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Player {
    /// Seat in the room.
    pub seat: u16,
    pub name: String,
    /// Whether the player has a socket.
    pub connected: bool,
    /// The body selected with H, M, P or a press.
    pub selected: Option<u32>,
    /// The body held with X.
    pub held: Option<u32>,
}

impl State {
    /// The displayed tick as a whole number; 0 before the first.
    pub fn ticks(&self) -> u32 {
        self.tick.unwrap_or(0.0) as u32
    }

    /// Number of players with a socket.
    pub fn connected(&self) -> usize {
        self.players.iter().filter(|player| player.connected).count()
    }

    /// The page's own player.
    pub fn own_player(&self) -> Option<&Player> {
        let seat = self.seat?;
        self.players.iter().find(|player| player.seat == seat)
    }

    /// The hero that belongs to a seat.
    pub fn hero(&self, seat: u16) -> Option<&Body> {
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

    /// Whether the page is playing and shows its own hero.
    pub fn plays(&self) -> bool {
        self.state == "playing" && self.own_hero().is_some()
    }
}

/// The page's state recorded frame by frame; see `Tab::record`.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Recorded {
    /// States in the order they were first seen.
    pub states: Vec<String>,
    /// Largest number of simultaneous bodies, by kind.
    pub kinds: BTreeMap<String, u32>,
    /// Largest number of simultaneous particles.
    pub particles: u32,
    /// Largest number of simultaneous emitters.
    pub emitters: u32,
}

impl Recorded {
    /// Largest number of simultaneous bodies of a kind.
    pub fn most_of(&self, kind: &str) -> u32 {
        self.kinds.get(kind).copied().unwrap_or(0)
    }
}
