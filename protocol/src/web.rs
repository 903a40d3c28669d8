//! The JSON answers of the server's HTTP API, read by the page and written by the server and the static page.

use jostle_game::Scene;
use jostle_sim::TICKS_PER_SECOND;
use serde::{Deserialize, Serialize};

/// Answer of `GET /api/rooms`, or of `GET /api/rooms?find=TEXT` for those whose code or title has the text.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Rooms {
    /// Public rooms that are open, at most [`ROOMS_LISTED_MAX`]: of more, those in which most people are.
    pub rooms: Vec<RoomCard>,
    /// All of these, listed or not.
    #[serde(default)]
    pub total: u32,
}

/// Rooms in a list, which each visitor of the lobby asks for every few seconds.
pub const ROOMS_LISTED_MAX: usize = 100;

/// A room as the lobby shows it.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct RoomCard {
    /// The word in its link.
    pub code: String,
    /// Name of its scene.
    pub scene: String,
    /// Title of its scene.
    pub title: String,
    /// Seats that are taken.
    pub players: u32,
    /// Players who are connected now.
    #[serde(default)]
    pub connected: u32,
    /// People who watch it.
    #[serde(default)]
    pub spectators: u32,
    /// Seats that it has.
    pub players_max: u32,
}

/// Answer of `GET /api/scenes`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Scenes {
    /// Scenes that a room can be opened with.
    pub scenes: Vec<SceneCard>,
    /// Who may open a room with a scene of their own; `None` for a page without a server.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub guest_scenes: Option<&'static str>,
}

/// A scene as the lobby shows it. Every visitor downloads all of them, so numbers that are 0 are left out.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct SceneCard {
    /// Name of the scene, as in its file.
    pub name: String,
    /// Title, for people.
    pub title: String,
    /// One sentence about it.
    pub about: String,
    /// Seats of a room that plays it.
    pub players_max: u32,
    /// Where it is shown: `games`, `playgrounds` or `book`.
    #[serde(default)]
    pub category: String,
    /// Teams; 0 if each player plays alone.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub teams: u32,
    /// Length of a round, seconds; 0 where none ends by itself.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub round_s: u32,
    /// Whether each player has a hero.
    #[serde(default)]
    pub heroes: bool,
    /// Players without whom no round begins.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub players_min: u32,
    /// Seats that bots take.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub fill: u32,
    /// Address of its picture.
    pub picture: Option<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(number: &u32) -> bool {
    *number == 0
}

impl SceneCard {
    /// The card of a scene whose picture has this address.
    pub fn of(scene: &Scene, picture: Option<String>) -> SceneCard {
        let round = scene.rules.round.as_ref();
        let round_ticks = round.and_then(|round| round.time).unwrap_or(0);
        SceneCard {
            name: scene.name.clone(),
            title: scene.title.clone(),
            about: scene.about.clone(),
            players_max: u32::from(scene.players_max),
            category: scene.category.name().to_owned(),
            teams: scene.rules.teams.len() as u32,
            round_s: round_ticks / TICKS_PER_SECOND,
            heroes: scene.hero.is_some(),
            players_min: round.map_or(1, |round| u32::from(round.players_min)),
            fill: round.map_or(0, |round| u32::from(round.fill)),
            picture,
        }
    }
}

/// Answer of `GET /api/replays`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Replays {
    /// Newest first.
    pub replays: Vec<ReplayCard>,
    /// Replays that ended because a disk failed.
    #[serde(skip_deserializing)]
    pub errors: u64,
    /// Of these, those that ended because it was too slow.
    #[serde(skip_deserializing)]
    pub dropped: u64,
}

/// A replay as the lobby shows it.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
pub struct ReplayCard {
    /// Its name, without the ending: `/replays/NAME.jostle` is the file, `/replay/NAME` the page that plays it.
    pub name: String,
    /// Name of its scene.
    pub scene: String,
    /// Code of the room.
    pub room: String,
    /// When the recording began, seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Length of the file so far, whole records alone.
    pub bytes: u64,
    /// Length of the game so far, seconds; `None` if its end is missing.
    #[serde(default)]
    pub seconds: Option<u32>,
    /// Most players at a time, bots included; 0 if unknown.
    #[serde(default)]
    pub players: u32,
    /// Whether it is still being recorded.
    pub recording: bool,
}

/// Answer of `GET /api/records`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Records {
    /// Whether the server keeps runs.
    #[serde(skip_deserializing)]
    pub kept: bool,
    /// Scenes whose runs are kept.
    pub scenes: Vec<RecordTable>,
}

/// The best runs of a scene.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct RecordTable {
    /// Name of the scene.
    pub scene: String,
    /// Which run is better: `time` or `points`.
    pub measure: String,
    /// The best first.
    pub records: Vec<RecordCard>,
}

/// A run that is kept.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct RecordCard {
    /// Name of its file: the scene, a dash and 16 digits.
    pub name: String,
    /// Ticks of its round.
    pub ticks: u32,
    /// Points of who won it.
    pub points: i32,
    /// Ticks of the replay before the round.
    pub begin: u32,
    /// Seat of the first who won it.
    pub seat: u16,
    /// Names of who won it.
    pub players: Vec<String>,
    /// Colour of the first who won it, an index into the palette.
    #[serde(skip_deserializing)]
    pub color: u8,
    /// When it was kept, seconds since 1970.
    #[serde(skip_deserializing)]
    pub unix_s: u64,
    /// Length of the file.
    #[serde(skip_deserializing)]
    pub bytes: u64,
}

/// Answer to what was sent: of `POST /api/rooms` and `POST /api/guest-rooms` a code and a key, of `POST /api/records` a
/// run, or an error.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
pub struct Posted {
    /// The word in the link of the room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// Makes the client that says hello with it the room's host.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_key: Option<String>,
    /// Rank of a run that is among the best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rank: Option<u32>,
    /// Why it was refused, for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The line of the error in a scene, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// The path of its field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// Content of the file there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<String>,
    /// Contents that are allowed there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed: Option<String>,
}

/// Answer to a run that proves itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubmittedRun {
    /// Name of its file, as in [`RecordCard::name`].
    pub name: String,
    /// Rank from 1; `None` if it is not among the best.
    pub rank: Option<u32>,
    /// Ticks of its round.
    pub ticks: u32,
    /// Points of who won it.
    pub points: i32,
}
