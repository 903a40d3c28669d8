//! The settings of a node.

use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// The settings of a server in a fleet.
#[derive(Clone, Debug)]
pub struct FleetSettings {
    /// Addresses of the NATS servers, separated by commas.
    pub nats: String,
    /// File with the credentials for these servers, if they require any.
    pub credentials: Option<PathBuf>,
    /// Copies that NATS keeps of each entry and record: 1, 3 or 5.
    pub replicas: usize,
    /// The name of this node, unique in the fleet.
    pub node: String,
    /// Address at which players reach this node: scheme and host, and optionally a port, without a trailing slash.
    pub url: String,
    /// Processor time that the node's rooms may take, in seconds per second.
    pub capacity: f64,
    /// Key that signs the tokens of seats and hosts, the same on all nodes.
    pub secret: [u8; 32],
}

impl FleetSettings {
    /// A few bits of a hash of the secret. They show whether nodes have the same secret, without revealing it.
    pub fn secret_mark(&self) -> u32 {
        let hash = Sha256::new().chain_update(b"jostle fleet").chain_update(self.secret).finalize();
        u32::from_le_bytes([hash[0], hash[1], hash[2], hash[3]])
    }
}

/// Minimum length of a secret, bytes.
pub const SECRET_BYTES_MIN: usize = 32;

/// The key derived from the content of a secret's file; `None` if it is too short. White space around it is ignored,
/// since editors add it.
pub fn secret(bytes: &[u8]) -> Option<[u8; 32]> {
    let bytes = bytes.trim_ascii();
    (bytes.len() >= SECRET_BYTES_MIN).then(|| Sha256::digest(bytes).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_see_whether_they_have_the_same_secret() {
        let mark = |secret| {
            let settings = FleetSettings {
                nats: String::new(),
                credentials: None,
                replicas: 1,
                node: String::new(),
                url: String::new(),
                capacity: 1.0,
                secret,
            };
            settings.secret_mark()
        };
        assert_eq!(mark([7; 32]), mark([7; 32]));
        assert_ne!(mark([7; 32]), mark([8; 32]));
    }
}
