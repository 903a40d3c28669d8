//! The server's HTTP answers about rooms and scenes, and which room "Play" joins.

use jostle_game::scene::SceneError;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Answer of `GET /api/rooms`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Rooms {
    /// Open rooms.
    pub rooms: Vec<Room>,
}

#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Room {
    /// The word in its link.
    pub code: String,
    /// Name of its scene.
    pub scene: String,
    /// Title of its scene.
    pub title: String,
    pub players: u32,
    /// Of these, players who are there now.
    #[serde(default)]
    pub connected: u32,
    #[serde(default)]
    pub spectators: u32,
    pub players_max: u32,
}

/// Answer of `GET /api/scenes`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Scenes {
    /// Scenes that a room can be opened with.
    pub scenes: Vec<SceneCard>,
}

/// A scene as the lobby shows it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct SceneCard {
    pub name: String,
    pub title: String,
    pub about: String,
    pub players_max: u32,
    /// Where it is shown: `games`, `playgrounds` or `book`.
    #[serde(default)]
    pub category: String,
    /// Teams; 0 if each player plays alone.
    #[serde(default)]
    pub teams: u32,
    /// Length of a round, seconds; 0 where none ends by itself.
    #[serde(default)]
    pub round_s: u32,
    /// Whether each player has a hero.
    #[serde(default)]
    pub heroes: bool,
    /// Players without whom no round begins.
    #[serde(default)]
    pub players_min: u32,
    /// Seats that bots take.
    #[serde(default)]
    pub fill: u32,
    /// Address of its picture.
    pub picture: Option<String>,
}

impl SceneCard {
    /// Bots beside a player who plays alone.
    pub fn bots_alone(&self) -> u32 {
        bots_beside_one(self.heroes, [self.fill, self.players_min, self.players_max])
    }
}

/// Bots beside a player who plays alone, by the numbers of a scene: as many as would fill a room of the server, and
/// at least as many as a round needs to begin. None where players have no heroes.
pub fn bots_beside_one(heroes: bool, [fill, players_min, players_max]: [u32; 3]) -> u32 {
    let seats = if heroes { fill.max(players_min).min(players_max) } else { 1 };
    seats.saturating_sub(1)
}

/// Answer of `GET /api/replays`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Replays {
    /// Newest first.
    pub replays: Vec<ReplayCard>,
}

/// A replay as the lobby shows it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct ReplayCard {
    /// Its name: `/replays/NAME.jostle` is the file, `/replay/NAME` the page that plays it.
    pub name: String,
    /// Name of its scene.
    pub scene: String,
    /// Code of the room.
    pub room: String,
    /// When it began, seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Length of the file by now.
    pub bytes: u64,
    /// Length of the game by now, seconds; unknown if its end is missing.
    #[serde(default)]
    pub seconds: Option<u32>,
    /// Most players at a time; 0 if unknown.
    #[serde(default)]
    pub players: u32,
    /// Whether it still grows.
    pub recording: bool,
}

/// Answer of `GET /api/records`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Records {
    /// Scenes whose runs are kept.
    pub scenes: Vec<RecordTable>,
}

/// The best runs of a scene.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct RecordTable {
    /// Name of the scene.
    pub scene: String,
    /// Which run is better: `time` or `points`.
    pub measure: String,
    /// The best first.
    pub records: Vec<RecordCard>,
}

impl RecordTable {
    /// Whether the fastest run is the best.
    pub fn is_timed(&self) -> bool {
        self.measure == "time"
    }
}

/// A run that is kept.
#[derive(Clone, Debug, Deserialize, PartialEq)]
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
}

impl RecordCard {
    /// The link that plays its replay.
    pub fn watch(&self) -> String {
        format!("#replay=/records/{}.jostle", self.name)
    }

    /// The link that plays its scene alone, beside its ghost.
    pub fn race(&self, scene: &str) -> String {
        let number = self.name.rsplit('-').next().unwrap_or_default();
        format!("#alone={scene}&bots=0&ghost={number}.{}.{}", self.begin, self.seat)
    }
}

/// Folder of the server's files.
pub const FILES: &str = "/assets";

/// Address of a scene's file in the folder of all files.
pub fn scene_file(files: &str, name: &str) -> String {
    format!("{files}/scenes/{name}.toml")
}

/// Address of a replay's file.
pub fn replay_file(name: &str) -> String {
    format!("/replays/{name}.jostle")
}

/// The replay that a path of the page names.
pub fn replay_name(path: &str) -> Option<&str> {
    let name = path.strip_prefix("/replay/")?.trim_end_matches('/');
    let name = name.strip_suffix(".jostle").unwrap_or(name);
    (!name.is_empty()).then_some(name)
}

/// The value of a name in the part of an address after `?`.
pub fn query_value<'a>(query: &'a str, name: &str) -> Option<&'a str> {
    let pairs = query.trim_start_matches('?').split('&').filter_map(|pair| pair.split_once('='));
    pairs.filter(|(key, _)| *key == name).map(|(_, value)| value).next()
}

