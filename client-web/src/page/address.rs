//! The page's address, and where it leads: to a room, a replay, the editor, or a game inside the page. The part after
//! `#` is never sent to a server.

use crate::net::api::{self, query_value};
use crate::net::scene_link;
use crate::page::event::Address;
use crate::world::daily;
use crate::world::ghost::GhostWish;
use crate::world::room_in_page::DemoRequest;
use jostle_game::Scene;
use jostle_game::scene::{WorstTick, is_name};

/// The fragment prefix before a replay's name.
const REPLAY: &str = "#replay=";
/// Estimated cost of a scene's worst tick above which the player is asked first, milliseconds. Beyond a tenth of a
/// second the page would appear to hang. The largest built-in scene, `hall`, stays below this.
const HEAVY_TICK_MS: f32 = 100.0;

/// The page's address, and whether the page has a server.
#[derive(Debug, Default)]
pub struct Site {
    pub address: Address,
    /// The part of the page's addresses that precedes the path.
    pub origin: String,
    /// Whether the page has no server.
    pub is_static: bool,
    /// Whether another page shows this one in a frame.
    pub is_framed: bool,
}

impl Site {
    /// Path of the lobby.
    pub fn home(&self) -> &str {
        if self.is_static { &self.address.path } else { "/" }
    }

    /// The page's address in its own tab, starting at the first slash.
    pub fn own_tab(&self) -> String {
        let Address { path, query, hash } = &self.address;
        [path.as_str(), query, hash].concat()
    }

    /// The link for a scene's text, starting at the first slash.
    pub fn scene_link(&self, text: &str) -> String {
        format!("{}{}{}", self.home(), scene_link::HASH, scene_link::encode(text))
    }

    /// The name of the site's scene that is played alone, and the seed of the game.
    pub fn alone(&self) -> (Option<&str>, u64) {
        let hash = &self.address.hash;
        (
            query_value(hash.trim_start_matches('#'), "alone"),
            PlayOptions::of(hash).seed.unwrap_or(1),
        )
    }
}

/// The place to which an address leads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination<'a> {
    Lobby,
    /// The room with this code, to play or to watch.
    Room {
        code: &'a str,
        watches: bool,
    },
    /// A replay, with its name and the address of its file.
    Replay(&'a str, String),
    /// The scene in a link.
    Linked(&'a str, PlayOptions),
    /// The track of the day with this date.
    Track(u32, PlayOptions),
    /// A game with one of the site's scenes.
    Scene(PendingGame),
    /// The editor, with a built-in scene or one of the player's own.
    Editor(Option<&'a str>),
}

impl<'a> Destination<'a> {
    pub fn of(address: &'a Address, is_static: bool) -> Destination<'a> {
        let Address { path, query, hash } = address;
        // Without a server, the path is just the page's folder.
        let path = if is_static { "/" } else { path };
        if let Some(origin) = edited(hash) {
            Destination::Editor(origin)
        } else if let Some(file) = hash.strip_prefix(REPLAY).filter(|file| !file.is_empty()) {
            Destination::Replay(file.rsplit('/').next().unwrap_or(file), file.to_owned())
        } else if let Some((link, wish)) = scene_link::in_hash(hash) {
            Destination::Linked(link, PlayOptions::of(wish))
        } else if let Some(date) = daily::in_hash(hash) {
            Destination::Track(date, PlayOptions::of(hash))
        } else if let Some(name) = query_value(hash.trim_start_matches('#'), "alone") {
            Destination::Scene(PendingGame::Alone(name.to_owned(), PlayOptions::of(hash)))
        } else if let Some(request) = DemoRequest::parse(query) {
            Destination::Scene(PendingGame::Demo(request))
        } else if let Some(name) = api::replay_name(path) {
            Destination::Replay(name, api::replay_file(name))
        } else {
            match path.trim_matches('/') {
                "" | "index.html" => Destination::Lobby,
                code => Destination::Room { code, watches: query_value(query, "watch").is_some() },
            }
        }
    }
}

/// Parses an `#edit` fragment and returns the name of a built-in scene, or none for a new scene.
fn edited(hash: &str) -> Option<Option<&str>> {
    match hash.strip_prefix("#edit")? {
        "" => Some(None),
        rest => Some(Some(rest.strip_prefix('=')?)).filter(|name| name.is_some_and(is_name)),
    }
}

/// An in-page game that is waiting for its scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PendingGame {
    Demo(DemoRequest),
    /// A scene to play alone, by name.
    Alone(String, PlayOptions),
    /// A scene to edit, by name.
    Edit(String),
}

impl PendingGame {
    /// Name of the scene.
    pub fn scene(&self) -> &str {
        match self {
            PendingGame::Demo(request) => &request.scene,
            PendingGame::Alone(scene, _) | PendingGame::Edit(scene) => scene,
        }
    }
}

/// Options for playing a scene alone. The same options start the same game.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlayOptions {
    /// The number of bots; the scene's default if not given.
    pub bots: Option<u16>,
    /// Seed of the game; 1 if not given.
    pub seed: Option<u64>,
    /// The run whose ghost is shown.
    pub ghost: Option<GhostWish>,
}

impl PlayOptions {
    /// Parses the options in an address fragment.
    pub fn of(hash: &str) -> PlayOptions {
        let number = |name| query_value(hash, name);
        PlayOptions {
            bots: number("bots").and_then(|bots| bots.parse().ok()),
            seed: number("seed").and_then(|seed| seed.parse().ok()),
            ghost: number("ghost").and_then(GhostWish::parse),
        }
    }

    /// The number of bots in a game with this scene: as requested, or as the scene specifies, but at least as many as a
    /// round needs.
    pub fn bots_in(&self, scene: &Scene) -> u16 {
        let round = scene.rules.round.as_ref();
        let (alone, players_min) = round.map_or((0, 1), |round| (round.alone, round.players_min));
        let [needed, wanted] = [0, alone].map(|alone| {
            let seats = [alone, players_min, scene.players_max].map(u32::from);
            api::bots_beside_one(scene.hero.is_some(), seats) as u16
        });
        self.bots.unwrap_or(wanted).max(needed)
    }

    /// The worst tick of a scene, if it may be too heavy for the page.
    pub fn heavy_tick(scene: &Scene) -> Option<WorstTick> {
        Some(WorstTick::of(scene)).filter(|worst| worst.ms > HEAVY_TICK_MS)
    }
}
