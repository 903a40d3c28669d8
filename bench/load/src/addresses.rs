//! Loopback addresses for the bots of a load test, so that they come from as many networks as players at home would.

use std::net::{IpAddr, Ipv4Addr};

/// Number of bots that share an address, below the server's limit per address.
const BOTS_PER_ADDRESS: u32 = 64;
/// First value of the second byte, chosen so that other programs do not use these addresses, and the number of values
/// used in each byte.
const FIRST: u32 = 64;
const NUMBERS: u32 = 128;

/// The address from which a bot joins, in a /24 shared by 64 bots. Only Linux treats all of 127.0.0.0/8 as local.
pub fn address_of(bot: u32) -> Option<IpAddr> {
    let network = bot / BOTS_PER_ADDRESS;
    let (high, low) = (FIRST + network / NUMBERS % NUMBERS, network % NUMBERS);
    cfg!(target_os = "linux").then_some(Ipv4Addr::new(127, high as u8, low as u8, 1).into())
}

/// The address from which a room is opened. The addresses differ because one address may open at most an eighth of all
/// rooms.
pub fn opener_of(room: u32) -> Option<IpAddr> {
    address_of(room * BOTS_PER_ADDRESS)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn bots_come_from_networks_of_their_own() {
        let shown = |bot| address_of(bot).map(|address| address.to_string());
        assert_eq!(shown(0).as_deref(), Some("127.64.0.1"));
        assert_eq!(shown(63), shown(0));
        assert_eq!(shown(64).as_deref(), Some("127.64.1.1"));
        assert_eq!(shown(64 * 128).as_deref(), Some("127.65.0.1"));
        assert_eq!(opener_of(3), address_of(192));
    }
}