/// Answer to what was sent: of `POST /api/rooms` and `POST /api/guest-rooms` a code and a key, of `POST /api/records` a rank,
/// or an error.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Posted {
    /// The word in the link of the room.
    pub code: Option<String>,
    /// Makes the client that says hello with it the room's host.
    pub host_key: Option<String>,
    /// Of a run that is among the best.
    pub rank: Option<u32>,
    /// Why it was refused, for people.
    pub error: Option<String>,
    /// The line of the error in a scene, from 1.
    pub line: Option<usize>,
    /// The path of its field.
    pub field: Option<String>,
    /// Content of the file there.
    pub found: Option<String>,
    /// Contents that are allowed there.
    pub allowed: Option<String>,
}

impl Posted {
    /// The error of a scene that was refused, for its file of this name.
    pub fn scene_error(self, file: &str) -> Option<SceneError> {
        Some(SceneError {
            file: file.to_owned(),
            line: self.line?,
            field: self.field?,
            found: self.found?,
            allowed: self.allowed?,
        })
    }
}

/// Reads an answer with the browser's own parser; one of ours would add to the download.
#[cfg(target_arch = "wasm32")]
pub fn parse<T: DeserializeOwned>(answer: &str) -> Option<T> {
    serde_wasm_bindgen::from_value(js_sys::JSON::parse(answer).ok()?).ok()
}

#[cfg(not(target_arch = "wasm32"))]
pub fn parse<T: DeserializeOwned>(answer: &str) -> Option<T> {
    serde_json::from_str(answer).ok()
}

/// A call to the server's API.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// The open rooms.
    Rooms,
    Scenes,
    Replays,
    Records,
    /// Sends the replay of a run.
    Run(Vec<u8>),
    /// Opens a room with a scene; a private one is not listed.
    Open {
        /// Name of the scene.
        scene: String,
        private: bool,
    },
    /// Opens a private room with the scene of this text.
    OpenGuest(String),
}

/// Time after which a call counts as unanswered, milliseconds.
const TIMEOUT_MS: u32 = 8000;
/// The same where a scene is tried first, after those of others.
const TRIAL_TIMEOUT_MS: u32 = 40_000;
/// The same where a run is played again, after those of others.
const RUN_TIMEOUT_MS: u32 = 90_000;

impl Request {
    /// HTTP method and path.
    pub fn target(&self) -> (&'static str, &'static str) {
        match self {
            Request::Rooms => ("GET", "/api/rooms"),
            Request::Scenes => ("GET", "/api/scenes"),
            Request::Replays => ("GET", "/api/replays"),
            Request::Records => ("GET", "/api/records"),
            Request::Run(_) => ("POST", "/api/records"),
            Request::Open { .. } => ("POST", "/api/rooms"),
            Request::OpenGuest(_) => ("POST", "/api/guest-rooms"),
        }
    }

