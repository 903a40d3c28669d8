//! What a server gives out and later believes: tokens for seats, keys for hosts. A seal (HMAC with
//! SHA-256, cut to 16 bytes) by a key that each process draws for itself says that they are its own;
//! who may use them, and how often, is decided by the room that they name.

use hmac::{Hmac, KeyInit, Mac};
use jostle_protocol::Token;
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_room::Claim;
use jostle_sim::Seat;
use sha2::Sha256;

/// Bytes of the seal at the end; nobody finds the right 128 bits by trying.
const SEAL_BYTES: usize = 16;
const NOTE_BYTES: usize = TOKEN_BYTES - SEAL_BYTES;

/// What a token is for; part of what is sealed, so that none can be taken for another.
#[derive(Clone, Copy)]
enum Purpose {
    Seat = 1,
    Host = 2,
    Secret = 3,
}

/// Seals, and knows its own seals.
#[derive(Clone)]
pub struct Sealer {
    mac: Hmac<Sha256>,
}

/// A claim to a seat, in the room that the number stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeatClaim {
    /// [`crate::rooms::Facts::number`].
    pub room: u64,
    /// The seat in it.
    pub claim: Claim,
}

impl Sealer {
    /// With this key; whoever knows it can forge seals.
    pub fn new(key: &[u8; 32]) -> Sealer {
        Sealer { mac: Hmac::new_from_slice(key).expect("a key of any length will do") }
    }

    /// A token for a seat.
    pub fn seat_token(&self, SeatClaim { room, claim }: SeatClaim) -> Token {
        let (seat, serial) = (claim.seat.0.to_le_bytes(), claim.serial.to_le_bytes());
        self.sealed(Purpose::Seat, &[&room.to_le_bytes()[..], &seat, &serial].concat())
    }

    /// What a token for a seat says; `None` if this server did not make it.
    pub fn seat_claim(&self, token: &Token) -> Option<SeatClaim> {
        let note = self.opened(Purpose::Seat, token)?;
        let (room, rest) = note.split_first_chunk::<8>()?;
        let (seat, serial) = rest.split_first_chunk::<2>()?;
        let seat = Seat(u16::from_le_bytes(*seat));
        let serial = u64::from_le_bytes(serial.try_into().ok()?);
        Some(SeatClaim { room: u64::from_le_bytes(*room), claim: Claim { seat, serial } })
    }

    /// The key of a room's host.
    pub fn host_key(&self, room: u64) -> Token {
        self.sealed(Purpose::Host, &room.to_le_bytes())
    }

    /// Whose host a key makes its holder; `None` if this server did not make it.
    pub fn hosted(&self, key: &Token) -> Option<u64> {
        let note = self.opened(Purpose::Host, key)?;
        note.first_chunk::<8>().map(|room| u64::from_le_bytes(*room))
    }

    /// Whether two secrets are the same, found out in a time that says nothing of where they differ.
    pub fn same(&self, a: &[u8], b: &[u8]) -> bool {
        let seal = self.seal(Purpose::Secret, b).finalize().into_bytes();
        self.seal(Purpose::Secret, a).verify_slice(&seal).is_ok()
    }

    fn sealed(&self, purpose: Purpose, note: &[u8]) -> Token {
        let mut bytes = [0; TOKEN_BYTES];
        bytes[..note.len()].copy_from_slice(note);
        let seal = self.seal(purpose, &bytes[..NOTE_BYTES]).finalize().into_bytes();
        bytes[NOTE_BYTES..].copy_from_slice(&seal[..SEAL_BYTES]);
        Token(bytes)
    }

    /// Compares in a time that does not depend on where the seals differ.
    fn opened<'a>(&self, purpose: Purpose, token: &'a Token) -> Option<&'a [u8]> {
        let (note, seal) = token.0.split_at(NOTE_BYTES);
        self.seal(purpose, note).verify_truncated_left(seal).is_ok().then_some(note)
    }

    fn seal(&self, purpose: Purpose, note: &[u8]) -> Hmac<Sha256> {
        let mut mac = self.mac.clone();
        mac.update(&[purpose as u8]);
        mac.update(note);
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
        let sealer = Sealer::new(&[7; 32]);
        let claim = claim(0x1234_5678_9abc_def0, 63, 1 << 40);
        let token = sealer.seat_token(claim);
        assert_eq!(sealer.seat_claim(&token), Some(claim));
        for bit in 0..TOKEN_BYTES * 8 {
            let mut forged = token;
            forged.0[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(sealer.seat_claim(&forged), None, "bit {bit}");
        }
    }

    #[test]
    fn another_process_or_purpose_does_not_count() {
        let (sealer, other) = (Sealer::new(&[7; 32]), Sealer::new(&[8; 32]));
        let (token, key) = (sealer.seat_token(claim(3, 0, 0)), sealer.host_key(3));
        assert_eq!(other.seat_claim(&token), None);
        assert_eq!((sealer.hosted(&token), sealer.seat_claim(&key)), (None, None));
        assert_eq!((sealer.hosted(&key), other.hosted(&key)), (Some(3), None));
    }

    #[test]
    fn secrets_are_the_same_or_not() {
        let sealer = Sealer::new(&[7; 32]);
        assert!(sealer.same(b"open sesame", b"open sesame"));
        assert!(!sealer.same(b"open sesame", b"open sesamE") && !sealer.same(b"", b"open sesame"));
    }
}
