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
    /// Displayed tick with its fraction, slightly behind the server.
    #[serde(default)]
    pub tick: Option<f64>,
    /// State hash of a game that runs in the page, 16 hex digits.
    #[serde(default)]
    pub hash: Option<String>,
    /// Tick of that hash.
    #[serde(default)]
    pub hash_tick: Option<u32>,
    #[serde(default)]
    pub bodies: Vec<Body>,
    #[serde(default)]
    pub particles: u32,
    /// Digest of the particles shown, 16 hex digits.
    #[serde(default)]
    pub particle_digest: Option<String>,
    #[serde(default)]
    pub emitters: u32,
    /// Players in the room, including those whose seat is held.
    #[serde(default)]
    pub players: Vec<Player>,
    /// Frames drawn since the page was opened.
    #[serde(default)]
    pub drawn_frames: u64,
    /// GPU resources, once they have been created.
    #[serde(default)]
    pub gpu: Option<Gpu>,
    /// For each section of snapshots, the number of messages that contained it.
    #[serde(default)]
    pub sections: Option<BTreeMap<String, u64>>,
    /// Events received that started emitters.
    #[serde(default)]
    pub emitter_events: u64,
    /// Position of the player's hero in the newest snapshot.
    #[serde(default)]
    pub told_place: Option<[f32; 2]>,
    /// Prediction of the player's hero.
    #[serde(default)]
    pub prediction: Option<Prediction>,
    /// Position of a ghost on the stage, world units.
    #[serde(default)]
    pub ghost: Option<[f32; 2]>,
    /// The replay on display.
    #[serde(default)]
    pub replay: Option<Shown>,
    #[serde(default)]
    pub sound: Sound,
}

/// Sound of a page.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Sound {
    /// State of the audio context: `none`, `suspended` or `running`.
    pub context: String,
    /// Voices started so far.
    pub started: u64,
    /// Chosen volume, percent.
    pub volume: u8,
    /// Whether sound is neither muted nor at volume 0.
    pub on: bool,
}

/// Prediction of the player's hero.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Prediction {
    /// Smoothed distance between the server's position and the predicted one for the same tick,
    /// world units.
    pub error: f32,
    /// Inputs that the server has not played yet.
    pub unacknowledged: usize,
}

#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Gpu {
    /// Names of the pipelines.
    pub pipelines: Vec<String>,
    /// Size of each texture, bytes.
    pub textures: BTreeMap<String, u64>,
}

/// A replay on display.
#[derive(Clone, Debug, Deserialize)]
pub struct Shown {
    /// Whole tick on display.
    pub tick: u32,
    /// Last tick that can be shown.
    pub last: u32,
    /// Whether the replay is playing.
    pub playing: bool,
    /// Playback speed as a multiple of real time.
    pub speed: f64,
    /// Whether the replay is seeking.
    pub seeking: bool,
    /// State hash of the displayed tick, 16 hex digits; `None` while seeking.
    pub hash: Option<String>,
    /// All ticks up to this one have been compared and are equal.
    pub agrees_until: u32,
    /// First tick known to differ.
    pub differs_at: Option<u32>,
    /// Ticks compared so far.
    pub compared: u32,
    /// Seat of the followed player.
    pub followed: Option<u8>,
    pub view: ShownView,
}

#[derive(Clone, Debug, Deserialize)]
pub struct ShownView {
    /// World point at the centre.
    pub center: [f32; 2],
    /// Visible height, world units.
    pub height: f32,
    pub pixels: [u32; 2],
}

/// A body as shown.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Body {
    /// The body's index, which a later body of the next generation may reuse.
    pub id: u32,
    /// Number of earlier bodies with the same index.
    pub generation: u32,
    /// `hero`, `minion`, `dumb`, `pack`, `platform`, `wall`.
    pub kind: String,
    /// Seat of its player.
    #[serde(default)]
    pub owner: Option<u16>,
    /// Centre, world units.
    pub pos: [f32; 2],
}

/// A player as shown.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Player {
    /// Seat in the room.
    pub seat: u16,
    pub name: String,
    /// Whether the player has a socket.
    pub connected: bool,
    /// The body selected by H, M, P or a press.
    pub selected: Option<u32>,
    /// The body held with X.
    pub held: Option<u32>,
}

impl State {
    /// Whole ticks shown, 0 before the first.
    pub fn ticks(&self) -> u32 {
        self.tick.unwrap_or(0.0) as u32
    }

    /// Players with a socket.
    pub fn connected(&self) -> usize {
        self.players.iter().filter(|player| player.connected).count()
    }

    /// The page's own player.
    pub fn own_player(&self) -> Option<&Player> {
        let seat = self.seat?;
        self.players.iter().find(|player| player.seat == seat)
    }

    /// The hero of a seat.
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
    /// States in the order in which they were first seen.
    pub states: Vec<String>,
    /// Largest number of bodies of a kind at once.
    pub kinds: BTreeMap<String, u32>,
    /// Largest number of particles at once.
    pub particles: u32,
    /// Largest number of emitters at once.
    pub emitters: u32,
}

impl Recorded {
    /// Largest number of bodies of a kind at once.
    pub fn most_of(&self, kind: &str) -> u32 {
        self.kinds.get(kind).copied().unwrap_or(0)
    }
}
