//! Signed tokens for seats, and keys for hosts. A signature (HMAC-SHA-256, truncated to 16 bytes) under the signer's
//! random key proves that the signer issued them. The room that a token names decides who may use it, and how often.

use hmac::{Hmac, KeyInit, Mac};
use jostle_game::Seat;
use jostle_protocol::Token;
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_room::Claim;
use sha2::Sha256;

/// Length of the signature at the end of a token, in bytes; 128 bits cannot be guessed by trial and error.
const SIGNATURE_BYTES: usize = 16;
const PAYLOAD_BYTES: usize = TOKEN_BYTES - SIGNATURE_BYTES;

/// A token's purpose. It is part of the signed bytes, so that no token can be used for another purpose.
#[derive(Clone, Copy)]
enum Purpose {
    Seat = 1,
    Host = 2,
    Secret = 3,
}

/// Signs tokens and verifies its own signatures.
#[derive(Clone)]
pub struct TokenSigner {
    mac: Hmac<Sha256>,
}

/// A claim to a seat in the room with this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeatClaim {
    /// [`crate::host::room_handle::RoomInfo::number`].
    pub room: u64,
    /// The claim within that room.
    pub claim: Claim,
}

impl TokenSigner {
    /// Creates a signer with a random key.
    pub fn with_random_key() -> TokenSigner {
        let mut key = [0; 32];
        getrandom::fill(&mut key)
            .expect("the system's random source worked when the server started");
        TokenSigner::new(&key)
    }

    /// Creates a signer with this key. Anyone who knows the key can forge tokens.
    pub fn new(key: &[u8; 32]) -> TokenSigner {
        TokenSigner { mac: Hmac::new_from_slice(key).expect("a key of any length will do") }
    }

    /// Creates a seat token.
    pub fn seat_token(&self, SeatClaim { room, claim }: SeatClaim) -> Token {
        let (seat, serial) = (claim.seat.0.to_le_bytes(), claim.serial.to_le_bytes());
        self.signed(Purpose::Seat, &[&room.to_le_bytes()[..], &seat, &serial].concat())
    }

    /// The claim in a seat token; `None` if this server did not issue the token.
    pub fn seat_claim(&self, token: &Token) -> Option<SeatClaim> {
        let payload = self.verified(Purpose::Seat, token)?;
        let (room, rest) = payload.split_first_chunk::<8>()?;
        let (seat, serial) = rest.split_first_chunk::<2>()?;
        let seat = Seat(u16::from_le_bytes(*seat));
        let serial = u64::from_le_bytes(serial.try_into().ok()?);
        Some(SeatClaim { room: u64::from_le_bytes(*room), claim: Claim { seat, serial } })
    }

    /// Creates a host key for a room.
    pub fn host_key(&self, room: u64) -> Token {
        self.signed(Purpose::Host, &room.to_le_bytes())
    }

    /// The number of the room that this key's holder hosts; `None` if this server did not issue the key.
    pub fn hosted(&self, key: &Token) -> Option<u64> {
        let payload = self.verified(Purpose::Host, key)?;
        payload.first_chunk::<8>().map(|room| u64::from_le_bytes(*room))
    }

    /// Compares two secrets in constant time, regardless of where they differ.
    pub fn same(&self, a: &[u8], b: &[u8]) -> bool {
        let signature = self.mac(Purpose::Secret, b).finalize().into_bytes();
        self.mac(Purpose::Secret, a).verify_slice(&signature).is_ok()
    }

    fn signed(&self, purpose: Purpose, payload: &[u8]) -> Token {
        let mut bytes = [0; TOKEN_BYTES];
        bytes[..payload.len()].copy_from_slice(payload);
        let signature = self.mac(purpose, &bytes[..PAYLOAD_BYTES]).finalize().into_bytes();
        bytes[PAYLOAD_BYTES..].copy_from_slice(&signature[..SIGNATURE_BYTES]);
        Token(bytes)
    }

    /// Verifies a token in constant time, regardless of where the signatures differ.
    fn verified<'a>(&self, purpose: Purpose, token: &'a Token) -> Option<&'a [u8]> {
        let (payload, signature) = token.0.split_at(PAYLOAD_BYTES);
        self.mac(purpose, payload).verify_truncated_left(signature).is_ok().then_some(payload)
    }

    fn mac(&self, purpose: Purpose, payload: &[u8]) -> Hmac<Sha256> {
        let mut mac = self.mac.clone();
        mac.update(&[purpose as u8]);
        mac.update(payload);
        mac
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(room: u64, seat: u16, serial: u64) -> SeatClaim {
        SeatClaim { room, claim: Claim { seat: Seat(seat), serial } }
    }

    #[test]
    fn a_claim_comes_back_and_no_changed_bit_does() {
        let signer = TokenSigner::new(&[7; 32]);
        let claim = claim(0x1234_5678_9abc_def0, 63, 1 << 40);
        let token = signer.seat_token(claim);
        assert_eq!(signer.seat_claim(&token), Some(claim));
        for bit in 0..TOKEN_BYTES * 8 {
            let mut forged = token;
            forged.0[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(signer.seat_claim(&forged), None, "bit {bit}");
        }
    }

    #[test]
    fn another_process_or_purpose_does_not_count() {
        let (signer, other) = (TokenSigner::new(&[7; 32]), TokenSigner::new(&[8; 32]));
        let (token, key) = (signer.seat_token(claim(3, 0, 0)), signer.host_key(3));
        assert_eq!(other.seat_claim(&token), None);
        assert_eq!((signer.hosted(&token), signer.seat_claim(&key)), (None, None));
        assert_eq!((signer.hosted(&key), other.hosted(&key)), (Some(3), None));
    }

    #[test]
    fn secrets_are_the_same_or_not() {
        let signer = TokenSigner::new(&[7; 32]);
        assert!(signer.same(b"open sesame", b"open sesame"));
        assert!(!signer.same(b"open sesame", b"open sesamE") && !signer.same(b"", b"open sesame"));
    }
}
