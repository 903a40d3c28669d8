//! Calls to the server's HTTP API, and the choice of the room that "Play" joins.

use jostle_game::scene::SceneError;
use jostle_protocol::web::{Posted, RecordCard, RecordTable, RoomCard, SceneCard};
#[cfg(not(target_arch = "wasm32"))]
use serde::de::DeserializeOwned;

#[cfg(target_arch = "wasm32")]
pub use super::json::parse;

/// The number of bots when a player plays a scene alone.
pub fn bots_alone(card: &SceneCard) -> u32 {
    bots_beside_one(card.heroes, [card.alone, card.players_min, card.players_max])
}

/// The number of bots for a single player, given a scene's settings: as many as the scene says, and at least enough for
/// a round to begin. Zero in scenes without heroes.
pub fn bots_beside_one(heroes: bool, [alone, players_min, players_max]: [u32; 3]) -> u32 {
    let seats = if heroes { alone.max(players_min).min(players_max) } else { 1 };
    seats.saturating_sub(1)
}

/// Whether the fastest run is the best one.
pub fn is_timed(table: &RecordTable) -> bool {
    table.measure == "time"
}

/// A link for watching the replay of a run.
pub fn watch(run: &RecordCard) -> String {
    format!("#replay=/records/{}.jostle", run.name)
}

/// A link for playing a run's scene alone, against the run's ghost.
pub fn race(run: &RecordCard, scene: &str) -> String {
    let number = run.name.rsplit('-').next().unwrap_or_default();
    format!("#alone={scene}&bots=0&ghost={number}.{}.{}", run.begin, run.seat)
}

/// Path to the server's static files.
pub const FILES: &str = "/assets";

/// The address of a scene file, given the path that contains all files.
pub fn scene_file(files: &str, name: &str) -> String {
    format!("{files}/scenes/{name}.toml")
}

/// The address of a replay file.
pub fn replay_file(name: &str) -> String {
    format!("/replays/{name}.jostle")
}

/// The name of the replay in the page's path.
pub fn replay_name(path: &str) -> Option<&str> {
    let name = path.strip_prefix("/replay/")?.trim_end_matches('/');
    let name = name.strip_suffix(".jostle").unwrap_or(name);
    (!name.is_empty()).then_some(name)
}

/// The value of a parameter in a query string.
pub fn query_value<'a>(query: &'a str, name: &str) -> Option<&'a str> {
    let pairs = query.trim_start_matches('?').split('&').filter_map(|pair| pair.split_once('='));
    pairs.filter(|(key, _)| *key == name).map(|(_, value)| value).next()
}

/// The error for a rejected scene, reported against the file of this name.
pub fn scene_error(refused: Posted, file: &str) -> Option<SceneError> {
    Some(SceneError {
        file: file.to_owned(),
        line: refused.line?,
        field: refused.field?,
        found: refused.found?,
        allowed: refused.allowed?,
    })
}

/// An error about a whole file, in the form in which the scene parser reports errors.
pub fn file_error(file: &str, found: &str, allowed: &str) -> SceneError {
    let (file, found, allowed) = (file.to_owned(), found.to_owned(), allowed.to_owned());
    SceneError { file, line: 1, field: "file".to_owned(), found, allowed }
}

#[cfg(not(target_arch = "wasm32"))]
pub fn parse<T: DeserializeOwned>(answer: &str) -> Option<T> {
    serde_json::from_str(answer).ok()
}

/// A call to the server's API.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    Rooms,
    Scenes,
    Replays,
    /// The best run of each scene.
    Records,
    /// The best runs of the scene with this name.
    BestRuns(String),
    /// Submits the replay of a run.
    Run(Vec<u8>),
    /// Opens a room with a scene. A private room is not listed.
    Open {
        /// Name of the scene.
        scene: String,
        private: bool,
        /// Host key of the room that the player closed before, whose players are led to the new one.
        after: Option<String>,
    },
    /// Asks for the room that the host of a closed room has opened since, given the player's token there.
    Next(String),
    /// Opens a private room with a scene given as text.
    OpenGuest(String),
}

/// Timeout of a call, milliseconds.
const TIMEOUT_MS: u32 = 8000;
/// Timeout of a call that makes the server test a scene, after any that are queued before it.
const TRIAL_TIMEOUT_MS: u32 = 40_000;
/// Timeout of a call that makes the server replay a run, after any that are queued before it.
const RUN_TIMEOUT_MS: u32 = 90_000;

impl Request {
    /// HTTP method and path.
    pub fn target(&self) -> (&'static str, String) {
        let (method, path) = match self {
            Request::Rooms => ("GET", "/api/rooms"),
            Request::Scenes => ("GET", "/api/scenes"),
            Request::Replays => ("GET", "/api/replays"),
            Request::Records => ("GET", "/api/records"),
            Request::BestRuns(_) => ("GET", "/api/records?scene="),
            Request::Run(_) => ("POST", "/api/records"),
            Request::Open { .. } => ("POST", "/api/rooms"),
            Request::Next(_) => ("POST", "/api/next"),
            Request::OpenGuest(_) => ("POST", "/api/guest-rooms"),
        };
        let scene = if let Request::BestRuns(scene) = self { scene } else { "" };
        (method, path.to_owned() + scene)
    }

