//! Tests of the real binary: its output, its signals, and its exit status.

use crate::client::{Client, LONG};
use jostle_game::Buttons;
use jostle_protocol::{Refusal, ServerMessage};
use jostle_sim::Vec2;
use jostle_tests::program::jostle;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tokio::time::timeout;

/// A running server, which is killed if the test fails.
pub struct Process {
    pub child: Child,
    pub address: SocketAddr,
    pub ops: SocketAddr,
}

impl Process {
    /// Starts the server with additional arguments; its log goes to `log`.
    pub fn serve(more: &[&str], log: Stdio) -> Process {
        Process::start(Command::new(jostle()), more, log)
    }

    /// Starts the server with additional environment variables.
    pub fn serve_with(variables: &[(String, String)], more: &[&str], log: Stdio) -> Process {
        let mut command = Command::new(jostle());
        command.envs(variables.iter().map(|(name, value)| (name, value)));
        Process::start(command, more, log)
    }

    /// Starts the server with at most `count` descriptors, set by the shell's `ulimit` with the given flags.
    #[cfg(unix)]
    pub fn serve_with_descriptors(flags: &str, count: u32, log: Stdio) -> Process {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("ulimit {flags} {count}; exec \"$0\" \"$@\"")).arg(jostle());
        Process::start(shell, &[], log)
    }

    /// Starts the server the way systemd starts a service with a watchdog: it must send a notification to the socket at
    /// least once in every period of length `within`.
    #[cfg(unix)]
    pub fn serve_supervised(socket: &std::path::Path, within: Duration, log: Stdio) -> Process {
        let mut command = Command::new(jostle());
        command.env("NOTIFY_SOCKET", socket).env_remove("WATCHDOG_PID");
        command.env("WATCHDOG_USEC", within.as_micros().to_string());
        Process::start(command, &[], log)
    }

    /// Starts the server the way Agones does, with the sidecar on the given port.
    #[cfg(unix)]
    pub fn serve_for_agones(port: u16, log: Stdio) -> Process {
        let mut command = Command::new(jostle());
        command.env("AGONES_SDK_HTTP_PORT", port.to_string()).env("JOSTLE_AGONES", "true");
        Process::start(command, &[], log)
    }

    fn start(mut command: Command, more: &[&str], log: Stdio) -> Process {
        let mut child = command
            .args(["serve", "--listen", "127.0.0.1:0", "--ops", "127.0.0.1:0"])
            .args(if more.contains(&"--log") { &[][..] } else { &["--log", "warn"] })
            .args(more)
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .expect("jostle starts");
        let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
        let mut address = || {
            let line = lines.next().expect("a line").expect("a readable line");
            let url = line.trim().rsplit(' ').next().expect("a url");
            let address = url.split_once("://").map_or(url, |(_, address)| address);
            address.trim_end_matches('/').parse().unwrap_or_else(|_| panic!("no url in {line:?}"))
        };
        let (address, ops) = (address(), address());
        Process { child, address, ops }
    }

    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args([format!("-{name}"), id]).status();
        assert!(sent.expect("kill starts").success());
    }

    pub async fn exit_status(mut self) -> Option<i32> {
        let ended = async {
            loop {
                if let Some(status) = self.child.try_wait().expect("a child") {
                    return status.code();
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(LONG, ended).await.expect("an end in time")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // The process has already ended, unless the test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Plays until the server closes the socket; returns the reason.
async fn play_to_the_end(mut client: Client) -> (bool, (Refusal, u16)) {
    loop {
        client.input(Buttons::FIRE, Some(Vec2::new(90.0, 60.0))).await;
        match client.message().await {
            ServerMessage::Draining { .. } => return (true, client.refusal().await),
            ServerMessage::Refused { refusal } => panic!("{refusal:?} without a notice"),
            _ => {}
        }
    }
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn signals_under_load_end_the_process_in_good_order() {
    for signal in ["TERM", "INT"] {
        let serve = || Process::serve(&[], Stdio::inherit());
        let process = tokio::task::spawn_blocking(serve).await.expect("a server");
        let mut playing = Vec::new();
        for index in 0..12 {
            let name = format!("P{index}");
            let client = Client::join(process.address, "arena", &name).await;
            playing.push(tokio::spawn(play_to_the_end(client)));
        }
        process.signal(signal);
        for client in playing {
            let ended = timeout(LONG, client).await.expect("an end in time").expect("no panic");
            assert_eq!(ended, (true, (Refusal::Closing, 1001)), "{signal}");
        }
        assert_eq!(process.exit_status().await, Some(0), "{signal}");
    }
}
