//! Messages in both directions and their binary form: one kind byte, then fields in the order of
//! declaration, numbers little-endian or LEB128.

use crate::wire::DecodeError;
use jostle_sim::Input;

/// How a player looks to others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Appearance {
    /// Shown name: 1..=20 characters after trimming, no control characters.
    pub name: String,
    /// Index into the palette of player colours.
    pub color: u8,
}

/// From client to server.
#[derive(Clone, Debug, PartialEq)]
pub enum ClientMessage {
    /// The first message on a socket.
    Hello {
        /// [`crate::VERSION`] of the client.
        version: u16,
        /// Name and colour.
        appearance: Appearance,
        /// Token of a seat held before, to get it back.
        token: Option<u64>,
    },
    /// Intent for one tick.
    Input {
        /// Grows by one with every input of a session, from 1.
        seq: u32,
        /// What is down, and the pointer.
        input: Input,
    },
    /// Asks for a [`ServerMessage::Pong`].
    Ping {
        /// Any number; comes back unchanged.
        stamp: u32,
    },
}

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
}

/// From server to client.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerMessage {
    /// The seat is taken; a keyframe follows.
    Welcome {
        /// The seat.
        seat: u8,
        /// Gives the seat back after a lost socket.
        token: u64,
        /// Tick at which the player joins.
        tick: u32,
        /// Code of the room, as in its link.
        room: String,
        /// Name of the scene.
        scene_name: String,
        /// TOML text of the scene.
        scene: String,
    },
    /// The session ends; the socket closes after this.
    Refused {
        /// Why.
        refusal: Refusal,
    },
    /// The server will close.
    Draining {
        /// Seconds left.
        seconds: u8,
    },
    /// Answer to a ping.
    Pong {
        /// The ping's stamp.
        stamp: u32,
        /// Server tick when it was answered.
        tick: u32,
    },
    /// A snapshot, still coded: decode with [`crate::Snapshot::decode`].
    Snapshot(Vec<u8>),
}

impl ClientMessage {
    /// Binary form, at most `CLIENT_MESSAGE_BYTES_MAX` long.
    pub fn encode(&self) -> Vec<u8> {
        todo!()
    }

    /// Reads one message; any bytes are safe.
    pub fn decode(bytes: &[u8]) -> Result<ClientMessage, DecodeError> {
        let _ = bytes;
        todo!()
    }
}

impl ServerMessage {
    /// Binary form.
    pub fn encode(&self) -> Vec<u8> {
        todo!()
    }

    /// Reads one message; any bytes are safe.
    pub fn decode(bytes: &[u8]) -> Result<ServerMessage, DecodeError> {
        let _ = bytes;
        todo!()
    }
}

impl Refusal {
    /// WebSocket close code: 1001 closing, 1008 policy, 1011 room failed, 4000 and up otherwise.
    pub fn close_code(self) -> u16 {
        todo!()
    }

    /// One sentence for the player: what happened and what to do.
    pub fn message(self) -> &'static str {
        todo!()
    }
}
