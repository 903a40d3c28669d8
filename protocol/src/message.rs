//! Messages in both directions and their binary form: a byte for the kind, then the fields in order.
//! `docs/protocol.md` lists the bytes.

pub use crate::appearance::{Appearance, AppearanceError};
pub use crate::clip::ClipRefusal;
pub use crate::refusal::Refusal;

use crate::error::{DecodeError, check};
use crate::fields::{read_seat, write_seat};
use crate::limits::{
    CLIENT_MESSAGE_BYTES_MAX, EMOTES, NODES_MAX, POINTER_MAX, REPLAY_NAME_BYTES_MAX,
    ROOM_CODE_BYTES_MAX, SCENE_BYTES_MAX, SCENE_NAME_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX, VIEW_MAX,
};
use crate::origin::{read_origin, write_origin};
use crate::snapshot::SNAPSHOT;
use crate::token::Token;
use crate::wire::{Reader, Writer};
use jostle_game::{Buttons, Input, Seat};
use jostle_sim::Vec2;

/// Version of the protocol; both ends must agree.
pub const VERSION: u16 = 5;

const HELLO: u8 = 0;
const INPUT: u8 = 1;
const PING: u8 = 2;
const VIEW: u8 = 3;
const KICK: u8 = 4;
const CLOSE_ROOM: u8 = 5;
const CLIP: u8 = 6;
const EMOTE: u8 = 7;

const WELCOME: u8 = 0;
const REFUSED: u8 = 1;
const DRAINING: u8 = 2;
const PONG: u8 = 3;
const DENIED: u8 = 4;
const MOVED: u8 = 5;
const NODES: u8 = 6;
const EMOTED: u8 = 7;
const CLIPPED: u8 = 8;

/// The part that a client takes in a room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// A player, with a seat.
    #[default]
    Player,
    /// A spectator, without one: it is sent everything and can change nothing.
    Spectator,
}

/// A message from client to server.
#[derive(Clone, Debug, PartialEq)]
pub enum ClientMessage {
    /// The first message on a socket.
    Hello {
        /// [`crate::VERSION`] of the client.
        version: u16,
        /// Name and colour of the player.
        appearance: Appearance,
        /// Token of a seat held before, to get it back.
        token: Option<Token>,
        /// Key of the room's host, if the player has it.
        host_key: Option<Token>,
        /// Whether it plays or watches. A spectator's token and key are not looked at.
        role: Role,
    },
    /// A player's intent for one tick.
    Input {
        /// Grows by one with every input of a session, from 1.
        seq: u32,
        /// Low bits of the tick of the newest decoded snapshot; before the first, of the welcome's tick.
        ack_tick: u16,
        /// Keys, buttons and pointer of the player.
        input: Input,
    },
    /// A request for a [`ServerMessage::Pong`].
    Ping {
        /// Any number; the pong returns it.
        stamp: u32,
    },
    /// How much of the world the page shows, if that is less than all of it.
    View {
        /// Width and height in world units, both above 0 and at most [`VIEW_MAX`].
        size: Vec2,
    },
    /// The host kicks a player, who cannot come back for a while.
    Kick {
        /// Seat of that player.
        seat: Seat,
    },
    /// The host closes the room.
    CloseRoom,
    /// A player asks the server to keep the last seconds of the game, which answers with a [`ServerMessage::Clip`].
    Clip,
    /// A player shows an emote to the whole room.
    Emote {
        /// Which, below [`EMOTES`].
        emote: u8,
    },
}

/// The seat in a welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WelcomeSeat {
    /// The seat that the player holds.
    pub seat: Seat,
    /// Whether the player is the room's host, because the hello had the right key.
    pub host: bool,
    /// The token with which the player gets the seat back after a lost socket, once.
    pub token: Token,
}

