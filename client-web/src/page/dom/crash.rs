//! The card shown after the program crashed.

use crate::browser;
use crate::page::dom;
use crate::page::dom::patch::Patch;
use crate::page::panels::dialogs;
use crate::page::strings;
use crate::page::view::View;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;

/// Shows a card after a crash. Uses only the document, since the program's state is lost.
pub fn show() {
    let view = View::panel("crash").with("", "data-state", "refused").show("#notice", true);
    Patch::default().show(dialogs::notice(view, &strings::CRASHED));
    let reload = Closure::once_into_js(|| {
        let _ = browser::window().location().reload();
    });
    let button = dom::html("notice-button");
    button.set_onclick(Some(reload.unchecked_ref()));
    let _ = button.focus();
}
