//! Everything a handler of an event may use besides its own state: the time, effects to request,
//! remembered values, chance, and numbers that are never used twice.

use crate::page::event::Effect;
use jostle_game::scene::SCENE_BYTES_MAX;
use jostle_protocol::Token;
use jostle_sim::Rng;
use std::collections::BTreeMap;

const NAME_KEY: &str = "jostle.name";
const COLOR_KEY: &str = "jostle.color";
const PREDICT_KEY: &str = "jostle.predict";
const VOLUME_KEY: &str = "jostle.volume";
const MUTED_KEY: &str = "jostle.muted";
const CAPTIONS_KEY: &str = "jostle.captions";
/// The draft of a scene of one's own; that of a shipped scene has a dot and its name behind it.
const DRAFT_KEY: &str = "jostle.draft";
const SEAT_PREFIX: &str = "jostle.seat.";

/// Values that the browser remembered, read once when the page is opened.
#[derive(Clone, Debug, Default)]
pub struct Remembered {
    /// For all visits.
    pub local: BTreeMap<String, String>,
    /// For this tab.
    pub session: BTreeMap<String, String>,
}

impl Remembered {
    /// Keys of settings.
    pub const LANGUAGE: &str = "jostle.language";
    pub const CALM: &str = "jostle.calm";
    pub const KEYS: &str = "jostle.keys";
    pub const PAD: &str = "jostle.pad";

    /// What was remembered under a key of the settings.
    pub fn setting(&self, key: &str) -> Option<&str> {
        self.local.get(key).map(String::as_str)
    }

    /// The remembered name and colour.
    pub fn player(&self) -> (&str, Option<u8>) {
        let name = self.local.get(NAME_KEY).map_or("", String::as_str);
        (name, self.local.get(COLOR_KEY).and_then(|color| color.parse().ok()))
    }

    /// The remembered volume in percent, whether sound is off, and whether captions are on.
    pub fn sound(&self) -> (Option<u8>, bool, bool) {
        let is_on = |key| self.local.get(key).is_some_and(|word| word == "1");
        let volume = self.local.get(VOLUME_KEY).and_then(|volume| volume.parse().ok());
        (volume, is_on(MUTED_KEY), is_on(CAPTIONS_KEY))
    }

    /// Whether prediction is on, by the address or by an earlier choice; on by default.
    pub fn predicts(&self, asked: Option<&str>) -> bool {
        let stored = || self.local.get(PREDICT_KEY).map(String::as_str);
        asked.or_else(stored).is_none_or(|word| word != "0")
    }
}

fn draft_key(origin: Option<&str>) -> String {
    origin.map_or(DRAFT_KEY.to_owned(), |name| format!("{DRAFT_KEY}.{name}"))
}

/// The context in which an event is handled.
pub struct Context {
    /// Time of the event, milliseconds since the page was opened.
    pub now_ms: f64,
    /// Effects requested so far.
    pub effects: Vec<Effect>,
    /// The own hero is shown ahead of the server.
    pub predicts: bool,
    /// The page has no server.
    pub is_static: bool,
    /// The clock itself, for work that is to end in time.
    pub clock: fn() -> f64,
    session: BTreeMap<String, String>,
    /// Seats that tabs left behind when they were closed, by the keys of their secrets.
    left: BTreeMap<String, String>,
    /// Texts of scenes that are edited, by their keys.
    drafts: BTreeMap<String, String>,
    rng: Rng,
    last_number: u32,
}

/// The kinds of secrets that a tab keeps for a room.
#[derive(Clone, Copy, Debug)]
pub enum Secret {
    /// Gives a seat back.
    Seat,
    /// Makes its holder the host.
    Host,
}

