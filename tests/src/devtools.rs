//! The part of the Chrome DevTools Protocol that the tests need: commands, responses and events as JSON over one
//! WebSocket (<https://chromedevtools.github.io/devtools-protocol>).
//!
//! Existing libraries define a type for every message of the protocol, which adds more than a minute to a cold build,
//! although the tests send only 22 different commands.

use crate::server::LONG;
use anyhow::{Context, Result, bail};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;

/// Commands to the browser or to one of its pages; clones share the connection.
#[derive(Clone)]
pub struct Session {
    commands: mpsc::UnboundedSender<Message>,
    pending: Arc<Mutex<Pending>>,
    /// The page's session; `None` addresses the browser.
    id: Option<String>,
}

/// An event of a page.
pub struct Event {
    pub method: String,
    pub params: Value,
}

/// Unanswered commands and listeners for events.
#[derive(Default)]
struct Pending {
    last_command: u64,
    answers: HashMap<u64, oneshot::Sender<Value>>,
    events: HashMap<String, mpsc::UnboundedSender<Event>>,
}

impl Session {
    /// Connects to the browser at the address that it prints, `ws://127.0.0.1:PORT/PATH`.
    pub async fn connect(address: &str) -> Result<Session> {
        let host = address.strip_prefix("ws://").and_then(|rest| rest.split('/').next());
        let host = host.with_context(|| format!("{address} is no address of a browser"))?;
        let stream = TcpStream::connect(host).await?;
        // The default buffer of 128 KiB is cleared at each read.
        let config = WebSocketConfig::default().read_buffer_size(8192);
        let (socket, _) =
            tokio_tungstenite::client_async_with_config(address, stream, Some(config)).await?;
        let (commands, queued) = mpsc::unbounded_channel();
        let pending = Arc::default();
        tokio::spawn(exchange(socket, queued, Arc::clone(&pending)));
        Ok(Session { commands, pending, id: None })
    }

    /// Attaches to a page. Returns its session and the events of the enabled domains.
    pub async fn attach(
        &self,
        target_id: &str,
    ) -> Result<(Session, mpsc::UnboundedReceiver<Event>)> {
        let params = json!({"targetId": target_id, "flatten": true});
        Ok(self.attached(text(&self.call("Target.attachToTarget", params).await?, "sessionId")?))
    }

    /// The session with this identifier, to a page or frame that the browser attached to.
    pub fn attached(&self, id: String) -> (Session, mpsc::UnboundedReceiver<Event>) {
        let (sender, events) = mpsc::unbounded_channel();
        lock(&self.pending).events.insert(id.clone(), sender);
        (Session { id: Some(id), ..self.clone() }, events)
    }

    /// Sends a command and waits for the response; fails with the browser's message if the command is refused.
    pub async fn call(&self, method: &str, params: Value) -> Result<Value> {
        let (sender, answer) = oneshot::channel();
        let number = {
            let mut pending = lock(&self.pending);
            pending.last_command += 1;
            let number = pending.last_command;
            pending.answers.insert(number, sender);
            number
        };
        let mut command = json!({"id": number, "method": method, "params": params});
        if let Some(id) = &self.id {
            command["sessionId"] = json!(id);
        }
        let gone = || format!("{method}: the browser is gone");
        self.commands.send(Message::text(command.to_string())).with_context(gone)?;
        let answer = tokio::time::timeout(LONG, answer).await;
        let answer = answer.with_context(|| format!("{method}: no answer"))?;
        let mut answer = answer.with_context(gone)?;
        if let Some(error) = answer.get("error") {
            bail!("{method}: {error}");
        }
        Ok(answer["result"].take())
    }
}

/// Returns a field of a response, which must be text.
pub(crate) fn text(answer: &Value, field: &str) -> Result<String> {
    let value = answer[field].as_str();
    Ok(value.with_context(|| format!("no {field} in {answer}"))?.to_owned())
}

/// Sends commands and dispatches incoming messages until either end is gone.
async fn exchange(
    socket: WebSocketStream<TcpStream>,
    mut queued: mpsc::UnboundedReceiver<Message>,
    pending: Arc<Mutex<Pending>>,
) {
    let (mut sink, mut stream) = socket.split();
    loop {
        tokio::select! {
            command = queued.recv() => {
                let Some(command) = command else { break };
                if sink.send(command).await.is_err() {
                    break;
                }
            }
            message = stream.next() => match message {
                Some(Ok(Message::Text(text))) => deliver(&text, &mut lock(&pending)),
                Some(Ok(_)) => {}
                _ => break,
            },
        }
    }
    // Fail all pending and future commands.
    queued.close();
    *lock(&pending) = Pending::default();
}

/// Passes a message to the command that it answers or to its session's listener.
fn deliver(text: &str, pending: &mut Pending) {
    let Ok(mut message) = serde_json::from_str::<Value>(text) else { return };
    if let Some(number) = message["id"].as_u64() {
        if let Some(sender) = pending.answers.remove(&number) {
            // The caller may have given up.
            drop(sender.send(message));
        }
        return;
    }
    let listener = message["sessionId"].as_str().and_then(|id| pending.events.get(id));
    if let (Some(listener), Some(method)) = (listener, message["method"].as_str()) {
        let method = method.to_owned();
        drop(listener.send(Event { method, params: message["params"].take() }));
    }
}

fn lock(pending: &Mutex<Pending>) -> MutexGuard<'_, Pending> {
    pending.lock().unwrap_or_else(PoisonError::into_inner)
}
