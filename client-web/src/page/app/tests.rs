use super::*;
use crate::net::api::{self, Request};
use crate::net::report::{Fetched, SocketEvent};
use crate::page::drafts::DraftStore;
use crate::page::event::{Focus, Form, Key};
use crate::page::page_action::PageAction;
use crate::world::room_in_page::RoomInPage;
use jostle_game::Buttons;
use jostle_protocol::{ClientMessage, ServerMessage};
use litemap::LiteMap;
use std::cell::RefCell;
use std::rc::Rc;

mod alone;
mod editing;
mod game;
mod hosts;
mod lobby;
mod moments;
mod moves;
mod over_http;
mod panels;
mod replays;
mod returns;
mod sound;

/// A page without a browser, and a room at the other end of its socket.
struct Browser {
    app: App,
    now_ms: f64,
    effects: Vec<Effect>,
    /// The newest session; `room` is its room while the socket is open.
    session: u32,
    room: Option<RoomInPage>,
    /// Messages to the server, decoded.
    sent: Vec<ClientMessage>,
    /// The address that the page set.
    address: String,
    /// The browser's storage, shared by its tabs.
    store: Shared,
}

type Shared = Rc<RefCell<LiteMap<String, String>>>;

impl DraftStore for LiteMap<String, String> {
    fn read(&self, key: &str) -> Option<String> {
        LiteMap::get(self, key).cloned()
    }

    fn write(&mut self, key: &str, value: Option<&str>) -> bool {
        match value {
            Some(value) => self.insert(key.to_owned(), value.to_owned()),
            None => self.remove(key),
        };
        true
    }
}

const CANVAS: Canvas = Canvas { pixels: [800, 600], top: 0, bottom: 0, css_width: 800 };

/// The server's response to a request for a scene file.
fn scene_fetched(name: &str) -> Event {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
    let fetched = scene.map_or(Fetched::Refused(404), |scene| Fetched::Bytes(scene.source.into()));
    Event::SceneFetched(name.to_owned(), fetched)
}

impl Browser {
    fn open(path: &str, query: &str) -> Browser {
        let local = [("jostle.name", "Ann"), ("jostle.color", "3")];
        let local = local.map(|(key, value)| (key.to_owned(), value.to_owned()));
        Browser::open_with(
            path,
            query,
            Storage { local: local.into_iter().collect(), ..Default::default() },
        )
    }

    fn open_with(path: &str, query: &str, storage: Storage) -> Browser {
        let store = Rc::new(RefCell::new(storage.local.clone()));
        let (query, origin) = (query.to_owned(), "http://play.example".to_owned());
        let startup =
            Startup { storage, query: query.clone(), seed: 1, origin, ..Startup::default() };
        let mut browser = Browser {
            app: App::new(startup),
            now_ms: 0.0,
            effects: Vec::new(),
            session: 0,
            room: None,
            sent: Vec::new(),
            address: path.to_owned(),
            store,
        };
        browser.say(Event::Navigated(Address {
            path: path.to_owned(),
            query,
            hash: String::new(),
        }));
        browser
    }

    /// Sends an event to the page and performs those of its effects that the tests need.
    fn say(&mut self, event: Event) -> Vec<String> {
        let effects = self.app.update(self.now_ms, event);
        let names = effects.iter().map(|effect| format!("{effect:?}")).collect();
        for effect in &effects {
            match effect {
                Effect::Connect { session, .. } => (self.session, self.room) = (*session, None),
                Effect::Disconnect { .. } => self.room = None,
                Effect::Send(bytes) => {
                    self.sent.push(ClientMessage::decode(bytes).expect("the page's own message"));
                    self.room.as_mut().expect("an open socket").receive(bytes);
                }
                Effect::PushAddress(address) => self.address.clone_from(address),
                Effect::StoreLocal(key, value) => {
                    self.store.borrow_mut().write(key, value.as_deref());
                }
                _ => {}
            }
        }
        let draft = effects.iter().find_map(|effect| match effect {
            Effect::StoreDraft(draft) => Some(draft.clone()),
            _ => None,
        });
        let fetched = effects.iter().find_map(|effect| match effect {
            Effect::FetchScene(name) => Some(name.clone()),
            _ => None,
        });
        self.effects.extend(effects);
        if let Some(draft) = draft {
            let kept = draft.keep(&mut *self.store.borrow_mut());
            self.say(Event::DraftKept(draft, kept));
        }
        if let Some(name) = fetched {
            let event = scene_fetched(&name);
            self.say(event);
        }
        names
    }

