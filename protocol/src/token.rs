//! Tokens with which a client regains a seat or a host's rights. They are opaque to this crate and to clients; only the
//! server knows what they contain and how they are sealed.

use crate::error::DecodeError;
use crate::limits::TOKEN_BYTES;
use crate::wire::{Reader, Writer};
use std::fmt;

/// A sealed note from the server to itself.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Token(pub [u8; TOKEN_BYTES]);

impl Token {
    /// The token as hexadecimal digits.
    pub fn text(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Parses the lower-case hexadecimal digits that [`Token::text`] returns.
    pub fn parse(text: &str) -> Option<Token> {
        let digit = |byte: u8| match byte {
            b'0'..=b'9' => Some(byte - b'0'),
            b'a'..=b'f' => Some(byte - b'a' + 10),
            _ => None,
        };
        let mut token = Token([0; TOKEN_BYTES]);
        let (pairs, rest) = text.as_bytes().as_chunks::<2>();
        if pairs.len() != TOKEN_BYTES || !rest.is_empty() {
            return None;
        }
        for (byte, &[high, low]) in token.0.iter_mut().zip(pairs) {
            *byte = digit(high)? << 4 | digit(low)?;
        }
        Some(token)
    }

    pub(crate) fn write(&self, writer: &mut Writer) {
        writer.raw(&self.0);
    }

    pub(crate) fn read(reader: &mut Reader, field: &'static str) -> Result<Token, DecodeError> {
        let bytes = reader.raw(TOKEN_BYTES, field)?;
        Ok(Token(bytes.try_into().expect("`raw` returned this many bytes")))
    }
}

impl fmt::Debug for Token {
    /// Omits the token, because anyone who reads the log could use it.
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("Token(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_parsed_from_its_own_text_alone() {
        let token = Token(std::array::from_fn(|place| (place * 37) as u8));
        let text = token.text();
        assert_eq!(Token::parse(&text), Some(token));
        let long = format!("{text}00");
        for wrong in ["", &text[2..], &text[1..], &long, &text.to_uppercase()] {
            assert_eq!(Token::parse(wrong), None, "{wrong}");
        }
        assert_eq!(Token::parse(&text.replacen('0', "g", 1)), None);
        assert_eq!(format!("{token:?}"), "Token(..)");
    }
}
