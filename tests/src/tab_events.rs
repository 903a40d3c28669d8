//! What a page in the browser reports by itself: documents that have loaded, frames, and errors.

use crate::devtools::Event;
use serde_json::Value;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::{mpsc, watch};

/// Collects all errors on the page's console and tracks which document was loaded most recently, and which frame of
/// another site was added.
pub async fn listen(
    mut events: mpsc::UnboundedReceiver<Event>,
    [loads, frames]: [watch::Sender<String>; 2],
    errors: Arc<Mutex<Vec<String>>>,
) {
    while let Some(Event { method, params }) = events.recv().await {
        let error = match method.as_str() {
            "Page.lifecycleEvent" if params["name"] == "load" => {
                loads.send_replace(params["loaderId"].as_str().unwrap_or("").to_owned());
                continue;
            }
            "Target.attachedToTarget" => {
                frames.send_replace(params["sessionId"].as_str().unwrap_or("").to_owned());
                continue;
            }
            "Runtime.consoleAPICalled" if params["type"] == "error" => {
                params["args"].as_array().map_or_else(String::new, |args| {
                    args.iter().map(shown).collect::<Vec<_>>().join(" ")
                })
            }
            "Runtime.exceptionThrown" => exception_text(&params["exceptionDetails"]),
            "Log.entryAdded" if params["entry"]["level"] == "error" => {
                let field = |name| params["entry"][name].as_str().unwrap_or("");
                format!("{} {}", field("text"), field("url"))
            }
            _ => continue,
        };
        errors.lock().unwrap_or_else(PoisonError::into_inner).push(error);
    }
}

/// Formats a value that was written to the console.
fn shown(value: &Value) -> String {
    match (value.get("value"), value["description"].as_str()) {
        (Some(value), _) => value.to_string(),
        (None, description) => description.unwrap_or("").to_owned(),
    }
}

/// The text of an exception, as the console shows it.
pub fn exception_text(details: &Value) -> String {
    let description = details["exception"]["description"].as_str().unwrap_or("");
    format!("{} {description}", details["text"].as_str().unwrap_or(""))
}
