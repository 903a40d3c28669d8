//! Plays a short game with a released program as a smoke test, which checks that it serves the page, plays, and shuts
//! down cleanly.

use super::program::ReleaseTarget;
use crate::packages;
use crate::shell::{in_path, line_of, output_of, run, say};
use anyhow::{Context, Result, ensure};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

const BOTS: &str = "2";
const SECONDS: &str = "3";

/// A running server, which is killed if the trial fails.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        // The server has already ended, unless the trial failed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts the server, fetches the page, plays with bots, and stops the server with SIGTERM.
pub fn play(target: &ReleaseTarget, program: &Path) -> Result<()> {
    if let Some([emulator, package]) = target.emulator
        && !in_path(emulator)
    {
        packages::provide(&format!("trials of programs for {}", target.name), &[package])?;
    }
    let mut serve = command(target, program);
    serve.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn"]).stdout(Stdio::piped());
    let child = serve.spawn().with_context(|| format!("cannot start {}", line_of(&serve)))?;
    let mut server = Server(child);
    let mut line = String::new();
    let stdout = server.0.stdout.take().context("the server's output")?;
    BufReader::new(stdout).read_line(&mut line)?;
    let address = line.trim().rsplit("//").next().unwrap_or_default().trim_end_matches('/');
    let page =
        fetch(address).with_context(|| format!("the page of a server that said {line:?}"))?;
    ensure!(page.contains("/assets/v-"), "{} does not hold the page", program.display());

    let mut bots = command(target, program);
    bots.args(["bots", &format!("ws://{address}/arena"), "--clients", BOTS, "--seconds", SECONDS]);
    let report: serde_json::Value = serde_json::from_str(&output_of(bots.arg("--json"))?)?;
    let snapshots = report["snapshots_per_second_mean"].as_f64().unwrap_or_default();
    ensure!(snapshots > 0.0, "bots got no snapshots: {report}");

    run(Command::new("kill").arg(server.0.id().to_string()))?;
    let status = server.0.wait()?;
    ensure!(status.success(), "after SIGTERM the server ended with {status}");
    say("dist", &format!("{}: {BOTS} bots got {snapshots:.0} snapshots a second", target.name));
    Ok(())
}

fn command(target: &ReleaseTarget, program: &Path) -> Command {
    match target.emulator {
        None => Command::new(program),
        Some([emulator, _]) => {
            let mut command = Command::new(emulator);
            command.arg(program);
            command
        }
    }
}

/// Fetches the page's document, including the response head.
fn fetch(address: &str) -> Result<String> {
    let mut socket = TcpStream::connect(address)?;
    write!(socket, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
    let mut response = String::new();
    socket.read_to_string(&mut response)?;
    Ok(response)
}
