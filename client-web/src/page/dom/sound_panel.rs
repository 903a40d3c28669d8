//! Listeners to the volume and the switches of the panel of sound.

use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use crate::sound::task::SoundEvent;
use web_sys::HtmlInputElement;

pub fn listen(events: Events) {
    dom::listen(&dom::html("volume"), "input", move |event: web_sys::Event| {
        if let Some(volume) = dom::value_of(&event) {
            events.push(Event::Sound(SoundEvent::VolumeChosen(volume)));
        }
    });
    for (id, chosen) in [
        ("sound-on", (|on| SoundEvent::MuteChosen(!on)) as fn(bool) -> SoundEvent),
        ("captions-on", SoundEvent::CaptionsChosen),
    ] {
        dom::listen(&dom::html(id), "change", move |_: web_sys::Event| {
            let on = dom::by_id::<HtmlInputElement>(id).checked();
            events.push(Event::Sound(chosen(on)));
        });
    }
}
