//! Why a session was refused or ended: its byte, its close code, its sentence.

/// Why a session was refused or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// The client speaks another protocol version.
    Version,
    /// Every seat of the room is taken.
    RoomFull,
    /// No such room.
    NoSuchRoom,
    /// The server has no room for another room.
    ServerFull,
    /// The first message was not a valid hello, or came too late.
    BadHello,
    /// A message could not be decoded, was too long, or was text.
    BadMessage,
    /// Too many messages.
    Flood,
    /// Too many sockets from one address.
    TooManySockets,
    /// Nothing was heard for too long.
    Silent,
    /// Another socket took the seat over.
    Replaced,
    /// The server is closing.
    Closing,
    /// The room failed; the others are not affected.
    RoomFailed,
    /// The token gives no seat back: it was used, or is of another server or room.
    BadToken,
    /// The host or an operator had the player leave.
    Kicked,
    /// The host or an operator closed the room.
    RoomClosed,
}

impl Refusal {
    /// Every refusal, in wire order. The bytes stay the same in all versions of the protocol, so
    /// that a client of another version can read why it was refused.
    pub const ALL: [Refusal; 15] = [
        Refusal::Version,
        Refusal::RoomFull,
        Refusal::NoSuchRoom,
        Refusal::ServerFull,
        Refusal::BadHello,
        Refusal::BadMessage,
        Refusal::Flood,
        Refusal::TooManySockets,
        Refusal::Silent,
        Refusal::Replaced,
        Refusal::Closing,
        Refusal::RoomFailed,
        Refusal::BadToken,
        Refusal::Kicked,
        Refusal::RoomClosed,
    ];

    /// WebSocket close code (RFC 6455, section 7.4): 1001 closing, 1008 policy, 1011 room failed,
    /// 4000 and up otherwise.
    pub fn close_code(self) -> u16 {
        match self {
            Refusal::Closing => 1001,
            Refusal::BadHello | Refusal::BadMessage => 1008,
            Refusal::Flood | Refusal::TooManySockets => 1008,
            Refusal::RoomFailed => 1011,
            Refusal::Version => 4000,
            Refusal::RoomFull => 4001,
            Refusal::NoSuchRoom => 4002,
            Refusal::ServerFull => 4003,
            Refusal::Silent => 4004,
            Refusal::Replaced => 4005,
            Refusal::BadToken => 4006,
            Refusal::Kicked => 4007,
            Refusal::RoomClosed => 4008,
        }
    }

    /// One sentence for the player: what happened and what to do.
    pub fn message(self) -> &'static str {
        match self {
            Refusal::Version => {
                "This page is of another version than the server; please reload it."
            }
            Refusal::RoomFull => {
                "Every seat of this room is taken; try again soon or pick another room."
            }
            Refusal::NoSuchRoom => {
                "This room closed when its last player left, or the link is wrong."
            }
            Refusal::ServerFull => "The server cannot hold another room; join one of its rooms.",
            Refusal::BadHello => "The server did not understand this page; please reload it.",
            Refusal::BadMessage => "The server received something it cannot read; please reload.",
            Refusal::Flood => "Too many messages were sent; wait a moment, then reload the page.",
            Refusal::TooManySockets => {
                "Too many players connect from your address; close another page first."
            }
            Refusal::Silent => "The server heard nothing from you for too long; please rejoin.",
            Refusal::Replaced => "You play on in another window; close it to play here.",
            Refusal::Closing => "The server is closing; it should be back soon.",
            Refusal::RoomFailed => "This room broke and was closed; please pick another one.",
            Refusal::BadToken => "Your seat could not be kept; join again for another one.",
            Refusal::Kicked => {
                "You or others at your address had to leave this room; \
                 come back in five minutes, or play elsewhere."
            }
            Refusal::RoomClosed => "This room was closed for all; please pick another one.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wire_order_is_the_order_of_declaration() {
        for (byte, refusal) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(refusal as usize, byte);
        }
    }

    #[test]
    fn close_codes_may_be_sent_and_messages_are_sentences() {
        for refusal in Refusal::ALL {
            let code = refusal.close_code();
            assert!([1001, 1008, 1011].contains(&code) || (4000..5000).contains(&code));
            // A close frame holds 125 bytes, two of them for the code.
            assert!(refusal.message().len() <= 123 && refusal.message().ends_with('.'));
        }
    }
}
