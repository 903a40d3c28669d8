//! The listening ports.

use super::finding::Finding;
use std::io;
use std::net::{SocketAddr, TcpListener};

/// Checks whether a flag's address can be bound, and releases it immediately.
pub fn look(flag: &str, address: SocketAddr) -> Finding {
    judge(flag, address, TcpListener::bind(address).map(drop))
}

fn judge(flag: &str, address: SocketAddr, bound: io::Result<()>) -> Finding {
    let Err(error) = bound else { return Finding::fine(flag, format!("{address} is free")) };
    let change = match error.kind() {
        io::ErrorKind::AddrInUse => {
            "take another port, or end the program that has this one (ss -ltnp names it), unless that is this server"
        }
        io::ErrorKind::PermissionDenied => {
            "take a port from 1024 on, or give the server the right to lower ones (AmbientCapabilities=CAP_NET_BIND_SERVICE)"
        }
        io::ErrorKind::AddrNotAvailable => {
            "take an address of this machine, or 0.0.0.0 or [::] for all of them"
        }
        _ => "take another address",
    };
    Finding::change(flag, format!("{address} cannot be bound: {error}"), change)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_obstacle_has_its_advice() {
        let address = SocketAddr::from(([127, 0, 0, 1], 80));
        assert!(judge("--listen", address, Ok(())).is_fine());
        for (kind, advice) in [
            (io::ErrorKind::AddrInUse, "another port"),
            (io::ErrorKind::PermissionDenied, "CAP_NET_BIND_SERVICE"),
            (io::ErrorKind::AddrNotAvailable, "of this machine"),
            (io::ErrorKind::Other, "another address"),
        ] {
            let finding = judge("--ops", address, Err(kind.into()));
            assert!(finding.change.is_some_and(|change| change.contains(advice)), "{kind:?}");
        }
    }

    #[test]
    fn a_port_that_is_taken_is_found() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = taken.local_addr().expect("a bound port");
        assert!(!look("--listen", address).is_fine());
        drop(taken);
        assert!(look("--listen", address).is_fine());
    }
}
