//! The JSON answers of the HTTP API. They are written by the server and the static page, and read by the page.

use jostle_game::Scene;
use jostle_sim::TICKS_PER_SECOND;
use serde::{Deserialize, Serialize};

/// Answer of `GET /api/rooms`. With `?find=TEXT` it has only rooms whose code or title contains the text.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Rooms {
    /// Open public rooms, at most [`ROOMS_LISTED_MAX`]; beyond that, those with the most people.
    pub rooms: Vec<RoomCard>,
    /// Number of all such rooms, listed or not.
    #[serde(default)]
    pub total: u32,
}

/// Maximum number of rooms in a list; every visitor of the lobby requests one every few seconds.
pub const ROOMS_LISTED_MAX: usize = 100;

/// A room as the lobby shows it.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct RoomCard {
    /// The word in the room's link.
    pub code: String,
    /// Name of the room's scene.
    pub scene: String,
    /// Title of the room's scene.
    pub title: String,
    /// Number of taken seats.
    pub players: u32,
    /// Players who are connected now.
    #[serde(default)]
    pub connected: u32,
    /// Number of spectators.
    #[serde(default)]
    pub spectators: u32,
    /// Number of seats.
    pub players_max: u32,
}

/// Answer of `GET /api/scenes`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Scenes {
    /// Scenes that a room can be opened with.
    pub scenes: Vec<SceneCard>,
    /// Who may open a room with their own scene; `None` for a page without a server.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub guest_scenes: Option<&'static str>,
}

/// A scene as the lobby shows it. Every visitor downloads all of them, so zeros are omitted.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct SceneCard {
    /// Name of the scene, as in its file.
    pub name: String,
    /// Title, for people.
    pub title: String,
    /// A one-sentence description.
    pub about: String,
    /// Seats in a room with this scene.
    pub players_max: u32,
    /// Section of the lobby: `games`, `playgrounds` or `book`.
    #[serde(default)]
    pub category: String,
    /// Number of teams; 0 if each player plays alone.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub teams: u32,
    /// Length of a round, seconds; 0 if rounds have no time limit.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub round_s: u32,
    /// Whether each player has a hero.
    #[serde(default)]
    pub heroes: bool,
    /// Minimum number of players for a round to begin.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub players_min: u32,
    /// Number of seats that bots fill.
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
    /// Creates the card of a scene. `picture` is the address of its picture.
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
    /// Number of recordings that ended because of a disk failure.
    #[serde(skip_deserializing)]
    pub errors: u64,
    /// Number of those that ended because the disk was too slow.
    #[serde(skip_deserializing)]
    pub dropped: u64,
}

/// A replay as the lobby shows it.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
pub struct ReplayCard {
    /// The replay's name without extension: `/replays/NAME.jostle` is the file, `/replay/NAME` the page that plays it.
    pub name: String,
    /// Name of the replay's scene.
    pub scene: String,
    /// Code of the room.
    pub room: String,
    /// Start of the recording, seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Length of the file so far, complete records only, bytes.
    pub bytes: u64,
    /// Length of the game so far, seconds; `None` if its end is missing.
    #[serde(default)]
    pub seconds: Option<u32>,
    /// Largest number of simultaneous players, bots included; 0 if unknown.
    #[serde(default)]
    pub players: u32,
    /// Whether it is still being recorded.
    pub recording: bool,
}

/// Answer of `GET /api/records`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Records {
    /// Whether the server stores best runs.
    #[serde(skip_deserializing)]
    pub kept: bool,
    /// Scenes for which runs are stored.
    pub scenes: Vec<RecordTable>,
}

/// The best runs of a scene.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct RecordTable {
    /// Name of the scene.
    pub scene: String,
    /// The measure that ranks runs: `time` or `points`.
    pub measure: String,
    /// The runs, best first.
    pub records: Vec<RecordCard>,
}

/// A stored run.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct RecordCard {
    /// Name of its file: the scene, a dash and 16 digits.
    pub name: String,
    /// Length of the round in ticks.
    pub ticks: u32,
    /// Points of the winners.
    pub points: i32,
    /// Ticks in the replay before the round.
    pub begin: u32,
    /// Seat of the first winner.
    pub seat: u16,
    /// Names of the winners.
    pub players: Vec<String>,
    /// Colour of the first winner, an index into the palette.
    #[serde(skip_deserializing)]
    pub color: u8,
    /// Time when the run was stored, seconds since 1970.
    #[serde(skip_deserializing)]
    pub unix_s: u64,
    /// Length of the file, bytes.
    #[serde(skip_deserializing)]
    pub bytes: u64,
}

/// Answer to a POST request: a code and a key from `/api/rooms` and `/api/guest-rooms`, a run from `/api/records`, or
/// an error.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
pub struct Posted {
    /// The word in the room's link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// A client that sends this key in its hello becomes the room's host.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_key: Option<String>,
    /// Rank of a run, if it is among the best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rank: Option<u32>,
    /// The reason for a refusal, for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Line of the error in the scene, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Path of the faulty field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// The content found there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<String>,
    /// The allowed content.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed: Option<String>,
}

/// Answer to a submitted run that has been verified.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubmittedRun {
    /// Name of the run's file, as in [`RecordCard::name`].
    pub name: String,
    /// Rank from 1; `None` if it is not among the best.
    pub rank: Option<u32>,
    /// Length of the round in ticks.
    pub ticks: u32,
    /// Points of the winners.
    pub points: i32,
}