/// A message from server to client.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerMessage {
    /// The client is in the room; a keyframe follows.
    Welcome {
        /// The seat of a player; a spectator has none.
        seat: Option<WelcomeSeat>,
        /// Tick at which the client joins.
        tick: u32,
        /// Code of the room, as in its link.
        room: String,
        /// Name of the scene.
        scene_name: String,
        /// TOML text of the scene.
        scene: String,
    },
    /// The session ends, and the socket closes after this message.
    Refused {
        /// Reason, and what the client should do.
        refusal: Refusal,
    },
    /// The server is about to close.
    Draining {
        /// Seconds left.
        seconds: u8,
        /// Whether the room goes on after the restart where it is then.
        keeps_room: bool,
    },
    /// The answer to a ping.
    Pong {
        /// The stamp of the ping that it answers.
        stamp: u32,
        /// The server's tick at the time of the answer.
        tick: u32,
    },
    /// The answer to a request that only a host may make, and to the kick of a host.
    Denied,
    /// The room is played by another server from now on, or is there in answer to a hello. The socket closes after
    /// this message, as [`Refusal::Moved`]. The client goes on at the same path there, at once, with its tokens.
    Moved {
        /// Origin of that server, which satisfies [`crate::is_origin`].
        url: String,
    },
    /// Other servers that know where the room is, for when this one falls silent. It replaces the list before.
    Nodes {
        /// Their origins, at most [`NODES_MAX`].
        urls: Vec<String>,
    },
    /// A player of the room shows an emote.
    Emote {
        /// Seat of the player.
        seat: Seat,
        /// Which, below [`EMOTES`].
        emote: u8,
    },
    /// The answer to a request for a clip.
    Clip {
        /// Name of the replay that was kept, under which the server has it like any other.
        kept: Result<String, ClipRefusal>,
    },
    /// A snapshot, still coded, with its kind, for [`crate::SnapshotStream::decode`].
    Snapshot(Vec<u8>),
}

impl ClientMessage {
    /// Encodes the message in at most `CLIENT_MESSAGE_BYTES_MAX` bytes. Panics on a field that `decode`
    /// would refuse as too long or not finite.
    pub fn encode(&self) -> Vec<u8> {
        let mut writer = Writer::new();
        match self {
            ClientMessage::Hello { version, appearance, token, host_key, role } => {
                writer.byte(HELLO);
                writer.fixed16(*version);
                appearance.write(&mut writer);
                for token in [token, host_key] {
                    writer.option(token.as_ref(), |writer, token| token.write(writer));
                }
                writer.flag(*role == Role::Spectator);
            }
            ClientMessage::Input { seq, ack_tick, input } => {
                writer.byte(INPUT);
                writer.leb32(*seq);
                writer.fixed16(*ack_tick);
                write_input(&mut writer, input);
            }
            ClientMessage::Ping { stamp } => {
                writer.byte(PING);
                writer.fixed32(*stamp);
            }
            ClientMessage::View { size } => {
                writer.byte(VIEW);
                writer.point(*size);
            }
            ClientMessage::Kick { seat } => {
                writer.byte(KICK);
                write_seat(&mut writer, *seat);
            }
            ClientMessage::CloseRoom => writer.byte(CLOSE_ROOM),
            ClientMessage::Clip => writer.byte(CLIP),
            ClientMessage::Emote { emote } => {
                writer.byte(EMOTE);
                writer.byte(*emote);
            }
        }
        writer.finish()
    }

    /// Decodes a message; any bytes are safe. Of a hello of another version only the version is read, because
    /// the rest may mean anything: the appearance is a placeholder.
    pub fn decode(bytes: &[u8]) -> Result<ClientMessage, DecodeError> {
        check_length(bytes, CLIENT_MESSAGE_BYTES_MAX)?;
        let mut reader = Reader::new(bytes);
        let message = match reader.byte("kind")? {
            HELLO => match reader.fixed16("version")? {
                VERSION => read_hello(&mut reader)?,
                version => return Ok(hello_of(version)),
            },
            INPUT => {
                let seq = reader.leb32("seq")?;
                let ack_tick = reader.fixed16("ack tick")?;
                ClientMessage::Input { seq, ack_tick, input: read_input(&mut reader)? }
            }
            PING => ClientMessage::Ping { stamp: reader.fixed32("stamp")? },
            VIEW => ClientMessage::View { size: read_view(&mut reader)? },
            KICK => ClientMessage::Kick { seat: read_seat(&mut reader)? },
            CLOSE_ROOM => ClientMessage::CloseRoom,
            CLIP => ClientMessage::Clip,
            EMOTE => ClientMessage::Emote { emote: read_emote(&mut reader)? },
            _ => return Err(DecodeError::OutOfRange { field: "kind" }),
        };
        reader.end()?;
        Ok(message)
    }
}