    fn socket(&mut self, event: SocketEvent) -> Vec<String> {
        self.say(Event::Socket(self.session, event))
    }

    /// Accepts the socket of a game that plays this scene.
    fn accept(&mut self, scene: &str) {
        self.accept_beside(0, scene);
    }

    /// Accepts the socket of a game with this many other players, whose colours are numbered from 1.
    fn accept_beside(&mut self, others: u8, scene: &str) {
        let scene = Scene::built_in().into_iter().find(|known| known.name == scene);
        self.room = Some(RoomInPage::new(Arc::new(scene.expect("a scene")), 1, others, false));
        self.socket(SocketEvent::Opened);
        self.deliver();
    }

    /// Delivers the messages that the room has sent.
    fn deliver(&mut self) {
        let messages = self.room.as_mut().map_or(Vec::new(), RoomInPage::take);
        for message in messages {
            self.socket(SocketEvent::Message(message));
        }
    }

    fn server_says(&mut self, message: &ServerMessage) -> Vec<String> {
        self.socket(SocketEvent::Message(message.encode()))
    }

    /// Opens another tab of the same browser at this address fragment.
    fn beside(&self, hash: &str) -> Browser {
        let local = self.store.borrow().clone();
        let mut tab = Browser::open_with("/", "", Storage { local, ..Default::default() });
        tab.store = Rc::clone(&self.store);
        tab.say(Event::Navigated(Address {
            path: "/".to_owned(),
            hash: hash.to_owned(),
            ..Address::default()
        }));
        tab
    }

    /// Notifies the page of a value that another tab has written.
    fn hear(&mut self, key: &str) -> Vec<String> {
        let value = self.store.borrow().get(key).cloned();
        self.say(Event::StoredElsewhere(key.to_owned(), value))
    }

    /// The value stored for all tabs under this key.
    fn stored(&self, key: &str) -> Option<String> {
        self.store.borrow().get(key).cloned()
    }

    /// Advances time, generating ticks, frames and pulses.
    fn wait(&mut self, milliseconds: u32) {
        for step in 1..=milliseconds / 20 {
            self.now_ms += 20.0;
            if let Some(room) = &mut self.room {
                room.tick();
            }
            self.deliver();
            self.say(Event::Frame(Some(CANVAS)));
            self.say(Event::Drawn(true));
            if step % 10 == 0 {
                self.say(Event::Pulse { hidden: false });
            }
        }
    }

    /// A page that is playing in the arena.
    fn playing() -> Browser {
        let mut browser = Browser::open("/arena", "");
        browser.accept("arena");
        browser.wait(200);
        assert_eq!(browser.app.state(), "playing");
        browser
    }

    fn press(&mut self, code: &str, letter: &str) -> Vec<String> {
        self.say(Event::KeyDown(key(code, letter)))
    }

    fn title(&self) -> &'static str {
        self.app.notice().map_or("", |card| card.title)
    }

    fn held(&self) -> Buttons {
        self.app.screen.game().expect("a game").input.controls.buttons()
    }

    fn click(&mut self, action: &str) -> Vec<String> {
        self.say(clicked(action, ""))
    }

    /// The buttons in the last input that was sent.
    fn last_sent(&self) -> Option<Buttons> {
        self.sent.iter().rev().find_map(|message| match message {
            ClientMessage::Input { input, .. } => Some(input.buttons()),
            _ => None,
        })
    }
}

fn key(code: &str, letter: &str) -> Key {
    let (code, letter) = (code.to_owned(), letter.to_owned());
    Key {
        code,
        letter,
        repeat: false,
        modified: false,
        command: false,
        shift: false,
        focus: Focus::Elsewhere,
    }
}

fn has(effects: &[String], name: &str) -> bool {
    effects.iter().any(|effect| effect.contains(name))
}

fn form(name: &str) -> Form {
    Form { name: name.to_owned(), color: 5, private: false, bots: true }
}

fn clicked(action: &str, value: &str) -> Event {
    Event::Clicked(PageAction::named(action).expect("an action"), value.to_owned())
}
