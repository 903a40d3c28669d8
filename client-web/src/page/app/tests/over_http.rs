//! Tests of when a page plays over HTTP instead of a WebSocket.

use super::*;
use crate::page::panels;

impl Browser {
    /// Fails to open the socket, and waits for the next attempt. Returns whether that one uses HTTP.
    fn fails_to_open(&mut self, is_answered: bool) -> bool {
        self.socket(SocketEvent::Closed { code: 1006 });
        let answer = is_answered.then(|| "{\"rooms\":[]}".to_owned());
        self.say(Event::Answered(Request::Rooms, answer));
        self.reconnects();
        self.uses_http()
    }

    /// Waits for the next attempt.
    fn reconnects(&mut self) {
        let session = self.session;
        while self.session == session {
            self.wait(200);
        }
    }

    fn uses_http(&self) -> bool {
        let mut effects = self.effects.iter().rev();
        effects.find_map(|effect| match effect {
            Effect::Connect { over_http, .. } => Some(*over_http),
            _ => None,
        }) == Some(true)
    }
}

#[test]
fn http_is_used_if_websockets_fail_and_the_server_answers() {
    let mut browser = Browser::open("/arena", "");
    assert!(!browser.fails_to_open(false), "the server is down");
    assert!(!browser.fails_to_open(true), "it is up again");
    assert!(browser.fails_to_open(false), "but no WebSocket opens");
    assert!(!browser.fails_to_open(false), "HTTP did not open either");
    assert!(!browser.fails_to_open(true) && browser.fails_to_open(false));
    browser.accept("arena");
    let shown = |browser: &Browser| {
        let mut panels = panels::OF_FRAMES.iter().map(|panel| panel(&browser.app));
        panels.any(|view| view.text_of("#told") == Some(strings::OVER_HTTP))
    };
    assert!(shown(&browser));
    browser.wait(20_000);
    assert!(!shown(&browser));
    let kept = Effect::StoreSession("jostle.http".into(), Some("1".into()));
    assert!(browser.effects.contains(&kept));
    // Once open, the connection is retried in the same way, and so is the tab's next game.
    browser.socket(SocketEvent::Closed { code: 1006 });
    browser.reconnects();
    assert!(browser.uses_http());
    browser.say(clicked("leave", ""));
    browser.effects.clear();
    browser.say(Event::Navigated(Address { path: "/bounds".into(), ..Address::default() }));
    assert!(browser.uses_http());
    assert!(!browser.fails_to_open(false), "another network may not let HTTP through");
    browser.accept("bounds");
    assert!(browser.effects.contains(&Effect::StoreSession("jostle.http".into(), None)));
}

#[test]
fn a_restart_does_not_change_to_http() {
    let mut browser = Browser::playing();
    for _ in 0..3 {
        assert!(!browser.fails_to_open(false));
    }
    assert!(!browser.fails_to_open(true), "it answered just after the attempt");
    browser.accept("arena");
    assert!(
        !browser.fails_to_open(true) && !browser.fails_to_open(true),
        "as if for the first time"
    );
}
