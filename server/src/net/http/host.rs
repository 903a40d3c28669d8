//! Headers that are checked in every request: those that may appear only once, and the name by which the request
//! addresses the server. A page on another site can make a browser address this server by that site's name (DNS
//! rebinding); the page then counts as being on the same site. A server that serves only this machine therefore answers
//! only to IP addresses and `localhost`, and any other server may list its names.

use hyper::header::{self, HeaderMap, HeaderName};
use hyper::{Request, Version};
use std::net::IpAddr;

/// Names by which a server may be addressed. IP addresses and `localhost` are always allowed, since no other site can
/// have those names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Hosts {
    #[default]
    Any,
    /// Only these names, in lower case and without ports.
    Listed(Vec<String>),
}

/// Checks that a request has exactly one `Host` header, as HTTP/1.1 requires (RFC 9112, section 3.2), and that it names
/// an allowed host. The error is a sentence for the client.
pub fn check<T>(request: &Request<T>, allowed: &Hosts) -> Result<(), String> {
    let headers = request.headers();
    match headers.get_all(header::HOST).iter().count() {
        0 if request.version() < Version::HTTP_11 => Ok(()),
        0 => Err("this request has no Host header; HTTP/1.1 demands one".to_owned()),
        1 => check_name(headers, allowed),
        count => Err(format!("this request has {count} Host headers; allowed: one")),
    }
}

fn check_name(headers: &HeaderMap, allowed: &Hosts) -> Result<(), String> {
    let Hosts::Listed(names) = allowed else { return Ok(()) };
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    let name = name(host).to_ascii_lowercase();
    let is_local = name == "localhost" || name.ends_with(".localhost");
    let address = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(&name);
    if is_local || address.parse::<IpAddr>().is_ok() || names.contains(&name) {
        return Ok(());
    }
    let host = host.escape_default();
    Err(format!(
        "this server does not go by the name \"{host}\"; its host can allow it with --host"
    ))
}

/// A host name without the port.
fn name(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Headers that affect decisions, each of which may appear at most once in a request: if there were two, a proxy might
/// have looked at one, and this server at the other. None of them is a list (RFC 9110, section 5.3). `Host`, which has
/// its own rules, and `Content-Length`, which hyper checks, are not included. `X-Forwarded-For` is a list and is read
/// as one.
const ONCE: [HeaderName; 5] = [
    header::ORIGIN,
    header::AUTHORIZATION,
    header::UPGRADE,
    header::SEC_WEBSOCKET_KEY,
    header::SEC_WEBSOCKET_VERSION,
];

/// Checks that none of these headers appears more than once. The error is a sentence for the client.
pub fn check_once(headers: &HeaderMap) -> Result<(), String> {
    for name in ONCE {
        let count = headers.get_all(&name).iter().count();
        if count > 1 {
            return Err(format!("this request has {count} headers {name}; allowed: one"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::header::HeaderValue;

    fn request(version: Version, hosts: &[&str]) -> Request<()> {
        let mut request = Request::builder().version(version);
        for host in hosts {
            request = request.header(header::HOST, *host);
        }
        request.body(()).expect("a request")
    }

    #[test]
    fn there_is_one_host() {
        let check = |version, hosts: &[&str]| check(&request(version, hosts), &Hosts::Any);
        assert!(check(Version::HTTP_11, &["any.example"]).is_ok());
        assert!(check(Version::HTTP_10, &[]).is_ok());
        assert!(check(Version::HTTP_11, &[]).is_err_and(|error| error.contains("no Host")));
        let twice = check(Version::HTTP_11, &["a", "a"]);
        assert!(twice.is_err_and(|error| error.contains("2 Host headers")));
    }

    #[test]
    fn other_names_than_the_listed_ones_are_refused_and_addresses_never() {
        let hosts = Hosts::Listed(vec!["play.example.org".to_owned()]);
        let check = |host| check(&request(Version::HTTP_11, &[host]), &hosts);
        for host in [
            "play.example.org",
            "Play.Example.org:8443",
            "localhost:8080",
            "jostle.localhost",
            "127.0.0.1:8080",
            "192.168.7.9",
            "[::1]:8080",
            "[2001:db8::1]",
        ] {
            assert_eq!(check(host), Ok(()), "{host}");
        }
        for host in
            ["evil.example", "play.example.org.evil.example:80", "", "localhost.evil.example"]
        {
            let error = check(host).expect_err(host);
            assert!(error.contains(&format!("\"{host}\"")) && error.contains("--host"), "{error}");
        }
    }

    #[test]
    fn a_doubled_header_that_decides_something_is_named() {
        for name in ONCE {
            let mut headers = HeaderMap::new();
            headers.append(&name, HeaderValue::from_static("http://here"));
            assert_eq!(check_once(&headers), Ok(()));
            // Even an equal value counts, since this check does not compare values.
            headers.append(&name, HeaderValue::from_static("http://here"));
            let error = check_once(&headers).expect_err("two of them");
            assert!(error.contains(&format!("2 headers {name};")), "{error}");
        }
    }

    #[test]
    fn lists_may_be_sent_in_several_headers() {
        let mut headers = HeaderMap::new();
        for name in ["x-forwarded-for", "accept-encoding", "connection"] {
            for _ in 0..3 {
                headers.append(HeaderName::from_static(name), HeaderValue::from_static("a"));
            }
        }
        assert_eq!(check_once(&headers), Ok(()));
    }
}
