//! Tests of rooms that move between servers, and of servers that fail.

use super::*;
use crate::net::clock::TICK_MS;
use crate::page::storage::Secret;
use jostle_protocol::{Refusal, Token};

const B: &str = "http://b:8081";
const C: &str = "https://c.example.org";

impl Browser {
    /// Runs ticks in real time, with one frame each.
    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let pulses = (self.now_ms / 200.0).floor();
            self.now_ms += TICK_MS;
            if let Some(room) = &mut self.room {
                room.tick();
            }
            self.deliver();
            self.say(Event::Frame(Some(CANVAS)));
            if (self.now_ms / 200.0).floor() > pulses {
                self.say(Event::Pulse { hidden: false });
            }
        }
    }

    /// A page that has played in the arena for a while, with a key held down.
    fn running() -> Browser {
        let mut browser = Browser::open("/arena", "");
        browser.accept("arena");
        browser.run(60);
        browser.press("KeyD", "d");
        browser.run(30);
        browser
    }

    fn told_of(nodes: &[&str]) -> Browser {
        let mut browser = Browser::running();
        let urls = nodes.iter().map(|&node| node.to_owned()).collect();
        browser.server_says(&ServerMessage::Nodes { urls });
        browser
    }

    /// Announces that the room moved; returns the room, and the server that the page contacts immediately.
    fn move_to(&mut self, url: &str) -> (Option<RoomInPage>, Option<String>) {
        let (room, asked) = (self.room.take(), self.asked().len());
        self.server_says(&ServerMessage::Moved { url: url.to_owned() });
        (room, self.asked().get(asked).cloned())
    }

    /// Connects the newest socket to the room.
    fn welcome_in(&mut self, room: Option<RoomInPage>) {
        self.room = room;
        self.socket(SocketEvent::Opened);
        self.deliver();
    }

    /// The origins to which sockets were opened, in order.
    fn asked(&self) -> Vec<String> {
        let asked = |effect: &Effect| match effect {
            Effect::Connect { path, origin, .. } => {
                assert_eq!(path, "/arena");
                Some(origin.clone())
            }
            _ => None,
        };
        self.effects.iter().filter_map(asked).collect()
    }

    /// The servers tried next while none is reachable, and the longest wait between attempts, milliseconds.
    fn asks_in_vain(&mut self, count: usize) -> (Vec<String>, f64) {
        let (begin, mut longest_ms) = (self.asked().len(), 0f64);
        for attempt in 1..=count {
            self.socket(SocketEvent::Closed { code: 1006 });
            let lost_ms = self.now_ms;
            while self.asked().len() < begin + attempt {
                assert!(self.now_ms - lost_ms < 10_000.0, "attempt {attempt} does not come");
                self.run(1);
            }
            longest_ms = longest_ms.max(self.now_ms - lost_ms);
        }
        (self.asked().split_off(begin), longest_ms)
    }

    fn display(&self) -> f64 {
        self.app.screen.replica().expect("a room").room.display
    }

    fn copy(&self) -> u32 {
        self.app.screen.frame(self.now_ms, false).expect("a frame").copy
    }

    fn hero_x(&self) -> f32 {
        self.app.screen.replica().and_then(|replica| replica.own_hero()).expect("a hero").center.x
    }

    fn hello(&self) -> (Option<Token>, Option<Token>) {
        let hello = self.sent.iter().rev().find_map(|message| match message {
            ClientMessage::Hello { token, host_key, .. } => Some((*token, *host_key)),
            _ => None,
        });
        hello.expect("a hello")
    }
}

