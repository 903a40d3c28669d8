//! The origin of a request: the site whose page sent it, and the client's address behind trusted proxies.

use hyper::header::{self, HeaderMap};
use std::net::IpAddr;

/// Header in which a proxy names its clients.
const FORWARDED_FOR: &str = "x-forwarded-for";

/// Returns whether a page of this site, or of an allowed one, sent the request. Browsers send the origin
/// with every upgrade and every POST, so that no other site can play in its visitors' names; other
/// programs send none, and are allowed. `allowed` holds origins such as `https://play.example.org`.
pub fn is_allowed(headers: &HeaderMap, allowed: &[String]) -> bool {
    let Some(origin) = headers.get(header::ORIGIN) else { return true };
    let Ok(origin) = origin.to_str() else { return false };
    if allowed.iter().any(|known| known.eq_ignore_ascii_case(origin)) {
        return true;
    }
    let Some((scheme, authority)) = origin.split_once("://") else { return false };
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    // A proxy that ends TLS passes the host on without a port, or with the default one.
    let bare = |text: &str| {
        let port = if scheme.eq_ignore_ascii_case("https") { ":443" } else { ":80" };
        text.strip_suffix(port).unwrap_or(text).to_ascii_lowercase()
    };
    host.is_some_and(|host| bare(host) == bare(authority))
}

/// The address that a request counts for. A trusted proxy is believed about the address before it; the
/// last address in its list that is no trusted proxy is the client's, for all before it could be
/// forged.
pub fn client_address(headers: &HeaderMap, peer: IpAddr, trusted: &[IpAddr]) -> IpAddr {
    let is_trusted = |ip: &IpAddr| trusted.contains(&ip.to_canonical());
    if !is_trusted(&peer) {
        return peer;
    }
    let values = headers.get_all(FORWARDED_FOR).iter().filter_map(|value| value.to_str().ok());
    let listed: Vec<&str> = values.flat_map(|value| value.split(',')).map(str::trim).collect();
    let mut address = peer;
    for text in listed.into_iter().rev() {
        let Ok(before) = text.parse::<IpAddr>() else { break };
        address = before;
        if !is_trusted(&before) {
            break;
        }
    }
    address
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
        for origin in ["null", "", "http://here", "http://there:8080", "http://here:8080.evil.org"]
        {
            assert!(!welcome("here:8080", origin), "{origin}");
        }
        assert!(!is_allowed(&headers(&[("origin", "http://here")]), &allowed), "no host");
    }

    #[test]
    fn only_a_trusted_proxy_is_believed() {
        let ip = |text: &str| text.parse::<IpAddr>().unwrap();
        let trusted = [ip("10.0.0.9"), ip("10.0.0.8")];
        let address = |peer: &str, listed: &'static str| {
            client_address(&headers(&[(FORWARDED_FOR, listed)]), ip(peer), &trusted)
        };
        assert_eq!(address("7.7.7.7", "1.2.3.4"), ip("7.7.7.7"));
        assert_eq!(address("10.0.0.9", "1.2.3.4"), ip("1.2.3.4"));
        assert_eq!(address("::ffff:10.0.0.9", "1.2.3.4"), ip("1.2.3.4"));
        assert_eq!(address("10.0.0.9", "6.6.6.6, 1.2.3.4, 10.0.0.8"), ip("1.2.3.4"));
        assert_eq!(address("10.0.0.9", "6.6.6.6, nonsense"), ip("10.0.0.9"));
        assert_eq!(address("10.0.0.9", "2001:db8::1"), ip("2001:db8::1"));
        assert_eq!(client_address(&HeaderMap::new(), ip("10.0.0.9"), &trusted), ip("10.0.0.9"));
    }
}
