//! The speaker in the hud, its panel with the volume, and captions. Plain DOM, touched only where something
//! changed.

use crate::browser;
use crate::language::say;
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::event::Event;
use crate::page::page_action::PageAction;
use crate::page::queue::Events;
use crate::page::strings;
use crate::sound::task::SoundEvent;
use web_sys::{HtmlInputElement, KeyboardEvent, MouseEvent};

/// The speaker as it was shown last.
pub struct SoundPanel {
    opened: bool,
    captions: List,
}

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
    let panel = dom::html("sound");
    // After a click keys belong to the game again. A clicked label first hands the focus to its box.
    dom::listen(&panel, "click", |event: MouseEvent| {
        if event.detail() > 0 {
            browser::after(0, dom::focus_stage);
        }
    });
    dom::listen(&panel, "keydown", move |event: KeyboardEvent| {
        if event.code() == "Escape" {
            event.prevent_default();
            event.stop_propagation();
            events.push(Event::Clicked(PageAction::Sound, String::new()));
        }
    });
}

impl SoundPanel {
    pub fn new() -> SoundPanel {
        SoundPanel { opened: false, captions: List::new("captions") }
    }

    /// Shows the speaker, and the panel if it is open.
    pub fn show(&mut self, app: &App) {
        let desk = &app.sound;
        let volume = if desk.is_on() { desk.volume } else { 0 };
        let speaker = dom::html("speaker");
        let waves = volume.div_ceil(34).to_string();
        dom::set(&speaker, "data-waves", Some(&waves));
        dom::set(&speaker, "aria-label", Some(&strings::speaker(desk.is_on(), desk.volume)));
        dom::text("speaker-volume", &strings::percent(volume));
        let opened = app.panels.sound;
        if std::mem::replace(&mut self.opened, opened) != opened {
            self.open(opened);
        }
        if opened {
            let slider: HtmlInputElement = dom::by_id("volume");
            let value = desk.volume.to_string();
            if slider.value() != value {
                slider.set_value(&value);
            }
            dom::text("volume-shown", &strings::percent(desk.volume));
            dom::by_id::<HtmlInputElement>("sound-on").set_checked(!desk.muted);
            dom::by_id::<HtmlInputElement>("captions-on").set_checked(desk.captioned);
            dom::text_or_hide("sound-missing", desk.missing.then_some(say(strings::NO_SOUND)));
        }
    }

    fn open(&self, opened: bool) {
        let panel = dom::html("sound");
        let within = dom::document().active_element().is_some_and(|e| panel.contains(Some(&e)));
        dom::show("sound", opened);
        dom::set(&dom::html("speaker"), "aria-expanded", Some(&opened.to_string()));
        if !opened && within {
            dom::focus_stage();
        }
    }

    pub fn show_captions(&mut self, app: &App) {
        let lines = app.sound.captions.lines.iter();
        self.captions.show(
            lines.map(|line| Item::new("caption-item", line.number).text("span", &*line.text)),
        );
    }
}
