//! Small HTTP requests to the page's server.

use crate::net::api::Request;
use crate::net::report::Fetched;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::{XmlHttpRequest, XmlHttpRequestResponseType};

/// Timeout for fetching a file, milliseconds.
const FILE_TIMEOUT_MS: u32 = 60_000;
/// Timeout for a post of a session over HTTP, milliseconds, as long as the silence after which a session is given up.
const POST_TIMEOUT_MS: u32 = 6000;

pub fn fetch(path: &str, done: impl FnOnce(Fetched) + 'static) {
    let Ok(request) = XmlHttpRequest::new() else { return done(Fetched::Nothing) };
    let sent = request.open_with_async("GET", path, true).and_then(|()| {
        request.set_timeout(FILE_TIMEOUT_MS);
        request.set_response_type(XmlHttpRequestResponseType::Arraybuffer);
        request.send()
    });
    if sent.is_err() {
        return done(Fetched::Nothing);
    }
    let answered = request.clone();
    let closure = Closure::once_into_js(move || {
        let status = answered.status().unwrap_or(0);
        done(match (status, answered.response()) {
            (200, Ok(buffer)) if buffer.is_object() => {
                Fetched::Bytes(js_sys::Uint8Array::new(&buffer).to_vec())
            }
            (0 | 200, _) => Fetched::Nothing,
            _ => Fetched::Refused(status),
        });
    });
    request.set_onloadend(Some(closure.unchecked_ref()));
}

/// Sends a body to an address, then calls `done` with the status of the response, or with 0 if there was none.
pub fn post(address: &str, body: &[u8], done: impl FnOnce(u16) + 'static) {
    let Ok(request) = XmlHttpRequest::new() else { return done(0) };
    let sent = request.open_with_async("POST", address, true).and_then(|()| {
        request.set_timeout(POST_TIMEOUT_MS);
        request.send_with_opt_u8_array(Some(body))
    });
    if sent.is_err() {
        return done(0);
    }
    let answered = request.clone();
    let closure = Closure::once_into_js(move || done(answered.status().unwrap_or(0)));
    request.set_onloadend(Some(closure.unchecked_ref()));
}

/// Sends a request to an address, then calls `done` with the text of the response, or with `None` if there was none. A
/// refusal by the server counts as a response.
pub fn call(
    call: &Request,
    (method, path): (&str, &str),
    done: impl FnOnce(Option<String>) + 'static,
) {
    let Ok(request) = XmlHttpRequest::new() else { return done(None) };
    let sent = request.open_with_async(method, path, true).and_then(|()| {
        request.set_timeout(call.timeout_ms());
        let Some((body, media_type)) = call.body() else { return request.send() };
        request.set_request_header("content-type", media_type)?;
        request.send_with_opt_u8_array(Some(&body))
    });
    if sent.is_err() {
        return done(None);
    }
    let answered = request.clone();
    // `loadend` fires exactly once, whatever the outcome.
    let closure = Closure::once_into_js(move || {
        let text = answered.response_text().ok().flatten();
        done(text.filter(|_| answered.status().is_ok_and(|status| status != 0)));
    });
    request.set_onloadend(Some(closure.unchecked_ref()));
}
