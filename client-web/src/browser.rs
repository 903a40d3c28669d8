//! Browser APIs other than the document: window, timers, storage and console.

use litemap::LiteMap;
use std::cell::Cell;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Storage, Window};

pub fn window() -> Window {
    web_sys::window().expect("the client runs in a page")
}

/// Milliseconds since the page was opened; the value never decreases.
pub fn now_ms() -> f64 {
    window().performance().map_or(0.0, |performance| performance.now())
}

/// Whether a media query matches.
pub fn media(query: &str) -> bool {
    window().match_media(query).ok().flatten().is_some_and(|list| list.matches())
}

/// Whether another page shows this one in a frame.
pub fn is_framed() -> bool {
    window().top().ok().flatten().is_none_or(|top| top != window())
}

/// Calls `react` at this interval for as long as the page is open.
pub fn every(interval_ms: i32, react: impl Fn() + 'static) {
    let closure = Closure::<dyn Fn()>::new(react);
    window()
        .set_interval_with_callback_and_timeout_and_arguments_0(
            closure.as_ref().unchecked_ref(),
            interval_ms,
        )
        .expect("a window has timers");
    closure.forget();
}

/// Calls `react` once, this many milliseconds from now.
pub fn after(delay_ms: i32, react: impl FnOnce() + 'static) {
    let closure = Closure::once_into_js(react);
    window()
        .set_timeout_with_callback_and_timeout_and_arguments_0(closure.unchecked_ref(), delay_ms)
        .expect("a window has timers");
}

/// The browser's storage for this site; `None` if access to it is blocked.
pub fn local_storage() -> Option<Storage> {
    window().local_storage().ok().flatten()
}

/// The storage of this tab; `None` if access to it is blocked.
pub fn session_storage() -> Option<Storage> {
    window().session_storage().ok().flatten()
}

pub fn stored(storage: Option<&Storage>) -> LiteMap<String, String> {
    let Some(storage) = storage else { return LiteMap::new() };
    let count = storage.length().unwrap_or(0);
    let keys = (0..count).filter_map(|index| storage.key(index).ok().flatten());
    keys.filter_map(|key| Some((storage.get_item(&key).ok()??, key)))
        .map(|(value, key)| (key, value))
        .collect()
}

/// Writes a warning to the developer console.
pub fn warn(text: &str) {
    web_sys::console::warn_1(&JsValue::from_str(text));
}

thread_local! {
    static IN_ATTEMPT: Cell<bool> = const { Cell::new(false) };
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(catch, js_namespace = Reflect)]
    fn apply(
        work: &mut dyn FnMut(),
        this: &JsValue,
        arguments: &js_sys::Array,
    ) -> Result<(), JsValue>;
}

/// Runs work that may panic through no fault of the page; returns `None` if it does. A panic is a WebAssembly trap,
/// which unwinds to the nearest JavaScript frame; the call through `Reflect.apply` provides one. Values owned by the
/// work are leaked, since they may be in an inconsistent state.
pub fn attempt<R>(work: impl FnOnce() -> R) -> Option<R> {
    let (mut work, mut result) = (Some(work), None);
    ends_well(&mut || result = work.take().map(|work| work())).then_some(result)?
}

fn ends_well(work: &mut dyn FnMut()) -> bool {
    IN_ATTEMPT.set(true);
    let ended = apply(&mut || work(), &JsValue::NULL, &js_sys::Array::new());
    IN_ATTEMPT.set(false);
    ended.is_ok()
}

/// Whether a panic at this point would end only the current [`attempt`].
pub fn is_in_attempt() -> bool {
    IN_ATTEMPT.get()
}
