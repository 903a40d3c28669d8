//! The server of the soak: a process of its own, whose machine fails on demand.

use crate::client::LONG;
use std::io::{BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;
use tokio::time::{sleep, timeout};

/// A running `shaky_host`; killed when the test fails.
pub struct Host {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    pub address: SocketAddr,
    /// The operators' port.
    pub ops: SocketAddr,
}

impl Host {
    /// Records into `dir`.
    pub fn start(dir: &Path) -> Host {
        let mut child = Command::new(env!("CARGO_BIN_EXE_shaky_host"))
            .arg(dir)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the host starts");
        let orders = child.stdin.take().expect("a pipe");
        let mut answers = BufReader::new(child.stdout.take().expect("a pipe"));
        let line = line(&mut answers);
        let (address, ops) = line.split_once(' ').expect("two addresses");
        let parse = |text: &str| text.parse().expect("an address");
        Host { child, orders, address: parse(address), ops: parse(ops), answers }
    }

    /// Has the machine do something; returns when it has.
    pub fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").expect("a live host");
        assert_eq!(line(&mut self.answers), "ok", "{order}");
    }

    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args([format!("-{name}"), id]).status();
        assert!(sent.expect("kill starts").success());
    }

    /// Waits for its end.
    pub async fn exit_status(mut self) -> Option<i32> {
        let ended = async {
            loop {
                if let Some(status) = self.child.try_wait().expect("a child") {
                    return status.code();
                }
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(LONG, ended).await.expect("an end in time")
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // Already ended, unless the test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn line(from: &mut impl BufRead) -> String {
    let mut line = String::new();
    from.read_line(&mut line).expect("a readable line");
    line.trim().to_owned()
}
