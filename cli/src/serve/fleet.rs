//! The flags for a server in a fleet.

use super::values::{origin, whole};
use crate::output::{Failure, OrFail};
use jostle_server::files::read_regular;
use jostle_server::fleet::settings::{FleetSettings, SECRET_BYTES_MIN, secret};
use jostle_server::limits::{SETTINGS_FILE_BYTES_MAX, processors};
use std::path::PathBuf;

/// The fraction of each processor that rooms may use, unless --capacity is given; the rest is for sockets.
const ROOMS_SHARE: f64 = 0.5;

/// Flags for a node in a fleet.
#[derive(clap::Args)]
pub struct FleetFlags {
    /// Addresses of NATS servers with JetStream, such as nats://10.0.0.5:4222. The game servers that share them are the
    /// nodes of a fleet: each lists all rooms and sends players to the node that plays their room. A room moves to
    /// another node when its own node drains, and resumes on another node when its own dies. Multiple addresses are
    /// separated by commas
    #[arg(
        long,
        value_name = "URL",
        value_delimiter = ',',
        requires = "node",
        requires = "public_url",
        requires = "secret"
    )]
    nats: Vec<String>,
    /// Credentials file for NATS, as created by the NATS tools
    #[arg(long, value_name = "FILE", requires = "nats")]
    nats_credentials: Option<PathBuf>,
    /// Number of copies that NATS keeps of the directory and the records, if this node is the first to use them: 3 for
    /// a cluster of three
    #[arg(long, value_name = "N", default_value_t = 1, requires = "nats", value_parser = whole(1, 5))]
    nats_replicas: u32,
    /// This node's name, unique in the fleet: lowercase letters, digits and hyphens
    #[arg(long, value_name = "NAME", requires = "nats", value_parser = node)]
    node: Option<String>,
    /// Address at which players' browsers reach this node, such as https://b.play.example.org
    #[arg(long, value_name = "URL", requires = "nats", value_parser = public_url)]
    public_url: Option<String>,
    /// File with a secret of at least 32 bytes, the same on all nodes, which makes seats and host keys valid on every
    /// node
    #[arg(long, value_name = "FILE", requires = "nats")]
    secret: Option<PathBuf>,
    /// Number of processors that this node's rooms may keep busy, such as 1.5; by default half of all processors. New
    /// rooms are placed on the node with the most spare capacity
    #[arg(long, value_name = "N", requires = "nats", value_parser = capacity)]
    capacity: Option<f64>,
}

impl FleetFlags {
    /// The settings; `None` without --nats. Fails if `keeps_state` is true, because a fleet keeps no rooms in a
    /// directory.
    pub fn settings(&self, keeps_state: bool) -> Result<Option<FleetSettings>, Failure> {
        let (Some(node), Some(url), Some(file)) = (&self.node, &self.public_url, &self.secret)
        else {
            return Ok(None);
        };
        if keeps_state {
            let text = "--state: found beside --nats; allowed: one of them, for a room is kept in one place";
            return Err(Failure::Usage(text.to_owned()));
        }
        let place = format!("--secret {}", file.display());
        let bytes = read_regular(file, SETTINGS_FILE_BYTES_MAX).or_usage(&place)?;
        let secret = secret(&bytes).ok_or_else(|| {
            let found = bytes.trim_ascii().len();
            Failure::Usage(format!(
                "{place}: found {found} bytes; allowed: {SECRET_BYTES_MIN} or more"
            ))
        })?;
        let processors = processors() as f64;
        Ok(Some(FleetSettings {
            nats: self.nats.join(","),
            credentials: self.nats_credentials.clone(),
            replicas: self.nats_replicas as usize,
            node: node.clone(),
            url: url.clone(),
            capacity: self.capacity.unwrap_or(processors * ROOMS_SHARE),
            secret,
        }))
    }
}

/// Parses a node's name.
fn node(text: &str) -> Result<String, String> {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    match (1..=60).contains(&text.len()) && text.bytes().all(allowed) {
        true => Ok(text.to_owned()),
        false => {
            Err("allowed: up to 60 small letters, digits and hyphens, such as node-3".to_owned())
        }
    }
}

/// Parses a node's address. Browsers send it without a trailing slash.
fn public_url(text: &str) -> Result<String, String> {
    let url = origin(text.strip_suffix('/').unwrap_or(text))?;
    match jostle_protocol::is_origin(&url) {
        true => Ok(url),
        false => Err("allowed: at most 200 characters without quotes".to_owned()),
    }
}

/// Parses a number of processors.
fn capacity(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (0.05..=1024.0).contains(number));
    number
        .ok_or_else(|| "allowed: a number of processors from 0.05 to 1024, such as 1.5".to_owned())
}

#[cfg(test)]
mod tests {
    use super::{capacity, node, public_url};

    #[test]
    fn names_addresses_and_capacities_are_read_or_refused_with_an_example() {
        assert_eq!(node("node-3").as_deref(), Ok("node-3"));
        for text in ["", "Node", "a.b", "a b", &"a".repeat(61)] {
            assert!(node(text).is_err_and(|error| error.contains("node-3")), "{text:?}");
        }
        assert_eq!(public_url("https://a.example:444/").as_deref(), Ok("https://a.example:444"));
        for text in ["a.example", "ws://a.example", "https://a.example/b", "https://a\"b"] {
            assert!(public_url(text).is_err(), "{text:?}");
        }
        assert_eq!(capacity("1.5"), Ok(1.5));
        for text in ["0", "-1", "nan", "inf", "2000", "many"] {
            assert!(capacity(text).is_err_and(|error| error.contains("1.5")), "{text:?}");
        }
    }
}
