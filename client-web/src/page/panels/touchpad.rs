//! Touch controls: a stick that appears under the left thumb, and a button for each tool on the right.

use crate::input::stick;
use crate::language::say;
use crate::page::app::App;
use crate::page::tools;
use crate::page::view::{View, word};
use crate::world::replica::Replica;
use jostle_game::Buttons;
use jostle_sim::Vec2;

pub fn view(app: &App) -> View {
    let view = View::panel("touchpad");
    let game = app.screen.game().and_then(|game| Some((&game.input.fingers, game.replica()?)));
    let Some((fingers, replica)) = game else { return view };
    let stick = fingers.stick();
    let (left, top, bottom) = match stick {
        Some((at, _)) => (format!("{}px", at.x), format!("{}px", at.y - stick::RADIUS_PX), "auto"),
        None => (String::new(), String::new(), ""),
    };
    let offset = stick.map_or(Vec2::ZERO, |(_, offset)| stick::knob(offset));
    view.list("#tools", tool_buttons(replica, fingers.armed))
        .show("#stick", tools::fingers(&replica.room.scene).steers)
        .with("#stick", "class", if stick.is_some() { "stick held" } else { "stick" })
        .style("#stick", "left", left)
        .style("#stick", "top", top)
        .style("#stick", "bottom", bottom)
        .style("#knob", "transform", format!("translate({}px, {}px)", offset.x, offset.y))
}

/// The tool buttons of a scene, with the armed tool and the selected kind of body. A single aimed tool needs no button,
/// since touching the world uses it.
fn tool_buttons(replica: &Replica, armed: Buttons) -> Vec<View> {
    let selected = replica.room.selected_kind();
    let tools = tools::touch_tools(&replica.room.scene);
    let lone = tools.iter().filter(|cap| cap.aimed).count() == 1;
    let tools = tools.into_iter().filter(|cap| !(lone && cap.aimed)).map(|cap| {
        let is_chosen = match tools::picks(cap.buttons) {
            Some(kind) => Some(selected == Some(kind)),
            None => cap.aimed.then_some(cap.buttons == armed),
        };
        View::item("tool-item", cap.buttons.0)
            .with("", "data-buttons", cap.buttons.0.to_string())
            .flag("", "data-arms", cap.aimed)
            .with_or_without("", "aria-pressed", is_chosen.map(word))
            .text("", say(cap.does))
    });
    tools.collect()
}
