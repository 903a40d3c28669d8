//! The emote wheel, and emotes over heroes. The pictures are symbols in `index.html`.

use crate::language::fill;
use crate::page::app::App;
use crate::page::panels::players::color_var;
use crate::page::strings;
use crate::page::view::{View, word};
use crate::view::frame;

/// Distance between a hero and its emote, CSS pixels. The name tag is in between.
const ABOVE_CSS: f32 = 30.0;
/// Minimum distance of an emote from the upper edge, CSS pixels.
const TOP_CSS: f32 = 64.0;
/// The buttons of the wheel.
const BUTTONS: [&str; strings::EMOTES.len()] = [
    "#wheel > :nth-child(1)",
    "#wheel > :nth-child(2)",
    "#wheel > :nth-child(3)",
    "#wheel > :nth-child(4)",
    "#wheel > :nth-child(5)",
    "#wheel > :nth-child(6)",
    "#wheel > :nth-child(7)",
    "#wheel > :nth-child(8)",
];

pub fn wheel(app: &App) -> View {
    let wheel = app.screen.game().and_then(|game| game.input.wheel.as_ref());
    let picked = wheel.and_then(|wheel| wheel.picked);
    let view = View::panel("wheel").show("#wheel", wheel.is_some());
    let buttons = (0..).zip(BUTTONS);
    buttons.fold(view, |view, (emote, button)| {
        view.with(button, "aria-pressed", word(picked == Some(emote)))
    })
}

/// The emotes currently shown over heroes, for a picture of this scale. The newest is announced to screen readers.
pub fn shown(app: &App, view: &frame::View, css_per_pixel: f32) -> View {
    let game = app.screen.game().and_then(|game| Some((game, game.pictured_replica()?)));
    let mut said = String::new();
    let mut items = Vec::new();
    let emotes = game
        .map(|(game, replica)| game.emotes.at(app.ctx.now_ms).map(move |shown| (shown, replica)));
    for (shown, replica) in emotes.into_iter().flatten() {
        let player = replica.room.players().iter().find(|player| player.seat == shown.seat);
        let Some(player) = player else { continue };
        let parts = [("player", &*player.appearance.name), ("emote", strings::emote(shown.emote))];
        said = fill("{player}: {emote}", &parts);
        let Some(at) = replica.top_of_hero(player) else { continue };
        let at = view.to_pixel(at) * css_per_pixel;
        items.push(
            View::item("emote-item", shown.seat.0)
                .with("use", "href", format!("#emote-{}", shown.emote))
                .style("", "--color", color_var(replica.room.color_of(player)))
                .style("", "--x", format!("{:.0}px", at.x))
                .style("", "--y", format!("{:.0}px", (at.y - ABOVE_CSS).max(TOP_CSS))),
        );
    }
    View::panel("emotes").list("#emotes", items).text("#emote-said", said)
}
