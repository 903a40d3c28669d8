//! `cargo xtask play`: from a fresh clone to a game in the browser.

use crate::shell::{cargo, in_path, root, run, say, target_dir};
use crate::web;
use anyhow::{Result, bail};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const READY_WITHIN: Duration = Duration::from_secs(30);

/// Builds everything and serves until ctrl-c.
pub fn play(listen: SocketAddr, open: bool) -> Result<()> {
    web::build(web::Profile::Small)?;
    say("play", "build the server");
    // A server does not draw, and without the replay renderer it builds in half the time.
    let mut build = cargo(&["build", "--release", "--package", "jostle-cli", "--bin", "jostle"]);
    run(build.arg("--no-default-features"))?;
    let local = reachable(listen);
    let link = format!("http://{local}/");
    say("play", &format!("open {link} (ctrl-c stops the server)"));
    if listen.ip().is_unspecified() {
        say("play", "others reach it by this machine's address and the same port");
    }
    if open {
        start_opener(&link, local)?;
    }
    let mut server = Command::new(target_dir().join("release/jostle"));
    server.args(["serve", "--listen", &listen.to_string()]).current_dir(root());
    become_server(server)
}

/// Replaces this process with the server, so that ctrl-c goes to the server, which may then take its time to shut down.
#[cfg(unix)]
fn become_server(mut server: Command) -> Result<()> {
    use std::os::unix::process::CommandExt;
    let error = server.exec();
    bail!("cannot start {}: {error}", server.get_program().display())
}

#[cfg(not(unix))]
fn become_server(mut server: Command) -> Result<()> {
    run(&mut server)
}

/// Returns an address at which this machine can reach a server listening on `listen`.
fn reachable(listen: SocketAddr) -> SocketAddr {
    if listen.ip().is_unspecified() {
        SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), listen.port())
    } else {
        listen
    }
}

/// Opens the page from a separate process, since this one becomes the server.
fn start_opener(link: &str, address: SocketAddr) -> Result<()> {
    let mut opener = Command::new(std::env::current_exe()?);
    opener.args(["open-when-ready", link, &address.to_string()]);
    opener.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    Ok(())
}

/// Waits for the server and opens the link in the desktop's browser, if there is a desktop.
pub fn open_when_ready(link: &str, address: SocketAddr) -> Result<()> {
    let deadline = Instant::now() + READY_WITHIN;
    while TcpStream::connect_timeout(&address, Duration::from_secs(1)).is_err() {
        if Instant::now() > deadline {
            bail!("no server at {address} after {} s", READY_WITHIN.as_secs());
        }
        thread::sleep(Duration::from_millis(100));
    }
    match opener() {
        Some(mut command) => run(command.arg(link)),
        None => Ok(()),
    }
}

fn opener() -> Option<Command> {
    if cfg!(target_os = "macos") {
        return Some(Command::new("open"));
    }
    if cfg!(windows) {
        return Some(Command::new("explorer"));
    }
    let desktop = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|v| std::env::var_os(v).is_some());
    (desktop && in_path("xdg-open")).then(|| Command::new("xdg-open"))
}