    /// The body and its media type, if the request has one. Scene names contain nothing that JSON would escape.
    pub fn body(&self) -> Option<(Vec<u8>, &'static str)> {
        match self {
            Request::Open { scene, private, after } => {
                let mut json = format!(r#"{{"scene":"{scene}","private":{private}"#);
                if let Some(key) = after {
                    json.extend([r#","after":""#, key.as_str(), "\""]);
                }
                Some(((json + "}").into_bytes(), "application/json"))
            }
            Request::Next(token) => {
                let json = [r#"{"token":""#, token.as_str(), r#""}"#].concat();
                Some((json.into_bytes(), "application/json"))
            }
            Request::OpenGuest(text) => Some((text.clone().into_bytes(), "application/toml")),
            Request::Run(replay) => Some((replay.clone(), "application/octet-stream")),
            _ => None,
        }
    }

    /// Timeout of this call, milliseconds.
    pub fn timeout_ms(&self) -> u32 {
        match self {
            Request::OpenGuest(_) => TRIAL_TIMEOUT_MS,
            Request::Run(_) => RUN_TIMEOUT_MS,
            _ => TIMEOUT_MS,
        }
    }
}

/// The scene that "Play" prefers, and that it opens if no room has players.
pub const FIRST_SCENE: &str = "splash";

/// The room with the most connected players and a free seat in which a newcomer can play against others immediately.
/// Excludes the book's scenes and cooperative ones, in which a crew may be in the middle of its task.
pub fn liveliest<'a>(rooms: &'a [RoomCard], scenes: &[SceneCard]) -> Option<&'a RoomCard> {
    let is_open = |s: &SceneCard| s.heroes && s.teams != 1 && s.category != "book";
    let has_heroes = |room: &RoomCard| scenes.iter().all(|s| s.name != room.scene || is_open(s));
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
    use jostle_protocol::web::{Replays, Rooms};

    fn room(code: &str, players: u32) -> RoomCard {
        let (scene, title) = (FIRST_SCENE.to_owned(), "Splash".to_owned());
        RoomCard {
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
            alone: 0,
            picture: None,
        }
    }

    fn liveliest(rooms: &[RoomCard]) -> Option<&RoomCard> {
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
        let elsewhere =
            |code, players| RoomCard { scene: "hill".to_owned(), ..room(code, players) };
        assert_eq!(liveliest(&[room("a", 0), elsewhere("b", 0)]), None);
        let chosen = |rooms: &[RoomCard]| liveliest(rooms).map(|room| room.code.clone());
        assert_eq!(chosen(&[elsewhere("a", 3), room("b", 3)]).as_deref(), Some("b"));
        assert_eq!(chosen(&[elsewhere("a", 4), room("b", 3)]).as_deref(), Some("a"));
    }

    /// Seats of closed tabs do not count, and newcomers need a scene with heroes.
    #[test]
    fn play_joins_neither_absent_players_nor_a_scene_without_heroes() {
        let absent = RoomCard { connected: 0, ..room("a", 3) };
        let bounds = RoomCard { scene: "bounds".to_owned(), ..room("b", 5) };
        let lock = RoomCard { scene: "lock".to_owned(), ..room("d", 2) };
        assert_eq!(liveliest(&[absent.clone(), bounds.clone(), lock]), None);
        let one = room("c", 1);
        assert_eq!(liveliest(&[absent, bounds, one]).map(|room| room.code.as_str()), Some("c"));
    }

    #[test]
    fn a_player_alone_gets_the_bots_that_the_scene_wants() {
        let bots = |heroes, alone, players_min, players_max| {
            let card = SceneCard { alone, players_min, players_max, ..card("x", heroes) };
            bots_alone(&card)
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
        let error = scene_error(refused, "mine.toml").expect("it has a place");
        assert_eq!((error.line, &*error.field, &*error.file), (3, "size", "mine.toml"));
    }

    #[test]
    fn a_request_for_a_room_is_json() {
        let json = |request: &Request| -> serde_json::Value {
            let body = String::from_utf8(request.body().expect("a body").0).expect("text");
            parse(&body).expect("valid")
        };
        let open = |after| Request::Open { scene: "arena".to_owned(), private: true, after };
        assert_eq!(json(&open(None)), serde_json::json!({ "scene": "arena", "private": true }));
        let after = json(&open(Some("0f".to_owned())));
        assert_eq!(after["after"], "0f");
        assert_eq!(json(&Request::Next("0a".to_owned())), serde_json::json!({ "token": "0a" }));
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
