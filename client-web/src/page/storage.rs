//! The page's values in the browser's storage, shared by all tabs. A value is written only when this tab changes it, so
//! a tab with old values does not overwrite newer ones; values written by other tabs are adopted. A draft may replace
//! only the text from which it was derived ([`Draft`]).

use crate::page::drafts::{self, Draft};
use crate::page::event::Effect;
use jostle_game::scene::SCENE_BYTES_MAX;
use jostle_protocol::Token;
use litemap::LiteMap;

/// Storage keys for the settings and the player.
pub const LANGUAGE: &str = "jostle.language";
pub const CALM: &str = "jostle.calm";
pub const KEYS: &str = "jostle.keys";
pub const PAD: &str = "jostle.pad";
pub const PREDICT: &str = "jostle.predict";
pub const VOLUME: &str = "jostle.volume";
pub const MUTED: &str = "jostle.muted";
pub const CAPTIONS: &str = "jostle.captions";
const NAME: &str = "jostle.name";
const COLOR: &str = "jostle.color";
const OVER_HTTP: &str = "jostle.http";

/// The kinds of secrets that a tab stores for a room.
#[derive(Clone, Copy, Debug)]
pub enum Secret {
    Seat,
    /// Proves that the holder is the host.
    Host,
}

/// Stored values as most recently read or written by this tab.
#[derive(Debug, Default)]
pub struct Storage {
    /// Values shared by all tabs and visits.
    pub local: LiteMap<String, String>,
    pub session: LiteMap<String, String>,
    pub writes: Vec<Effect>,
}

impl Storage {
    /// The value stored under a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.local.get(key).map(String::as_str)
    }

    /// Stores a value for all visits if it differs.
    pub fn keep(&mut self, key: &str, value: &str) {
        if self.get(key) != Some(value) {
            self.local.insert(key.to_owned(), value.to_owned());
            self.writes.push(Effect::StoreLocal(key.to_owned(), Some(value.to_owned())));
        }
    }

    pub fn keep_flag(&mut self, key: &str, on: bool) {
        self.keep(key, if on { "1" } else { "0" });
    }

    /// Adopts a value that another tab wrote or removed.
    pub fn take(&mut self, key: &str, value: Option<String>) {
        match value {
            Some(value) => self.local.insert(key.to_owned(), value),
            None => self.local.remove(key),
        };
    }

    /// The player's name and colour.
    pub fn player(&self) -> (&str, Option<u8>) {
        (self.get(NAME).unwrap_or_default(), self.get(COLOR).and_then(|color| color.parse().ok()))
    }

    pub fn keep_player(&mut self, name: &str, color: u8) {
        self.keep(NAME, name);
        self.keep(COLOR, &color.to_string());
    }

    /// Whether prediction is on, according to the address or an earlier choice. It is on by default.
    pub fn predicts(&self, asked: Option<&str>) -> bool {
        asked.or_else(|| self.get(PREDICT)).is_none_or(|word| word != "0")
    }

    /// The volume in percent, whether sound is muted, and whether captions are on.
    pub fn sound(&self) -> (Option<u8>, bool, bool) {
        let is_on = |key| self.get(key) == Some("1");
        (self.get(VOLUME).and_then(|volume| volume.parse().ok()), is_on(MUTED), is_on(CAPTIONS))
    }

    /// The draft of a built-in scene or, for `None`, of a new scene.
    pub fn draft(&self, origin: Option<&str>) -> Option<&str> {
        self.get(&drafts::key(origin))
    }

    /// Stores a draft that was derived from `base`. An empty text removes the draft, so that the built-in scene is
    /// edited again. A text that is too long for a scene is not stored.
    pub fn keep_draft(&mut self, origin: Option<&str>, text: &str, base: Option<&str>) {
        if text.len() <= SCENE_BYTES_MAX {
            let text = Some(text).filter(|text| !text.is_empty());
            let [origin, text, base] = [origin, text, base].map(|part| part.map(str::to_owned));
            self.writes.push(Effect::StoreDraft(Draft { origin, text, base }));
        }
    }

    /// Whether this tab's newest game connection was one over HTTP.
    pub fn over_http(&self) -> bool {
        self.session.contains_key(OVER_HTTP)
    }

    /// Remembers for this tab whether a game connection over HTTP opened. Returns whether that is new.
    pub fn keep_over_http(&mut self, on: bool) -> bool {
        let value = on.then(|| "1".to_owned());
        let before = match &value {
            Some(value) => self.session.insert(OVER_HTTP.to_owned(), value.clone()),
            None => self.session.remove(OVER_HTTP),
        };
        let is_new = before != value;
        if is_new {
            self.writes.push(Effect::StoreSession(OVER_HTTP.to_owned(), value));
        }
        is_new
    }

    /// This tab's secret for a room, or one that a closed tab left behind.
    pub fn secret(&self, kind: Secret, room: &str) -> Option<Token> {
        let key = kind.key(room);
        Token::parse(self.session.get(&key).or_else(|| self.local.get(&key))?)
    }

    /// Leaves the seat in a room to the next tab that opens the room.
    pub fn leave_seat_behind(&mut self, room: &str) {
        let key = Secret::Seat.key(room);
        if let Some(token) = self.session.get(&key).cloned() {
            self.keep(&key, &token);
        }
    }

    /// Stores or removes this tab's secret for a room.
    pub fn set_secret(&mut self, kind: Secret, room: &str, token: Option<Token>) {
        let (key, text) = (kind.key(room), token.map(|token| token.text()));
        match &text {
            Some(text) => self.session.insert(key.clone(), text.clone()),
            None => self.session.remove(&key),
        };
        // Once the seat is taken or given up, no other tab may claim it with this secret.
        if self.local.remove(&key).is_some() {
            self.writes.push(Effect::StoreLocal(key.clone(), None));
        }
        self.writes.push(Effect::StoreSession(key, text));
    }
}

impl Secret {
    fn key(self, room: &str) -> String {
        match self {
            Secret::Seat => format!("jostle.seat.{room}"),
            Secret::Host => format!("jostle.host.{room}"),
        }
    }
}
