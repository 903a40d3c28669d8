//! A node's settings.

use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// Settings for a server in a fleet.
#[derive(Clone, Debug)]
pub struct FleetSettings {
    /// Addresses of the NATS servers, separated by commas.
    pub nats: String,
    /// File with the credentials for these servers, if they require any.
    pub credentials: Option<PathBuf>,
    /// Number of copies that NATS keeps of each entry and record: 1, 3 or 5.
    pub replicas: usize,
    /// This node's name, unique in the fleet.
    pub node: String,
    /// Address at which players reach this node: a scheme, a host and optionally a port, without a trailing slash.
    pub url: String,
    /// Processor time available to the node's rooms, in seconds per second.
    pub capacity: f64,
    /// Key that signs seat and host tokens; the same on all nodes.
    pub secret: [u8; 32],
}

impl FleetSettings {
    /// A few bits of a hash of the secret. They show whether nodes share the same secret without revealing it.
    pub fn secret_mark(&self) -> u32 {
        let hash = Sha256::new().chain_update(b"jostle fleet").chain_update(self.secret).finalize();
        u32::from_le_bytes([hash[0], hash[1], hash[2], hash[3]])
    }
}

/// Minimum length of a secret, in bytes.
pub const SECRET_BYTES_MIN: usize = 32;

/// The key derived from the contents of a secret file; `None` if the secret is too short. Surrounding white space is
/// ignored, since editors add it.
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
