//! Room addresses.

use jostle_server::host::rooms::is_code;
use std::str::FromStr;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BotTarget {
    pub authority: String,
    /// The word in the room's link.
    pub room: String,
}

impl FromStr for BotTarget {
    type Err = &'static str;

    fn from_str(url: &str) -> Result<BotTarget, &'static str> {
        let parts = url.strip_prefix("ws://").and_then(|rest| rest.split_once('/'));
        match parts {
            Some((host, room)) if !host.is_empty() && is_code(room) => {
                let port = if has_port(host) { "" } else { ":80" };
                Ok(BotTarget { authority: format!("{host}{port}"), room: room.to_owned() })
            }
            _ => Err("allowed: ws://HOST/ROOM"),
        }
    }
}

impl BotTarget {
    /// The origin of the room's server.
    pub fn origin(&self) -> String {
        format!("http://{}", self.authority)
    }

    /// The same room on the server with this origin; `None` if that server needs TLS, which bots do not speak.
    pub fn at(&self, origin: &str) -> Option<BotTarget> {
        format!("ws://{}/{}", origin.strip_prefix("http://")?, self.room).parse().ok()
    }
}

fn has_port(host: &str) -> bool {
    host.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_at_the_same_path_of_another_server() {
        let target: BotTarget = "ws://a:1/oak".parse().expect("a target");
        assert_eq!(target.at(&target.origin()), Some(target.clone()));
        assert_eq!(target.at("http://b:2"), "ws://b:2/oak".parse().ok());
        assert_eq!(target.at("http://b"), "ws://b:80/oak".parse().ok());
        assert_eq!(target.at("https://b"), None);
    }

    #[test]
    fn addresses_are_read_or_refused() {
        for (url, authority) in [
            ("ws://127.0.0.1:8080/arena", "127.0.0.1:8080"),
            ("ws://example.org/arena", "example.org:80"),
            ("ws://[::1]:9/arena", "[::1]:9"),
        ] {
            let target: BotTarget = url.parse().expect(url);
            assert_eq!(target, BotTarget { authority: authority.into(), room: "arena".into() });
        }
        for url in ["wss://h/arena", "ws://h", "ws://h/", "ws:///arena", "ws://h/a/b", "arena"] {
            assert!(url.parse::<BotTarget>().is_err(), "{url}");
        }
    }
}
