//! Events in a coded snapshot. Each event is coded with the distance between its tick and the previous event's tick.

use crate::error::{DecodeError, check};
use crate::ids::{kind_of, read_id, read_leb16, read_seat, write_id, write_seat};
use crate::limits::EVENTS_MAX;
use crate::snapshot::TimedEvent;
use crate::wire::{Reader, Writer};
use jostle_game::{Event, Seat};
use jostle_sim::{EmitterDef, Source};

const IMPACT: u8 = 0;
const PACK_HIT: u8 = 1;
const BODY_LEFT: u8 = 2;
const EMITTER_STARTED: u8 = 3;
const JOINED: u8 = 4;
const LEFT: u8 = 5;
const REPEATER_STARTED: u8 = 6;
const LAUNCHER_HIT: u8 = 7;
const SAID: u8 = 8;

/// Length of the shortest event, bytes: distance, kind and a seat.
const EVENT_BYTES_MIN: usize = 3;

/// Writes events with ticks after `after`, up to and including `tick`.
pub fn write(writer: &mut Writer, events: &[TimedEvent], after: u32, tick: u32) {
    assert!(events.len() <= EVENTS_MAX, "{} events exceed {EVENTS_MAX}", events.len());
    assert!(events[0].tick > after, "event of {} is in the baseline {after}", events[0].tick);
    assert!(events[events.len() - 1].tick <= tick, "events must not be later than {tick}");
    assert!(events.is_sorted_by_key(|event| event.tick), "events must be in tick order");
    writer.count(events.len());
    let mut before = after;
    for timed in events {
        writer.leb32(timed.tick - before);
        before = timed.tick;
        write_event(writer, &timed.event);
    }
}

fn write_event(writer: &mut Writer, event: &Event) {
    match *event {
        Event::Impact { a, b, point, speed } => {
            writer.byte(IMPACT);
            write_id(writer, a);
            write_id(writer, b);
            writer.point(point);
            writer.finite(speed);
        }
        Event::PackHit { owner, victim, hero, point } => {
            match owner {
                Some(owner) => {
                    writer.byte(PACK_HIT);
                    write_seat(writer, owner);
                }
                None => writer.byte(LAUNCHER_HIT),
            }
            writer.option(victim, write_seat);
            write_id(writer, hero);
            writer.point(point);
        }
        Event::BodyLeft { kind, body, point } => {
            writer.byte(BODY_LEFT);
            writer.byte(kind as u8);
            write_id(writer, body);
            writer.point(point);
        }
        Event::EmitterStarted(emitter) => {
            writer.byte(EMITTER_STARTED);
            write_emitter(writer, &emitter);
        }
        Event::ScheduledEmitterStarted { index, seed } => {
            writer.byte(REPEATER_STARTED);
            writer.byte(index);
            writer.fixed32(seed);
        }
        Event::Said { rule, it, by } => {
            writer.byte(SAID);
            writer.byte(rule);
            writer.option(it, write_seat);
            writer.option(by, write_seat);
        }
        Event::Joined(seat) => {
            writer.byte(JOINED);
            write_seat(writer, seat);
        }
        Event::Left(seat) => {
            writer.byte(LEFT);
            write_seat(writer, seat);
        }
    }
}

fn write_emitter(writer: &mut Writer, emitter: &EmitterDef) {
    writer.byte(emitter.recipe);
    writer.leb32(u32::from(emitter.count));
    writer.fixed32(emitter.seed);
    match emitter.source {
        Source::Point(point) => {
            writer.flag(false);
            writer.point(point);
        }
        Source::Body(id) => {
            writer.flag(true);
            write_id(writer, id);
        }
    }
}

/// Reads events with ticks after `after`, up to and including `tick`.
pub fn read(reader: &mut Reader, after: u32, tick: u32) -> Result<Vec<TimedEvent>, DecodeError> {
    let count = reader.some_count(EVENTS_MAX, EVENT_BYTES_MIN, "events")?;
    let mut events = Vec::with_capacity(count);
    let mut before = after;
    for _ in 0..count {
        before += reader.leb_up_to(tick - before, "event tick")?;
        check(before > after, "event tick")?;
        events.push(TimedEvent { tick: before, event: read_event(reader)? });
    }
    Ok(events)
}

fn read_hit(reader: &mut Reader, owner: Option<Seat>) -> Result<Event, DecodeError> {
    Ok(Event::PackHit {
        owner,
        victim: reader.option("victim", read_seat)?,
        hero: read_id(reader, "hero")?,
        point: reader.point("hit point")?,
    })
}

fn read_event(reader: &mut Reader) -> Result<Event, DecodeError> {
    match reader.byte("event kind")? {
        IMPACT => Ok(Event::Impact {
            a: read_id(reader, "impact")?,
            b: read_id(reader, "impact")?,
            point: reader.point("impact point")?,
            speed: reader.finite("impact speed")?,
        }),
        PACK_HIT => {
            let owner = read_seat(reader)?;
            read_hit(reader, Some(owner))
        }
        LAUNCHER_HIT => read_hit(reader, None),
        BODY_LEFT => Ok(Event::BodyLeft {
            kind: kind_of(reader.byte("body kind")?)?,
            body: read_id(reader, "body")?,
            point: reader.point("leave point")?,
        }),
        EMITTER_STARTED => Ok(Event::EmitterStarted(read_emitter(reader)?)),
        REPEATER_STARTED => Ok(Event::ScheduledEmitterStarted {
            index: reader.byte("emitter")?,
            seed: reader.fixed32("emitter seed")?,
        }),
        SAID => Ok(Event::Said {
            rule: reader.byte("rule")?,
            it: reader.option("player", read_seat)?,
            by: reader.option("player", read_seat)?,
        }),
        JOINED => Ok(Event::Joined(read_seat(reader)?)),
        LEFT => Ok(Event::Left(read_seat(reader)?)),
        _ => Err(DecodeError::OutOfRange { field: "event kind" }),
    }
}

fn read_emitter(reader: &mut Reader) -> Result<EmitterDef, DecodeError> {
    let recipe = reader.byte("recipe")?;
    let count = read_leb16(reader, "particle count")?;
    let seed = reader.fixed32("emitter seed")?;
    let source = if reader.flag("emitter source")? {
        Source::Body(read_id(reader, "emitter body")?)
    } else {
        Source::Point(reader.point("emitter point")?)
    };
    Ok(EmitterDef { recipe, count, seed, source })
}
