//! A card in the middle of the page.

use crate::page::qr_code::Drawing;
use std::borrow::Cow;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CardAction {
    /// Back to the lobby.
    Lobby,
    Watch,
    Again,
    /// Loads the page again.
    Reload,
    Play,
    /// Takes the card away.
    Stay,
    /// Asks for a replay file.
    File,
    /// Asks the server again.
    Refetch,
    /// Edits the scene of the link.
    Edit,
    /// Edits the draft that is kept.
    Draft,
    /// Edits what is played.
    Unplay,
    /// Plays a scene that may be too heavy.
    PlayHeavy,
    /// Goes on with a game or a replay that stands still.
    Resume,
}

/// A card in the middle of the page that says what happened and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Card {
    /// Two or three words.
    pub title: &'static str,
    /// One sentence or two.
    pub text: Cow<'static, str>,
    /// A line about exactly what was found, or empty.
    pub detail: String,
    pub button: &'static str,
    pub action: CardAction,
    /// A second, less inviting button and its action.
    pub other: Option<(&'static str, CardAction)>,
    /// Goes away by itself; the button need not have the focus.
    pub passing: bool,
    /// A link as a QR code.
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

/// A card that goes away by itself.
pub const fn passing(mut card: Card) -> Card {
    card.passing = true;
    card
}

/// With a second button.
pub const fn card_or(mut card: Card, label: &'static str, action: CardAction) -> Card {
    card.other = Some((label, action));
    card
}