#[test]
fn the_picture_goes_on_where_it_was_when_the_room_moved() {
    let mut browser = Browser::running();
    let (copy, display, key) = (browser.copy(), browser.display(), Token([9; limits::TOKEN_BYTES]));
    browser.app.ctx.storage.set_secret(Secret::Host, "arena", Some(key));
    let (room, asked) = browser.move_to(B);
    assert_eq!(asked.as_deref(), Some(B));
    browser.run(20);
    assert_eq!((browser.app.state(), browser.title(), browser.display()), ("moving", "", display));
    assert!(
        browser
            .app
            .screen
            .frame(browser.app.ctx.now_ms, browser.app.settings.calm)
            .is_some_and(|frame| !frame.dimmed)
    );
    assert_eq!(browser.held(), Buttons::RIGHT, "the key is still down");

    let (sent, mut x) = (browser.sent.len(), browser.hero_x());
    browser.welcome_in(room);
    assert_eq!(browser.app.state(), "playing");
    assert_eq!(browser.hello(), (Some(Token([0; limits::TOKEN_BYTES])), Some(key)));
    let (mut display, start) = (display, x);
    for _ in 0..60 {
        browser.run(1);
        let (shown, now) = (browser.display(), browser.hero_x());
        assert!((0.0..3.1).contains(&(shown - display)), "{display} to {shown}");
        assert!((-0.5..2.0).contains(&(now - x)), "{x} to {now}");
        (display, x) = (shown, now);
    }
    assert_eq!(browser.copy(), copy, "drawing goes on too");
    assert!(x > start + 10.0, "the hero runs on: {start} to {x}");
    let inputs: Vec<_> = browser.sent[sent..].iter().filter_map(input).collect();
    assert!(inputs.iter().map(|input| input.0).eq(1..=inputs.len() as u32), "{inputs:?}");
    assert_eq!(inputs[0].1, Buttons::RIGHT);
    assert!(inputs.is_sorted_by_key(|input| input.2) && f64::from(inputs[0].2) > display - 62.0);
}

/// The sequence number, buttons and acknowledged tick of an input.
fn input(message: &ClientMessage) -> Option<(u32, Buttons, u16)> {
    match message {
        ClientMessage::Input { seq, ack_tick, input } => Some((*seq, input.buttons(), *ack_tick)),
        _ => None,
    }
}

#[test]
fn a_room_moves_to_and_fro() {
    let mut browser = Browser::running();
    let copy = browser.copy();
    for url in [B, C, B, C] {
        let (room, asked) = browser.move_to(url);
        assert_eq!(asked.as_deref(), Some(url), "at once");
        browser.run(5);
        browser.welcome_in(room);
        browser.run(30);
        assert_eq!((browser.app.state(), browser.copy()), ("playing", copy));
    }
}

#[test]
fn a_move_that_takes_long_is_shown_as_a_lost_connection() {
    let mut browser = Browser::running();
    let (room, _) = browser.move_to(B);
    browser.run(80);
    assert_eq!(
        (browser.app.state(), browser.title()),
        ("reconnecting", strings::RECONNECTING.title)
    );
    assert_eq!(browser.held(), Buttons(0));
    browser.welcome_in(room);
    assert_eq!((browser.app.state(), browser.title()), ("playing", ""));
}

#[test]
fn a_seat_that_is_regained_soon_goes_on_too() {
    let delay = |browser: &Browser| {
        let membership = browser.app.screen.game().and_then(|game| game.membership.as_ref());
        membership.expect("a seat").clock.delay_ticks()
    };
    let mut browser = Browser::running();
    let (copy, before) = (browser.copy(), delay(&browser));
    let mut room = browser.room.take();
    browser.socket(SocketEvent::Closed { code: 1006 });
    browser.run(20);
    let away = room.as_mut().expect("a room");
    (0..20).for_each(|_| away.tick());
    // Messages on the lost socket never arrive.
    away.take();
    browser.welcome_in(room);
    // The display catches up without jumping.
    browser.run(160);
    assert_eq!((browser.app.state(), browser.copy()), ("playing", copy));
    assert!(
        delay(&browser) < before + 0.5,
        "{} ticks: the time away is no jitter",
        delay(&browser)
    );
    let newest =
        browser.app.screen.replica().and_then(|replica| replica.room.newest()).expect("one").tick;
    assert!(f64::from(newest) - browser.display() < before + 0.5, "{newest}");
}

