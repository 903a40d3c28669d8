//! The list of players: in the order of their scores, the own one always in it. A host has a button
//! beside each other player that removes them.

use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use crate::page::strings;
use crate::world::replica::Replica;
use jostle_game::Seat;
use jostle_protocol::{Appearance, PlayerState};
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, MouseEvent};

/// Players in the list; the rest is counted. A host has to reach all of them.
const LISTED_MAX: usize = 10;

/// The list as it was shown last.
#[derive(Default)]
pub struct PlayersView {
    listed: Option<Listed>,
    /// The score of each line, and its element.
    scores: Vec<(u16, HtmlElement)>,
}

/// The list without the scores.
#[derive(PartialEq)]
struct Listed {
    lines: Vec<Line>,
    more: usize,
    own: Seat,
    host: bool,
}

/// One player in the list.
#[derive(PartialEq)]
struct Line {
    seat: Seat,
    appearance: Appearance,
    connected: bool,
}

/// Listens to the list's buttons.
pub fn listen(events: Events) {
    dom::listen(&dom::by_id::<HtmlElement>("players"), "click", move |event: MouseEvent| {
        let button = dom::target_within(&event, "button");
        let seat = button.and_then(|button| button.get_attribute("data-seat"));
        if let Some(seat) = seat.and_then(|seat| seat.parse().ok()).map(Seat) {
            dom::back_to_stage(&event);
            events.push(Event::KickClicked(seat));
        }
    });
}

impl PlayersView {
    /// Brings the list up to date. Lines stay while only scores change: a click takes its time.
    pub fn show(&mut self, replica: &Replica, host: bool) {
        let (listed, scores) = Listed::new(replica, host);
        if self.listed.as_ref() != Some(&listed) {
            self.scores = listed.fill().into_iter().map(|element| (0, element)).collect();
            self.listed = Some(listed);
        }
        for ((shown, element), score) in self.scores.iter_mut().zip(scores) {
            if *shown != score {
                *shown = score;
                dom::set_text(element, &score.to_string());
            }
        }
    }
}

impl Listed {
    /// The list of now, and the scores of its lines.
    fn new(replica: &Replica, host: bool) -> (Listed, Vec<u16>) {
        let mut order: Vec<&PlayerState> = replica.players().iter().collect();
        order.sort_by_key(|player| (std::cmp::Reverse(player.score), player.seat));
        let most = if host { order.len() } else { LISTED_MAX };
        let more = order.len().saturating_sub(most);
        let own = order.iter().position(|player| player.seat == replica.seat).unwrap_or(0);
        if own >= most && more > 0 {
            order.swap(own, most - 1);
        }
        order.truncate(most);
        let lines = order.iter().map(|player| Line {
            seat: player.seat,
            appearance: player.appearance.clone(),
            connected: player.connected,
        });
        let listed = Listed { lines: lines.collect(), more, own: replica.seat, host };
        (listed, order.iter().map(|player| player.score).collect())
    }

    /// Makes the lines again, and returns the elements of the scores. The keyboard focus stays where
    /// it was.
    fn fill(&self) -> Vec<HtmlElement> {
        let list: HtmlElement = dom::by_id("players");
        let focused = dom::document().active_element().and_then(|e| e.get_attribute("data-seat"));
        let scrolled = list.scroll_top();
        list.set_text_content(None);
        let _ = list.class_list().toggle_with_force("host", self.host);
        let mut scores = Vec::with_capacity(self.lines.len());
        for line in &self.lines {
            let (element, score) = self.element(line);
            dom::append(&list, &element);
            scores.push(score);
        }
        if self.more > 0 {
            let text = format!("and {} more", self.more);
            dom::append(&list, &dom::labelled("li", "quiet", &text));
        }
        list.set_scroll_top(scrolled);
        if let Some(seat) = focused {
            let button = list.query_selector(&format!("[data-seat='{seat}']")).ok().flatten();
            let button = button.and_then(|button| button.dyn_into::<HtmlElement>().ok());
            let _ = button.map(|button| button.focus());
        }
        scores
    }

    /// A line, and the part of it that is the score.
    fn element(&self, line: &Line) -> (HtmlElement, HtmlElement) {
        let own = line.seat == self.own;
        let class = match (own, line.connected) {
            (true, _) => "own",
            (false, true) => "",
            (false, false) => "away",
        };
        let element = dom::element("li", class);
        dom::append(&element, &name_element(&line.appearance));
        let dot = dom::element("i", "");
        dom::style(&dot, "--color", &color_of(&line.appearance));
        dom::append(&element, &dot);
        let score = dom::labelled("span", "score", "0");
        dom::append(&element, &score);
        if self.host && !own {
            dom::append(&element, &kick_button(line));
        }
        (element, score)
    }
}

/// Removes a player, once that is confirmed.
fn kick_button(line: &Line) -> HtmlElement {
    let button = dom::labelled("button", "leave", "\u{d7}");
    let [before, after] = strings::KICK;
    let label = format!("{before}{}{after}", line.appearance.name);
    for (name, value) in [("type", "button"), ("aria-label", &label), ("title", &label)] {
        dom::set(&button, name, value);
    }
    dom::set(&button, "data-seat", &line.seat.0.to_string());
    button
}

/// The CSS value of a player colour.
pub fn color_of(appearance: &Appearance) -> String {
    format!("var(--player-{})", appearance.color)
}

/// A name in its colour, kept apart from the direction of the text around it.
pub fn name_element(appearance: &Appearance) -> HtmlElement {
    let name = dom::labelled("bdi", "", &appearance.name);
    dom::style(&name, "--color", &color_of(appearance));
    name
}
