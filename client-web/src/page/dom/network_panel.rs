//! Listeners to the switches of the network panel.

use crate::net::simulated_link::NetworkConditions;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use web_sys::HtmlInputElement;

pub fn listen(events: Events) {
    dom::listen(&dom::html("net-predict"), "change", move |_: web_sys::Event| {
        let on = dom::by_id::<HtmlInputElement>("net-predict").checked();
        events.push(Event::PredictionChosen(on));
    });
    dom::listen(&dom::html("net-presets"), "change", move |event: web_sys::Event| {
        let chosen = dom::value_of::<String>(&event);
        if let Some(conditions) = chosen.and_then(|code| NetworkConditions::parse(&code)) {
            events.push(Event::ConditionsChosen(conditions));
        }
    });
}
