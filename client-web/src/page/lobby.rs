//! The lobby: the player's form, open rooms, scenes and replays, and the note under the form.

use crate::net::api::{self, Request};
use crate::page::context::Context;
use crate::page::event::{Effect, Form};
use crate::page::storage::Secret;
use crate::page::{name, strings};
use crate::world::daily;
use jostle_protocol::web::{Posted, ReplayCard, Replays, RoomCard, Rooms, SceneCard, Scenes};
use jostle_protocol::{Appearance, Token};
use serde::de::DeserializeOwned;

/// Interval between requests for the rooms, milliseconds.
const REFRESH_MS: f64 = 3000.0;
/// Interval between requests for the replays, milliseconds. It is longer because the answers may be large.
const REPLAYS_MS: f64 = 15_000.0;

/// A line under the form.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LobbyNote {
    pub text: String,
    /// Whether the note reports a problem.
    pub bad: bool,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lobby {
    pub rooms: Vec<RoomCard>,
    /// Whether the server has sent the list of rooms.
    pub rooms_known: bool,
    pub scenes: Vec<SceneCard>,
    /// Replays, the newest first.
    pub replays: Vec<ReplayCard>,
    /// The line under the form.
    pub note: LobbyNote,
    /// Whether the typed name is invalid.
    pub name_invalid: bool,
    /// Whether a room is being opened.
    pub busy: bool,
    asked_ms: f64,
    replays_asked_ms: Option<f64>,
}

impl Lobby {
    /// Resets the lobby and requests the server's lists.
    pub fn show(&mut self, ctx: &mut Context) {
        self.busy = false;
        self.note = LobbyNote::default();
        self.name_invalid = false;
        self.replays_asked_ms = None;
        self.ask(ctx);
    }

    /// Requests the rooms again if the interval has passed.
    pub fn refresh(&mut self, ctx: &mut Context) {
        if ctx.now_ms - self.asked_ms >= REFRESH_MS {
            self.ask(ctx);
        }
    }

    /// Requests the rooms, and the scenes until they are known.
    fn ask(&mut self, ctx: &mut Context) {
        self.asked_ms = ctx.now_ms;
        if self.scenes.is_empty() {
            ctx.request(Effect::Request(Request::Scenes));
        }
        if ctx.site.is_static {
            return;
        }
        ctx.request(Effect::Request(Request::Rooms));
        if self.replays_asked_ms.is_none_or(|asked_ms| ctx.now_ms - asked_ms >= REPLAYS_MS) {
            self.replays_asked_ms = Some(ctx.now_ms);
            ctx.request(Effect::Request(Request::Replays));
            ctx.request(Effect::Request(Request::Records));
        }
    }

    /// Reads the name and colour from the form; `None` if the name is invalid, which the note then explains.
    pub fn read(&mut self, form: &Form) -> Option<Appearance> {
        match Appearance::new(name::finished(&form.name), form.color) {
            Ok(appearance) => {
                self.name_invalid = false;
                self.note = LobbyNote::default();
                Some(appearance)
            }
            Err(error) => {
                self.name_invalid = true;
                self.say(&error.to_string(), true);
                None
            }
        }
    }

    /// Joins the room with the most players, or opens one with the first scene. Returns the code of the room to enter, if any.
    pub fn play(&mut self, ctx: &mut Context) -> Option<String> {
        let room = api::liveliest(&self.rooms, &self.scenes);
        let room = room.map(|room| room.code.clone());
        if room.is_none() {
            self.open(ctx, api::FIRST_SCENE, false);
        }
        room
    }

    /// Opens a room with a scene, hosted by the player.
    pub fn open(&mut self, ctx: &mut Context, scene: &str, private: bool) {
        let request = match scene {
            daily::CARD => Request::OpenGuest(daily::track(daily::date(ctx.day()))),
            _ => {
                let (scene, after) = (scene.to_owned(), ctx.closed.clone());
                Request::Open { scene, private, after }
            }
        };
        if self.busy {
            return;
        }
        self.busy = true;
        self.say(strings::STARTING, false);
        ctx.request(Effect::Request(request));
    }

    /// Handles an answer from the server. Returns the code of the room to enter, if any.
    pub fn take(
        &mut self,
        ctx: &mut Context,
        request: &Request,
        answer: Option<&str>,
    ) -> Option<String> {
        match request {
            Request::Rooms => match parse::<Rooms>(answer) {
                Some(Rooms { rooms, .. }) => {
                    (self.rooms, self.rooms_known) = (rooms, true);
                    if self.note.text == strings::UNANSWERED {
                        self.note = LobbyNote::default();
                    }
                }
                None => self.say(strings::UNANSWERED, true),
            },
            Request::Scenes => {
                if let Some(Scenes { scenes, .. }) = parse(answer) {
                    self.scenes = scenes;
                } else if ctx.site.is_static {
                    self.say(strings::NO_SCENES, true);
                }
            }
            Request::Replays => {
                if let Some(Replays { replays, .. }) = parse(answer) {
                    self.replays = replays;
                }
            }
            Request::Records | Request::BestRuns(_) | Request::Run(_) | Request::Next(_) => {}
            Request::Open { .. } | Request::OpenGuest(_) => {
                return self.opened(ctx, answer);
            }
        }
        None
    }

    fn opened(&mut self, ctx: &mut Context, answer: Option<&str>) -> Option<String> {
        self.busy = false;
        match take_room(ctx, answer) {
            Ok(code) => Some(code),
            Err(refused) => {
                self.say(refused.error.as_deref().unwrap_or(strings::SILENCE), true);
                None
            }
        }
    }

    fn say(&mut self, text: &str, bad: bool) {
        self.note = LobbyNote { text: text.to_owned(), bad };
    }
}

/// The code of a room that the server opened with the player as host, or the reason why it did not open one.
pub fn take_room(ctx: &mut Context, answer: Option<&str>) -> Result<String, Box<Posted>> {
    let opened = parse(answer).unwrap_or_default();
    if let Posted { code: Some(code), host_key: Some(host_key), .. } = opened {
        ctx.storage.set_secret(Secret::Host, &code, Token::parse(&host_key));
        ctx.closed = None;
        return Ok(code);
    }
    Err(Box::new(opened))
}

fn parse<T: DeserializeOwned>(answer: Option<&str>) -> Option<T> {
    api::parse(answer?)
}
