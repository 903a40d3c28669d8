//! The headers that protect the page from other sites, and the sites that may show it in a frame.

use hyper::header::{self, HeaderMap, HeaderName, HeaderValue};

/// Headers with the same value in every response. In a frame the opener policy has no effect, and the resource policy
/// concerns only files, which the page loads from its own site.
const FIXED: [(HeaderName, &str); 5] = [
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    // The only device features that the page uses are the screen, keys and pointers.
    (
        HeaderName::from_static("permissions-policy"),
        "camera=(), display-capture=(), geolocation=(), microphone=(), midi=(), payment=(), \
         serial=(), usb=()",
    ),
];

/// The form of a frame's origin. Browsers ignore other sources in a policy, or interpret them differently.
const ALLOWED: &str = "allowed: a scheme, a host and perhaps a port, such as https://www.example.org, without a path, \
    `*` or an IPv6 address; a name that is not in English letters begins with xn--";

/// The origin of a site whose pages may show this server's page in a frame: `https://www.example.org`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameOrigin(String);

impl FrameOrigin {
    /// Parses an origin as browsers show it. The error describes the allowed values.
    pub fn parse(text: &str) -> Result<FrameOrigin, String> {
        let is_name = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_');
        let is_port = |port: &str| {
            port.bytes().all(|byte| byte.is_ascii_digit())
                && port.parse().is_ok_and(|port: u16| port > 0)
        };
        let is_site = text.split_once("://").is_some_and(|(scheme, authority)| {
            let (host, port) = authority.split_once(':').unwrap_or((authority, "1"));
            matches!(scheme, "http" | "https")
                && !host.is_empty()
                && host.bytes().all(is_name)
                && is_port(port)
        });
        match is_site {
            true => Ok(FrameOrigin(text.to_ascii_lowercase())),
            false => Err(ALLOWED.to_owned()),
        }
    }
}

/// The headers of every response on the players' port.
#[derive(Debug)]
pub struct Protection {
    security_policy: HeaderValue,
    /// Whether no page may show this one in a frame.
    is_frameless: bool,
    /// Whether browsers shall use only TLS from now on.
    is_secure: bool,
}

impl Protection {
    /// Headers for a server that may be in a fleet, may speak TLS, and may be shown in the frames of some sites.
    pub fn new(in_fleet: bool, is_secure: bool, embedders: &[FrameOrigin]) -> Protection {
        let is_frameless = embedders.is_empty();
        let mut policy = security_policy(in_fleet);
        policy += if is_frameless { " 'none'" } else { "" };
        for FrameOrigin(origin) in embedders {
            policy.push(' ');
            policy += origin;
        }
        let security_policy = HeaderValue::try_from(policy).expect("origins are plain ASCII");
        Protection { security_policy, is_frameless, is_secure }
    }

    /// Adds the headers to a response.
    pub fn add_to(&self, headers: &mut HeaderMap) {
        headers.insert(header::CONTENT_SECURITY_POLICY, self.security_policy.clone());
        // The header for browsers without policies cannot name sites, so that it is left out if any are allowed.
        let frames = self.is_frameless.then_some((header::X_FRAME_OPTIONS, "DENY"));
        let secure =
            self.is_secure.then_some((header::STRICT_TRANSPORT_SECURITY, "max-age=31536000"));
        for (name, value) in FIXED.into_iter().chain(frames).chain(secure) {
            headers.insert(name, HeaderValue::from_static(value));
        }
    }
}

/// The policy up to the list of frames: scripts and wasm are loaded only from this site, and sockets connect only to it.
/// The sockets of a fleet's page also follow a room to nodes that did not exist when the page was loaded.
fn security_policy(in_fleet: bool) -> String {
    let sockets = if in_fleet { " http: https: ws: wss:" } else { "" };
    format!(
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; \
         img-src 'self' data: blob:; media-src 'self'; font-src 'self'; connect-src 'self'{sockets}; \
         manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last directive of the policy, and the header for old browsers.
    fn frames(sites: &[&str]) -> (String, Option<String>) {
        let origins: Vec<_> =
            sites.iter().map(|site| FrameOrigin::parse(site).expect("an origin")).collect();
        let mut headers = HeaderMap::new();
        Protection::new(false, false, &origins).add_to(&mut headers);
        let text = |name| {
            let value = headers.get(name).map(|value: &HeaderValue| value.to_str().expect("text"));
            value.map(str::to_owned)
        };
        let policy = text(header::CONTENT_SECURITY_POLICY).expect("a policy");
        let (_, last) = policy.rsplit_once("; ").expect("several directives");
        (last.to_owned(), text(header::X_FRAME_OPTIONS))
    }

    #[test]
    fn only_listed_sites_show_the_page_in_a_frame() {
        assert_eq!(frames(&[]), ("frame-ancestors 'none'".into(), Some("DENY".into())));
        assert_eq!(
            frames(&["https://A.example", "http://127.0.0.1:8081"]),
            ("frame-ancestors https://a.example http://127.0.0.1:8081".into(), None)
        );
    }

    #[test]
    fn sockets_leave_the_site_only_in_a_fleet() {
        assert!(security_policy(false).contains("connect-src 'self'; "));
        assert!(security_policy(true).contains("connect-src 'self' http: https: ws: wss:; "));
    }

    #[test]
    fn what_would_change_a_policy_is_no_origin() {
        for text in [
            "",
            "a.example",
            "https://",
            "https://a.example/",
            "https://a.example;",
            "https://a.example,b.example",
            "https://a.example https://b.example",
            "https://*.a.example",
            "https://b\u{fc}hne.example",
            "https://u@a.example",
            "https://a.example:",
            "https://a.example:+80",
            "https://a.example:65536",
            "http://[::1]:8080",
            "wss://a.example",
            "HTTPS://a.example",
            "'self'",
            "null",
        ] {
            let refused = FrameOrigin::parse(text);
            assert!(refused.is_err_and(|error| error.contains("https://www.example")), "{text:?}");
        }
    }
}
