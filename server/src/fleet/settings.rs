//! The settings of a node.

use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// How a server takes part in a fleet.
#[derive(Clone, Debug)]
pub struct FleetSettings {
    /// Addresses of the NATS servers, separated by commas.
    pub nats: String,
    /// File with the credentials for them, if they ask for some.
    pub credentials: Option<PathBuf>,
    /// Copies that NATS keeps of each entry and record: 1, 3 or 5.
    pub replicas: usize,
    /// The name of this node, which no other node of the fleet may have.
    pub node: String,
    /// Where players reach this node: scheme and host, perhaps a port, without a slash at the end.
    pub url: String,
    /// Processor seconds a second that its rooms may take.
    pub capacity: f64,
    /// Key that signs the tokens of seats and hosts; all nodes have the same.
    pub secret: [u8; 32],
}

impl FleetSettings {
    /// A few bits of a hash of the secret, by which nodes see that they have the same without telling it.
    pub fn secret_mark(&self) -> u32 {
        let hash = Sha256::new().chain_update(b"jostle fleet").chain_update(self.secret).finalize();
        u32::from_le_bytes([hash[0], hash[1], hash[2], hash[3]])
    }
}

/// Bytes that a secret has at least.
pub const SECRET_BYTES_MIN: usize = 32;

/// The key that follows from the bytes of a secret's file; `None` if these are too few. Space around them does not
/// count: editors add it.
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
