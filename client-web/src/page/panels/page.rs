//! The root element's attributes for the style sheet, and the buttons that copy the link.

use crate::language::say;
use crate::page::app::App;
use crate::page::game::GameScreen;
use crate::page::panels::players::color_var;
use crate::page::view::View;

pub fn view(app: &App) -> View {
    let (text, title) = match app.visit.copied {
        None => (say("Copy link"), ""),
        Some(true) => (say("Copied"), ""),
        Some(false) => (say("Couldn't copy"), say("Copy the link from the address bar.")),
    };
    let site = &app.ctx.site;
    let hud = app.picture.frozen_hud.map(|hud| if hud { "yes" } else { "no" });
    let view = View::panel("page")
        .with("", "data-state", app.state())
        // The page uses the player's colour.
        .style("", "--own", color_var(app.visit.own_color))
        .yes("", "data-calm", app.settings.calm)
        .yes("", "data-clean", app.panels.clean)
        .yes("", "data-watching", app.screen.game().is_some_and(GameScreen::watches))
        .yes("", "data-touch", app.settings.touched)
        .yes("", "data-world", app.picture.world_shown)
        .yes("", "data-framed", site.is_framed)
        .show("#own-tab", site.is_framed)
        .with_or_without("#own-tab", "href", site.is_framed.then(|| site.own_tab()))
        .with_or_without("", "data-hud", hud);
    view.text("#copy span", text)
        .with("#copy", "title", if title.is_empty() { text } else { title })
        .yes("#copy", "data-copied", app.visit.copied == Some(true))
        .text("#edit-copy", text)
        .with("#edit-copy", "title", title)
}