    /// Body and its media type, if it has one. Names of scenes hold nothing that would need an escape.
    pub fn body(&self) -> Option<(Vec<u8>, &'static str)> {
        match self {
            Request::Open { scene, private } => {
                let json = format!(r#"{{"scene":"{scene}","private":{private}}}"#);
                Some((json.into_bytes(), "application/json"))
            }
            Request::OpenGuest(text) => Some((text.clone().into_bytes(), "application/toml")),
            Request::Run(replay) => Some((replay.clone(), "application/octet-stream")),
            _ => None,
        }
    }

    /// Time after which it counts as unanswered, milliseconds.
    pub fn timeout_ms(&self) -> u32 {
        match self {
            Request::OpenGuest(_) => TRIAL_TIMEOUT_MS,
            Request::Run(_) => RUN_TIMEOUT_MS,
            _ => TIMEOUT_MS,
        }
    }
}

/// The scene that "Play" prefers, and opens when no room has players.
pub const FIRST_SCENE: &str = "splash";

/// The liveliest room with a free seat and somebody in it now, in which a newcomer plays against others at
/// once: not a scene of the book, nor one that a crew is in the middle of.
pub fn liveliest<'a>(rooms: &'a [Room], scenes: &[SceneCard]) -> Option<&'a Room> {
    let is_open = |s: &SceneCard| s.heroes && s.teams != 1 && s.category != "book";
    let has_heroes = |room: &Room| scenes.iter().all(|s| s.name != room.scene || is_open(s));
    let joinable = rooms
        .iter()
        .filter(|room| room.players < room.players_max && room.connected > 0 && has_heroes(room));
    joinable.max_by_key(|room| {
        (room.connected, room.scene == FIRST_SCENE, std::cmp::Reverse(&room.code))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(code: &str, players: u32) -> Room {
        let (scene, title) = (FIRST_SCENE.to_owned(), "Splash".to_owned());
        Room {
            code: code.to_owned(),
            scene,
            title,
            players,
            connected: players,
            spectators: 0,
            players_max: 8,
        }
    }

    fn card(name: &str, heroes: bool) -> SceneCard {
        let (title, about) = (name.to_owned(), String::new());
        let (category, teams, round_s) = ("games".to_owned(), 0, 0);
        let name = name.to_owned();
        SceneCard {
            name,
            title,
            about,
            players_max: 8,
            category,
            teams,
            round_s,
            heroes,
            players_min: 1,
            fill: 0,
            picture: None,
        }
    }

    fn liveliest(rooms: &[Room]) -> Option<&Room> {
        let crew = SceneCard { teams: 1, ..card("lock", true) };
        let scenes = [card(FIRST_SCENE, true), card("hill", true), card("bounds", false), crew];
        super::liveliest(rooms, &scenes)
    }

    #[test]
    fn play_joins_the_fullest_room_with_a_free_seat() {
        let rooms = [room("a", 1), room("b", 8), room("c", 5), room("d", 5)];
        assert_eq!(liveliest(&rooms).map(|r| r.code.as_str()), Some("c"));
        assert_eq!(liveliest(&rooms[1..2]), None);
        assert_eq!(liveliest(&[]), None);
    }

    #[test]
    fn play_joins_no_empty_room_and_prefers_the_first_scene() {
        let elsewhere = |code, players| Room { scene: "hill".to_owned(), ..room(code, players) };
        assert_eq!(liveliest(&[room("a", 0), elsewhere("b", 0)]), None);
        let chosen = |rooms: &[Room]| liveliest(rooms).map(|room| room.code.clone());
        assert_eq!(chosen(&[elsewhere("a", 3), room("b", 3)]).as_deref(), Some("b"));
        assert_eq!(chosen(&[elsewhere("a", 4), room("b", 3)]).as_deref(), Some("a"));
    }

    /// Seats of closed tabs are no company, and a newcomer wants a hero.
    #[test]
    fn play_joins_neither_absent_players_nor_a_scene_without_heroes() {
        let absent = Room { connected: 0, ..room("a", 3) };
        let bounds = Room { scene: "bounds".to_owned(), ..room("b", 5) };
        let lock = Room { scene: "lock".to_owned(), ..room("d", 2) };
        assert_eq!(liveliest(&[absent.clone(), bounds.clone(), lock]), None);
        let one = room("c", 1);
        assert_eq!(liveliest(&[absent, bounds, one]).map(|room| room.code.as_str()), Some("c"));
    }

    #[test]
    fn a_player_alone_gets_the_bots_that_the_scene_wants() {
        let bots = |heroes, fill, players_min, players_max| {
            let card = SceneCard { fill, players_min, players_max, ..card("x", heroes) };
            card.bots_alone()
        };
        assert_eq!([bots(true, 4, 1, 16), bots(true, 0, 1, 16), bots(true, 0, 2, 12)], [3, 0, 1]);
        assert_eq!(bots(true, 8, 1, 4), 3, "as many as there are seats");
        assert_eq!([bots(false, 4, 2, 8), bots(true, 0, 0, 1)], [0, 0]);
    }

    #[test]
    fn answers_are_read() {
        let rooms: Rooms = parse(
            r#"{"rooms":[{"code":"x","scene":"arena","title":"Arena","players":1,"players_max":8,"more":0}]}"#,
        )
        .expect("valid");
        assert_eq!(rooms.rooms[0].players, 1);
        let replays: Replays = parse(
            r#"{"replays":[{"name":"a-1","scene":"arena","room":"x","unix_s":1,"bytes":2,"recording":true}],"errors":0,"dropped":0}"#,
        )
        .expect("valid");
        assert!(replays.replays[0].recording);
        let opened: Posted = parse(r#"{"code":"abc","host_key":"0f"}"#).expect("valid");
        let (code, host_key) = (Some("abc".into()), Some("0f".into()));
        assert_eq!(opened, Posted { code, host_key, ..Posted::default() });
        let refused: Posted = parse(r#"{"error":"full"}"#).expect("valid");
        assert_eq!(refused, Posted { error: Some("full".into()), ..Posted::default() });
        assert_eq!(parse::<Posted>("<html>"), None);
        let refused: Posted = parse(
            r#"{"error":"guest.toml:3: size","line":3,"field":"size","found":"[9000, 1]","allowed":"less"}"#,
        )
        .expect("valid");
        let error = refused.scene_error("mine.toml").expect("it has a place");
        assert_eq!((error.line, &*error.field, &*error.file), (3, "size", "mine.toml"));
    }

    #[test]
    fn a_request_for_a_room_is_json() {
        let body = Request::Open { scene: "arena".to_owned(), private: true }.body();
        let body = String::from_utf8(body.expect("a body").0).expect("text");
        let body: serde_json::Value = parse(&body).expect("valid");
        assert_eq!(body, serde_json::json!({ "scene": "arena", "private": true }));
    }

    #[test]
    fn a_link_to_a_replay_names_it() {
        assert_eq!(replay_name("/replay/arena-1"), Some("arena-1"));
        assert_eq!(replay_name("/replay/arena-1.jostle/"), Some("arena-1"));
        assert_eq!(replay_name("/replay/"), None);
        assert_eq!(replay_name("/replay"), None);
        assert_eq!(replay_name("/arena"), None);
        assert_eq!(replay_file("arena-1"), "/replays/arena-1.jostle");
    }
}
