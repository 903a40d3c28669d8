//! A request's origin: the site whose page sent it, and the client's address behind trusted proxies.

use hyper::header::{self, HeaderMap};
use ipnet::IpNet;
use std::net::{IpAddr, SocketAddr};

/// The header in which a proxy lists its clients.
const FORWARDED_FOR: &str = "x-forwarded-for";

/// Returns whether a page from this site or an allowed one sent the request. Browsers send the origin with every
/// upgrade and every POST, so that no other site can act on behalf of its visitors. Other programs send no origin, and
/// are allowed. `allowed` contains origins such as `https://play.example.org`.
pub fn is_allowed(headers: &HeaderMap, allowed: &[String]) -> bool {
    let Some(origin) = headers.get(header::ORIGIN) else { return true };
    let Ok(origin) = origin.to_str() else { return false };
    if allowed.iter().any(|known| known.eq_ignore_ascii_case(origin)) {
        return true;
    }
    let Some((scheme, authority)) = origin.split_once("://") else { return false };
    // Only in these schemes is the authority a host; a browser extension may have the same name as this server.
    let is_secure = scheme.eq_ignore_ascii_case("https");
    if !is_secure && !scheme.eq_ignore_ascii_case("http") {
        return false;
    }
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    // A proxy that terminates TLS may pass on the host without a port, or with the default port.
    let bare = |text: &str| {
        let port = if is_secure { ":443" } else { ":80" };
        text.strip_suffix(port).unwrap_or(text).to_ascii_lowercase()
    };
    host.is_some_and(|host| bare(host) == bare(authority))
}

/// The client that sent a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientAddress {
    /// Address to which the request counts.
    pub ip: IpAddr,
    /// Text from a trusted proxy that is not an address; in that case the request counts towards the proxy.
    pub unreadable: Option<String>,
}

/// The address to which a request counts. A trusted proxy is believed about the address that precedes it in the list.
/// The last address that does not belong to a trusted proxy is the client's; all addresses before it could be forged.
pub fn client_address(headers: &HeaderMap, peer: IpAddr, trusted: &[IpNet]) -> ClientAddress {
    let mut client = ClientAddress { ip: peer, unreadable: None };
    if !is_proxy(peer, trusted) {
        return client;
    }
    let values = headers.get_all(FORWARDED_FOR).iter();
    let values: Vec<_> =
        values.map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned()).collect();
    let listed: Vec<&str> = values.iter().flat_map(|value| value.split(',')).collect();
    for text in listed.into_iter().rev() {
        let Some(before) = forwarded_address(text.trim()) else {
            client.unreadable = Some(text.trim().to_owned());
            break;
        };
        client.ip = before;
        if !is_proxy(before, trusted) {
            break;
        }
    }
    client
}

/// Returns whether an address belongs to a trusted proxy.
pub fn is_proxy(ip: IpAddr, trusted: &[IpNet]) -> bool {
    let ip = ip.to_canonical();
    trusted.iter().any(|network| network.contains(&ip))
}

/// Parses an address in the forms that proxies write: plain, with a port, or in brackets with or without a port.
fn forwarded_address(text: &str) -> Option<IpAddr> {
    let bracketed = || text.strip_prefix('[')?.strip_suffix(']')?.parse().ok();
    let with_port = || text.parse().ok().map(|address: SocketAddr| address.ip());
    text.parse().ok().or_else(with_port).or_else(bracketed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::header::{HeaderName, HeaderValue};

    fn headers(pairs: &[(&'static str, &'static str)]) -> HeaderMap {
        let pair =
            |&(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value));
        pairs.iter().map(pair).collect()
    }

    #[test]
    fn only_pages_of_this_site_and_of_allowed_ones_are_accepted() {
        let allowed = ["https://play.example.org".to_owned()];
        let welcome =
            |host, origin| is_allowed(&headers(&[("host", host), ("origin", origin)]), &allowed);
        assert!(is_allowed(&headers(&[("host", "here:8080")]), &allowed));
        assert!(welcome("here:8080", "http://here:8080"));
        assert!(welcome("Here", "https://here:443") && welcome("here:443", "https://here"));
        assert!(welcome("here", "http://HERE:80"));
        assert!(welcome("10.0.0.1:8080", "https://play.example.org"));
        for origin in [
            "null",
            "",
            "http://here",
            "http://there:8080",
            "http://here:8080.evil.org",
            "chrome-extension://here:8080",
            "ws://here:8080",
            "://here:8080",
        ] {
            assert!(!welcome("here:8080", origin), "{origin}");
        }
        assert!(!is_allowed(&headers(&[("origin", "http://here")]), &allowed), "no host");
    }

    fn ip(text: &str) -> IpAddr {
        text.parse().unwrap()
    }

    /// The client's address, with trusted proxies at 10.0.0.9, in 10.1.0.0/16 and in an IPv6 network.
    fn client(peer: &str, listed: &'static str) -> ClientAddress {
        let trusted = ["10.0.0.9/32", "10.1.0.0/16", "2001:db8:1::/48"];
        let trusted = trusted.map(|text| text.parse().unwrap());
        client_address(&headers(&[(FORWARDED_FOR, listed)]), ip(peer), &trusted)
    }

    #[test]
    fn only_a_trusted_proxy_is_believed() {
        for (peer, listed, expected) in [
            ("7.7.7.7", "1.2.3.4", "7.7.7.7"),
            ("10.0.0.9", "1.2.3.4", "1.2.3.4"),
            ("::ffff:10.0.0.9", "1.2.3.4", "1.2.3.4"),
            ("10.1.200.3", "1.2.3.4", "1.2.3.4"),
            ("10.2.0.3", "1.2.3.4", "10.2.0.3"),
            ("2001:db8:1:5::1", "1.2.3.4", "1.2.3.4"),
            ("10.0.0.9", "6.6.6.6, 1.2.3.4, 10.1.7.7", "1.2.3.4"),
            ("10.0.0.9", "2001:db8::1", "2001:db8::1"),
            ("10.0.0.9", "1.2.3.4:5678", "1.2.3.4"),
            ("10.0.0.9", "6.6.6.6:1, [2001:db8::1]:443", "2001:db8::1"),
            ("10.0.0.9", "[2001:db8::1]", "2001:db8::1"),
        ] {
            assert_eq!(client(peer, listed), ClientAddress { ip: ip(expected), unreadable: None });
        }
        let client =
            client_address(&HeaderMap::new(), ip("10.0.0.9"), &["10.0.0.9/32".parse().unwrap()]);
        assert_eq!(client.ip, ip("10.0.0.9"));
    }

    #[test]
    fn what_is_no_address_is_reported_and_counts_for_the_proxy() {
        for text in
            ["nonsense", "unknown", "1.2.3", "1.2.3.4:", "[2001:db8::1", "1.2.3.4:99999", ""]
        {
            let client = client("10.0.0.9", text);
            assert_eq!((client.ip, client.unreadable.as_deref()), (ip("10.0.0.9"), Some(text)));
        }
        let behind = client("10.0.0.9", "6.6.6.6, nonsense, 10.1.0.1");
        assert_eq!((behind.ip, behind.unreadable.as_deref()), (ip("10.1.0.1"), Some("nonsense")));
    }
}
