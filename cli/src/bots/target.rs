//! Addresses of rooms.

use jostle_server::host::rooms::is_code;
use std::str::FromStr;

/// A parsed `ws://HOST/ROOM`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// `host:port`.
    pub authority: String,
    /// The word in the room's link.
    pub room: String,
}

impl FromStr for Target {
    type Err = &'static str;

    fn from_str(url: &str) -> Result<Target, &'static str> {
        let parts = url.strip_prefix("ws://").and_then(|rest| rest.split_once('/'));
        match parts {
            Some((host, room)) if !host.is_empty() && is_code(room) => {
                let port = if has_port(host) { "" } else { ":80" };
                Ok(Target { authority: format!("{host}{port}"), room: room.to_owned() })
            }
            _ => Err("allowed: ws://HOST/ROOM"),
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
            let target: Target = url.parse().expect(url);
            assert_eq!(target, Target { authority: authority.into(), room: "arena".into() });
        }
        for url in ["wss://h/arena", "ws://h", "ws://h/", "ws:///arena", "ws://h/a/b", "arena"] {
            assert!(url.parse::<Target>().is_err(), "{url}");
        }
    }
}
