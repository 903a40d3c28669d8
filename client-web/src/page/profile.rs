//! Who plays: name and colour, remembered by the browser.

use super::dom;
use crate::api::query_value;
use crate::{name, words};
use jostle_protocol::{Appearance, Token, limits};
use std::cell::Cell;

const NAME_KEY: &str = "jostle.name";
const COLOR_KEY: &str = "jostle.color";
const PREDICT_KEY: &str = "jostle.predict";

/// The remembered player, or a friendly stranger who is remembered from now on.
pub fn load() -> Appearance {
    let stored = |key| dom::local_storage().and_then(|s| s.get_item(key).ok().flatten());
    let color = stored(COLOR_KEY).and_then(|text| text.parse().ok());
    let color = color.filter(|c| *c < limits::COLORS).unwrap_or_else(random_color);
    let name = stored(NAME_KEY).unwrap_or_default();
    Appearance::new(name::finished(&name), color).unwrap_or_else(|_| {
        let stranger = Appearance { name: words::friendly_name(random_bits()), color };
        save(&stranger);
        stranger
    })
}

/// Remembers the player.
pub fn save(appearance: &Appearance) {
    if let Some(storage) = dom::local_storage() {
        // A full or forbidden storage only means that the next visit starts anew.
        let _ = storage.set_item(NAME_KEY, &appearance.name);
        let _ = storage.set_item(COLOR_KEY, &appearance.color.to_string());
    }
}

thread_local! {
    /// Whether the own hero is to be shown before the server's word.
    static PREDICTS: Cell<bool> = Cell::new(predicts_at_first());
}

/// What the address (`?predict=0`) says, else what was chosen on another day; on for strangers.
fn predicts_at_first() -> bool {
    let query = dom::window().location().search().unwrap_or_default();
    let asked = query_value(&query, "predict").map(str::to_owned);
    let stored = || dom::local_storage().and_then(|s| s.get_item(PREDICT_KEY).ok().flatten());
    asked.or_else(stored).is_none_or(|word| word != "0")
}

/// Whether the own hero is to be shown before the server's word.
pub fn predicts() -> bool {
    PREDICTS.get()
}

/// Remembers whether the own hero is to be shown before the server's word.
pub fn set_predicts(wanted: bool) {
    PREDICTS.set(wanted);
    if let Some(storage) = dom::local_storage() {
        let _ = storage.set_item(PREDICT_KEY, if wanted { "1" } else { "0" });
    }
}

/// The token of the seat that this tab had in a room.
pub fn seat_token(code: &str) -> Option<Token> {
    token("seat", code)
}

/// Remembers the token of a seat, or forgets it.
pub fn set_seat_token(code: &str, token: Option<Token>) {
    set_token("seat", code, token);
}

/// The key of the host of a room that this tab opened.
pub fn host_key(code: &str) -> Option<Token> {
    token("host", code)
}

/// Remembers the key of a room's host, or forgets it.
pub fn set_host_key(code: &str, key: Option<Token>) {
    set_token("host", code, key);
}

/// What this tab keeps for a room.
fn token(of: &str, code: &str) -> Option<Token> {
    let text = dom::session_storage()?.get_item(&format!("jostle.{of}.{code}")).ok()??;
    Token::parse(&text)
}

fn set_token(of: &str, code: &str, token: Option<Token>) {
    let Some(storage) = dom::session_storage() else { return };
    let key = format!("jostle.{of}.{code}");
    let _ = match token {
        Some(token) => storage.set_item(&key, &token.text()),
        None => storage.remove_item(&key),
    };
}

fn random_bits() -> u32 {
    (js_sys::Math::random() * f64::from(u32::MAX)) as u32
}

fn random_color() -> u8 {
    (random_bits() % u32::from(limits::COLORS)) as u8
}
