//! Messages in both directions and their binary form: a byte for the kind, then the fields in order. The bytes are
//! documented in `docs/protocol.md`.

mod forms;

pub use crate::appearance::{Appearance, AppearanceError};
pub use crate::clip::ClipRefusal;
pub use crate::refusal::Refusal;
pub use crate::role::{Role, WelcomeSeat};

use crate::error::DecodeError;
use crate::limits::{CLIENT_MESSAGE_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use crate::snapshot::SNAPSHOT;
use crate::token::Token;
use crate::wire::{Reader, Writer};
use forms::{
    APPEARANCE, BYTE, CLIP, EMOTE, FIXED16, FIXED32, FLAG, INPUT, LEB32, ORIGIN, ORIGINS, REFUSAL,
    ROLE, ROOM_CODE, SCENE, SCENE_NAME, SEAT, SEATS, SOME_TOKEN, VIEW, WELCOME_SEAT,
};
use jostle_game::{Input, Seat};
use jostle_sim::Vec2;

/// Version of the protocol; both ends must have the same one.
pub const VERSION: u16 = 5;

/// A message from a client to a server.
#[derive(Clone, Debug, PartialEq)]
pub enum ClientMessage {
    /// The first message on a socket.
    Hello {
        /// The client's [`crate::VERSION`].
        version: u16,
        /// The player's name and colour.
        appearance: Appearance,
        /// Token of a seat held earlier, for resuming it.
        token: Option<Token>,
        /// Key of the room's host, if the player has it.
        host_key: Option<Token>,
        /// Whether the client plays or watches. A spectator's token and key are ignored.
        role: Role,
    },
    /// A player's intent for one tick.
    Input {
        /// Starts at 1 and increases by one with each of a session's inputs.
        seq: u32,
        /// Low bits of the tick of the newest decoded snapshot or, before the first snapshot, of the welcome's tick.
        ack_tick: u16,
        /// The player's keys, buttons and pointer.
        input: Input,
    },
    /// A request for a [`ServerMessage::Pong`].
    Ping {
        /// Any number, which the pong returns.
        stamp: u32,
    },
    /// The size of the page's view, if it is smaller than the world.
    View {
        /// Width and height in world units, both greater than 0 and at most [`crate::limits::VIEW_MAX`].
        size: Vec2,
    },
    /// The host kicks a player, who cannot return for a while. Others on the player's network can.
    Kick {
        /// The player's seat.
        seat: Seat,
    },
    /// The host closes the room.
    CloseRoom,
    /// A player asks the server to keep the last few seconds of the game. The answer is a [`ServerMessage::Clip`].
    Clip,
    /// A player shows an emote to the whole room.
    Emote {
        /// The emote's index, below [`crate::limits::EMOTES`].
        emote: u8,
    },
    /// A player takes another name or colour.
    Look {
        /// The requested name and colour. The room makes them distinct, as in a hello.
        appearance: Appearance,
    },
    /// Like [`ClientMessage::Kick`], but nobody new from the player's network can join for a while.
    KickNetwork {
        /// The player's seat.
        seat: Seat,
    },
    /// Asks for a [`ServerMessage::Bots`] now and whenever the bots change.
    FollowBots,
}

/// A message from a server to a client.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerMessage {
    /// The client is in the room. A keyframe follows.
    Welcome {
        /// The player's seat. Spectators have none.
        seat: Option<WelcomeSeat>,
        /// Tick at which the client joins.
        tick: u32,
        /// The room's code, as in its link.
        room: String,
        /// Name of the scene.
        scene_name: String,
        /// The scene's TOML text.
        scene: String,
    },
    /// The session is ending, and the socket closes after this message.
    Refused {
        /// The reason, and what the client should do.
        refusal: Refusal,
    },
    /// The server is about to close.
    Draining {
        /// Number of seconds left.
        seconds: u8,
        /// Whether the room resumes in its current state after the restart.
        keeps_room: bool,
    },
    /// The answer to a ping.
    Pong {
        /// The stamp of the ping being answered.
        stamp: u32,
        /// The server's tick at the time of the answer.
        tick: u32,
    },
    /// The answer to a host request from a player who is not the host, or to an attempt to kick the host.
    Denied,
    /// Another server plays the room, either from now on or already at the time of the hello. The socket closes after
    /// this message with [`Refusal::Moved`]. The client immediately reconnects to the same path on that server, with
    /// its tokens.
    Moved {
        /// The server's origin, which satisfies [`crate::is_origin`].
        url: String,
    },
    /// Other servers that know where the room is, in case this one fails. Replaces the previous list.
    Nodes {
        /// The servers' origins, at most [`crate::limits::NODES_MAX`] of them.
        urls: Vec<String>,
    },
    /// A player in the room shows an emote.
    Emote {
        /// The player's seat.
        seat: Seat,
        /// The emote's index, below [`crate::limits::EMOTES`].
        emote: u8,
    },
    /// The answer to a request for a clip.
    Clip {
        /// Name of the saved replay, which the server lists like any other.
        kept: Result<String, ClipRefusal>,
    },
    /// The room's bots, for a client that asked for them. Replaces the previous list.
    Bots {
        /// Their seats, in increasing order.
        seats: Vec<Seat>,
    },
    /// A coded snapshot including its kind byte, for [`crate::SnapshotStream::decode`].
    Snapshot(Vec<u8>),
}

