//! The name by which a request addresses the server. A page of another site can make a browser ask this
//! server under that site's name (DNS rebinding); it then counts as a page of the same site. So a server that
//! is for this machine alone answers to addresses and `localhost` only, and any other may list its names.

use hyper::header::{self, HeaderMap};
use hyper::{Request, Version};
use std::net::IpAddr;

/// Names by which a server may be addressed. Addresses and `localhost` are always allowed: no other site
/// can have them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Hosts {
    #[default]
    Any,
    /// These names, in lower case and without ports.
    Listed(Vec<String>),
}

/// Checks that a request has one `Host`, as HTTP/1.1 demands (RFC 9112, section 3.2), and an allowed one. An
/// error is a sentence for the client.
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

/// A host without its port.
fn name(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