/// A hello of another version, of which nothing else is known.
fn hello_of(version: u16) -> ClientMessage {
    let appearance = Appearance { name: "?".into(), color: 0 };
    let role = Role::Player;
    ClientMessage::Hello { version, appearance, token: None, host_key: None, role }
}

fn read_hello(reader: &mut Reader) -> Result<ClientMessage, DecodeError> {
    let appearance = Appearance::read(reader)?;
    let token = read_token(reader, "token")?;
    let host_key = read_token(reader, "host key")?;
    let role = if reader.flag("role")? { Role::Spectator } else { Role::Player };
    Ok(ClientMessage::Hello { version: VERSION, appearance, token, host_key, role })
}

fn read_emote(reader: &mut Reader) -> Result<u8, DecodeError> {
    let emote = reader.byte("emote")?;
    check(emote < EMOTES, "emote")?;
    Ok(emote)
}

fn read_token(reader: &mut Reader, field: &'static str) -> Result<Option<Token>, DecodeError> {
    reader.option(field, |reader| Token::read(reader, field))
}

fn write_input(writer: &mut Writer, input: &Input) {
    writer.leb32(u32::from(input.buttons().0));
    writer.option(input.pointer(), Writer::point);
}

fn read_input(reader: &mut Reader) -> Result<Input, DecodeError> {
    let buttons = Buttons(reader.leb_up_to(u32::from(Buttons::ALL.0), "buttons")? as u16);
    Ok(Input::new(buttons, reader.option("pointer", read_pointer)?))
}

fn read_pointer(reader: &mut Reader) -> Result<Vec2, DecodeError> {
    let point = reader.point("pointer")?;
    check(point.x.abs() <= POINTER_MAX && point.y.abs() <= POINTER_MAX, "pointer")?;
    Ok(point)
}

fn read_view(reader: &mut Reader) -> Result<Vec2, DecodeError> {
    let size = reader.point("view")?;
    let allowed = |length: f32| length > 0.0 && length <= VIEW_MAX;
    check(allowed(size.x) && allowed(size.y), "view")?;
    Ok(size)
}

fn check_length(bytes: &[u8], bytes_max: usize) -> Result<(), DecodeError> {
    let bytes = bytes.len();
    if bytes > bytes_max { Err(DecodeError::TooLong { bytes, bytes_max }) } else { Ok(()) }
}

impl ServerMessage {
    /// Encodes the message. Panics on a text that is longer than its limit, and on a URL that is no origin.
    pub fn encode(&self) -> Vec<u8> {
        let mut writer = Writer::new();
        self.write(&mut writer);
        writer.finish()
    }

    /// Encodes the message, and appends it to the writer.
    pub fn write(&self, writer: &mut Writer) {
        match self {
            ServerMessage::Welcome { seat, tick, room, scene_name, scene } => {
                writer.byte(WELCOME);
                writer.option(seat.as_ref(), |writer, WelcomeSeat { seat, host, token }| {
                    write_seat(writer, *seat);
                    writer.flag(*host);
                    token.write(writer);
                });
                writer.leb32(*tick);
                writer.text(room, ROOM_CODE_BYTES_MAX);
                writer.text(scene_name, SCENE_NAME_BYTES_MAX);
                writer.text(scene, SCENE_BYTES_MAX);
            }
            ServerMessage::Refused { refusal } => {
                writer.byte(REFUSED);
                writer.byte(*refusal as u8);
            }
            ServerMessage::Draining { seconds, keeps_room } => {
                writer.byte(DRAINING);
                writer.byte(*seconds);
                writer.flag(*keeps_room);
            }
            ServerMessage::Pong { stamp, tick } => {
                writer.byte(PONG);
                writer.fixed32(*stamp);
                writer.leb32(*tick);
            }
            ServerMessage::Denied => writer.byte(DENIED),
            ServerMessage::Moved { url } => {
                writer.byte(MOVED);
                write_origin(writer, url);
            }
            ServerMessage::Nodes { urls } => {
                assert!(urls.len() <= NODES_MAX, "{} nodes exceed {NODES_MAX}", urls.len());
                writer.byte(NODES);
                writer.count(urls.len());
                urls.iter().for_each(|url| write_origin(writer, url));
            }
            ServerMessage::Emote { seat, emote } => {
                writer.byte(EMOTED);
                write_seat(writer, *seat);
                writer.byte(*emote);
            }
            ServerMessage::Clip { kept } => {
                writer.byte(CLIPPED);
                match kept {
                    Ok(name) => {
                        writer.byte(0);
                        writer.text(name, REPLAY_NAME_BYTES_MAX);
                    }
                    Err(refusal) => writer.byte(*refusal as u8),
                }
            }
            ServerMessage::Snapshot(bytes) => writer.raw(bytes),
        }
    }

