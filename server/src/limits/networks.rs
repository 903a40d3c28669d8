//! The networks that an address belongs to. One person may have many addresses: a household has a /64 of IPv6 or a
//! whole /56, an organisation a /48, and a rented machine a few neighbouring addresses in an IPv4 /24.

use ipnet::IpNet;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

/// Number of networks that an address belongs to.
pub const LEVELS: usize = 3;
/// The networks' prefix lengths, longest first.
const BITS_V4: [u32; LEVELS] = [32, 24, 24];
const BITS_V6: [u32; LEVELS] = [64, 56, 48];

/// An address's networks, narrowest first, each represented by its first address.
pub fn networks(ip: IpAddr) -> [IpAddr; LEVELS] {
    match ip.to_canonical() {
        IpAddr::V4(ip) => BITS_V4.map(|bits| {
            IpAddr::V4(Ipv4Addr::from_bits(ip.to_bits() & u32::MAX << (u32::BITS - bits)))
        }),
        IpAddr::V6(ip) => BITS_V6.map(|bits| {
            IpAddr::V6(Ipv6Addr::from_bits(ip.to_bits() & u128::MAX << (u128::BITS - bits)))
        }),
    }
}

/// The network for limits that use only one: a single IPv4 address, or an IPv6 /64.
pub fn network(ip: IpAddr) -> IpAddr {
    networks(ip)[0]
}

/// An address's widest network.
pub fn widest(ip: IpAddr) -> IpAddr {
    networks(ip)[LEVELS - 1]
}

/// The narrowest network, with its prefix length.
pub fn prefix(ip: IpAddr) -> IpNet {
    let ip = ip.to_canonical();
    let bits = if ip.is_ipv4() { BITS_V4[0] } else { BITS_V6[0] };
    IpNet::new_assert(ip, bits as u8).trunc()
}

/// The shares of an address's networks if the narrowest may have `narrowest`. Each wider network may have twice as much
/// as the previous one, so that a neighbourhood gets more than a household, and no single network gets everything.
pub fn shares(narrowest: usize) -> [usize; LEVELS] {
    std::array::from_fn(|level| narrowest.saturating_mul(1 << level))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ip(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    #[test]
    fn an_address_belongs_to_wider_and_wider_networks() {
        let of = |text| networks(ip(text));
        assert_eq!(
            of("2001:db8:1:2345:6:7:8:9"),
            ["2001:db8:1:2345::", "2001:db8:1:2300::", "2001:db8:1::"].map(ip)
        );
        assert_eq!(of("203.0.113.77"), ["203.0.113.77", "203.0.113.0", "203.0.113.0"].map(ip));
        assert_eq!(of("::ffff:203.0.113.77"), of("203.0.113.77"));
        assert_eq!(shares(8), [8, 16, 32]);
        let prefixes =
            ["2001:db8:1:2345:6:7:8:9", "203.0.113.77"].map(|text| prefix(ip(text)).to_string());
        assert_eq!(prefixes, ["2001:db8:1:2345::/64", "203.0.113.77/32"]);
    }
}
