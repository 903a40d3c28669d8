//! Properties of messages. Except for pointers, which are rounded, an accepted message has exactly one form: encoding
//! it gives the bytes that it was decoded from.

use crate::part;
use crate::snapshots::streams;
use jostle_game::scene::presets;
use jostle_protocol::limits::{BODIES_MAX, EVENTS_MAX, QUANTA_MAX};
use jostle_protocol::{ClientMessage, Decoded, ServerMessage, SnapshotStream, VERSION};
use jostle_sim::Particles;
use std::sync::Arc;

/// The scene's limit on particles.
const PARTICLES_MAX: usize = 500;

pub fn client_message(bytes: &[u8]) {
    if let Ok(message) = ClientMessage::decode(bytes) {
        let again = message.encode();
        match message {
            // Only the version number of such a hello is read.
            ClientMessage::Hello { version, .. } if version != VERSION => (),
            ClientMessage::Input { .. } => assert_eq!(ClientMessage::decode(&again), Ok(message)),
            _ => assert_eq!(again, bytes, "{message:?}"),
        }
    }
}

/// Checks a message from the server. Only the first byte of a snapshot is examined here.
pub fn server_message(bytes: &[u8]) {
    if let Ok(message) = ServerMessage::decode(bytes) {
        assert_eq!(message.encode(), bytes, "{message:?}");
    }
}

/// Checks a snapshot for a client that has none yet.
pub fn keyframe(bytes: &[u8]) {
    let mut reader = SnapshotStream::default();
    let Ok(decoded) = reader.decode(bytes) else { return };
    assert_sound(&reader, &decoded, bytes);
    let mut sender = SnapshotStream::new(bytes_every(bytes));
    let newest = reader.newest().expect("a keyframe was read");
    let again = sender.keyframe(newest, &decoded.events, &decoded.particles);
    assert_eq!(again, bytes, "{newest:?}");
}

/// The message interval in ticks, as stored after the tick of a keyframe.
fn bytes_every(keyframe: &[u8]) -> u8 {
    let tick_bytes = 1 + keyframe[1..].iter().position(|byte| byte & 0x80 == 0).unwrap_or(0);
    keyframe[1 + tick_bytes]
}

/// Checks events in a keyframe that has no other sections.
pub fn events(bytes: &[u8]) {
    // Header: kind, sections, tick 16383, one message per tick.
    keyframe(&[&[0b1110_0000, 0xff, 0x7f, 1], bytes].concat());
}

/// Checks the particles of a keyframe: accepted particles must encode to the same number of bytes and live no longer
/// than their recipes allow.
pub fn particles(bytes: &[u8]) {
    let Ok(mut particles) = Particles::decode(presets(), PARTICLES_MAX, bytes) else { return };
    assert_eq!(particles.encode().len(), bytes.len());
    let count = particles.len();
    assert!(count <= PARTICLES_MAX && count * 20 <= bytes.len());
    for _ in 0..4 {
        particles.step(&[], |_| None);
        assert!(particles.positions().iter().all(|position| position.is_finite()));
    }
}

/// Checks messages, given as parts, for a client with the stream selected by the first byte.
pub fn delta(bytes: &[u8]) {
    let Some((&chosen, mut rest)) = bytes.split_first() else { return };
    let streams = streams();
    let mut reader = streams[usize::from(chosen) % streams.len()].clone();
    while let Some((_, message)) = part(&mut rest) {
        let mut sender = reader.clone();
        let before = reader.newest().map(Arc::clone);
        let Ok(decoded) = reader.decode(message) else {
            assert_eq!(reader.newest(), before.as_ref(), "what was refused changes nothing");
            continue;
        };
        assert_sound(&reader, &decoded, message);
        if message[0] & 0x40 == 0 {
            // A shorter encoding of the same snapshot may exist, but it must decode to the same result.
            let newest = reader.newest().expect("a snapshot was read");
            let again = sender.clone().decode(&sender.encode(newest, &decoded.events));
            assert_eq!(again.map(|decoded| decoded.events), Ok(decoded.events));
        }
    }
}

/// Asserts that an accepted snapshot could have been sent by a server, and that it takes no more memory than a real
/// one.
fn assert_sound(reader: &SnapshotStream, decoded: &Decoded, bytes: &[u8]) {
    let snapshot = reader.newest().expect("a snapshot was read");
    assert!(snapshot.bodies.is_sorted_by(|a, b| a.id.index < b.id.index));
    assert!(snapshot.bodies.len() <= BODIES_MAX && decoded.events.len() <= EVENTS_MAX);
    assert!(decoded.events.len() <= bytes.len());
    assert!(snapshot.players.is_sorted_by(|a, b| a.seat < b.seat));
    let pointers = snapshot.players.iter().filter_map(|player| player.pointer);
    let positions = snapshot.bodies.iter().map(|body| body.quanta).chain(pointers);
    assert!(positions.flatten().all(|axis| axis.abs() <= QUANTA_MAX));
    assert!(decoded.events.is_sorted_by_key(|event| event.tick));
    assert!(decoded.events.iter().all(|event| event.tick <= snapshot.tick));
    assert!(reader.ticks_until_next() > 0);
}