    /// Decodes a message; any bytes are safe.
    pub fn decode(bytes: &[u8]) -> Result<ServerMessage, DecodeError> {
        check_length(bytes, SERVER_MESSAGE_BYTES_MAX)?;
        let mut reader = Reader::new(bytes);
        let message = match reader.byte("kind")? {
            WELCOME => read_welcome(&mut reader)?,
            REFUSED => {
                let refusal = Refusal::ALL.get(usize::from(reader.byte("refusal")?));
                let refusal = *refusal.ok_or(DecodeError::OutOfRange { field: "refusal" })?;
                ServerMessage::Refused { refusal }
            }
            DRAINING => {
                let seconds = reader.byte("seconds")?;
                ServerMessage::Draining { seconds, keeps_room: reader.flag("keeps room")? }
            }
            PONG => {
                let stamp = reader.fixed32("stamp")?;
                ServerMessage::Pong { stamp, tick: reader.leb32("tick")? }
            }
            DENIED => ServerMessage::Denied,
            MOVED => ServerMessage::Moved { url: read_origin(&mut reader)? },
            NODES => {
                let count = reader.count(NODES_MAX, 1, "nodes")?;
                let mut urls = Vec::with_capacity(count);
                for _ in 0..count {
                    urls.push(read_origin(&mut reader)?);
                }
                ServerMessage::Nodes { urls }
            }
            EMOTED => {
                let seat = read_seat(&mut reader)?;
                ServerMessage::Emote { seat, emote: read_emote(&mut reader)? }
            }
            CLIPPED => ServerMessage::Clip { kept: read_clip(&mut reader)? },
            SNAPSHOT.. => {
                reader.raw(reader.remaining(), "snapshot")?;
                ServerMessage::Snapshot(bytes.to_vec())
            }
            _ => return Err(DecodeError::OutOfRange { field: "kind" }),
        };
        reader.end()?;
        Ok(message)
    }
}

fn read_welcome(reader: &mut Reader) -> Result<ServerMessage, DecodeError> {
    let seat = reader.option("seat", |reader| {
        Ok(WelcomeSeat {
            seat: read_seat(reader)?,
            host: reader.flag("host")?,
            token: Token::read(reader, "token")?,
        })
    })?;
    Ok(ServerMessage::Welcome {
        seat,
        tick: reader.leb32("tick")?,
        room: reader.text(ROOM_CODE_BYTES_MAX, "room")?.to_owned(),
        scene_name: reader.text(SCENE_NAME_BYTES_MAX, "scene name")?.to_owned(),
        scene: reader.text(SCENE_BYTES_MAX, "scene")?.to_owned(),
    })
}

fn read_clip(reader: &mut Reader) -> Result<Result<String, ClipRefusal>, DecodeError> {
    match reader.byte("clip")? {
        0 => Ok(Ok(reader.text(REPLAY_NAME_BYTES_MAX, "clip")?.to_owned())),
        byte => {
            let refusal = ClipRefusal::ALL.into_iter().find(|&refusal| refusal as u8 == byte);
            Ok(Err(refusal.ok_or(DecodeError::OutOfRange { field: "clip" })?))
        }
    }
}

#[cfg(test)]
mod tests;
