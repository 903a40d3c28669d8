//! The wheel of emotes, and emotes over heroes. The pictures are symbols of `index.html`.

use crate::language::fill;
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::emotes::{ShownEmote, Wheel};
use crate::page::panels::players;
use crate::page::strings;
use crate::view::frame::View;

/// CSS pixels between a hero and its emote: the name is there.
const ABOVE_CSS: f32 = 30.0;

/// Wheel and emotes as they were shown last.
pub struct EmotesView {
    wheel: Option<Wheel>,
    shown: List,
    said: Option<ShownEmote>,
}

impl EmotesView {
    pub fn new() -> EmotesView {
        EmotesView { wheel: None, shown: List::new("emotes"), said: None }
    }

    /// Shows the wheel, if it is open.
    pub fn show(&mut self, app: &App) {
        if self.wheel == app.wheel {
            return;
        }
        self.wheel.clone_from(&app.wheel);
        dom::show("wheel", app.wheel.is_some());
        let picked = app.wheel.as_ref().and_then(|wheel| wheel.picked);
        let buttons = dom::html("wheel").children();
        for emote in 0..strings::EMOTES.len() as u8 {
            if let Some(button) = buttons.item(emote.into()) {
                dom::set(&button, "aria-pressed", Some(&(picked == Some(emote)).to_string()));
            }
        }
    }

    /// Puts the emotes of this moment over their heroes.
    pub fn update(&mut self, app: &App, view: &View, css_per_pixel: f32) {
        let Some((game, replica)) =
            app.game().and_then(|game| Some((game, game.pictured_replica()?)))
        else {
            return self.clear();
        };
        let mut newest = None;
        let mut items = Vec::new();
        for shown in game.emotes.at(app.now_ms()) {
            let player = replica.players().iter().find(|player| player.seat == shown.seat);
            let Some(player) = player else { continue };
            newest = Some((*shown, &player.appearance.name));
            let hero = player.hero.and_then(|id| replica.bodies().iter().find(|b| b.id == id));
            let Some(hero) = hero else { continue };
            let mut at = hero.center;
            at.y += hero.shape.half_extent().y;
            let at = view.to_pixel(at) * css_per_pixel;
            let color = replica.color_of(player);
            items.push(
                Item::new("emote-item", shown.seat.0)
                    .with("use", "href", format!("#emote-{}", shown.emote))
                    .with("", "--color", players::color_var(color))
                    .with("", "--x", format!("{:.0}px", at.x))
                    .with("", "--y", format!("{:.0}px", (at.y - ABOVE_CSS).max(64.0))),
            );
        }
        self.shown.show(items);
        self.announce(newest);
    }

    fn announce(&mut self, newest: Option<(ShownEmote, &std::sync::Arc<str>)>) {
        let emote = newest.map(|(shown, _)| shown);
        if self.said == emote {
            return;
        }
        self.said = emote;
        let said = newest.map(|(shown, name)| {
            let emote = strings::emote(shown.emote);
            fill("{player}: {emote}", &[("player", name), ("emote", emote)])
        });
        dom::text("emote-said", &said.unwrap_or_default());
    }

    pub fn clear(&mut self) {
        self.shown.show([]);
        self.announce(None);
    }
}