impl Context {
    /// A context at time zero.
    pub fn new(remembered: Remembered, predicts: bool, seed: u64) -> Context {
        let Remembered { mut local, session } = remembered;
        let mut drafts = local.clone();
        drafts.retain(|key, _| key.starts_with(DRAFT_KEY));
        local.retain(|key, _| key.starts_with(SEAT_PREFIX));
        Context {
            now_ms: 0.0,
            effects: Vec::new(),
            predicts,
            is_static: false,
            clock: || 0.0,
            session,
            left: local,
            drafts,
            rng: Rng::new(seed, 0),
            last_number: 0,
        }
    }

    pub fn request(&mut self, effect: Effect) {
        self.effects.push(effect);
    }

    /// A number of its own, from 1 on.
    pub fn next_number(&mut self) -> u32 {
        self.last_number += 1;
        self.last_number
    }

    /// A random number in [0, 1).
    pub fn random(&mut self) -> f64 {
        f64::from(self.rng.range(0.0, 1.0))
    }

    pub fn random_bits(&mut self) -> u32 {
        self.rng.next_u32()
    }

    pub fn remember_player(&mut self, name: &str, color: u8) {
        self.store(NAME_KEY, name.to_owned());
        self.store(COLOR_KEY, color.to_string());
    }

    pub fn remember_prediction(&mut self, on: bool) {
        self.predicts = on;
        self.store(PREDICT_KEY, u8::from(on).to_string());
    }

    pub fn remember_sound(&mut self, volume: u8, muted: bool, captioned: bool) {
        self.store(VOLUME_KEY, volume.to_string());
        self.store(MUTED_KEY, u8::from(muted).to_string());
        self.store(CAPTIONS_KEY, u8::from(captioned).to_string());
    }

    /// Remembers a setting for later visits.
    pub fn remember(&mut self, key: &str, value: &str) {
        self.store(key, value.to_owned());
    }

    fn store(&mut self, key: &str, value: String) {
        self.request(Effect::StoreLocal(key.to_owned(), Some(value)));
    }

    /// The draft of a shipped scene, or of a scene of one's own (`None`).
    pub fn draft(&self, origin: Option<&str>) -> Option<&String> {
        self.drafts.get(&draft_key(origin))
    }

    /// Keeps a draft in place of the former one of the same scene. An empty text is forgotten, so that the shipped scene
    /// is edited again; one that can be no scene, because it is too long, is not kept.
    pub fn keep_draft(&mut self, origin: Option<&str>, text: &str) {
        let key = draft_key(origin);
        if text.is_empty() {
            self.drafts.remove(&key);
            self.request(Effect::StoreLocal(key, None));
        } else if text.len() <= SCENE_BYTES_MAX {
            self.store(&key, text.to_owned());
            self.drafts.insert(key, text.to_owned());
        }
    }

    /// A secret of this tab for a room, or of one that was closed.
    pub fn secret(&self, kind: Secret, room: &str) -> Option<Token> {
        let key = kind.key(room);
        Token::parse(self.session.get(&key).or_else(|| self.left.get(&key))?)
    }

    /// Leaves the seat in a room behind for the next tab that comes to it.
    pub fn leave_seat_behind(&mut self, room: &str) {
        let key = Secret::Seat.key(room);
        if let Some(token) = self.session.get(&key).cloned() {
            self.request(Effect::StoreLocal(key, Some(token)));
        }
    }

    /// Remembers a secret of this tab for a room, or forgets it.
    pub fn set_secret(&mut self, kind: Secret, room: &str, token: Option<Token>) {
        let (key, text) = (kind.key(room), token.map(|token| token.text()));
        match &text {
            Some(text) => self.session.insert(key.clone(), text.clone()),
            None => self.session.remove(&key),
        };
        // Once it is taken, or given up, no other tab may come with it.
        if self.left.remove(&key).is_some() {
            self.request(Effect::StoreLocal(key.clone(), None));
        }
        self.request(Effect::StoreSession(key, text));
    }
}

impl Secret {
    fn key(self, room: &str) -> String {
        match self {
            Secret::Seat => format!("{SEAT_PREFIX}{room}"),
            Secret::Host => format!("jostle.host.{room}"),
        }
    }
}
