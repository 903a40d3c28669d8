//! The speaker button in the HUD, its panel with the volume, and captions.

use crate::language::say;
use crate::page::app::App;
use crate::page::strings;
use crate::page::view::{Set, View, word};

pub fn view(app: &App) -> View {
    let desk = &app.sound;
    let volume = if desk.is_on() { desk.volume } else { 0 };
    let opened = app.panels.sound;
    let view = View::panel("sound")
        .with("#speaker", "data-waves", volume.div_ceil(34).to_string())
        .with("#speaker", "aria-label", strings::speaker(desk.is_on(), desk.volume))
        .text("#speaker-volume", strings::percent(volume))
        .show("#sound", opened)
        .with("#speaker", "aria-expanded", word(opened));
    if !opened {
        return view;
    }
    view.set("#volume", Set::Value(desk.volume.to_string().into()))
        .text("#volume-shown", strings::percent(desk.volume))
        .set("#sound-on", Set::Checked(!desk.muted))
        .set("#captions-on", Set::Checked(desk.captioned))
        .text_or_hide("#sound-missing", desk.missing.then_some(say(strings::NO_SOUND)))
}

pub fn captions(app: &App) -> View {
    let lines = app.sound.captions.lines.iter();
    let lines =
        lines.map(|line| View::item("caption-item", line.number).text("span", line.text.clone()));
    View::panel("captions").list("#captions", lines)
}