#[test]
fn a_room_that_goes_on_from_an_earlier_moment_is_shown_from_there() {
    let mut browser = Browser::running();
    let copy = browser.copy();
    browser.move_to(B);
    browser.accept("arena");
    browser.run(10);
    assert_ne!(browser.copy(), copy);
    assert!(browser.display() < 30.0, "{}", browser.display());
}

#[test]
fn after_a_loss_the_servers_are_asked_in_turn_and_soon() {
    let mut browser = Browser::told_of(&[B, C]);
    let room = browser.room.take();
    let (asked, _) = browser.asks_in_vain(7);
    assert_eq!(asked, ["", B, C, "", B, C, ""]);
    browser.socket(SocketEvent::Closed { code: 1006 });
    browser.run(600);
    assert_eq!(browser.asked().last().map(String::as_str), Some(B));
    browser.welcome_in(room);
    browser.run(30);
    assert_eq!(browser.app.state(), "playing");
    browser.room = None;
    let (asked, longest_ms) = browser.asks_in_vain(3);
    assert_eq!(asked, [B, C, ""]);
    assert!(longest_ms < 2300.0, "all are asked soon, although it was bad before: {longest_ms}");
}

#[test]
fn a_server_that_does_not_answer_is_given_up_for_one_that_may() {
    let mut browser = Browser::told_of(&[B, C]);
    browser.socket(SocketEvent::Closed { code: 1006 });
    browser.run(600);
    let asked = browser.asked();
    assert_eq!(asked[1..4], ["", B, C], "{asked:?}");
}

#[test]
fn a_server_says_where_the_room_of_a_dead_one_is() {
    let mut browser = Browser::told_of(&[B]);
    let room = browser.room.take();
    let (asked, _) = browser.asks_in_vain(2);
    assert_eq!(asked, ["", B]);
    let (_, asked) = browser.move_to(C);
    assert_eq!(asked.as_deref(), Some(C), "at once");
    browser.welcome_in(room);
    assert_eq!((browser.app.state(), browser.title()), ("playing", ""));
}

#[test]
fn two_servers_that_disagree_cause_no_storm() {
    let mut browser = Browser::running();
    browser.room = None;
    let (mut at_once, begin) = (Vec::new(), browser.asked().len());
    let mut url = B;
    while browser.now_ms < 60_000.0 {
        at_once.push(browser.move_to(url).1.is_some());
        url = if url == B { C } else { B };
        let asked = browser.asked().len();
        let waits = !at_once[at_once.len() - 1];
        while waits && browser.asked().len() == asked {
            browser.run(1);
        }
    }
    assert!(at_once.chunks(2).all(|pair| pair[0] && !pair.get(1).is_some_and(|second| *second)));
    let asked = browser.asked().len() - begin;
    assert!((10..40).contains(&asked), "asked {asked} times in a minute");
}

#[test]
fn a_room_on_its_way_is_waited_for_silently() {
    let mut browser = Browser::told_of(&[B]);
    let room = browser.room.take();
    browser.server_says(&ServerMessage::Refused { refusal: Refusal::Moving });
    assert_eq!((browser.app.state(), browser.title()), ("moving", ""));
    for attempt in 0..8 {
        let (asked, lost_ms) = (browser.asked().len(), browser.now_ms);
        while browser.asked().len() == asked {
            browser.run(1);
        }
        assert!(browser.now_ms - lost_ms < 2300.0, "attempt {attempt}");
        let refused = ServerMessage::Refused { refusal: Refusal::Moving };
        if attempt < 7 {
            browser.server_says(&refused);
        }
    }
    assert_eq!(browser.title(), strings::RECONNECTING.title, "after a while it says so");
    browser.welcome_in(room);
    assert_eq!((browser.app.state(), browser.title()), ("playing", ""));
}

#[test]
fn a_close_code_alone_is_enough_to_go_on() {
    for refusal in [Refusal::Moved, Refusal::Moving] {
        let mut browser = Browser::running();
        browser.room = None;
        let asked = browser.asked().len();
        browser.socket(SocketEvent::Closed { code: refusal.close_code() });
        browser.run(60);
        assert_eq!(browser.asked().len(), asked + 1, "{refusal:?}");
    }
}
