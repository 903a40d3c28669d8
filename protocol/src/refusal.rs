//! Reasons for refusing or ending a session, each with its byte, close code and sentence.

/// Close codes for a bad message: broken frames, text, undecodable contents, a message out of order, and a message that
/// is too long.
pub const BAD_MESSAGE_CODES: [u16; 5] = [1002, 1003, 1007, 1008, 1009];

/// The reason why a session was refused or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// The client speaks a different protocol version.
    Version,
    /// All of the room's seats are taken.
    RoomFull,
    /// The room does not exist.
    NoSuchRoom,
    /// The server has no capacity for another room.
    ServerFull,
    /// The first message was not a valid hello, or came too late.
    BadHello,
    /// A message could not be decoded, was too long, or was text.
    BadMessage,
    /// The client sent too many messages.
    Flood,
    /// The address has too many sockets.
    TooManySockets,
    /// The client has been silent for too long.
    Silent,
    /// Another socket took the seat over.
    Replaced,
    /// The server is closing.
    Closing,
    /// The room failed. Other rooms are not affected.
    RoomFailed,
    /// The token is no longer valid, or belongs to another server or room.
    BadToken,
    /// The host or an operator kicked the player.
    Kicked,
    /// The host or an operator closed the room.
    RoomClosed,
    /// The seat was given to a newcomer because the room is full and the player was idle, or was on a network that
    /// holds many seats.
    GaveWay,
    /// Another server plays the room. [`crate::ServerMessage::Moved`] named it.
    Moved,
    /// No server plays the room at the moment, because it is moving from one to another.
    Moving,
    /// A guest's scene used more than the room's share of the server.
    TooCostly,
    /// The room, or this address within it, has reached its limit of spectators.
    TooManySpectators,
}

impl Refusal {
    /// All refusals in wire order. The bytes are the same in all protocol versions, so that a client with a different
    /// version can read the reason.
    pub const ALL: [Refusal; 20] = [
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
        Refusal::GaveWay,
        Refusal::Moved,
        Refusal::Moving,
        Refusal::TooCostly,
        Refusal::TooManySpectators,
    ];

    /// WebSocket close code (RFC 6455, section 7.4): a registered code if one fits, otherwise a private code from 4000
    /// upwards. For a bad message, the server may choose a more specific code from [`BAD_MESSAGE_CODES`].
    pub fn close_code(self) -> u16 {
        match self {
            Refusal::Closing => 1001,
            Refusal::BadMessage => 1007,
            Refusal::BadHello | Refusal::Flood | Refusal::TooManySockets => 1008,
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
            Refusal::GaveWay => 4009,
            Refusal::Moved => 4010,
            Refusal::Moving => 4011,
            Refusal::TooCostly => 4012,
            Refusal::TooManySpectators => 4013,
        }
    }

    /// A sentence that tells the player about the problem and what to do.
    pub fn message(self) -> &'static str {
        match self {
            Refusal::Version => "Jostle has been updated. Please reload the page.",
            Refusal::RoomFull => "This room is full. Try again soon or pick another one.",
            Refusal::NoSuchRoom => {
                "This room closed when its last player left, or the link is wrong."
            }
            Refusal::ServerFull => {
                "The server is at its room limit. Join an existing room instead."
            }
            Refusal::BadHello => {
                "Something went wrong between the page and the server. Please reload."
            }
            Refusal::BadMessage => {
                "Something went wrong between the page and the server. Please reload."
            }
            Refusal::Flood => "You're sending too much at once. Wait a moment, then rejoin.",
            Refusal::TooManySockets => {
                "Too many players are connected from your network. Close another tab first."
            }
            Refusal::Silent => {
                "You were disconnected because we lost touch with you. Please rejoin."
            }
            Refusal::Replaced => {
                "You're playing in another tab. Play here to move the game to this one."
            }
            Refusal::Closing => "The server is restarting. It should be back soon.",
            Refusal::RoomFailed => "This room crashed and was closed. Please pick another one.",
            Refusal::BadToken => "Your spot couldn't be kept. Join again to get a new one.",
            Refusal::Kicked => {
                "The host removed you or someone on your network. You can come back in five minutes."
            }
            Refusal::RoomClosed => "The host closed this room. Please pick another one.",
            Refusal::GaveWay => {
                "Your spot in the full room went to a newcomer: you were idle, or many of your network play."
            }
            Refusal::Moved => "This room is now on another server. Rejoin to follow it.",
            Refusal::Moving => "This room is moving to another server. Try again in a moment.",
            Refusal::TooCostly => {
                "This room was closed: its scene takes too much of the server. Try it with fewer bodies."
            }
            Refusal::TooManySpectators => {
                "As many people watch this room as it has places for. Try again soon, or watch another one."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The close codes and refusals in the table in docs/protocol.md.
    fn documented() -> BTreeSet<(u16, usize)> {
        let page = include_str!("../../docs/protocol.md");
        let rows = page.lines().skip_while(|line| !line.starts_with("| close code")).skip(2);
        let mut code = 0;
        let number = |cell: &str| -> Option<u16> { cell.split(' ').next()?.parse().ok() };
        let read = |row: &str| {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            code = number(cells[1]).unwrap_or(code);
            (code, number(cells[2]).expect("a refusal").into())
        };
        rows.take_while(|row| row.starts_with('|')).map(read).collect()
    }

    #[test]
    fn the_table_of_close_codes_is_complete() {
        let sent = Refusal::ALL.into_iter().map(|refusal| (refusal.close_code(), refusal as usize));
        let bad_message = BAD_MESSAGE_CODES.map(|code| (code, Refusal::BadMessage as usize));
        assert_eq!(documented(), sent.chain(bad_message).collect());
    }

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
            assert!([1001, 1007, 1008, 1011].contains(&code) || (4000..5000).contains(&code));
            // A close frame's payload is at most 125 bytes, two of which are for the code.
            assert!(refusal.message().len() <= 123 && refusal.message().ends_with('.'));
        }
    }
}
