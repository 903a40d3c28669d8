//! A card in the middle of the page.

use crate::page::qr_code::Drawing;
use std::borrow::Cow;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardAction {
    /// Returns to the lobby.
    Lobby,
    Watch,
    /// Follows the host to the next room.
    Follow,
    Again,
    Reload,
    Play,
    Stay,
    /// Opens a file chooser for a replay.
    File,
    /// Repeats the request to the server.
    Refetch,
    /// Edits the scene in the link.
    Edit,
    /// Edits the stored draft.
    Draft,
    /// Edits the scene being played.
    Unplay,
    /// Plays a scene that may be too heavy.
    PlayHeavy,
    /// Continues a paused game or replay.
    Resume,
}

/// A card in the middle of the page that says what happened and offers a next step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Card {
    /// A title of two or three words.
    pub title: &'static str,
    /// One or two sentences.
    pub text: Cow<'static, str>,
    /// A line with the exact details; may be empty.
    pub detail: String,
    pub button: &'static str,
    pub action: CardAction,
    /// A second, less prominent button and its action.
    pub other: Option<(&'static str, CardAction)>,
    /// Whether the card closes by itself, so that its button does not need the focus.
    pub passing: bool,
    /// A link shown as a QR code.
    pub code: Option<Arc<Drawing>>,
}

/// A card with one button.
pub const fn card(
    title: &'static str,
    text: &'static str,
    button: &'static str,
    action: CardAction,
) -> Card {
    let text = Cow::Borrowed(text);
    let detail = String::new();
    Card { title, text, detail, button, action, other: None, passing: false, code: None }
}

/// Makes a card close by itself.
pub const fn passing(mut card: Card) -> Card {
    card.passing = true;
    card
}

/// A card with a second button.
pub const fn card_or(mut card: Card, label: &'static str, action: CardAction) -> Card {
    card.other = Some((label, action));
    card
}
