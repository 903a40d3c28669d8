//! Cards about scenes: invalid ones, links, drafts, and scenes that are too heavy.

use crate::language::fill;
use crate::net::scene_link::SceneLinkError;
use crate::page::card::{Card, CardAction, card, card_or, passing};
use crate::page::qr_code;
use jostle_game::scene::{SceneError, WorstTick};
use std::sync::Arc;

/// The card for an invalid scene. `playing` says whether a game or replay is on display.
pub fn bad_scene(error: &SceneError, playing: bool) -> Card {
    let (label, action) = match playing {
        true => ("Keep going", CardAction::Stay),
        false => ("Back to the lobby", CardAction::Lobby),
    };
    let text = "It can be played once this is corrected:";
    let card = card("The scene has an error", text, "Open another file", CardAction::File);
    Card { detail: error.to_string(), ..card_or(card, label, action) }
}

/// The card for a link to an invalid scene.
pub fn bad_linked_scene(error: &SceneError) -> Card {
    let card = Card { button: "Edit", action: CardAction::Edit, ..bad_scene(error, false) };
    Card { text: "It can be played once this is corrected.".into(), ..card }
}

/// The card with the QR code of a link.
pub fn link_code(link: &str) -> Card {
    let text = "Point the camera of a phone at the code to open the link there.";
    let card = card("QR code", text, "Done", CardAction::Stay);
    match qr_code::draw(link) {
        Some(code) => Card { code: Some(Arc::new(code)), ..card },
        None => Card { text: LONG_LINK.into(), ..card },
    }
}
const LONG_LINK: &str = "This scene is too long for a QR code. Copy its link instead.";

/// The card for a scene link that cannot be decoded.
pub fn bad_link(error: &SceneLinkError) -> Card {
    let text = "This link holds no scene that can be played. Ask for the link again, or for the scene's file.";
    let card = card("Broken scene link", text, "Back to the lobby", CardAction::Lobby);
    Card { detail: error.to_string(), ..card }
}

/// The card shown if no room could be opened, for a reason other than an error in the scene's text.
pub fn no_room(reason: &str) -> Card {
    let text = "You can go on editing, and nothing is lost.";
    let card = card("No room was opened", text, "Keep going", CardAction::Stay);
    Card { detail: reason.to_owned(), ..card }
}

/// Shown when the stored draft differs from the edited text, because another tab changed it or it is from an earlier
/// visit.
pub const OTHER_DRAFT: Card = passing(card(
    "There is another draft",
    "A draft of this scene with other changes was saved in another tab or earlier.",
    "Open it here",
    CardAction::Draft,
));

/// The card for a draft that was stored under this name next to another draft of the same scene.
pub fn second_draft(name: &str) -> Card {
    let text = "This scene had another draft, saved in another tab or earlier. Yours is now \u{201c}{name}\u{201d}; go back to see the other one.";
    let card = card("Saved as a second draft", "", "Keep editing", CardAction::Stay);
    Card { text: fill(text, &[("name", name)]).into(), ..card }
}

/// The card for a scene that may be too heavy for the page. `edits` says whether it is being edited.
pub fn heavy_scene(worst: &WorstTick, edits: bool) -> Card {
    let text = "It may run slowly, or make this tab stop responding for a while.";
    let card = card("This scene is heavy", text, "Play anyway", CardAction::PlayHeavy);
    let (label, action) = match edits {
        true => ("Keep editing", CardAction::Stay),
        false => ("Back to the lobby", CardAction::Lobby),
    };
    let detail = fill(
        "One tick may take {time} ms, mostly because of {field}.",
        &[("time", &format!("{:.0}", worst.ms)), ("field", &worst.field)],
    );
    Card { detail, ..card_or(card, label, action) }
}

/// The card for an in-page game or a replay that was paused because a tick took this long, milliseconds.
pub fn stalled(taken_ms: f64, edits: bool) -> Card {
    let (label, action) = match edits {
        true => ("Edit", CardAction::Unplay),
        false => ("Back to the lobby", CardAction::Lobby),
    };
    let text = fill(
        "One tick of this scene took {time} s. It is paused so that this tab keeps responding.",
        &[("time", &format!("{:.1}", taken_ms / 1000.0))],
    );
    let card = card_or(card("Paused", "", label, action), "Keep going", CardAction::Resume);
    Card { text: text.into(), ..card }
}
