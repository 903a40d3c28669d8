//! Questions before what cannot be taken back: a card with two buttons, of which the one that does
//! nothing has the focus.

use super::{app, dom, modal};
use crate::words;
use jostle_protocol::{Appearance, PlayerState};
use jostle_sim::Seat;
use std::cell::RefCell;
use web_sys::{Event, HtmlElement};

/// What a host is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Is this player to leave? The seat alone could be somebody else's by the time of the answer.
    Kick(Seat, Appearance),
    /// Is the room to be closed?
    CloseRoom,
}

thread_local! {
    static ASKED: RefCell<Option<Question>> = const { RefCell::new(None) };
}

/// Listens to the card's buttons.
pub fn listen() {
    dom::listen(&dom::by_id::<HtmlElement>("ask-no"), "click", |_: Event| withdraw());
    dom::listen(&dom::by_id::<HtmlElement>("ask-yes"), "click", |_: Event| {
        let asked = ASKED.with(|asked| asked.borrow().clone());
        withdraw();
        app::with(|app| match (&mut app.play, asked) {
            (Some(play), Some(Question::Kick(seat, _))) => play.kick(seat),
            (Some(play), Some(Question::CloseRoom)) => play.close_room(),
            _ => {}
        });
    });
}

/// Asks, in a card.
pub fn ask(question: Question) {
    let title: HtmlElement = dom::by_id("ask-title");
    title.set_text_content(None);
    let (text, yes) = match &question {
        Question::Kick(_, who) => {
            let [before, after] = words::ASK_KICK;
            dom::append(&title, &dom::labelled("span", "", before));
            dom::append(&title, &dom::labelled("bdi", "", &who.name));
            dom::append(&title, &dom::labelled("span", "", after));
            (words::ABOUT_KICK, words::DO_KICK)
        }
        Question::CloseRoom => {
            dom::set_text(&title, words::ASK_CLOSE);
            (words::ABOUT_CLOSE, words::DO_CLOSE)
        }
    };
    dom::set_text(&dom::by_id("ask-text"), text);
    dom::set_text(&dom::by_id("ask-yes"), yes);
    ASKED.set(Some(question));
    modal::set_ask(true);
}

/// Takes the question back, if there is one.
pub fn withdraw() {
    if ASKED.take().is_some() {
        modal::set_ask(false);
    }
}

/// Takes a question about somebody back who is not here any more.
pub fn settle(players: &[PlayerState]) {
    let moot = ASKED.with(|asked| match &*asked.borrow() {
        Some(Question::Kick(seat, who)) => {
            !players.iter().any(|player| player.seat == *seat && player.appearance == *who)
        }
        _ => false,
    });
    if moot {
        withdraw();
    }
}
