//! `jostle bots`: players made of seeded dice, to see how a server holds up and what it sends.

mod client;
mod report;

use super::run::json;
use super::{Failure, say};
use crate::rooms::is_code;
use client::Bot;
use report::Report;
use std::time::Duration;

/// Clients that one process plays.
const CLIENTS_MAX: u32 = 1024;

/// Play with many clients at once, and report what they got
///
/// Each moves, launches, makes and drags at random, decodes every snapshot, and measures bytes,
/// snapshots, gaps and ping. Status 1 if any of them met an error.
#[derive(clap::Args)]
pub struct Bots {
    /// Where to play
    #[arg(value_name = "ws://HOST/ROOM")]
    url: String,
    /// How many
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(CLIENTS_MAX)))]
    clients: u32,
    /// How long each plays
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// Seed of what they do
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// End with one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// A parsed ws:// address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// `host:port`.
    pub authority: String,
    /// The word in the room's link.
    pub room: String,
}

impl Bots {
    /// Plays and reports.
    pub fn run(self) -> Result<(), Failure> {
        let target = Target::parse(&self.url)?;
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        let runtime = runtime.map_err(|error| Failure::Check(format!("runtime: {error}")))?;
        let report = runtime.block_on(self.play(&target));
        if self.json { say(json(&report)) } else { say(&report) }?;
        match report.failure() {
            None => Ok(()),
            Some(failure) => Err(Failure::Check(failure)),
        }
    }

    async fn play(&self, target: &Target) -> Report {
        let length = Duration::from_secs(self.seconds.into());
        let mut playing = Vec::new();
        for index in 0..self.clients {
            let bot = Bot { index, seed: self.seed, length, target: target.clone() };
            playing.push(tokio::spawn(bot.play()));
        }
        let mut clients = Vec::new();
        for client in playing {
            clients.push(client.await.expect("a bot does not panic"));
        }
        Report::new(target, clients)
    }
}

impl Target {
    fn parse(url: &str) -> Result<Target, Failure> {
        let parts = url.strip_prefix("ws://").and_then(|rest| rest.split_once('/'));
        match parts {
            Some((host, room)) if !host.is_empty() && is_code(room) => {
                let port = if has_port(host) { "" } else { ":80" };
                Ok(Target { authority: format!("{host}{port}"), room: room.to_owned() })
            }
            _ => {
                let text = format!("address: found {url:?}; allowed: ws://HOST/ROOM");
                Err(Failure::Usage(text))
            }
        }
    }
}

fn has_port(host: &str) -> bool {
    host.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_or_refused() {
        for (url, authority) in [
            ("ws://127.0.0.1:8080/arena", "127.0.0.1:8080"),
            ("ws://example.org/arena", "example.org:80"),
            ("ws://[::1]:9/arena", "[::1]:9"),
        ] {
            let target = Target::parse(url).expect(url);
            assert_eq!(target, Target { authority: authority.into(), room: "arena".into() });
        }
        for url in ["wss://h/arena", "ws://h", "ws://h/", "ws:///arena", "ws://h/a/b", "arena"] {
            assert!(Target::parse(url).is_err(), "{url}");
        }
    }
}
