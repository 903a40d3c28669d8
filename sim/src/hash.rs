//! The state hash is xxh3 over raw bits, fed in id order.

use xxhash_rust::xxh3::Xxh3;

/// Collects 32-bit words and digests them. The same words give the same digest on every target.
///
/// Words are collected into blocks, because the digest is fast on blocks and slow on single words.
pub struct StateHasher {
    block: [u8; BLOCK_BYTES],
    filled: usize,
    digest: Xxh3,
}

const BLOCK_BYTES: usize = 1024;

impl Default for StateHasher {
    fn default() -> StateHasher {
        StateHasher { block: [0; BLOCK_BYTES], filled: 0, digest: Xxh3::new() }
    }
}

impl StateHasher {
    /// Adds a word to the digest.
    #[inline]
    pub fn push(&mut self, word: u32) {
        self.block[self.filled..self.filled + 4].copy_from_slice(&word.to_le_bytes());
        self.filled += 4;
        if self.filled == BLOCK_BYTES {
            self.digest.update(&self.block);
            self.filled = 0;
        }
    }

    /// Adds two words, low one first.
    pub fn push_u64(&mut self, word: u64) {
        self.push(word as u32);
        self.push((word >> 32) as u32);
    }

    /// Adds bytes to the digest. Call [`StateHasher::fill_word`] before adding another word.
    #[inline]
    pub(crate) fn push_bytes(&mut self, bytes: &[u8]) {
        let end = self.filled + bytes.len();
        if end < BLOCK_BYTES {
            self.block[self.filled..end].copy_from_slice(bytes);
            self.filled = end;
        } else {
            bytes.iter().for_each(|&byte| self.push_byte(byte));
        }
    }

    fn push_byte(&mut self, byte: u8) {
        self.block[self.filled] = byte;
        self.filled += 1;
        if self.filled == BLOCK_BYTES {
            self.digest.update(&self.block);
            self.filled = 0;
        }
    }

    /// Pads the current word with zeros.
    pub(crate) fn fill_word(&mut self) {
        while !self.filled.is_multiple_of(4) {
            self.push_byte(0);
        }
    }

    /// Returns the digest of all words so far.
    pub fn finish(mut self) -> u64 {
        self.fill_word();
        self.digest.update(&self.block[..self.filled]);
        self.digest.digest()
    }
}
