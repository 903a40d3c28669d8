//! Parsers for flag values. Errors describe the allowed values.

use ipnet::IpNet;
use std::net::{IpAddr, SocketAddr};

/// Parses a listening address.
pub fn socket_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "allowed: an IP address and a port, such as 0.0.0.0:8080 or [::]:8080".to_owned()
    })
}

/// Creates a parser for whole numbers in a range.
pub fn whole(low: u32, high: u32) -> impl Fn(&str) -> Result<u32, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| (low..=high).contains(number));
        number.ok_or_else(|| format!("allowed: a whole number from {low} to {high}"))
    }
}

/// Parses a host name without a scheme or port.
pub fn host(text: &str) -> Result<String, String> {
    let is_name = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_');
    match !text.is_empty() && text.bytes().all(is_name) {
        true => Ok(text.to_ascii_lowercase()),
        false => {
            Err("allowed: a name without scheme and port, such as play.example.org".to_owned())
        }
    }
}

/// Minimum prefix lengths for a network of proxies: those of the largest private networks, 10.0.0.0/8 and fc00::/7. A
/// wider network would include public addresses.
const PROXY_BITS_MIN: [u8; 2] = [8, 7];

/// Parses the address of a proxy or a network of proxies.
pub fn proxies(text: &str) -> Result<IpNet, String> {
    let address = || text.parse().ok().map(|ip: IpAddr| IpNet::from(ip.to_canonical()));
    let network: IpNet = text.parse().ok().or_else(address).ok_or_else(|| {
        "allowed: an IP address or a network, such as 10.0.0.9 or 10.0.0.0/8".to_owned()
    })?;
    let [v4, v6] = PROXY_BITS_MIN;
    match network.prefix_len() >= if network.addr().is_ipv4() { v4 } else { v6 } {
        true => Ok(network),
        false => Err(format!(
            "allowed: a network of proxies alone, such as 10.0.0.0/8, at least /{v4} (IPv6: /{v6}); a wider one \
             has players in it, who could then pass for any address (X-Forwarded-For), past every limit and ban"
        )),
    }
}

/// Parses a site's origin as browsers send it: a scheme, a host and optionally a port.
pub fn origin(text: &str) -> Result<String, String> {
    let is_host = |host: &str| !host.is_empty() && !host.contains(['/', '?', '#', '@', ' ']);
    match text.split_once("://") {
        Some(("http" | "https", host)) if is_host(host) => Ok(text.to_owned()),
        _ => Err("allowed: a scheme and a host, such as https://play.example.org".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::{origin, proxies, socket_address};

    #[test]
    fn proxies_are_addresses_or_networks() {
        for (text, network) in [
            ("10.0.0.9", "10.0.0.9/32"),
            ("::ffff:10.0.0.9", "10.0.0.9/32"),
            ("10.0.0.0/8", "10.0.0.0/8"),
            ("2001:db8::/32", "2001:db8::/32"),
        ] {
            assert_eq!(proxies(text).map(|network| network.to_string()).as_deref(), Ok(network));
        }
        for text in ["10.0.0.0/33", "proxy", "10.0.0.9:80", "", "0.0.0.0/0", "128.0.0.0/1"] {
            assert!(proxies(text).is_err_and(|error| error.contains("10.0.0.0/8")), "{text:?}");
        }
        // The whole internet, or a large part of it, including in IPv6.
        for text in ["0.0.0.0/0", "0.0.0.0/7", "::/0", "2000::/3", "::ffff:0.0.0.0/0"] {
            assert!(proxies(text).is_err_and(|error| error.contains("pass for any")), "{text:?}");
        }
        assert!(proxies("fc00::/7").is_ok());
    }

    #[test]
    fn addresses_and_origins_are_read_or_refused_with_an_example() {
        assert!(socket_address("[::1]:0").is_ok());
        assert!(socket_address("8080").is_err_and(|error| error.contains("0.0.0.0:8080")));
        assert_eq!(origin("https://a.example:444").as_deref(), Ok("https://a.example:444"));
        for text in ["a.example", "ws://a.example", "https://", "https://a.example/", ""] {
            assert!(origin(text).is_err_and(|error| error.contains("https://")), "{text:?}");
        }
    }
}
