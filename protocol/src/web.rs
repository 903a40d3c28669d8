//! The JSON answers of the HTTP API. The server and the static page write them, and the page reads them.

use jostle_game::Scene;
use jostle_sim::TICKS_PER_SECOND;
use serde::{Deserialize, Serialize};

/// Answer to `GET /api/rooms`. With `?find=TEXT`, it contains only rooms whose code or title contains the text.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Rooms {
    /// Open public rooms, up to [`ROOMS_LISTED_MAX`]; if there are more, those with the most people.
    pub rooms: Vec<RoomCard>,
    /// Total number of such rooms, listed or not.
    #[serde(default)]
    pub total: u32,
}

/// Maximum number of rooms in a list; each visitor in the lobby requests one every few seconds.
pub const ROOMS_LISTED_MAX: usize = 100;

/// A room as shown in the lobby.
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
    /// Number of currently connected players.
    #[serde(default)]
    pub connected: u32,
    /// Number of spectators.
    #[serde(default)]
    pub spectators: u32,
    /// Number of seats.
    pub players_max: u32,
}

/// Answer to `GET /api/scenes`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Scenes {
    /// Scenes with which a room can be opened.
    pub scenes: Vec<SceneCard>,
    /// Who may open rooms with their own scenes; `None` for a page without a server.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub guest_scenes: Option<&'static str>,
}

/// A scene as shown in the lobby. Every visitor downloads all of them, so zeros are omitted.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct SceneCard {
    /// Name of the scene, as in its file.
    pub name: String,
    /// Title for people to read.
    pub title: String,
    /// A one-sentence description.
    pub about: String,
    /// Number of seats in a room with this scene.
    pub players_max: u32,
    /// The section in the lobby: `games`, `gallery`, `playgrounds` or `book`.
    #[serde(default)]
    pub category: String,
    /// Number of teams; 0 if each player plays alone.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub teams: u32,
    /// Length of a round, in seconds; 0 if rounds have no time limit.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub round_s: u32,
    /// Whether each player has a hero.
    #[serde(default)]
    pub heroes: bool,
    /// Minimum number of players needed for a round to begin.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub players_min: u32,
    /// Number of seats that bots fill.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub fill: u32,
    /// Number of seats in a game that one player plays alone, of which bots take all but one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub alone: u32,
    /// Address of the scene's picture.
    #[serde(default)]
    pub picture: Option<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(number: &u32) -> bool {
    *number == 0
}

impl SceneCard {
    /// Creates a scene's card. `picture` is the address of the scene's picture.
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
            alone: round.map_or(0, |round| u32::from(round.alone)),
            picture,
        }
    }
}

/// Answer to `GET /api/replays`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Replays {
    /// The replays, newest first.
    pub replays: Vec<ReplayCard>,
    /// Number of recordings that ended because of a disk failure.
    #[serde(skip_deserializing)]
    pub errors: u64,
    /// Number of these recordings that ended because the disk was too slow.
    #[serde(skip_deserializing)]
    pub dropped: u64,
}

/// A replay as shown in the lobby.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
pub struct ReplayCard {
    /// The replay's name without its extension. The file is `/replays/NAME.jostle`, and the page that plays it is
    /// `/replay/NAME`.
    pub name: String,
    /// Name of the replay's scene.
    pub scene: String,
    /// The room's code.
    pub room: String,
    /// Start of the recording, in seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Length of the file so far, counting only complete records, in bytes.
    pub bytes: u64,
    /// Length of the game so far, in seconds; `None` if its end is missing.
    #[serde(default)]
    pub seconds: Option<u32>,
    /// The largest number of simultaneous players, including bots; 0 if unknown.
    #[serde(default)]
    pub players: u32,
    /// Whether the replay is still being recorded.
    pub recording: bool,
}

/// Answer to `GET /api/records`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Records {
    /// Whether the server stores best runs.
    #[serde(skip_deserializing)]
    pub kept: bool,
    /// Scenes for which runs are stored.
    pub scenes: Vec<RecordTable>,
}

/// A scene's best runs.
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
    /// Name of the run's file: the scene, a dash and 16 digits.
    pub name: String,
    /// The round's length in ticks.
    pub ticks: u32,
    /// The winners' points.
    pub points: i32,
    /// Number of ticks in the replay before the round.
    pub begin: u32,
    /// Seat of the first winner.
    pub seat: u16,
    /// The winners' names.
    pub players: Vec<String>,
    /// Colour of the first winner, as an index into the palette.
    #[serde(skip_deserializing)]
    pub color: u8,
    /// Time when the run was stored, in seconds since 1970.
    #[serde(skip_deserializing)]
    pub unix_s: u64,
    /// Length of the file, in bytes.
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
    /// The run's rank, if it is among the best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rank: Option<u32>,
    /// The reason for a refusal, in a form for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Line of the error in the scene, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Path of the faulty field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// The value found there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<String>,
    /// The values allowed there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed: Option<String>,
}

/// Answer for a submitted run that has been verified.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubmittedRun {
    /// Name of the run's file, as in [`RecordCard::name`].
    pub name: String,
    /// Rank, starting at 1; `None` if the run is not among the best.
    pub rank: Option<u32>,
    /// The round's length in ticks.
    pub ticks: u32,
    /// The winners' points.
    pub points: i32,
}
