//! Codecs for the fields of messages, which define how each field is written, read and checked.

use crate::appearance::Appearance;
use crate::clip::ClipRefusal;
use crate::error::{DecodeError, check};
use crate::ids::{check_seat_order, read_seat, write_seat};
use crate::limits::{
    EMOTES, NODES_MAX, POINTER_MAX, REPLAY_NAME_BYTES_MAX, ROOM_CODE_BYTES_MAX, SCENE_BYTES_MAX,
    SCENE_NAME_BYTES_MAX, VIEW_MAX,
};
use crate::origin::{read_origin, write_origin};
use crate::refusal::Refusal;
use crate::role::{Role, WelcomeSeat};
use crate::token::Token;
use crate::wire::{Reader, Writer};
use jostle_game::{Buttons, Input, SEATS_MAX, Seat};
use jostle_sim::Vec2;

/// A field's reader and writer. Read errors name the field.
pub struct FieldCodec<T> {
    pub write: fn(&mut Writer, &T),
    pub read: fn(&mut Reader, &'static str) -> Result<T, DecodeError>,
}

pub const BYTE: FieldCodec<u8> =
    FieldCodec { write: |writer, it| writer.byte(*it), read: |reader, field| reader.byte(field) };
pub const FLAG: FieldCodec<bool> =
    FieldCodec { write: |writer, it| writer.flag(*it), read: |reader, field| reader.flag(field) };
pub const FIXED16: FieldCodec<u16> = FieldCodec {
    write: |writer, it| writer.fixed16(*it),
    read: |reader, field| reader.fixed16(field),
};
pub const FIXED32: FieldCodec<u32> = FieldCodec {
    write: |writer, it| writer.fixed32(*it),
    read: |reader, field| reader.fixed32(field),
};
pub const LEB32: FieldCodec<u32> =
    FieldCodec { write: |writer, it| writer.leb32(*it), read: |reader, field| reader.leb32(field) };

pub const SEAT: FieldCodec<Seat> =
    FieldCodec { write: |writer, it| write_seat(writer, *it), read: |reader, _| read_seat(reader) };
/// Seats in increasing order.
pub const SEATS: FieldCodec<Vec<Seat>> = FieldCodec {
    write: |writer, it| {
        writer.count(it.len());
        it.iter().for_each(|seat| write_seat(writer, *seat));
    },
    read: |reader, field| {
        let count = reader.count(SEATS_MAX, 1, field)?;
        let mut seats = Vec::with_capacity(count);
        for _ in 0..count {
            let seat = read_seat(reader)?;
            check_seat_order(seats.last().copied(), seat)?;
            seats.push(seat);
        }
        Ok(seats)
    },
};
pub const APPEARANCE: FieldCodec<Appearance> =
    FieldCodec { write: |writer, it| it.write(writer), read: |reader, _| Appearance::read(reader) };
pub const SOME_TOKEN: FieldCodec<Option<Token>> = FieldCodec {
    write: |writer, it| writer.option(it.as_ref(), |writer, token| token.write(writer)),
    read: |reader, field| reader.option(field, |reader| Token::read(reader, field)),
};
pub const ROLE: FieldCodec<Role> = FieldCodec {
    write: |writer, it| writer.flag(*it == Role::Spectator),
    read: |reader, field| Ok(if reader.flag(field)? { Role::Spectator } else { Role::Player }),
};
pub const EMOTE: FieldCodec<u8> = FieldCodec {
    write: BYTE.write,
    read: |reader, field| {
        let emote = reader.byte(field)?;
        check(emote < EMOTES, field)?;
        Ok(emote)
    },
};

pub const INPUT: FieldCodec<Input> = FieldCodec {
    write: |writer, it| {
        writer.leb32(u32::from(it.buttons().0));
        writer.option(it.pointer(), Writer::point);
    },
    read: |reader, _| {
        let buttons = Buttons(reader.leb_up_to(u32::from(Buttons::ALL.0), "buttons")? as u16);
        let pointer = reader.option("pointer", |reader| {
            let point = reader.point("pointer")?;
            check(point.x.abs() <= POINTER_MAX && point.y.abs() <= POINTER_MAX, "pointer")?;
            Ok(point)
        })?;
        Ok(Input::new(buttons, pointer))
    },
};
pub const VIEW: FieldCodec<Vec2> = FieldCodec {
    write: |writer, it| writer.point(*it),
    read: |reader, field| {
        let size = reader.point(field)?;
        let allowed = |length: f32| length > 0.0 && length <= VIEW_MAX;
        check(allowed(size.x) && allowed(size.y), field)?;
        Ok(size)
    },
};

pub const WELCOME_SEAT: FieldCodec<Option<WelcomeSeat>> = FieldCodec {
    write: |writer, it| {
        writer.option(it.as_ref(), |writer, WelcomeSeat { seat, host, token }| {
            write_seat(writer, *seat);
            writer.flag(*host);
            token.write(writer);
        });
    },
    read: |reader, field| {
        reader.option(field, |reader| {
            let (seat, host) = (read_seat(reader)?, reader.flag("host")?);
            Ok(WelcomeSeat { seat, host, token: Token::read(reader, "token")? })
        })
    },
};
/// A text of up to this many bytes.
macro_rules! text {
    ($bytes_max:ident) => {
        FieldCodec {
            write: |writer, it| writer.text(it, $bytes_max),
            read: |reader, field| Ok(reader.text($bytes_max, field)?.to_owned()),
        }
    };
}
pub const ROOM_CODE: FieldCodec<String> = text!(ROOM_CODE_BYTES_MAX);
pub const SCENE_NAME: FieldCodec<String> = text!(SCENE_NAME_BYTES_MAX);
pub const SCENE: FieldCodec<String> = text!(SCENE_BYTES_MAX);
const REPLAY_NAME: FieldCodec<String> = text!(REPLAY_NAME_BYTES_MAX);

pub const REFUSAL: FieldCodec<Refusal> = FieldCodec {
    write: |writer, it| writer.byte(*it as u8),
    read: |reader, field| {
        let refusal = Refusal::ALL.get(usize::from(reader.byte(field)?));
        refusal.copied().ok_or(DecodeError::OutOfRange { field })
    },
};
/// A clip's name after a zero byte, or the reason why the clip was refused.
pub const CLIP: FieldCodec<Result<String, ClipRefusal>> = FieldCodec {
    write: |writer, it| match it {
        Ok(name) => {
            writer.byte(0);
            (REPLAY_NAME.write)(writer, name);
        }
        Err(refusal) => writer.byte(*refusal as u8),
    },
    read: |reader, field| match reader.byte(field)? {
        0 => (REPLAY_NAME.read)(reader, field).map(Ok),
        byte => {
            let refusal = ClipRefusal::ALL.into_iter().find(|&refusal| refusal as u8 == byte);
            refusal.map(Err).ok_or(DecodeError::OutOfRange { field })
        }
    },
};

pub const ORIGIN: FieldCodec<String> = FieldCodec {
    write: |writer, it| write_origin(writer, it),
    read: |reader, _| read_origin(reader),
};
pub const ORIGINS: FieldCodec<Vec<String>> = FieldCodec {
    write: |writer, it| {
        assert!(it.len() <= NODES_MAX, "{} nodes exceed {NODES_MAX}", it.len());
        writer.count(it.len());
        it.iter().for_each(|url| write_origin(writer, url));
    },
    read: |reader, field| {
        let count = reader.count(NODES_MAX, 1, field)?;
        let mut urls = Vec::with_capacity(count);
        for _ in 0..count {
            urls.push(read_origin(reader)?);
        }
        Ok(urls)
    },
};
