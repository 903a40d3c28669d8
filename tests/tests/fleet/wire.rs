//! A NATS client that speaks the text protocol over a plain socket.

use jostle_tests::server::LONG;
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Subject for the responses to this client's requests.
const ANSWERS: &str = "_INBOX.wire";
/// Time after which a request is sent again. A server whose leader has just changed never responds to some requests.
const ASK_AGAIN: Duration = Duration::from_secs(5);

pub struct Wire {
    server: SocketAddr,
    stream: BufReader<TcpStream>,
    /// The description that the server initially sends of itself.
    pub info: Value,
}

impl Wire {
    pub async fn connect(server: SocketAddr) -> Wire {
        let stream = TcpStream::connect(server).await.expect("a server that accepts");
        Wire::begin(stream).await
    }

    /// Takes over a connection that nothing has been read from yet.
    pub async fn begin(stream: TcpStream) -> Wire {
        let server = stream.peer_addr().expect("a connection");
        let mut wire = Wire { server, stream: BufReader::new(stream), info: Value::Null };
        let line = wire.line().await;
        let info = line.strip_prefix("INFO ").unwrap_or_else(|| panic!("no INFO: {line}"));
        wire.info = serde_json::from_str(info).expect("JSON");
        wire.send("CONNECT {\"verbose\":false,\"headers\":true}\r\n").await;
        wire.send(&format!("SUB {ANSWERS} 1\r\n")).await;
        wire.ping().await;
        wire
    }

    pub async fn send(&mut self, text: &str) {
        self.stream.write_all(text.as_bytes()).await.expect("a connection");
    }

    /// Reads the next line that is not a ping.
    pub async fn line(&mut self) -> String {
        let read = async {
            loop {
                let mut line = String::new();
                let read = self.stream.read_line(&mut line).await.expect("a connection");
                assert!(read > 0, "the server closed the connection");
                match line.trim_end() {
                    "PING" => self.send("PONG\r\n").await,
                    line => return line.to_owned(),
                }
            }
        };
        timeout(LONG, read).await.expect("a line in time")
    }

    pub async fn ping(&mut self) {
        self.send("PING\r\n").await;
        assert_eq!(self.line().await, "PONG");
    }

    /// Whether no unread data from the server is available.
    pub fn is_silent(&self) -> bool {
        let read = self.stream.get_ref().try_read(&mut [0]);
        self.stream.buffer().is_empty()
            && read.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock)
    }

    /// Waits for the connection to end.
    pub async fn ends(mut self) {
        let mut rest = Vec::new();
        let read = timeout(LONG, self.stream.read_to_end(&mut rest)).await.expect("an end in time");
        // A killed server may reset the connection.
        assert!(rest.is_empty() || read.is_err(), "{}", String::from_utf8_lossy(&rest));
    }

    pub async fn subscribe(&mut self, subject: &str) {
        self.send(&format!("SUB {subject} 2\r\n")).await;
        self.ping().await;
    }

    pub async fn publish(&mut self, subject: &str, text: &str) {
        self.send(&format!("PUB {subject} {}\r\n{text}\r\n", text.len())).await;
    }

    /// The text of a subscription's next message.
    pub async fn message(&mut self) -> String {
        let line = self.line().await;
        assert!(line.starts_with("MSG "), "no message: {line}");
        let length = line.rsplit(' ').next().and_then(|length| length.parse::<usize>().ok());
        let mut bytes = vec![0; length.expect("a length") + "\r\n".len()];
        let read = timeout(LONG, self.stream.read_exact(&mut bytes)).await.expect("a text in time");
        read.expect("a connection");
        String::from_utf8(bytes).expect("text").trim_end().to_owned()
    }

    /// Sends a request until it is answered and returns the response. The request must therefore be idempotent.
    async fn request(&mut self, subject: &str, headers: &str, body: &str) -> Value {
        let headers = format!("NATS/1.0\r\n{headers}\r\n");
        let (head, all) = (headers.len(), headers.len() + body.len());
        let request = format!("HPUB {subject} {ANSWERS} {head} {all}\r\n{headers}{body}\r\n");
        let answered = async {
            loop {
                self.send(&request).await;
                match timeout(ASK_AGAIN, self.message()).await {
                    Ok(answer) => return serde_json::from_str(&answer).expect("JSON"),
                    // A new connection ensures that a late response is not mistaken for the response to another
                    // request.
                    Err(_late) => *self = Box::pin(Wire::connect(self.server)).await,
                }
            }
        };
        timeout(LONG, answered).await.expect("an answer in time")
    }

    /// Stores a text in a stream exactly once and returns its sequence number.
    pub async fn keep(&mut self, stream: &str, text: &str) -> u64 {
        let answer = self.request(stream, &format!("Nats-Msg-Id: {text}\r\n"), text).await;
        answer["seq"].as_u64().unwrap_or_else(|| panic!("not kept: {answer}"))
    }

    /// Returns the server's response to an API request.
    pub async fn ask(&mut self, subject: &str, body: &Value) -> Value {
        let answer = self.request(subject, "", &body.to_string()).await;
        assert_eq!(answer["error"], Value::Null);
        answer
    }

    /// Creates a stream, with replicas on `copies` servers, that stores messages published under its name.
    pub async fn create_stream(&mut self, name: &str, copies: usize) {
        let body = json!({"name": name, "subjects": [name], "num_replicas": copies});
        self.ask(&format!("$JS.API.STREAM.CREATE.{name}"), &body).await;
    }

    /// The state of a stream, with the number of messages per subject; null if the stream does not exist.
    pub async fn state_of(&mut self, stream: &str) -> Value {
        let subject = format!("$JS.API.STREAM.INFO.{stream}");
        self.request(&subject, "", r#"{"subjects_filter":">"}"#).await["state"].take()
    }

    /// Returns the number of messages in a stream.
    pub async fn count_of(&mut self, stream: &str) -> u64 {
        let answer = self.request(&format!("$JS.API.STREAM.INFO.{stream}"), "", "").await;
        answer["state"]["messages"].as_u64().unwrap_or_else(|| panic!("no count: {answer}"))
    }
}
