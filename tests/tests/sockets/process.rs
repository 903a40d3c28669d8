//! The real binary: its line of output, its signals, its exit status.

use crate::client::{Client, LONG};
use jostle_game::Buttons;
use jostle_protocol::{Refusal, ServerMessage};
use jostle_sim::Vec2;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tokio::time::timeout;

/// Builds `jostle` with the profile of this test, since an older binary could be misleading.
/// Selected from the whole workspace it shares the features, and so the dependencies, with this
/// test.
fn binary() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let profile_dir = test.ancestors().nth(2).expect("target/PROFILE/deps/test");
    let target_dir = profile_dir.parent().expect("target/PROFILE");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--workspace", "--bin", "jostle"]);
    cargo.arg("--target-dir").arg(target_dir);
    if profile_dir.ends_with("release") {
        cargo.arg("--release");
    }
    // Cargo sets these for this test. Some build scripts depend on them, and would run again.
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy();
        if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") {
            cargo.env_remove(&*name);
        }
    }
    assert!(cargo.status().expect("cargo starts").success(), "jostle builds");
    profile_dir.join(format!("jostle{}", std::env::consts::EXE_SUFFIX))
}

/// A running server, killed if the test fails.
pub struct Process {
    pub child: Child,
    pub address: SocketAddr,
    /// The operators' port.
    pub ops: SocketAddr,
}

impl Process {
    /// Starts the server with more arguments; its log goes to `log`.
    pub fn serve(more: &[&str], log: Stdio) -> Process {
        Process::start(Command::new(binary()), more, log)
    }

    /// Starts it with at most this many descriptors, by the shell's `ulimit` with these flags.
    #[cfg(unix)]
    pub fn serve_with_descriptors(flags: &str, count: u32, log: Stdio) -> Process {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("ulimit {flags} {count}; exec \"$0\" \"$@\"")).arg(binary());
        Process::start(shell, &[], log)
    }

    /// Starts it as systemd does a service whose signs of life it wants at this socket, within this time of each other.
    #[cfg(unix)]
    pub fn serve_supervised(socket: &std::path::Path, within: Duration, log: Stdio) -> Process {
        let mut command = Command::new(binary());
        command.env("NOTIFY_SOCKET", socket).env_remove("WATCHDOG_PID");
        command.env("WATCHDOG_USEC", within.as_micros().to_string());
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
        // Already ended, unless the test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Plays until the server says why it closes.
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