/// Defines the messages of an enum once for both directions: the byte for each kind, then its fields in order, with
/// their codecs. The last arms write the kinds that have no definition.
macro_rules! messages {
    (
        $Message:ident {
            $($byte:literal => $Kind:ident { $($field:ident: $form:ident),* },)*
        }
        $writer:ident { $($other:pat => $write:expr)? }
    ) => {
        impl $Message {
            fn write_fields(&self, $writer: &mut Writer) {
                match self {
                    $($Message::$Kind { $($field),* } => {
                        $writer.byte($byte);
                        $(($form.write)($writer, $field);)*
                    })*
                    $($other => $write,)?
                }
            }

            fn read_fields(kind: u8, reader: &mut Reader) -> Result<$Message, DecodeError> {
                match kind {
                    $($byte => Ok($Message::$Kind {
                        $($field: ($form.read)(reader, stringify!($field))?),*
                    }),)*
                    _ => Err(DecodeError::OutOfRange { field: "kind" }),
                }
            }
        }
    };
}

messages! {
    ClientMessage {
        0 => Hello {
            version: FIXED16, appearance: APPEARANCE, token: SOME_TOKEN, host_key: SOME_TOKEN, role: ROLE
        },
        1 => Input { seq: LEB32, ack_tick: FIXED16, input: INPUT },
        2 => Ping { stamp: FIXED32 },
        3 => View { size: VIEW },
        4 => Kick { seat: SEAT },
        5 => CloseRoom {},
        6 => Clip {},
        7 => Emote { emote: EMOTE },
        8 => Look { appearance: APPEARANCE },
        9 => KickNetwork { seat: SEAT },
        10 => FollowBots {},
    }
    writer {}
}

messages! {
    ServerMessage {
        0 => Welcome {
            seat: WELCOME_SEAT, tick: LEB32, room: ROOM_CODE, scene_name: SCENE_NAME, scene: SCENE
        },
        1 => Refused { refusal: REFUSAL },
        2 => Draining { seconds: BYTE, keeps_room: FLAG },
        3 => Pong { stamp: FIXED32, tick: LEB32 },
        4 => Denied {},
        5 => Moved { url: ORIGIN },
        6 => Nodes { urls: ORIGINS },
        7 => Emote { seat: SEAT, emote: EMOTE },
        8 => Clip { kept: CLIP },
        9 => Bots { seats: SEATS },
    }
    writer { ServerMessage::Snapshot(bytes) => writer.raw(bytes) }
}

impl ClientMessage {
    /// Encodes the message in at most `CLIENT_MESSAGE_BYTES_MAX` bytes. Panics if a field is too long or not finite, so
    /// that `decode` would refuse it.
    pub fn encode(&self) -> Vec<u8> {
        let mut writer = Writer::new();
        self.write_fields(&mut writer);
        writer.finish()
    }

    /// Decodes a message. This is safe for any bytes. If a hello has a different version, only the version is read,
    /// because the rest may mean anything; the appearance is a placeholder.
    pub fn decode(bytes: &[u8]) -> Result<ClientMessage, DecodeError> {
        check_length(bytes, CLIENT_MESSAGE_BYTES_MAX)?;
        if let [0, low, high, ..] = *bytes
            && u16::from_le_bytes([low, high]) != VERSION
        {
            return Ok(hello_of(u16::from_le_bytes([low, high])));
        }
        let mut reader = Reader::new(bytes);
        let kind = reader.byte("kind")?;
        let message = ClientMessage::read_fields(kind, &mut reader)?;
        reader.end()?;
        Ok(message)
    }
}

/// A hello with a different version. Only its version is known.
fn hello_of(version: u16) -> ClientMessage {
    let appearance = Appearance { name: "?".into(), color: 0 };
    let role = Role::Player;
    ClientMessage::Hello { version, appearance, token: None, host_key: None, role }
}

fn check_length(bytes: &[u8], bytes_max: usize) -> Result<(), DecodeError> {
    let bytes = bytes.len();
    if bytes > bytes_max { Err(DecodeError::TooLong { bytes, bytes_max }) } else { Ok(()) }
}

impl ServerMessage {
    /// Encodes the message. Panics if a text is longer than its limit or a URL is not an origin.
    pub fn encode(&self) -> Vec<u8> {
        let mut writer = Writer::new();
        self.write(&mut writer);
        writer.finish()
    }

    /// Encodes the message into the writer.
    pub fn write(&self, writer: &mut Writer) {
        self.write_fields(writer);
    }

    /// Decodes a message. This is safe for any bytes.
    pub fn decode(bytes: &[u8]) -> Result<ServerMessage, DecodeError> {
        check_length(bytes, SERVER_MESSAGE_BYTES_MAX)?;
        let mut reader = Reader::new(bytes);
        let kind = reader.byte("kind")?;
        if kind >= SNAPSHOT {
            return Ok(ServerMessage::Snapshot(bytes.to_vec()));
        }
        let message = ServerMessage::read_fields(kind, &mut reader)?;
        reader.end()?;
        Ok(message)
    }
}

#[cfg(test)]
mod tests;
