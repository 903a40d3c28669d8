//! The card of a program that ended by a mistake of its own.

use crate::browser;
use crate::page::dom;
use crate::page::dom::patch::Patch;
use crate::page::panels::dialogs;
use crate::page::strings;
use crate::page::view::View;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;

/// The last card there is: the program ended by a mistake of its own. Needs nothing but the document.
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
